//! Policies that say what was written down, and planners that start from them.

use nalgebra::Vector3;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::qp::{Checksum, Valid};
use remora_core::advanced::scp::Settings;
use remora_core::advanced::stages::{LINKS, Mode, NODES, ReorientationTrajectory};
use remora_core::advanced::time::Deadline;
use remora_core::advanced::warmstart::{ACTION, Action, Encoding, Policy, Scene, rollout};
use remora_host::formats::ScenarioSet;
use remora_host::memory::on_heap;
use std::cell::Cell;

/// Gives actions that were written down, whatever it sees.
pub struct Script {
    pub action: Action,
    pub lines: Vec<[f32; ACTION]>,
    pub at: Cell<usize>,
    pub chunk: usize,
    pub executed: usize,
    pub stride: usize,
}

impl Script {
    pub fn new(action: Action, lines: Vec<[f32; ACTION]>) -> Self {
        Self { action, lines, at: Cell::new(0), chunk: 1, executed: 1, stride: 1 }
    }

    pub fn of(action: Action, motion: &ReorientationTrajectory<NODES, LINKS>) -> Self {
        let line = |k: usize| {
            let (state, next) = (&motion.states[k], &motion.states[k + 1]);
            let numbers: Vec<f32> = action.of(state, &motion.controls[k], next).collect();
            numbers.try_into().unwrap()
        };
        Self::new(action, (0..NODES - 1).map(line).collect())
    }
}

impl Policy for Script {
    fn encoding(&self) -> Encoding {
        Encoding::Body
    }

    fn action(&self) -> Action {
        self.action
    }

    fn nodes(&self) -> usize {
        NODES
    }

    fn joints(&self) -> usize {
        LINKS
    }

    fn deviation(&self, _: &[f32]) -> f32 {
        0.0
    }

    fn chunk(&self) -> usize {
        self.chunk
    }

    fn executed(&self) -> usize {
        self.executed
    }

    fn stride(&self) -> usize {
        self.stride
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.integer(7);
    }

    fn begin(&self, _: u64) {
        self.at.set(0);
    }

    fn act(&self, features: &[f32], actions: &mut [f32], _: &Deadline<'_>) -> bool {
        assert_eq!(actions.len(), ACTION * self.chunk);
        for (j, action) in actions.chunks_mut(ACTION).enumerate() {
            let line = self.lines.get(self.at.get() + j).or(self.lines.last());
            action.copy_from_slice(line.expect("a script has lines"));
        }
        self.observe(features)
    }

    fn observe(&self, features: &[f32]) -> bool {
        assert_eq!(features.len(), Encoding::Body.features(LINKS));
        self.at.set(self.at.get() + self.stride);
        true
    }
}

/// Settings with another limit of iterations.
pub fn limited(settings: &Valid<Settings>, iterations: usize) -> Valid<Settings> {
    Settings::with_max_iterations(settings, iterations)
}

pub struct Bench {
    pub mission: Mission<LINKS>,
    pub set: ScenarioSet,
    /// The one last planned.
    pub scenario: Scenario,
    pub workspace: Box<Workspace>,
    pub solver: Box<EmbeddedSolver>,
}

impl Bench {
    pub fn new() -> Self {
        Self {
            mission: Mission::default(),
            set: ScenarioSet::built_in().unwrap(),
            scenario: Scenario::default(),
            workspace: on_heap(Workspace::new),
            solver: on_heap(EmbeddedSolver::new),
        }
    }

    pub fn plan(
        &mut self,
        scenario: usize,
        integrator: Integrator,
        start: &InitialGuess<'_>,
    ) -> Report {
        self.plan_with(scenario, &PlanSettings::new(Mode::Optimal, integrator), start)
    }

    pub fn plan_with(
        &mut self,
        scenario: usize,
        options: &PlanSettings,
        start: &InitialGuess<'_>,
    ) -> Report {
        let scenario = self.set.scenarios[scenario].scenario().resized();
        self.scenario = scenario;
        let Self { mission, workspace, solver, .. } = self;
        plan(
            mission,
            &scenario,
            &Options::from_parts(*options, *start, Platform::BARE),
            &mut **solver,
            workspace,
        )
    }

    pub fn rollout(
        &self,
        integrator: Integrator,
        script: &Script,
    ) -> ReorientationTrajectory<NODES, LINKS> {
        let mut out = ReorientationTrajectory::ZERO;
        assert!(rollout(&self.scene(integrator), script, 0, &mut out));
        out
    }

    pub fn scene(&self, integrator: Integrator) -> Scene<'_> {
        let Workspace { target, translation, .. } = &*self.workspace;
        Scene::new(&self.mission, &self.scenario, &translation.trajectory, target, integrator)
    }
}

pub const RK4: Integrator = Integrator::Rk4 { substeps: 4 };

/// Largest distance of poses and rates, in radians and radians a node.
pub fn distance(
    a: &ReorientationTrajectory<NODES, LINKS>,
    b: &ReorientationTrajectory<NODES, LINKS>,
) -> f64 {
    let of = |k: usize| {
        let (a, b) = (&a.states[k], &b.states[k]);
        let turn: Vector3<f64> = quaternion::difference(&a.attitude, &b.attitude);
        let rates = (a.rate - b.rate).amax().max((a.joint_rate - b.joint_rate).amax());
        turn.amax().max((a.joint_angle - b.joint_angle).amax()).max(20.0 * rates)
    };
    (0..NODES).map(of).fold(0.0, f64::max)
}
