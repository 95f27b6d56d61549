//! Which of the two problems is solved: the paper's at the nodes, or the one to fly.

use core::fmt;
use core::str::FromStr;

/// How an interval of Stage 2 is integrated; controls are held over it. By name `euler`, `rk4` (the
/// default number of substeps a node) or `rk4:M`.
///
/// ```
/// use remora_core::prelude::*;
///
/// assert_eq!("rk4:4".parse(), Ok(Integrator::Rk4 { substeps: 4 }));
/// assert_eq!(Integrator::RK4.to_string(), "rk4");
/// assert!("rk4:3".parse::<Integrator>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Integrator {
    /// One explicit Euler step, the quaternion renormalised: the paper's.
    Euler,
    /// Classical RK4 in so many equal substeps, the quaternion renormalised after each: the one
    /// to fly.
    Rk4 {
        /// Number of substeps, at least one.
        substeps: usize,
    },
}

/// Why a text is no integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidIntegrator {
    /// It is no name of one.
    Unknown,
    /// So few substeps: plans would miss the port when they are flown.
    TooFew(usize),
    /// More substeps than are taken.
    TooMany,
}

impl Integrator {
    /// RK4 with [`Integrator::DEFAULT_SUBSTEPS`].
    pub const RK4: Self = Self::Rk4 { substeps: Self::DEFAULT_SUBSTEPS };
    /// Substeps a node of plain `rk4`.
    pub const DEFAULT_SUBSTEPS: usize = 8;
    /// Fewest substeps a node of a plan: with fewer, plans miss the port when they are flown.
    pub const MIN_SUBSTEPS: usize = 4;
    /// Most substeps a node of a plan.
    pub const MAX_SUBSTEPS: usize = 1000;

    /// Whether its plans are made to be flown: RK4's are, Euler's follow the paper.
    pub fn is_flown(self) -> bool {
        matches!(self, Self::Rk4 { .. })
    }
}

impl Default for Integrator {
    fn default() -> Self {
        Self::RK4
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Euler => f.pad("euler"),
            Self::Rk4 { substeps: Self::DEFAULT_SUBSTEPS } => f.pad("rk4"),
            Self::Rk4 { substeps } => write!(f, "rk4:{substeps}"),
        }
    }
}

impl FromStr for Integrator {
    type Err = InvalidIntegrator;

    fn from_str(text: &str) -> Result<Self, InvalidIntegrator> {
        let substeps = match text {
            "euler" => return Ok(Self::Euler),
            "rk4" => return Ok(Self::RK4),
            _ => text.strip_prefix("rk4:").and_then(|m| m.parse::<usize>().ok()),
        };
        match substeps {
            Some(substeps) if substeps < Self::MIN_SUBSTEPS => {
                Err(InvalidIntegrator::TooFew(substeps))
            }
            Some(substeps) if substeps > Self::MAX_SUBSTEPS => Err(InvalidIntegrator::TooMany),
            Some(substeps) => Ok(Self::Rk4 { substeps }),
            None => Err(InvalidIntegrator::Unknown),
        }
    }
}

impl fmt::Display for InvalidIntegrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => {
                f.write_str("expected euler, rk4 or rk4:M with a number M of substeps")
            }
            Self::TooFew(substeps) => {
                let least = Integrator::MIN_SUBSTEPS;
                write!(f, "rk4 needs at least {least} substeps a node, not {substeps}")
            }
            Self::TooMany => {
                write!(f, "rk4 takes at most {} substeps a node", Integrator::MAX_SUBSTEPS)
            }
        }
    }
}

impl core::error::Error for InvalidIntegrator {}

/// In files an integrator is its name.
#[cfg(feature = "serde")]
mod files {
    use super::Integrator;
    use core::fmt;
    use serde::de::{Error, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    impl Serialize for Integrator {
        fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
            to.collect_str(self)
        }
    }

    impl<'de> Deserialize<'de> for Integrator {
        fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
            struct Name;
            impl Visitor<'_> for Name {
                type Value = Integrator;

                fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    f.write_str("euler, rk4 or rk4:M")
                }

                fn visit_str<E: Error>(self, text: &str) -> Result<Integrator, E> {
                    text.parse().map_err(E::custom)
                }
            }
            from.deserialize_str(Name)
        }
    }
}

/// Whether a part of the problem that the paper does not have is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum Switch {
    /// In force where the plan is made to be flown: with RK4, not with Euler.
    #[default]
    Auto = 0,
    /// In force.
    On = 1,
    /// Not in force; in files `none`.
    #[cfg_attr(feature = "serde", serde(rename = "none"))]
    Off = 2,
}

impl Switch {
    /// Whether it is in force under `integrator`.
    pub fn is_on(self, integrator: Integrator) -> bool {
        match self {
            Self::Auto => integrator.is_flown(),
            Self::On => true,
            Self::Off => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrators_have_names() {
        for (text, integrator) in [
            ("euler", Integrator::Euler),
            ("rk4", Integrator::RK4),
            ("rk4:8", Integrator::RK4),
            ("rk4:4", Integrator::Rk4 { substeps: 4 }),
        ] {
            assert_eq!(text.parse(), Ok(integrator));
        }
        for text in ["rk4:3", "rk4:0", "rk4:", "rk4:x", "rk4:-4", "rk4:5000", "RK4", "", "rk45"] {
            assert!(text.parse::<Integrator>().is_err(), "{text}");
        }
        assert_eq!("rk4:3".parse::<Integrator>(), Err(InvalidIntegrator::TooFew(3)));
    }

    #[test]
    fn auto_is_on_for_what_is_flown() {
        let (euler, rk4) = (Integrator::Euler, Integrator::Rk4 { substeps: 4 });
        assert!(Switch::Auto.is_on(rk4) && !Switch::Auto.is_on(euler));
        assert!(Switch::On.is_on(euler) && !Switch::Off.is_on(rk4));
    }
}
