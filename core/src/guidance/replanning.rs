//! Beginning of the next plan: its scenario and its initial guess.

use super::flight_plan::Cursor;
use super::turn::Turn;
use super::{Estimate, FlightPlan, Guidance, MAX_REFERENCE_STEPS};
use crate::dynamics::Multibody;
use crate::math::quaternion;
use crate::model::{Mission, Scenario, TargetState};
use crate::planner::Nominal;

/// Beginning of the next plan: the scenario of the time left, and the plan in force as its guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replan<const NL: usize> {
    /// State, target and time left when the next plan takes over.
    pub scenario: Scenario<NL>,
    /// The plan in force, turned to the target as it is estimated: the guess, `elapsed` after its start.
    pub nominal: Nominal<NL>,
    /// Time from the start of the plan in force to the next plan's [s].
    pub elapsed: f64,
    /// When the next plan begins, on the clock of the estimates [s].
    pub begins: f64,
}

impl<const NL: usize> Guidance<NL> {
    /// Beginning of a plan that takes over `lead` [s] after the estimate: as long as planning may take.
    ///
    /// The servicer is expected to stay as far from the plan in force until then as it is now, and the
    /// target to go on as its model says.
    /// `None` where nothing is left to plan, or the estimate is no number. Cost: that of a step, and the
    /// motion over `lead`.
    pub fn replan(
        &self,
        mission: &Mission<NL>,
        plan: &FlightPlan<NL>,
        estimate: &Estimate<NL>,
        lead: f64,
    ) -> Option<Replan<NL>> {
        if !(estimate.is_finite() && lead >= 0.0) {
            return None;
        }
        let begins = estimate.time + lead;
        let elapsed = begins - plan.begins;
        let (duration, nodes) = plan.nominal.left(elapsed);
        if !(duration > 0.0 && elapsed >= 0.0) {
            return None;
        }
        let target = target_after(mission, plan, estimate, lead);
        let share = [self.share_of_turn(estimate.time)[0], 0.0];
        let (mut cursor, closing) = (Cursor::START, self.closing(plan));
        let mut aim = |time: f64, target: &TargetState| {
            let pace = plan.pace(&closing, time);
            let mut wanted = cursor.at(plan, mission, pace.time);
            pace.apply(&mut wanted);
            let turn = Turn::to(plan, mission, &wanted, target, share);
            turn.apply(&mut wanted);
            (wanted, turn)
        };
        let (now, _) = aim(estimate.time, &estimate.target);
        let (then, then_turn) = aim(begins, &target);

        let body = Multibody::new(mission);
        let (center, drift) = body.center_of_mass(&estimate.state);
        let mut state = then.state;
        let off = quaternion::conjugate(&now.state.attitude);
        let off = quaternion::product(&estimate.state.attitude, &off);
        state.attitude = quaternion::normalized(&quaternion::product(&off, &then.state.attitude));
        state.rate += estimate.state.rate - now.state.rate;
        state.joint_angle += estimate.state.joint_angle - now.state.joint_angle;
        state.joint_rate += estimate.state.joint_rate - now.state.joint_rate;
        let [away, recedes, _] =
            closing.shift(mission, &estimate.target, plan.left(estimate.time), 0.0);
        let velocity = estimate.velocity + drift + self.memory.offset.rate - recedes - now.velocity;
        let position = estimate.position + center + self.memory.offset.value - away - now.position;
        let to_body = quaternion::rotation_matrix(&target.attitude).transpose();
        let scenario = Scenario {
            target_attitude: target.attitude,
            target_rate: to_body * target.rate,
            position: then.position + position + velocity * lead,
            velocity: then.velocity + velocity,
            start: state.as_start(),
            duration: Some(duration),
            nodes: Some(nodes),
        };
        Some(Replan { scenario, nominal: turned(plan, &then_turn), elapsed, begins })
    }
}

/// The estimated target after `lead` [s].
fn target_after<const NL: usize>(
    mission: &Mission<NL>,
    plan: &FlightPlan<NL>,
    estimate: &Estimate<NL>,
    lead: f64,
) -> TargetState {
    let (n, steps) = (mission.mean_motion(), MAX_REFERENCE_STEPS);
    mission.target.after(plan.has_gradient(), n, &estimate.target, lead, steps)
}

/// A plan's motion turned as a whole.
fn turned<const NL: usize>(plan: &FlightPlan<NL>, turn: &Turn) -> Nominal<NL> {
    let mut nominal = plan.nominal;
    for state in &mut nominal.reorientation.states {
        state.attitude = quaternion::product(turn.attitude(), &state.attitude);
        state.rate = turn.turned(&state.rate);
    }
    nominal
}
