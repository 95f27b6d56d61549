//! An approach after Stage 1, kept: what a guess of Stage 2 sees, and what torques come to along it.

use crate::engine::{Build, Engine};
use crate::formats::{
    MAX_JOINTS, Mission, Motion, Scenario, resized_control, resized_motion, resized_state,
};
use crate::method::Integrator;
use crate::padded::{PaddedPolicy, own_features};
use crate::request::PlanRequest;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::model::{self, CostUnits, Refusal, TargetState};
use remora_core::advanced::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory, size,
};
use remora_core::advanced::warmstart::{Action, Encoding, MAX_FEATURES, Policy, Scene, rollout};

/// An approach whose translation is planned.
#[derive(Clone, Debug)]
pub struct Approach {
    /// The mission; valid.
    pub mission: Mission,
    /// The scenario.
    pub scenario: Scenario,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Trajectory of the system's centre of mass.
    pub translation: TranslationTrajectory<NODES>,
    /// The target at the nodes.
    pub target: [TargetState; NODES],
    /// Mission and scenario in the size of the built-in arm, where the arm has as many joints.
    usual: Option<(model::Mission<LINKS>, model::Scenario<LINKS>)>,
    /// Divisors of torques in the cost.
    units: CostUnits<MAX_JOINTS>,
}

/// Evaluates an expression in which `$scene` is the approach as the core's learned guess sees it, in the size
/// that plans for the arm.
macro_rules! with_scene {
    ($approach:expr, $scene:ident => $body:expr) => {{
        let Approach { mission, scenario, integrator, translation, target, usual, .. } = $approach;
        match usual {
            Some((mission, scenario)) => {
                let $scene = Scene::new(mission, scenario, translation, target, *integrator);
                $body
            }
            None => {
                let $scene = Scene::new(&**mission, scenario, translation, target, *integrator);
                $body
            }
        }
    }};
}

