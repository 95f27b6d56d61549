//! Options that the caller adds to a file, and how a command line writes them.

use crate::pose::Pose;
use std::collections::{BTreeMap, BTreeSet};
use thiserror::Error;

/// Largest joint angle of a limit or a held joint [rad].
pub const MAX_ANGLE: f64 = 1e3;

/// Radius of a link of which no collision shape is known [m], unless the options say otherwise.
pub const DEFAULT_RADIUS: f64 = 0.05;

/// Limits of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least angle [rad].
    pub lower: f64,
    /// Largest angle [rad].
    pub upper: f64,
    /// Largest rate, both ways [rad/s].
    pub rate: f64,
    /// Largest torque, both ways [N m].
    pub torque: f64,
}

/// Options that the caller gives beside the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Link that becomes the bus, or is fixed to it; the tree's root by default.
    pub root: Option<String>,
    /// Link whose frame is the end effector; the only leaf by default.
    pub end_effector: Option<String>,
    /// Limits by the joint's name, instead of the file's.
    pub limits: BTreeMap<String, Limits>,
    /// Joints that do not move, by name, with their angle [rad], or position [m] if prismatic.
    pub held: BTreeMap<String, f64>,
    /// Links taken as point masses, without their inertia. A joint of the arm must not move them.
    pub point_masses: BTreeSet<String>,
    /// Pose of the root link's frame in the bus frame.
    pub mount: Pose,
    /// Radius of a link of which no collision shape is known [m].
    pub default_radius: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            root: None,
            end_effector: None,
            limits: BTreeMap::new(),
            held: BTreeMap::new(),
            point_masses: BTreeSet::new(),
            mount: Pose::identity(),
            default_radius: DEFAULT_RADIUS,
        }
    }
}

/// A value of a command line that cannot be understood.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum OptionError {
    /// The numbers of `--limit`.
    #[error(
        "--limit `{0}`: expects JOINT=lower,upper,rate,torque [rad, rad, rad/s, N m]: four finite numbers, angles \
         within {MAX_ANGLE}, lower below upper, rate and torque positive"
    )]
    Limit(String),
    /// The number of `--hold`.
    #[error(
        "--hold `{0}`: expects JOINT=angle [rad, or m if prismatic], finite and within {MAX_ANGLE}"
    )]
    Hold(String),
    /// The numbers of `--mount`.
    #[error(
        "--mount `{0}`: expects x,y,z or x,y,z,roll,pitch,yaw [m, rad], finite and within {MAX_ANGLE}"
    )]
    Mount(String),
    /// Joint that is given twice.
    #[error("{flag}: joint `{joint}` is given twice")]
    Twice {
        /// Name of the flag.
        flag: &'static str,
        /// The joint.
        joint: String,
    },
}

impl Options {
    /// Takes the value of a flag `--limit JOINT=lower,upper,rate,torque` [rad, rad, rad/s, N m].
    pub fn add_limit(&mut self, text: &str) -> Result<(), OptionError> {
        let refused = || OptionError::Limit(text.to_owned());
        let (joint, values) = text.rsplit_once('=').ok_or_else(refused)?;
        let values = numbers(values).ok_or_else(refused)?;
        let [lower, upper, rate, torque] = <[f64; 4]>::try_from(values).map_err(|_| refused())?;
        let is_ordered = -MAX_ANGLE <= lower && lower < upper && upper <= MAX_ANGLE;
        if !(is_ordered && rate > 0.0 && torque > 0.0) {
            return Err(refused());
        }
        let before = self.limits.insert(joint.to_owned(), Limits { lower, upper, rate, torque });
        once("--limit", joint, before.is_some())
    }

    /// Takes the value of a flag `--hold JOINT=angle` [rad], [m] for a prismatic joint.
    pub fn add_hold(&mut self, text: &str) -> Result<(), OptionError> {
        let refused = || OptionError::Hold(text.to_owned());
        let (joint, value) = text.rsplit_once('=').ok_or_else(refused)?;
        let Some(&[value]) = numbers(value).as_deref() else { return Err(refused()) };
        if !(value.abs() <= MAX_ANGLE) {
            return Err(refused());
        }
        once("--hold", joint, self.held.insert(joint.to_owned(), value).is_some())
    }

    /// Takes the value of the flag `--mount x,y,z[,roll,pitch,yaw]` [m, rad].
    pub fn set_mount(&mut self, text: &str) -> Result<(), OptionError> {
        let refused = || OptionError::Mount(text.to_owned());
        let values = numbers(text).ok_or_else(refused)?;
        if !values.iter().all(|value| value.abs() <= MAX_ANGLE) {
            return Err(refused());
        }
        self.mount = match values[..] {
            [x, y, z] => Pose::from_xyz_rpy([x, y, z], [0.0; 3]),
            [x, y, z, roll, pitch, yaw] => Pose::from_xyz_rpy([x, y, z], [roll, pitch, yaw]),
            _ => return Err(refused()),
        };
        Ok(())
    }
}

fn once(flag: &'static str, joint: &str, is_twice: bool) -> Result<(), OptionError> {
    let twice = || OptionError::Twice { flag, joint: joint.to_owned() };
    if is_twice { Err(twice()) } else { Ok(()) }
}

/// Finite numbers with commas between them.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |part: &str| part.trim().parse().ok().filter(|value: &f64| value.is_finite());
    text.split(',').map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_understood_or_refused_with_what_they_expect() {
        let mut options = Options::default();
        options.add_limit("a=b=-1,2,0.1,5").unwrap();
        assert_eq!(
            options.limits["a=b"],
            Limits { lower: -1.0, upper: 2.0, rate: 0.1, torque: 5.0 }
        );
        for text in ["a", "a=1,2,3", "a=2,1,3,4", "a=-1,1,0,4", "a=-1,1,NaN,4", "a=-inf,1,2,3"] {
            let error = options.add_limit(text).unwrap_err();
            assert_eq!(error, OptionError::Limit(text.to_owned()));
            assert!(error.to_string().contains("JOINT=lower,upper,rate,torque"));
        }
        assert!(options.add_limit("a=b=-1,2,0.1,5").unwrap_err().to_string().contains("twice"));
        options.add_hold("finger=0.02").unwrap();
        assert_eq!(options.held["finger"], 0.02);
        assert!(options.add_hold("finger=1e4").is_err() && options.add_hold("x=1,2").is_err());
        options.set_mount("1, 2, 3").unwrap();
        assert_eq!(options.mount.position, nalgebra::Vector3::new(1.0, 2.0, 3.0));
        options.set_mount("0,0,0,0,0,1.5").unwrap();
        assert!((options.mount.rotation[(1, 0)] - 1.5_f64.sin()).abs() < 1e-15);
        assert!(options.set_mount("0,0").is_err() && options.set_mount("0,0,NaN").is_err());
    }
}
