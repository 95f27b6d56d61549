//! The last way along the port's axis.
//!
//! Plans may come to the port along its plane, a millimetre above it for centimetres: what is not known of
//! the port, some millimetres, would make the end effector touch beside it. So the plan is shifted
//! outwards along the port's normal, and the shift is taken back in the last part of the approach.

use super::{FlightPlan, GuidanceSettings, Reference};
use crate::math::quaternion;
use crate::model::{Mission, TargetState};
use nalgebra::Vector3;
use remora_qp::dense::clamp;

/// Distance from the port's plane that is added to the plan, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closing {
    /// The distance [m]; zero for none.
    pub distance: f64,
    /// Time before capture at which it begins to come in, is there, and begins to go out [s].
    pub times: [f64; 3],
}

impl Closing {
    /// 15 mm from 250 s before capture on, taken back within the last 100 s.
    pub const DEFAULT: Self = Self { distance: 0.015, times: [250.0, 150.0, 100.0] };

    /// The distance with `left` [s] to go, its rate and its acceleration: smooth steps in and out.
    fn at(&self, left: f64) -> [f64; 3] {
        let [begins, there, ends] = self.times;
        let into = smooth(begins - left, begins - there);
        let out = smooth(ends - left, ends);
        [0, 1, 2].map(|i| self.distance * (into[i] - out[i]))
    }

    /// What is added to where the centre of mass is to be, how fast and how it is to speed up (RTN), with
    /// `left` [s] to go to a target that is seen so.
    pub(super) fn shift<const NL: usize>(
        &self,
        mission: &Mission<NL>,
        target: &TargetState,
        left: f64,
    ) -> [Vector3<f64>; 3] {
        let [distance, rate, acceleration] = self.at(left);
        let normal = quaternion::rotation_matrix(&target.attitude) * mission.target.port_normal;
        let turned = target.rate.cross(&normal);
        [
            normal * distance,
            normal * rate + turned * distance,
            normal * acceleration + turned * (2.0 * rate) + target.rate.cross(&turned) * distance,
        ]
    }
}

/// A smooth step over `time`, with its first and second derivative: `s^2 (3 - 2 s)`.
fn smooth(since: f64, time: f64) -> [f64; 3] {
    let s = clamp(since / time, 0.0, 1.0);
    let is_under_way = s > 0.0 && s < 1.0;
    let acceleration = if is_under_way { (6.0 - 12.0 * s) / (time * time) } else { 0.0 };
    [s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / time, acceleration]
}

/// Shifts what is wanted of the centre of mass by what closing adds `left` [s] before capture.
pub(super) fn add<const NL: usize>(
    wanted: &mut Reference<NL>,
    settings: &GuidanceSettings,
    mission: &Mission<NL>,
    target: &TargetState,
    left: f64,
) {
    let [position, velocity, acceleration] = settings.closing.shift(mission, target, left);
    wanted.position += position;
    wanted.velocity += velocity;
    wanted.acceleration += acceleration;
}

impl<const NL: usize> FlightPlan<NL> {
    /// Time left to capture at a time on the clock of the estimates [s].
    pub(super) fn left(&self, time: f64) -> f64 {
        self.duration() - (time - self.begins)
    }
}
