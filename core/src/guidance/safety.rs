//! Escape and free drift from each node of an approach that must end there.

use super::{Estimate, FlightPlan, GuidanceSettings, Limits, Reference};
use super::{closing, flight_plan::Cursor, leaving::Leaving, tracking::Tracking, turn::Turn};
use crate::dynamics::{Control, Multibody, State, SystemState};
use crate::math::quaternion;
use crate::model::{HcwTransition, Mission, TargetState, signed_distance_to_box};
use crate::stages::clearances_at;
use nalgebra::{Vector3, Vector6};
use remora_qp::dense::count;

/// Time between the steps of an escape and of a drift [s].
const ESCAPE_STEP: f64 = 2.0;
const DRIFT_STEP: f64 = 10.0;

/// Most steps of an escape: 20 minutes.
pub(crate) const MAX_ESCAPE_STEPS: usize = 600;

/// Most steps of a drift: one orbit of up to 8 hours.
pub(crate) const MAX_DRIFT_STEPS: usize = 2880;

/// Results of an abort and of a free drift from one node of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Safety {
    /// Time of the node [s].
    pub time: f64,
    /// Leaving the target by [`Guidance::abort`](super::Guidance::abort).
    pub escape: Escape,
    /// Drifting without any control.
    pub drift: Drift,
}

/// The abort from a node.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Escape {
    /// Whether it leaves the far keep-out distance and no bodies touch on the way.
    pub clears: bool,
    /// Time until the centre of mass is beyond the far keep-out distance and moving away [s]; infinite
    /// where that does not come within 20 minutes.
    pub time: f64,
    /// Distance of the bodies that come nearest to each other on the way [m]; negative: overlap.
    pub clearance: f64,
}

/// The free drift from a node over one orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drift {
    /// Whether the centre of mass stays outside the keep-out distance in force at the node.
    pub clears: bool,
    /// Least distance of the centre of mass from the target's box [m].
    pub distance: f64,
}

impl<const NL: usize> FlightPlan<NL> {
    /// Simulates an abort and a drift from node `k`, in the planner's world; `None` beyond the last node.
    ///
    /// Both begin where guidance has the servicer at the node's time: on the plan, and on the last way ahead of
    /// it and away from the port ([`Closing`](super::Closing)). The abort is flown by the law that guidance flies
    /// it by, with `limits`.
    /// Cost: up to 600 steps of four evaluations of the dynamics and one of all distances, and up to
    /// 2880 steps of a linear drift.
    pub fn safety(&self, mission: &Mission<NL>, limits: &Limits<NL>, k: usize) -> Option<Safety> {
        let target = self.target.get(k).filter(|_| k < self.nominal.nodes)?;
        let time = self.nominal.time(k);
        let Reference { position, velocity, state, .. } = self.flown(mission, target, time);
        let keep_out = self.grid().keep_out(k);
        let body = Multibody::new(mission);
        let (center, rate) = body.center_of_mass(&state);
        let servicer =
            SystemState { position: position - center, velocity: velocity - rate, internal: state };
        let flight = Flight { mission, body, has_gradient: self.has_gradient() };
        let escape = flight.escape(limits, servicer, *target);
        let drift = flight.drift(keep_out, position, velocity, *target);
        Some(Safety { time, escape, drift })
    }

    /// Where guidance has the servicer `time` [s] after the first node, with the target where it is
    /// expected.
    fn flown(&self, mission: &Mission<NL>, target: &TargetState, time: f64) -> Reference<NL> {
        let left = self.duration() - time;
        let closing = GuidanceSettings::DEFAULT.closing.within(self.duration());
        let pace = closing.pace(left, self.duration());
        let mut cursor = Cursor::START;
        let mut there = cursor.at(self, mission, pace.time);
        pace.apply(&mut there);
        // Where the plan is flown ahead, the target is behind.
        Turn::to(self, mission, &there, target, [1.0, 0.0]).apply(&mut there);
        closing::add(&mut there, &closing, mission, target, [left, 0.0]);
        there
    }
}

/// A world of the planner's equations.
struct Flight<'m, const NL: usize> {
    mission: &'m Mission<NL>,
    body: Multibody<'m, NL>,
    has_gradient: bool,
}

