//! The last way along the port's axis.
//!
//! Plans may come to the port along its plane, a millimetre above it for centimetres: what is not known of
//! the port, some millimetres, would make the end effector touch beside it, and while it still moves. So
//! the plan is shifted outwards along the port's normal, it is flown ahead of its time, so that its own
//! motion ends some time before capture, and the shift is taken back in the last part of the approach.

use super::{FlightPlan, GuidanceSettings, Reference};
use crate::math::quaternion;
use crate::model::{Mission, TargetState};
use nalgebra::Vector3;
use remora_qp::dense::clamp;

/// Distance from the port's plane that is added to the plan, when, and how far ahead the plan is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closing {
    /// The distance [m]; zero for none.
    pub distance: f64,
    /// Time before capture at which it begins to come in, is there, and begins to go out [s].
    pub times: [f64; 3],
    /// Time before capture at which the plan's own motion ends [s], a tenth of the time since it began to
    /// be flown ahead at most; zero for none.
    pub settle: f64,
}

/// Where a plan is flown, and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Time since the plan's first node [s].
    pub time: f64,
    /// Its derivatives.
    pub rate: f64,
    pub acceleration: f64,
}

impl Closing {
    /// 15 mm from 250 s before capture on, taken back within the last 100 s; the plan's own motion ends 25 s
    /// before capture.
    pub const DEFAULT: Self = Self { distance: 0.015, times: [250.0, 150.0, 100.0], settle: 25.0 };

    /// Where a plan of this `duration` is flown with `left` [s] to go: ahead of its time from the
    /// first of the times on, or from its begin where that is later.
    pub(super) fn pace(&self, left: f64, duration: f64) -> Pace {
        let begins = self.times[0].min(duration);
        let settle = self.settle.min(0.1 * begins);
        let [share, rate, acceleration] = smooth(begins - left, begins - settle);
        let to_go = left - settle * share;
        if to_go <= 0.0 {
            return Pace { time: duration, rate: 0.0, acceleration: 0.0 };
        }
        let time = duration - to_go;
        Pace { time, rate: 1.0 + settle * rate, acceleration: settle * acceleration }
    }

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

/// Shifts what is wanted of the centre of mass by what closing adds `left` [s] before capture, and tells
/// the shift of its position (RTN) [m].
pub(super) fn add<const NL: usize>(
    wanted: &mut Reference<NL>,
    settings: &GuidanceSettings,
    mission: &Mission<NL>,
    target: &TargetState,
    left: f64,
) -> Vector3<f64> {
    let [position, velocity, acceleration] = settings.closing.shift(mission, target, left);
    wanted.position += position;
    wanted.velocity += velocity;
    wanted.acceleration += acceleration;
    position
}

impl Pace {
    /// What a plan asks for where it is flown at this pace: all that is a rate goes with it.
    pub fn apply<const NL: usize>(&self, plan: &mut Reference<NL>) {
        let Self { rate, acceleration, .. } = *self;
        let squared = rate * rate;
        plan.acceleration = plan.acceleration * squared + plan.velocity * acceleration;
        plan.velocity *= rate;
        let (state, turned) = (&mut plan.state, &mut plan.state_acceleration);
        turned.bus = turned.bus * squared + state.rate * acceleration;
        turned.joint = turned.joint * squared + state.joint_rate * acceleration;
        state.rate *= rate;
        state.joint_rate *= rate;
        let target = &mut plan.target_acceleration;
        *target = *target * squared + plan.target.rate * acceleration;
        plan.target.rate *= rate;
    }
}

impl<const NL: usize> FlightPlan<NL> {
    /// Where it is flown at a time on the clock of the estimates [s].
    pub(super) fn pace(&self, closing: &Closing, time: f64) -> Pace {
        closing.pace(self.left(time), self.duration())
    }

    /// Time left to capture at a time on the clock of the estimates [s].
    pub(super) fn left(&self, time: f64) -> f64 {
        self.duration() - (time - self.begins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plan_is_flown_ahead_smoothly_and_ends_before_capture() {
        let closing = Closing::DEFAULT;
        for duration in [60.0_f64, 200.0, 1200.0] {
            let begins: f64 = duration.min(250.0);
            let settle = (0.1 * begins).min(25.0);
            let at = |time: f64| closing.pace(duration - time, duration);
            assert_eq!(at(duration - begins).time, duration - begins);
            assert_eq!(at(duration - begins - 1.0).rate, 1.0);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for i in 1..1000 {
                let time = duration - begins + (begins - settle) * f64::from(i) / 1000.0;
                let h = 1e-3;
                let [before, now, after] = [time - h, time, time + h].map(at);
                let rate = (after.time - before.time) / (2.0 * h);
                let acceleration = (after.rate - before.rate) / (2.0 * h);
                assert!((rate - now.rate).abs() < 1e-7, "{time}: {rate} {now:?}");
                assert!((acceleration - now.acceleration).abs() < 1e-7, "{time}: {now:?}");
                (least, most) = (least.min(now.rate), most.max(now.rate));
            }
            assert!(least >= 1.0 && most < 1.17, "{least} {most}");
            for time in [duration - settle, duration, duration + 10.0] {
                let ended = Pace { time: duration, rate: 0.0, acceleration: 0.0 };
                assert_eq!(at(time + 1e-9), ended);
            }
        }
        let as_planned = Closing { settle: 0.0, ..closing };
        assert_eq!(as_planned.pace(100.0, 1200.0).time, 1100.0);
        assert_eq!(as_planned.pace(100.0, 1200.0).rate, 1.0);
    }
}
