//! When enough has been flown: `'miss_m<=0.02 p>=0.9973 conf>=0.95'`.

use crate::row::Row;
use remora_host::statistics::lower_bound;
use std::str::FromStr;

/// A share of flights with a quantity within a bound that is to be shown with a confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    quantity: Quantity,
    most: f64,
    share: f64,
    confidence: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Miss,
    Angle,
    Speed,
}

impl FromStr for Until {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "expected QUANTITY<=BOUND p>=SHARE conf>=CONFIDENCE, for example \
                    'miss_m<=0.02 p>=0.9973 conf>=0.95'; quantities are miss_m, angle_rad, speed_m_s";
        let wrong = || format!("{text:?}: {form}");
        let mut parts = text.split_whitespace();
        let mut next = |sign: &str| {
            let (name, value) = parts.next().and_then(|part| part.split_once(sign))?;
            value.parse::<f64>().ok().filter(|x| x.is_finite()).map(|value| (name, value))
        };
        let (name, most) = next("<=").ok_or_else(wrong)?;
        let quantity = match name {
            "miss_m" => Quantity::Miss,
            "angle_rad" => Quantity::Angle,
            "speed_m_s" => Quantity::Speed,
            _ => return Err(wrong()),
        };
        let (p, share) = next(">=").ok_or_else(wrong)?;
        let (conf, confidence) = next(">=").ok_or_else(wrong)?;
        let chances = [share, confidence].iter().all(|x| *x > 0.0 && *x < 1.0);
        if p != "p" || conf != "conf" || !chances || parts.next().is_some() {
            return Err(wrong());
        }
        Ok(Self { quantity, most, share, confidence })
    }
}

impl Until {
    /// Flights within the bound, of how many.
    pub fn within(&self, rows: &[Row]) -> (u64, u64) {
        let within = |row: &&Row| {
            row.flown.as_ref().is_some_and(|flown| {
                let value = match self.quantity {
                    Quantity::Miss => flown.arrival.miss_m,
                    Quantity::Angle => flown.arrival.angle_rad,
                    Quantity::Speed => flown.arrival.speed_m_s,
                };
                value <= self.most
            })
        };
        (rows.iter().filter(within).count() as u64, rows.len() as u64)
    }

    /// Whether the share is shown.
    pub fn is_shown(&self, rows: &[Row]) -> bool {
        let (count, of) = self.within(rows);
        of > 0 && lower_bound(count, of, 1.0 - self.confidence) >= self.share
    }

    /// Whether the share is shown, or can no longer be shown with `most` flights in all.
    pub fn is_decided(&self, rows: &[Row], most: u64) -> bool {
        let (count, of) = self.within(rows);
        let best = lower_bound(count + (most - of), most, 1.0 - self.confidence);
        self.is_shown(rows) || best < self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_and_nonsense_is_named() {
        let until: Until = "miss_m<=0.02 p>=0.9973 conf>=0.95".parse().unwrap();
        assert_eq!((until.most, until.share, until.confidence), (0.02, 0.9973, 0.95));
        for wrong in [
            "",
            "miss_m<=0.02",
            "miss<=0.02 p>=0.9 conf>=0.9",
            "miss_m<=0.02 p>=1.0 conf>=0.9",
            "miss_m<=x p>=0.9 conf>=0.9",
            "miss_m<=0.02 p>=0.9 conf>=0.9 more",
            "miss_m>=0.02 p>=0.9 conf>=0.9",
        ] {
            assert!(wrong.parse::<Until>().is_err(), "{wrong}");
        }
    }
}
