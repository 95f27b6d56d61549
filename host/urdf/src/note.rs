//! Notes for the user: what was assumed, merged or left out.

use crate::fault::{Fault, Place};
use thiserror::Error;

/// Arms and links that are longer were probably written in millimetres [m].
pub(crate) const MAX_REACH: f64 = 30.0;

/// Something that the user should know of a file that was read.
#[derive(Clone, Debug, Error, PartialEq)]
#[allow(missing_docs, reason = "the messages tell what the fields are")]
pub enum Note {
    #[error("link `{link}` floats free of `{root}`, which has no mass: it is the root")]
    FloatingRoot { root: String, link: String },
    #[error("links before the root `{root}` are left out, {mass} kg of them")]
    LeftOut { root: String, mass: f64 },
    #[error(
        "link `{link}` and what is fixed to it have {mass} kg: they are the bus, or are fixed to the one that is given"
    )]
    Bus { link: String, mass: f64 },
    #[error("link `{link}` and what is fixed to it have no mass: a bare arm, which needs a bus")]
    BareArm { link: String },
    #[error("link `{link}` has no <inertial>: taken as massless")]
    NoInertial { link: String },
    #[error("link `{link}`, {mass} kg, is part of `{into}` by fixed or held joints")]
    Merged { link: String, into: String, mass: f64 },
    #[error("joint `{joint}` is held at {value}")]
    Held { joint: String, value: f64 },
    #[error("joint `{joint}` follows `{leader}`: held at {value}")]
    Followed { joint: String, leader: String, value: f64 },
    #[error(
        "joint `{joint}` is continuous: limits of -pi and +pi are assumed; `--limit {joint}=lower,upper,rate,torque` gives others"
    )]
    ContinuousAssumed { joint: String },
    #[error(
        "joint `{joint}`: only one end of its range is written, the other is 0, as URDF has it"
    )]
    OneEnd { joint: String },
    #[error("joint `{joint}`: limits by --limit, not by the file")]
    LimitGiven { joint: String },
    #[error(
        "joint `{joint}`: limits {lower} to {upper} by its <safety_controller>, which is narrower than its <limit>"
    )]
    SoftLimits { joint: String, lower: f64, upper: f64 },
    #[error("joint `{joint}`: its <safety_controller> leaves no range: left out")]
    SoftLimitsEmpty { joint: String },
    #[error(
        "joint `{joint}`: the range {lower} to {upper} rad is more than two turns: is it in degrees?"
    )]
    WideRange { joint: String, lower: f64, upper: f64 },
    #[error("{place}: `origin/rpy` {value} rad is more than two turns: is it in degrees?")]
    Turned { place: Place, value: f64 },
    #[error("joint `{joint}`: held at {value} rad, more than two turns: is it in degrees?")]
    HeldTurned { joint: String, value: f64 },
    #[error("the arm reaches {reach:.0} m, more than {MAX_REACH} m: are lengths in millimetres?")]
    LongArm { reach: f64 },
    #[error(
        "link `{link}` extends {extent:.0} m, more than {MAX_REACH} m: are lengths in millimetres?"
    )]
    LongLink { link: String, extent: f64 },
    #[error("joint `{joint}`: the angle 0 is not within its range, {lower} to {upper} rad")]
    ZeroOutside { joint: String, lower: f64, upper: f64 },
    #[error("joint `{joint}`: no <axis> is written: x, as URDF has it")]
    AxisAssumed { joint: String },
    #[error("joint `{joint}`: the axis has length {length}: made a unit vector")]
    AxisScaled { joint: String, length: f64 },
    #[error("joint `{joint}`: damping {damping} and friction {friction} are left out")]
    Dynamics { joint: String, damping: f64, friction: f64 },
    #[error("{place}: `{field}` {value} is taken as it stands, not as {nearest} pi")]
    NearPi { place: Place, field: String, value: f64, nearest: f64 },
    #[error(
        "link `{link}`: its inertia misses the triangle inequality by {by:.1e} kg m^2, as rounding to six digits \
         does: the nearest inertia that a body can have is taken"
    )]
    InertiaRounded { link: String, by: f64 },
    #[error("link `{link}`, {mass} kg, is taken as a point, without its inertia")]
    PointMass { link: String, mass: f64 },
    #[error("link `{link}`: collision meshes that are not read: {count}")]
    Meshes { link: String, count: usize },
    #[error(
        "link `{link}`: its collision shapes are not all known as boxes, cylinders, spheres or capsules: a capsule of \
         radius {radius} m from joint to joint is assumed"
    )]
    RadiusAssumed { link: String, radius: f64 },
    #[error(
        "link `{link}`: its shapes are beside the line between its joints: its capsule is there, of radius {own:.3} m, \
         not {radius:.3} m from joint to joint"
    )]
    CapsuleAside { link: String, radius: f64, own: f64 },
    #[error(
        "link `{link}`: the largest radius of gyration is {gyration:.4} m, the link's extent {extent:.4} m: is the \
         inertia given about the link's frame instead of the centre of mass?"
    )]
    Gyration { link: String, gyration: f64, extent: f64 },
}

impl Note {
    /// Whether the note is on a probable mistake in the file.
    pub fn is_doubt(&self) -> bool {
        matches!(
            self,
            Self::WideRange { .. }
                | Self::Turned { .. }
                | Self::HeldTurned { .. }
                | Self::LongArm { .. }
                | Self::LongLink { .. }
        )
    }
}

/// Faults and notes that reading a file has found.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub faults: Vec<Fault>,
    pub notes: Vec<Note>,
}
