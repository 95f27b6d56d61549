//! The last way along the port's axis.
//!
//! Plans may come to the port along its plane, a millimetre above it for centimetres: what is not known of
//! the port, some millimetres, would make the end effector touch beside it, and while it still moves. And
//! where a thruster fails while the arm is a few centimetres from the target, there is no time left to go
//! past it. So the plan is shifted outwards along the port's normal, it is flown ahead of its time, so that
//! its own motion ends some time before capture, and the shift is taken back in two parts: most of it until
//! the end effector is near enough to arrive whatever fails, and the rest slowly, up to capture.

use super::{FlightPlan, Reference};
use crate::math::quaternion;
use crate::model::{Mission, TargetState};
use nalgebra::Vector3;
use remora_qp::dense::{clamp, divisor};

/// Distances from the port's plane that are added to the plan, when, and how far ahead the plan is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closing {
    /// The distances, each taken back by itself [m]; zero for none.
    pub distances: [f64; 2],
    /// Time before capture at which they begin to come in, and are there [s].
    pub out: [f64; 2],
    /// Time before capture at which each begins to go, and is gone [s].
    pub back: [[f64; 2]; 2],
    /// Time before capture at which the plan's own motion ends [s]; zero for none.
    pub settle: f64,
}

/// Place on a plan that is flown, and its pace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Time since the plan's first node [s].
    pub time: f64,
    /// Its derivatives.
    pub rate: f64,
    pub acceleration: f64,
}

impl Closing {
    /// 10 cm from 250 s before capture on: 85 mm are taken back until 45 s before it, the rest up to
    /// it; the plan's own motion ends 25 s before capture.
    pub const DEFAULT: Self = Self {
        distances: [0.085, 0.015],
        out: [350.0, 250.0],
        back: [[185.0, 45.0], [100.0, 0.0]],
        settle: 25.0,
    };

    /// Scales the closing to a flight of `time` [s]: in a short one all comes later and is less, with
    /// the same accelerations.
    pub(super) fn within(&self, time: f64) -> Self {
        let share = clamp(time / self.out[0], 0.01, 1.0);
        Self {
            distances: self.distances.map(|distance| distance * share * share),
            out: self.out.map(|time| time * share),
            back: self.back.map(|times| times.map(|time| time * share)),
            settle: self.settle * share,
        }
    }

    /// Where a plan of this `duration` is flown with `left` [s] to go: ahead of its time once the distances
    /// come in. A plan that begins later has in its start what the one before was ahead, and is flown ahead
    /// by the rest.
    pub(super) fn pace(&self, left: f64, duration: f64) -> Pace {
        let begins = if duration < self.out[0] { duration } else { self.out[0] };
        let [before, ..] = smooth(self.out[0] - begins, self.out[0] - self.settle);
        let settle = self.settle * (1.0 - before);
        let [share, rate, acceleration] = smooth(begins - left, begins - self.settle);
        let to_go = left - settle * share;
        if to_go <= 0.0 {
            return Pace { time: duration, rate: 0.0, acceleration: 0.0 };
        }
        let time = duration - to_go;
        Pace { time, rate: 1.0 + settle * rate, acceleration: settle * acceleration }
    }

    /// The distance with `left` [s] to go, its rate and its acceleration: smooth steps in and out, the last
    /// one slow at its end.
    fn at(&self, left: f64) -> [f64; 3] {
        let [come, gone] =
            [self.out, self.back[0]].map(|[begins, ends]| smoother(begins - left, begins - ends));
        let [begins, ends] = self.back[1];
        let last = smooth(begins - left, begins - ends);
        let [most, rest] = self.distances;
        [0, 1, 2].map(|i| most * (come[i] - gone[i]) + rest * (come[i] - last[i]))
    }

    /// Shift of the centre of mass's reference position, velocity and acceleration (RTN), `left` [s] before
    /// capture at `target`. The acceleration is that at the middle of the next `step` [s].
    pub(super) fn shift<const NL: usize>(
        &self,
        mission: &Mission<NL>,
        target: &TargetState,
        left: f64,
        step: f64,
    ) -> [Vector3<f64>; 3] {
        let [distance, rate, _] = self.at(left);
        let [_, _, acceleration] = self.at(left - 0.5 * step);
        let normal = quaternion::rotation_matrix(&target.attitude) * mission.target.port_normal;
        let turned = target.rate.cross(&normal);
        [
            normal * distance,
            normal * rate + turned * distance,
            normal * acceleration + turned * (2.0 * rate) + target.rate.cross(&turned) * distance,
        ]
    }
}

/// A smooth step over `time`, with its first and second derivative: `s^2 (3 - 2 s)`. Over no time it is done.
pub(super) fn smooth(since: f64, time: f64) -> [f64; 3] {
    if !(time > 0.0) {
        return [1.0, 0.0, 0.0];
    }
    let time = divisor(time);
    let s = clamp(since / time, 0.0, 1.0);
    let is_under_way = s > 0.0 && s < 1.0;
    let acceleration = if is_under_way { (6.0 - 12.0 * s) / (time * time) } else { 0.0 };
    [s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / time, acceleration]
}

/// A smoother step, whose second derivative begins and ends at zero: `s^3 (10 - 15 s + 6 s^2)`.
fn smoother(since: f64, time: f64) -> [f64; 3] {
    let time = divisor(time);
    let s = clamp(since / time, 0.0, 1.0);
    let rest = 1.0 - s;
    let acceleration = 60.0 * s * rest * (rest - s) / (time * time);
    [s * s * s * (10.0 - s * (15.0 - 6.0 * s)), 30.0 * s * s * rest * rest / time, acceleration]
}

/// Shifts what is wanted of the centre of mass by what closing adds `left` [s] before capture, in a step
/// so long [s], and tells the shift of its position (RTN) [m].
pub(super) fn add<const NL: usize>(
    wanted: &mut Reference<NL>,
    closing: &Closing,
    mission: &Mission<NL>,
    target: &TargetState,
    [left, step]: [f64; 2],
) -> Vector3<f64> {
    let [position, velocity, acceleration] = closing.shift(mission, target, left, step);
    wanted.position += position;
    wanted.velocity += velocity;
    wanted.acceleration += acceleration;
    position
}

impl Pace {
    /// Applies the pace to a plan's reference: its rates and accelerations change.
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
            let closing = closing.within(duration);
            let (begins, settle) = (closing.out[0], closing.settle);
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
        // A plan that begins on the last way takes over where the one before is, at its pace.
        let closing = Closing::DEFAULT;
        for duration in [349.0, 200.0, 100.0, 26.0, 25.0, 10.0] {
            let ahead = closing.pace(duration, 1200.0).time - (1200.0 - duration);
            let begin = closing.pace(duration, duration);
            assert!(begin.time.abs() < 1e-9 && begin.rate == 1.0, "{duration}: {begin:?}");
            // Where the plan before has ended there is nothing left to be ahead.
            let rest = if duration > closing.settle { closing.settle - ahead } else { 0.0 };
            let ends = closing.pace(rest - 1e-9, duration);
            assert!(ends.time == duration && ends.rate == 0.0, "{duration}: {ends:?}");
            let before = closing.pace(rest + 1.0, duration);
            assert!(before.time < duration && before.rate > 0.0, "{duration}: {before:?}");
        }
        let as_planned = Closing { settle: 0.0, ..closing };
        assert_eq!(as_planned.pace(100.0, 1200.0).time, 1100.0);
        assert_eq!(as_planned.pace(100.0, 1200.0).rate, 1.0);
    }
}
