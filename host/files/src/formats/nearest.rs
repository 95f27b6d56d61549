//! The two bodies that come nearest to each other over a plan.

use super::{Clearances, Closest};
use crate::error::FieldError;
use serde::{Deserialize, Serialize};

/// The pair of bodies that comes nearest, without the end effector: that one is at its port at capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nearest {
    /// Smallest distance, and its time.
    pub at: Closest,
    /// `bus:target`, `link_N:target` or `link_N:bus`, links from 1; empty if it was not computed.
    pub pair: String,
}

impl Nearest {
    /// Value before anything was computed.
    pub const NONE: Self = Self { at: Closest::NONE, pair: String::new() };

    /// Finds the pair from a plan's clearances, and from those of its links to the target.
    pub fn of(clearances: &Clearances, links: &Closest) -> Self {
        let link = |at: &Closest, to: &str| (*at, format!("link_{}:{to}", at.body));
        let bus = (clearances.bus, "bus:target".to_string());
        let pairs = [link(links, "target"), bus, link(&clearances.own, "bus")];
        // A distance that is not a number is the nearest.
        let key = |at: &Closest| if at.distance.is_nan() { f64::NEG_INFINITY } else { at.distance };
        let nearest = pairs.into_iter().min_by(|(a, _), (b, _)| key(a).total_cmp(&key(b)));
        let nearest = nearest.filter(|(at, _)| at.distance != f64::INFINITY);
        nearest.map_or(Self::NONE, |(at, pair)| Self { at, pair })
    }

    /// Refuses a pair of no bodies, or one that is nearer than both distances of the bus allow.
    pub(super) fn check(&self, clearances: &Clearances) -> Result<(), FieldError> {
        let is_link = |name: &str| {
            let number = name.strip_prefix("link_").and_then(|number| number.parse::<u32>().ok());
            number.is_some_and(|number| number >= 1)
        };
        let is_known = match self.pair.split_once(':') {
            Some(("bus", "target")) => true,
            Some((link, "target" | "bus")) => is_link(link),
            _ => self.pair.is_empty() && self.at.distance == f64::INFINITY,
        };
        if !is_known {
            return Err(FieldError::new("nearest.pair", format!("{:?} is unknown", self.pair)));
        }
        let others = [clearances.bus, clearances.own];
        match others.iter().any(|other| self.at.distance > other.distance) {
            true => Err(FieldError::new("nearest.at", "is farther than another pair")),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(distance: f64, body: u32) -> Closest {
        Closest { distance, time_s: 9.0, body }
    }

    #[test]
    fn the_nearest_pair_is_named_and_the_end_effector_is_none_of_it() {
        let clearances = Clearances { arm: at(0.001, 3), bus: at(1.0, 0), own: at(0.2, 2) };
        let of = |links, clearances: &Clearances| Nearest::of(clearances, &links);
        assert_eq!(
            of(at(0.3, 3), &clearances),
            Nearest { at: at(0.2, 2), pair: "link_2:bus".into() }
        );
        assert_eq!(of(at(0.1, 1), &clearances).pair, "link_1:target");
        let far = Clearances { own: at(2.0, 2), ..clearances };
        assert_eq!(of(at(3.0, 1), &far), Nearest { at: at(1.0, 0), pair: "bus:target".into() });
        assert_eq!(of(Closest::NONE, &Clearances::NONE), Nearest::NONE);
        assert_eq!(of(at(f64::NAN, 2), &clearances).pair, "link_2:target");
    }

    #[test]
    fn what_is_no_pair_is_refused() {
        let clearances = Clearances { arm: at(0.001, 3), bus: at(1.0, 0), own: at(0.2, 2) };
        let check = |at, pair: &str| Nearest { at, pair: pair.into() }.check(&clearances).is_ok();
        assert!(check(at(0.2, 0), "link_2:bus") && check(at(0.1, 0), "link_10:target"));
        for pair in ["", "link_0:bus", "link_x:bus", "bus:bus", "link_2:port", "link_2"] {
            assert!(!check(at(0.2, 0), pair), "{pair}");
        }
        assert!(!check(at(0.3, 0), "link_1:target"));
        assert!(Nearest::NONE.check(&Clearances::NONE).is_ok());
    }
}