impl<const NL: usize> Flight<'_, NL> {
    /// Distance of a point from the target's box [m].
    fn distance(&self, position: &Vector3<f64>, target: &TargetState) -> f64 {
        let to_target = quaternion::rotation_matrix(&target.attitude).transpose();
        signed_distance_to_box(&self.mission.target.half_extents_m, &(to_target * position)).value
    }

    /// The target after `time`.
    fn target_after(&self, target: &TargetState, time: f64) -> TargetState {
        let n = self.mission.mean_motion();
        self.mission.target.after(self.has_gradient, n, target, time, 1)
    }

    fn escape(
        &self,
        limits: &Limits<NL>,
        mut servicer: SystemState<NL>,
        mut target: TargetState,
    ) -> Escape {
        let tracking = Tracking {
            body: self.body,
            mean_motion: self.mission.mean_motion(),
            settings: &GuidanceSettings::DEFAULT,
            limits,
            since: ESCAPE_STEP,
        };
        let far = self.mission.approach.keep_out_far_m;
        let mut clearance = f64::INFINITY;
        let mut leaving = Leaving::without(Vector3::zeros());
        // Bound: steps of an escape.
        for step in 0..MAX_ESCAPE_STEPS {
            let time = step as f64 * ESCAPE_STEP;
            let (center, drift) = self.body.center_of_mass(&servicer.internal);
            let (position, velocity) = (servicer.position + center, servicer.velocity + drift);
            let state = &servicer.internal;
            let least = clearances_at(self.mission, time, &target, &position, state).least();
            // A distance that is NaN is taken, too.
            clearance = if least > clearance { clearance } else { least };
            if self.distance(&position, &target) >= far && position.dot(&velocity) >= 0.0 {
                return Escape { clears: clearance >= 0.0, time, clearance };
            }
            let estimate = Estimate {
                time,
                position: servicer.position,
                velocity: servicer.velocity,
                state: servicer.internal,
                target,
                wrist: None,
            };
            let effort = leaving.effort(&tracking, self.mission, &estimate);
            servicer = self.step(&servicer, &effort.control, &effort.force, ESCAPE_STEP);
            target = self.target_after(&target, ESCAPE_STEP);
        }
        Escape { clears: false, time: f64::INFINITY, clearance }
    }

    fn drift(
        &self,
        keep_out: f64,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
        mut target: TargetState,
    ) -> Drift {
        let n = self.mission.mean_motion();
        let along = HcwTransition::new(n, DRIFT_STEP).state;
        let orbit = 2.0 * core::f64::consts::PI / n;
        // Saturates, and makes nothing of NaN.
        let steps = count(libm::ceil(orbit / DRIFT_STEP)).min(MAX_DRIFT_STEPS);
        let mut x = Vector6::from_fn(|i, _| if i < 3 { position[i] } else { velocity[i - 3] });
        let mut distance = f64::INFINITY;
        // Bound: steps of a drift.
        for _ in 0..steps {
            let here = self.distance(&Vector3::new(x[0], x[1], x[2]), &target);
            distance = if here > distance { distance } else { here };
            x = along * x;
            target = self.target_after(&target, DRIFT_STEP);
        }
        let tolerance = self.mission.tolerances.keep_out_m;
        Drift { clears: distance >= keep_out - tolerance, distance }
    }

    /// One step of RK4 with what is commanded held.
    fn step(
        &self,
        x: &SystemState<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
        h: f64,
    ) -> SystemState<NL> {
        let moved = |x: &SystemState<NL>, at: &SystemState<NL>, h: f64| {
            let rates = self.body.system_rates(at, control, force);
            let turn = quaternion::derivative(&at.internal.attitude, &at.internal.rate);
            let internal = State {
                attitude: x.internal.attitude + turn * h,
                joint_angle: x.internal.joint_angle + at.internal.joint_rate * h,
                rate: x.internal.rate + rates.rate * h,
                joint_rate: x.internal.joint_rate + rates.joint_rate * h,
            };
            let position = x.position + at.velocity * h;
            SystemState { position, velocity: x.velocity + rates.bus * h, internal }
        };
        let (b, half) = (moved(x, x, 0.5 * h), 0.5 * h);
        let c = moved(x, &b, half);
        let d = moved(x, &c, h);
        let mut next = moved(x, x, h / 6.0);
        for (at, share) in [(&b, 1.0 / 3.0), (&c, 1.0 / 3.0), (&d, 1.0 / 6.0)] {
            next = moved(&next, at, share * h);
        }
        next.internal.attitude = quaternion::normalized(&next.internal.attitude);
        next
    }
}
