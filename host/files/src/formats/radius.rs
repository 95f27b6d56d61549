//! Keep-out radii: given, or derived from the servicer.

use super::Mission;
use remora_core::advanced::model::{Approach, Link};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// A keep-out radius of a mission file: metres, or `"auto"`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Radius {
    /// The published one for the servicer of the problem definition, and for any other that which
    /// follows from its geometry.
    #[default]
    Auto,
    /// A radius [m].
    Metres(f64),
}

const AUTO: &str = "auto";

impl Radius {
    /// The radius while far [m]: how far the arm extends from the system's centre of mass.
    pub fn far(self, mission: &Mission) -> f64 {
        match self {
            Self::Metres(radius) => radius,
            Self::Auto if is_published(mission) => Approach::default().keep_out_far_m,
            Self::Auto => mission.servicer.extension(),
        }
    }

    /// The radius afterwards [m]: how far the arm reaches at capture.
    pub fn near(self, mission: &Mission) -> f64 {
        match self {
            Self::Metres(radius) => radius,
            Self::Auto if is_published(mission) => Approach::default().keep_out_near_m,
            Self::Auto => mission.servicer.capture_geometry().reach,
        }
    }
}

/// Whether all that the radii follow from is as published.
fn is_published(mission: &Mission) -> bool {
    let built_in = Mission::default();
    let (s, published) = (&mission.servicer, &built_in.servicer);
    let link = |link: &Link| (link.tip_m, link.center_of_mass_m, link.mass_kg, link.axis);
    mission.joints() == built_in.joints()
        && (s.bus_mass_kg, s.arm_base_m) == (published.bus_mass_kg, published.arm_base_m)
        && s.links.iter().map(link).eq(published.links.iter().map(link))
        && s.min_joint_angle_rad == published.min_joint_angle_rad
        && s.max_joint_angle_rad == published.max_joint_angle_rad
        && s.capture_joint_angle_rad == published.capture_joint_angle_rad
}

impl Serialize for Radius {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => to.serialize_str(AUTO),
            Self::Metres(radius) => to.serialize_f64(*radius),
        }
    }
}

impl<'de> Deserialize<'de> for Radius {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Read;
        impl Visitor<'_> for Read {
            type Value = Radius;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of metres or \"auto\"")
            }

            fn visit_f64<E: de::Error>(self, radius: f64) -> Result<Radius, E> {
                Ok(Radius::Metres(radius))
            }

            fn visit_i64<E: de::Error>(self, radius: i64) -> Result<Radius, E> {
                Ok(Radius::Metres(radius as f64))
            }

            fn visit_u64<E: de::Error>(self, radius: u64) -> Result<Radius, E> {
                Ok(Radius::Metres(radius as f64))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Radius, E> {
                match text {
                    AUTO => Ok(Radius::Auto),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }
        }
        from.deserialize_any(Read)
    }
}

#[cfg(test)]
mod tests {
    use crate::formats::{Mission, MissionFile};

    fn radii(text: &str) -> (f64, f64) {
        let mission = MissionFile::parse(text).and_then(|file| file.mission()).unwrap();
        (mission.approach.keep_out_far_m, mission.approach.keep_out_near_m)
    }

    #[test]
    fn radii_follow_from_another_servicer_and_are_the_published_ones_for_the_default() {
        assert_eq!(radii(""), (1.85, 1.46));
        assert_eq!(radii("[approach]\nkeep_out_far_m = \"auto\""), (1.85, 1.46));
        assert_eq!(radii("[servicer]\nforce_limit_n = 1.0"), (1.85, 1.46));
        let (far, near) = radii("[servicer]\nbus_mass_kg = 60");
        let mut light = Mission::default().servicer;
        light.bus_mass_kg = 60.0;
        assert_eq!((far, near), (light.extension(), light.capture_geometry().reach));
        assert!(far < 1.85 && near < 1.46, "{far} {near}");
    }

    #[test]
    fn radii_that_are_given_stay() {
        let given = "[approach]\nkeep_out_far_m = 2\nkeep_out_near_m = 1.5\n";
        assert_eq!(radii(given), (2.0, 1.5));
        let light = format!("{given}[servicer]\nbus_mass_kg = 60");
        assert_eq!(radii(&light), (2.0, 1.5));
        let refused = |text: &str| {
            MissionFile::parse(text).and_then(|file| file.mission()).unwrap_err().to_owned()
        };
        let error = refused("[approach]\nkeep_out_far_m = \"large\"");
        assert_eq!(error.field, "approach.keep_out_far_m");
        assert!(error.reason.contains("metres or \"auto\""), "{}", error.reason);
        assert_eq!(refused("[approach]\nkeep_out_near_m = -1").field, "approach.keep_out_near_m");
    }
}