impl Approach {
    /// Plans Stage 1 with an engine.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    pub(crate) fn plan<const M: usize, const NX: usize, const NU: usize>(
        engine: &mut Engine<M, NX, NU>,
        request: &PlanRequest,
        scenario: Scenario,
    ) -> Result<Self, Refusal>
    where
        Engine<M, NX, NU>: Build<M, NX, NU>,
    {
        let (mission, integrator) = (request.mission, request.method.integrator);
        engine.translate(&mission.sized(), &scenario.resized(), integrator)?;
        let (translation, target) = (*engine.workspace.translation(), engine.workspace.target);
        Ok(Self::new(mission, scenario, integrator, translation, target))
    }

    /// An approach along a translation that was planned before.
    pub fn new(
        mission: Mission,
        scenario: Scenario,
        integrator: Integrator,
        translation: TranslationTrajectory<NODES>,
        target: [TargetState; NODES],
    ) -> Self {
        let units = mission.cost_units();
        let is_usual = mission.joints() == LINKS;
        let usual = is_usual.then(|| (mission.sized(), scenario.resized()));
        Self { mission, scenario, integrator, translation, target, usual, units }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.mission.grid(&self.scenario).nodes
    }

    /// Largest torques: of the bus, then of the joints [N m].
    pub fn torque_limits(&self) -> impl Iterator<Item = f64> {
        let servicer = &self.mission.servicer;
        let joints = servicer.joint_torque_limit_n_m.iter().take(self.mission.joints());
        servicer.bus_torque_limit_n_m.iter().chain(joints).copied()
    }

    /// Bus and arm at the first node.
    pub fn initial_state(&self) -> State<MAX_JOINTS> {
        with_scene!(self, scene => resized_state(&scene.initial_state()))
    }

    /// Distance of the end effector from the port, were the last node's state this [m].
    pub fn miss(&self, last: &State<MAX_JOINTS>) -> f64 {
        with_scene!(self, scene => scene.miss(&resized_state(last)))
    }

    /// Holds torques from node `k` to the next, a row of bus and joint torques; `held` were held before. Torques
    /// are kept within their limits; those that are missing are zero [N m].
    pub fn step(
        &self,
        k: usize,
        state: &State<MAX_JOINTS>,
        torques: &[f32],
        held: &Control<MAX_JOINTS>,
    ) -> (Control<MAX_JOINTS>, State<MAX_JOINTS>) {
        with_scene!(self, scene => {
            let (state, held) = (resized_state(state), resized_control(held));
            let (control, next) = scene.apply(Action::Torque, k, &state, torques, &held);
            (resized_control(&control), resized_state(&next))
        })
    }

    /// Features of node `k` for a learned guess of this encoding; `held` is the last torque [N m].
    pub fn features(
        &self,
        encoding: Encoding,
        k: usize,
        state: &State<MAX_JOINTS>,
        held: &[f32],
        out: &mut [f32],
    ) {
        let joints = self.mission.joints();
        let mut previous = [0.0; size::controls(MAX_JOINTS)];
        previous.iter_mut().zip(held).for_each(|(x, torque)| *x = *torque);
        let mut seen = [0.0; MAX_FEATURES];
        with_scene!(self, scene => {
            scene.features(encoding, k, &resized_state(state), &previous, &mut seen);
        });
        match self.usual {
            Some(_) => out.copy_from_slice(&seen[..out.len()]),
            None => {
                own_features(encoding, joints, MAX_JOINTS, &seen, out);
            }
        }
    }

    /// Stage 2's cost of a torque held over an interval.
    pub fn cost(&self, control: &Control<MAX_JOINTS>) -> f64 {
        let (weights, units) = (&self.mission.weights, &self.units);
        weights.bus_torque * control.bus_torque.component_div(&units.bus_torque).norm_squared()
            + weights.joint_torque
                * control.joint_torque.component_div(&units.joint_torque).norm_squared()
    }

    /// The motion that a policy makes; `None` where it fails or a number is not finite.
    pub fn policy_rollout(&self, policy: &dyn Policy, seed: u64) -> Option<Motion> {
        let room = if self.usual.is_some() { LINKS } else { MAX_JOINTS };
        let policy = &PaddedPolicy { policy, joints: self.mission.joints(), room };
        with_scene!(self, scene => {
            let mut motion = ReorientationTrajectory::ZERO;
            rollout(&scene, policy, seed, &mut motion).then(|| resized_motion(&motion))
        })
    }

    /// The motion that torques make, a row of bus and joint torques an interval one after the other [N m].
    /// Torques are kept within their limits; those that are missing are zero.
    pub fn roll_out(&self, torques: &[f32]) -> Motion {
        let mut motion = Motion::ZERO;
        let rows = torques.chunks_exact(size::controls(self.mission.joints()));
        let rows = rows.chain(std::iter::repeat(&[][..]));
        with_scene!(self, scene => {
            let mut state = scene.initial_state();
            motion.states[0] = resized_state(&state);
            for (k, row) in (0..scene.last).zip(rows) {
                let (control, next) = scene.apply(Action::Torque, k, &state, row, &Control::ZERO);
                motion.controls[k] = resized_control(&control);
                motion.states[k + 1] = resized_state(&next);
                state = next;
            }
        });
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ScenarioSet;
    use crate::learned::{Learned, Memories};
    use crate::memory::on_large_stack;
    use crate::method::Method;
    use crate::planning::Planner;
    use crate::request::Guess;
    use std::sync::Arc;

    /// The torques of a plan, rounded to single precision.
    fn torques(plan: &crate::formats::PlanStage2) -> Vec<f32> {
        let rows = plan.bus_torque.iter().zip(&plan.joint_torque);
        rows.flat_map(|(bus, joint)| bus.iter().chain(joint).map(|x| *x as f32)).collect()
    }

    /// A rollout of the built-in model is the core's in the arm's own size, bit by bit.
    #[test]
    fn a_policy_leads_where_the_core_says() {
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let method = Method { integrator: Integrator::Euler, ..Method::default() };
        let request = PlanRequest { method, ..PlanRequest::default() };
        on_large_stack(|| {
            let approach = Planner::new().approach(&request, scenario).unwrap();
            let Approach { scenario, integrator, translation, target, .. } = &approach;
            let (own, start) = (request.mission.sized::<LINKS>(), scenario.resized());
            let scene = Scene::new(&own, &start, translation, target, *integrator);
            let mut motion = ReorientationTrajectory::ZERO;
            let led = Learned::built_in(*integrator).at_work(&mut Memories::default(), |policy| {
                let policy: &dyn Policy = policy?;
                assert!(rollout(&scene, policy, 1, &mut motion));
                approach.policy_rollout(policy, 1)
            });
            assert_eq!(led, Some(resized_motion(&motion)));
            let miss = scene.miss(&motion.states[NODES - 1]);
            assert_eq!(led.map(|led| approach.miss(&led.states[NODES - 1])), Some(miss));
        })
        .unwrap();
    }

    #[test]
    fn the_torques_of_a_plan_lead_where_it_does_and_are_a_guess_that_is_kept() {
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let method = Method { integrator: Integrator::RK4, ..Method::default() };
        let request = PlanRequest { method, ..PlanRequest::default() };
        on_large_stack(|| {
            let mut planner = Planner::new();
            let plan = planner.plan(&request, scenario).file;
            let approach = planner.approach(&request, scenario).unwrap();
            assert_eq!(approach.translation, plan.stage1.trajectory());
            let motion = approach.roll_out(&torques(&plan.stage2));
            let planned = plan.stage2.trajectory();
            let miss = approach.miss(&motion.states[NODES - 1]);
            assert!(miss < 1e-3, "{miss}");
            assert!((motion.states[59].joint_angle - planned.states[59].joint_angle).norm() < 1e-3);
            let cost: f64 = planned.controls[..59].iter().map(|u| approach.cost(u)).sum();
            assert!((cost / plan.stage2.cost - 1.0).abs() < 1e-12);

            let guess = Guess::Given(Arc::new(motion));
            let again = planner.plan(&PlanRequest { guess, ..request }, scenario);
            assert_eq!(again.file.warm_start, "given");
            assert!(again.evidence.is_verified);
            assert!(again.file.stage2.iterations < plan.stage2.iterations);
        })
        .unwrap();
    }
}
