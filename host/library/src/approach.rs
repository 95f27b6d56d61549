//! An approach after Stage 1, kept: what a guess of Stage 2 sees, and what torques come to along it.

use crate::engine::{Build, Engine};
use crate::method::Integrator;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::model::{CostUnits, Mission, Refusal, Scenario, TargetState};
use remora_core::advanced::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory, size,
};
use remora_core::advanced::warmstart::{Action, Scene};

/// An approach whose translation is planned.
#[derive(Clone, Debug)]
pub struct Approach<const NL: usize = LINKS> {
    /// The mission; valid.
    pub mission: Mission<NL>,
    /// The scenario.
    pub scenario: Scenario<NL>,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Trajectory of the system's centre of mass.
    pub translation: TranslationTrajectory<NODES>,
    /// The target at the nodes.
    pub target: [TargetState; NODES],
    /// What torques are divided by in the cost.
    units: CostUnits<NL>,
}

impl<const NL: usize> Approach<NL> {
    /// Plans Stage 1 with an engine.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    pub(crate) fn plan<const M: usize, const NX: usize, const NU: usize>(
        engine: &mut Engine<M, NX, NU>,
        mission: Mission<NL>,
        scenario: Scenario<NL>,
        integrator: Integrator,
    ) -> Result<Self, Refusal>
    where
        Engine<M, NX, NU>: Build<M, NX, NU>,
    {
        engine.translate(&mission.resized(), &scenario.resized(), integrator)?;
        let (translation, target) = (*engine.workspace.translation(), engine.workspace.target);
        let units = mission.cost_units();
        Ok(Self { mission, scenario, integrator, translation, target, units })
    }

    /// The approach as the core's learned guess sees it.
    pub fn scene(&self) -> Scene<'_, NL> {
        let Self { mission, scenario, integrator, translation, target, .. } = self;
        Scene::new(mission, scenario, translation, target, *integrator)
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.mission.grid(&self.scenario).nodes
    }

    /// Largest torques: of the bus, then of the joints [N m].
    pub fn torque_limits(&self) -> impl Iterator<Item = f64> {
        let servicer = &self.mission.servicer;
        servicer.bus_torque_limit_n_m.iter().chain(servicer.joint_torque_limit_n_m.iter()).copied()
    }

    /// What Stage 2's cost counts for a torque held over an interval.
    pub fn cost(&self, control: &Control<NL>) -> f64 {
        let (weights, units) = (&self.mission.weights, &self.units);
        weights.bus_torque * control.bus_torque.component_div(&units.bus_torque).norm_squared()
            + weights.joint_torque
                * control.joint_torque.component_div(&units.joint_torque).norm_squared()
    }

    /// The motion that torques make, a row of bus and joint torques an interval one after the other [N m].
    /// Torques are kept within their limits; those that are missing are zero.
    pub fn roll_out(&self, torques: &[f32]) -> ReorientationTrajectory<NODES, NL> {
        let scene = self.scene();
        let mut motion = ReorientationTrajectory::ZERO;
        motion.states[0] = scene.initial_state();
        let rows = torques.chunks_exact(size::controls(NL));
        let rows = rows.chain(std::iter::repeat(&[][..]));
        for (k, row) in (0..scene.last).zip(rows) {
            let state: State<NL> = motion.states[k];
            let (control, next) = scene.apply(Action::Torque, k, &state, row, &Control::ZERO);
            motion.controls[k] = control;
            motion.states[k + 1] = next;
        }
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ScenarioSet;
    use crate::guess::Guess;
    use crate::memory::on_large_stack;
    use crate::method::Method;
    use crate::planning::{Planner, WallClock};

    /// The torques of a plan, as one who answers in single precision would give them.
    fn torques(plan: &crate::formats::PlanStage2) -> Vec<f32> {
        let rows = plan.bus_torque.iter().zip(&plan.joint_torque);
        rows.flat_map(|(bus, joint)| bus.iter().chain(joint).map(|x| *x as f32)).collect()
    }

    #[test]
    fn the_torques_of_a_plan_lead_where_it_does_and_are_a_guess_that_is_kept() {
        let mission = Mission::default();
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let method = Method { integrator: Integrator::RK4, ..Method::default() };
        on_large_stack(|| {
            let mut planner = Planner::new();
            let plan = planner.plan(&mission, scenario, &method, None).file;
            let approach = planner.approach(&mission, scenario, method.integrator).unwrap();
            assert_eq!(approach.translation, plan.stage1.trajectory());
            let motion = approach.roll_out(&torques(&plan.stage2));
            let planned = plan.stage2.trajectory::<LINKS>();
            let miss = approach.scene().miss(&motion.states[NODES - 1]);
            assert!(miss < 1e-3, "{miss}");
            assert!((motion.states[59].joint_angle - planned.states[59].joint_angle).norm() < 1e-3);
            let cost: f64 = planned.controls[..59].iter().map(|u| approach.cost(u)).sum();
            assert!((cost / plan.stage2.cost - 1.0).abs() < 1e-12);

            let guess = Guess::Given(&motion);
            let clock = WallClock::start();
            let again = planner.plan_from(&clock, &mission, scenario, &method, guess);
            assert_eq!(again.file.warm_start, "given");
            assert!(again.evidence.is_verified);
            assert!(again.file.stage2.iterations < plan.stage2.iterations);
        })
        .unwrap();
    }
}
