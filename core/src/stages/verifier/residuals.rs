//! Findings of the verifier: residuals, clearances, and how the worst of them is kept.

use crate::model::Tolerances;
use crate::stages::worse;

/// Residuals of a plan, each zero or positive, in the units of section 7. In files infinity is `null`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(deny_unknown_fields, expecting = "an object with the residuals")
)]
pub struct Residuals {
    /// Stage 1 dynamics, initial and terminal state: r over 1 m, v over 1e-2 m/s.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub dynamics1: f64,
    /// Keep-out [m].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub keep_out: f64,
    /// Stage 2 dynamics and initial state: q, alpha over 1, w, alpha' over 1e-2 rad/s.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub dynamics2: f64,
    /// Excess of any control over its limit, relative.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub control: f64,
    /// Joint limits [rad].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub joint: f64,
    /// Excess of a joint rate over its limit, relative.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub joint_rate: f64,
    /// Pointing, in cosine.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub pointing: f64,
    /// Arm preset, angles over 1 rad, rates over 1e-2 rad/s.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub preset: f64,
    /// Terminal bus rate over 1e-2 rad/s.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub terminal_rate: f64,
    /// Distance of the end effector from the port [m].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub ee_position: f64,
    /// Angle between end-effector direction and approach direction [rad].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub ee_angle: f64,
    /// Overlap of bodies [m]; zero where [`Approach::clearance`](crate::model::Approach) is not in
    /// force.
    #[cfg_attr(feature = "serde", serde(default, deserialize_with = "files::infinity_or_number"))]
    pub clearance: f64,
}

/// The smallest distance between two bodies over a plan, nodes and what lies between them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "serde", serde(expecting = "an object with distance_m, time_s and body"))]
pub struct Closest {
    /// Distance of their surfaces [m]; negative where they overlap, infinite where nobody has looked.
    #[cfg_attr(feature = "serde", serde(rename = "distance_m"))]
    #[cfg_attr(feature = "serde", serde(deserialize_with = "files::infinity_or_number"))]
    pub distance: f64,
    /// When [s].
    pub time_s: f64,
    /// Which body of the servicer: 0 the bus, then the links, from 1.
    pub body: u32,
}

impl Closest {
    /// Initial value, before any pair was checked.
    pub const NONE: Self = Self { distance: f64::INFINITY, time_s: 0.0, body: 0 };

    /// The nearer of this and another, this one where they are as near. What is not a number is
    /// the nearest.
    pub(super) fn or(self, other: Self) -> Self {
        if self.distance.is_nan() || self.distance <= other.distance { self } else { other }
    }
}

/// How near bodies come to each other, by the verifier; judged or not.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(deny_unknown_fields, expecting = "an object with the clearances")
)]
pub struct Clearances {
    /// The arm and the target; within the corridor, the end effector and its edge.
    pub arm: Closest,
    /// The bus and the target.
    pub bus: Closest,
    /// The arm and its own bus.
    pub own: Closest,
}

impl Clearances {
    /// Initial value, before any pair was checked.
    pub const NONE: Self = Self { arm: Closest::NONE, bus: Closest::NONE, own: Closest::NONE };

    /// Names and values, in the order of the plan file.
    pub fn named(&self) -> [(&'static str, Closest); 3] {
        [("arm", self.arm), ("bus", self.bus), ("own", self.own)]
    }

    /// Distance of the bodies that are nearest to each other [m].
    pub fn least(&self) -> f64 {
        -[self.arm, self.bus, self.own]
            .iter()
            .fold(f64::NEG_INFINITY, |most, pair| worse(most, -pair.distance))
    }

    /// Deepest overlap of two bodies [m].
    pub(super) fn overlap(&self) -> f64 {
        [self.arm, self.bus, self.own].iter().fold(0.0, |most, pair| worse(most, -pair.distance))
    }
}

/// The two parts of [`Clearances::arm`]. The end effector is at its port at capture, and nearest by intent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmClearances {
    /// Distance of links and target, without the end effector's length of the last link.
    pub links: Closest,
    /// Distance of end effector and target; within the corridor, of its edge.
    pub end_effector: Closest,
}

impl ArmClearances {
    /// Initial value, before any pair was checked.
    pub const NONE: Self = Self { links: Closest::NONE, end_effector: Closest::NONE };
}

