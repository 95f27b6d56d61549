//! When a plan begins, and times after it as text.

use chrono::{DateTime, NaiveDateTime, Utc};
use std::fmt;
use std::str::FromStr;

/// Microseconds of a second.
pub const MICROS: f64 = 1e6;

/// An instant of UTC, to the microsecond, of the years 1970 to 2100.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Epoch {
    /// Microseconds since 1970, without leap seconds.
    micros: i64,
}

/// How it is written and read; a fraction of a second may be left out.
const FORM: &str = "%Y-%m-%dT%H:%M:%S%.f";

/// The first instant that is none any more: the year 2100.
const END: i64 = 4_102_444_800_000_000;

impl Epoch {
    /// Now, or what `SOURCE_DATE_EPOCH` says in its place, to the second: files can be made again bit for bit.
    pub fn now() -> Self {
        let said = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|seconds| seconds.parse().ok());
        let seconds = said.unwrap_or_else(|| Utc::now().timestamp());
        Self { micros: seconds.saturating_mul(1_000_000).clamp(0, END - 1) }
    }

    /// So many microseconds later.
    pub fn after(self, micros: i64) -> Self {
        Self { micros: self.micros + micros }
    }

    /// Since 1970 [ns].
    pub fn nanos(self) -> u64 {
        self.micros as u64 * 1000
    }
}

impl FromStr for Epoch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted =
            "expected a time of UTC such as 2026-11-23T00:00:00, of the years 1970 to 2099";
        let bare = text.strip_suffix('Z').unwrap_or(text);
        let time = NaiveDateTime::parse_from_str(bare, FORM).map_err(|_| wanted.to_string())?;
        let micros = time.and_utc().timestamp_micros();
        // A second 60 is none that other times could be counted from.
        match (0..END).contains(&micros) && time.and_utc().timestamp_subsec_micros() < 1_000_000 {
            true => Ok(Self { micros }),
            false => Err(wanted.into()),
        }
    }
}

impl fmt::Display for Epoch {
    /// As CCSDS has it, to the microsecond.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = DateTime::from_timestamp_micros(self.micros).unwrap_or_default();
        write!(f, "{}", time.format("%Y-%m-%dT%H:%M:%S%.6f"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_counted_over_the_ends_of_days_and_years() {
        let epoch: Epoch = "2027-12-31T23:59:59.5Z".parse().unwrap();
        assert_eq!(epoch.to_string(), "2027-12-31T23:59:59.500000");
        assert_eq!(epoch.after(500_001).to_string(), "2028-01-01T00:00:00.000001");
        let bare: Epoch = "2027-12-31T23:59:59.5".parse().unwrap();
        assert_eq!(bare, epoch);
        assert_eq!("1970-01-01T00:00:01".parse::<Epoch>().unwrap().nanos(), 1_000_000_000);
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            "now",
            "2026-11-23",
            "2026-02-30T00:00:00",
            "2026-11-23T24:00:00",
            "2016-12-31T23:59:60",
            "1969-12-31T23:59:59",
            "2100-01-01T00:00:00",
            "2026-11-23T00:00:00+01:00",
        ] {
            assert!(text.parse::<Epoch>().is_err(), "{text}");
        }
    }
}
