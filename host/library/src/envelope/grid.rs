//! The axes of a map.

use super::cell::CellPlace;
use std::fmt;
use std::str::FromStr;

/// Tumble rates, distances and horizons.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Norms of the target's rate [deg/s].
    pub rates: Vec<Number>,
    /// Distances ahead of the port [m].
    pub distances: Vec<Number>,
    /// Horizons [s].
    pub horizons: Vec<Number>,
}

/// A finite number, zero or positive, as it is written on the command line and in file names.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Number(f64);

impl Number {
    /// The number.
    pub fn value(self) -> f64 {
        self.0
    }
}

impl FromStr for Number {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(Self(value.abs())),
            Ok(_) => Err("must be finite and not negative".into()),
            Err(_) => Err("expected a number".into()),
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

fn numbers(values: &[f64]) -> Vec<Number> {
    values.iter().map(|value| Number(*value)).collect()
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            rates: numbers(&[0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0]),
            distances: numbers(&[2.0, 5.0, 10.0, 20.0, 30.0, 50.0, 100.0]),
            horizons: numbers(&[60.0, 120.0, 300.0, 600.0, 1200.0]),
        }
    }
}

impl Grid {
    /// A small part of the default: enough to see that all of it still works.
    pub fn coarse() -> Self {
        Self {
            rates: numbers(&[0.0, 1.0, 5.0]),
            distances: numbers(&[5.0, 10.0]),
            horizons: numbers(&[60.0, 300.0]),
        }
    }

    /// Whether there is a cell, and none twice.
    ///
    /// # Errors
    /// The axis, by its option, with the reason.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let axes = [
            ("--rate", &self.rates),
            ("--distance", &self.distances),
            ("--horizon", &self.horizons),
        ];
        for (option, axis) in axes {
            if axis.is_empty() {
                return Err((option, "needs a number".into()));
            }
            if let Some(i) = (1..axis.len()).find(|i| axis[..*i].contains(&axis[*i])) {
                return Err((option, format!("{} is given twice", axis[i])));
            }
        }
        Ok(())
    }

    /// The places of a vehicle's cells: horizons, in each of them rates, in each of these distances.
    pub fn places(&self, vehicle: &str) -> Vec<CellPlace> {
        let mut places = Vec::new();
        for horizon in &self.horizons {
            for rate in &self.rates {
                places.extend(self.distances.iter().map(|distance| CellPlace {
                    vehicle: vehicle.into(),
                    horizon_s: horizon.0,
                    rate_deg_s: rate.0,
                    distance_m: distance.0,
                }));
            }
        }
        places
    }
}

/// Numbers as an option takes them.
pub(super) fn listed(axis: &[Number]) -> String {
    axis.iter().map(Number::to_string).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_horizon_rate_and_distance() {
        let places = Grid::default().places("a");
        assert_eq!(places.len(), 5 * 7 * 7);
        let first =
            CellPlace { vehicle: "a".into(), horizon_s: 60.0, rate_deg_s: 0.0, distance_m: 2.0 };
        assert_eq!(places[0], first);
        assert_eq!(places[1].distance_m, 5.0);
        assert_eq!(places[7].rate_deg_s, 0.5);
        assert_eq!(places[49].horizon_s, 120.0);
    }

    #[test]
    fn the_coarse_grid_is_a_part_of_the_default() {
        let (coarse, all) = (Grid::coarse(), Grid::default());
        assert!(coarse.places("a").iter().all(|place| all.places("a").contains(place)));
        assert!(coarse.places("a").len() <= 12);
    }

    #[test]
    fn axes_are_numbers_each_once() {
        for text in ["-1", "nan", "inf", "1e999"] {
            assert_eq!(text.parse::<Number>().unwrap_err(), "must be finite and not negative");
        }
        assert_eq!("x".parse::<Number>().unwrap_err(), "expected a number");
        assert_eq!("-0".parse::<Number>().unwrap().to_string(), "0");
        let twice = Grid { rates: numbers(&[1.0, 2.0, 1.0]), ..Grid::default() };
        assert_eq!(twice.check(), Err(("--rate", "1 is given twice".into())));
        assert_eq!(Grid::default().check(), Ok(()));
        assert_eq!(listed(&Grid::default().rates), "0,0.5,1,2,3,5,7");
    }
}