/// Findings of the verifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verification {
    /// The residuals.
    pub residuals: Residuals,
    /// How near bodies come to each other.
    pub clearances: Clearances,
    /// Smallest distance of each part of the arm from the target.
    pub arm: ArmClearances,
}

impl Residuals {
    /// Residuals of a plan that was not verified to its end: all are infinite, so none passes.
    pub const UNFINISHED: Self = Self {
        dynamics1: f64::INFINITY,
        keep_out: f64::INFINITY,
        dynamics2: f64::INFINITY,
        control: f64::INFINITY,
        joint: f64::INFINITY,
        joint_rate: f64::INFINITY,
        pointing: f64::INFINITY,
        preset: f64::INFINITY,
        terminal_rate: f64::INFINITY,
        ee_position: f64::INFINITY,
        ee_angle: f64::INFINITY,
        clearance: f64::INFINITY,
    };

    /// Number of residuals.
    pub const COUNT: usize = 12;

    /// Units, in the order of the plan file; several where parts are scaled apart.
    pub const UNITS: [&'static str; Self::COUNT] = [
        "1 m, 1e-2 m/s",
        "m",
        "1, 1 rad, 1e-2 rad/s",
        "of the limit",
        "rad",
        "of the limit",
        "cosine",
        "1 rad, 1e-2 rad/s",
        "1e-2 rad/s",
        "m",
        "rad",
        "m",
    ];

    /// Names, values and tolerances, in the order of the plan file.
    pub fn against(&self, t: &Tolerances) -> [(&'static str, f64, f64); Self::COUNT] {
        [
            ("dynamics1", self.dynamics1, t.dynamics),
            ("keep_out", self.keep_out, t.keep_out_m),
            ("dynamics2", self.dynamics2, t.dynamics),
            ("control", self.control, t.control),
            ("joint", self.joint, t.joint_rad),
            ("joint_rate", self.joint_rate, t.joint_rate),
            ("pointing", self.pointing, t.pointing),
            ("preset", self.preset, t.preset),
            ("terminal_rate", self.terminal_rate, t.terminal_rate),
            ("ee_position", self.ee_position, t.ee_position_m),
            ("ee_angle", self.ee_angle, t.ee_angle_rad),
            ("clearance", self.clearance, t.clearance_m),
        ]
    }

    /// Name of the residual that is farthest beyond its tolerance, where one is. What is not a number
    /// is the worst.
    pub fn worst(&self, tolerances: &Tolerances) -> Option<&'static str> {
        let mut worst: Option<(&'static str, f64)> = None;
        for (name, value, tolerance) in self.against(tolerances) {
            let over = if value.is_nan() { f64::INFINITY } else { value / tolerance };
            let is_beyond = !(value <= tolerance);
            if is_beyond && worst.is_none_or(|(_, most)| over >= most) {
                worst = Some((name, over));
            }
        }
        worst.map(|(name, _)| name)
    }

    /// Whether every residual is a finite number.
    pub fn is_finite(&self) -> bool {
        self.against(&Tolerances::default()).iter().all(|(_, value, _)| value.is_finite())
    }

    /// Whether every residual is within its tolerance. NaN never is.
    pub fn are_within(&self, tolerances: &Tolerances) -> bool {
        self.against(tolerances).iter().all(|(_, value, tolerance)| value <= tolerance)
    }
}

/// Scales of section 7: rates over 1e-2 rad/s, velocities over 1e-2 m/s.
pub(super) const RATE_SCALE: f64 = 1e-2;

/// Largest magnitude; NaN where a component is not a number.
pub(super) fn worst(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| worse(m, v.abs()))
}

/// Largest excess of a value over its own limit, relative to that limit.
// Not inlined: an image has room for one.
#[inline(never)]
pub(super) fn excess(values: &[f64], limits: &[f64]) -> f64 {
    let pairs = values.iter().zip(limits);
    pairs.fold(0.0, |most, (value, limit)| worse(most, value.abs() / limit - 1.0))
}

/// Excess of an angle beyond its stops; negative within them [rad].
pub(super) fn beyond_stops(angle: f64, lower: f64, upper: f64) -> f64 {
    worse(angle - upper, lower - angle)
}

/// JSON has neither infinity nor NaN: writers put `null`, which is read as infinity.
#[cfg(feature = "serde")]
mod files {
    use serde::{Deserialize, Deserializer};

    pub(super) fn infinity_or_number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
    }
}
