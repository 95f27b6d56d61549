//! The front door: a planner with its memory, and the plan it leaves.

use crate::dynamics::{Control, State};
use crate::executor::ForkJoin;
use crate::guidance::{FlightPlan, NotFlyable};
use crate::model::{Grid, Integrator, Mission, Refusal, Scenario};
use crate::planner::{
    self, ArmSolver, ArmWorkspace, EmbeddedSolver, GuessRecord, InitialGuess, Nominal, Options,
    Report, Session, SolveRecord, Solver, StageReport, Verdict,
};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory, Verification, size, verify,
};
use nalgebra::Vector3;
use remora_qp::Valid;
use remora_qp::time::Deadline;

/// A planner: workspace and QP solver, for any number of plans one after the other.
///
/// Place it in static memory or on a heap: with about [`Planner::BYTES`] bytes it is too large for a
/// small stack. All bits of a new one are zero, so that in static memory it costs no room in an image.
///
/// ```
/// use remora_core::prelude::*;
///
/// let mut planner = Box::new(Planner::new());
/// let mission = Mission::default().validated()?;
/// let scenario = Scenario {
///     target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
///     target_rate: Vector3::new(0.0, 0.0, 1.0e-3),
///     position: Vector3::new(8.0, 0.0, 0.0),
///     ..Scenario::default()
/// }
/// .validated()?;
/// let options = Options::builder().mode(Mode::Feasible).integrator(Integrator::RK4).build()?;
/// let plan = planner.plan(&mission, &scenario, &options)?;
/// assert!(plan.is_verified());
/// assert_eq!(plan.states().len(), plan.controls().len() + 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type Planner<S = EmbeddedSolver> = ArmPlanner<LINKS, { size::NX }, { size::NU }, S>;

/// A planner for an arm of `NL` joints, two or more, with `NX = 6 + 2 NL` states and `NU = 3 + NL`
/// controls; other sizes do not compile. [`Planner`] is the one for the mission's arm.
///
/// An arm of fewer joints than a build has room for, even of one, is planned by [`Mission::resized`].
///
/// ```
/// use remora_core::advanced::model::{Link, Servicer};
/// use remora_core::prelude::*;
///
/// // An arm of two joints: ten states, five controls.
/// let mut planner = Box::new(ArmPlanner::<2, 10, 5>::new());
/// let base = Mission::default();
/// let s = base.servicer;
/// let servicer = Servicer {
///     bus_mass_kg: s.bus_mass_kg,
///     bus_inertia_kg_m2: s.bus_inertia_kg_m2,
///     bus_half_extents_m: s.bus_half_extents_m,
///     boresight: s.boresight,
///     arm_base_m: s.arm_base_m,
///     links: [Link::cylinder(1.1, 15.0, 0.05), Link::cylinder(0.7, 10.0, 0.05)],
///     min_joint_angle_rad: [-1.5, -1.5].into(),
///     max_joint_angle_rad: [1.5, 1.5].into(),
///     joint_rate_limit_rad_s: [5.0e-3, 5.0e-3].into(),
///     initial_joint_angle_rad: [-0.4, 0.6].into(),
///     capture_joint_angle_rad: [-0.3, 0.7].into(),
///     force_limit_n: s.force_limit_n,
///     bus_torque_limit_n_m: s.bus_torque_limit_n_m,
///     joint_torque_limit_n_m: [5.0e-3, 5.0e-3].into(),
/// };
/// let mission = base.with_servicer(servicer).validated()?;
/// let scenario = Scenario::default().validated()?;
/// let options = Options::for_arm().mode(Mode::Feasible).build()?;
/// let plan = planner.plan(&mission, &scenario, &options)?;
/// assert!(plan.is_verified());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct ArmPlanner<const NL: usize, const NX: usize, const NU: usize, S = ArmSolver<NX, NU>> {
    workspace: ArmWorkspace<NL, NX, NU>,
    solver: S,
}

impl<const NL: usize, const NX: usize, const NU: usize> ArmPlanner<NL, NX, NU> {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// A planner that has planned nothing yet.
    pub const fn new() -> Self {
        Self { workspace: ArmWorkspace::new(), solver: ArmSolver::new() }
    }
}

impl<S: Solver<NX, NU>, const NL: usize, const NX: usize, const NU: usize>
    ArmPlanner<NL, NX, NU, S>
{
    /// A planner with another QP solver.
    pub const fn with_solver(solver: S) -> Self {
        Self { workspace: ArmWorkspace::new(), solver }
    }

    /// Plans one approach. The plan is a function of mission, scenario, settings and initial guess alone,
    /// bit for bit, unless a deadline passes.
    ///
    /// A stage that fails leaves its best iterate; [`Plan::is_verified`] says whether the plan can be
    /// flown. Cost: 50 to 300 ms on a desktop with RK4,
    /// 0.8 to 12 thousand million instructions on a Cortex-M7 (`docs/evidence/results.md`).
    ///
    /// # Errors
    /// A scenario that is infeasible before planning, by name of the constraint with its numbers.
    pub fn plan<P: ForkJoin>(
        &mut self,
        mission: &Valid<Mission<NL>>,
        scenario: &Valid<Scenario<NL>>,
        options: &Options<'_, P, NL>,
    ) -> Result<ArmPlan<'_, NL, NX, NU, S>, Refusal> {
        let Self { workspace, solver } = self;
        let report = planner::plan(mission, scenario, options, solver, workspace);
        match report.refusal {
            Some(refusal) => Err(refusal),
            None => {
                let grid = mission.grid(scenario);
                let integrator = options.settings().integrator;
                let has_gradient = mission.target.gravity_gradient.is_on(integrator);
                Ok(ArmPlan { planner: self, grid, integrator, has_gradient, report })
            }
        }
    }

    /// Plans Stage 1 alone, the translation of the centre of mass, which is left in the planner.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn translate<P: ForkJoin>(
        &mut self,
        mission: &Valid<Mission<NL>>,
        scenario: &Valid<Scenario<NL>>,
        options: &Options<'_, P, NL>,
    ) -> Result<StageReport, Refusal> {
        let session = Session { mission, scenario, options };
        session.translate(&mut self.solver, &mut self.workspace)
    }

    /// Plans Stage 2 alone, the reorientation along the translation that [`Planner::translate`] left,
    /// from the options' initial guess and, where that fails, from the heuristic.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn reorient<P: ForkJoin>(
        &mut self,
        mission: &Valid<Mission<NL>>,
        scenario: &Valid<Scenario<NL>>,
        options: &Options<'_, P, NL>,
    ) -> Result<(StageReport, GuessRecord), Refusal> {
        let session = Session { mission, scenario, options };
        session.reorient(&mut self.solver, &mut self.workspace)
    }

    /// Runs the independent verifier alone on the trajectories in the planner.
    pub fn verify<P: ForkJoin>(
        &self,
        mission: &Valid<Mission<NL>>,
        scenario: &Valid<Scenario<NL>>,
        options: &Options<'_, P, NL>,
    ) -> Verification {
        let (translation, reorientation) =
            (self.workspace.translation(), self.workspace.reorientation());
        let integrator = options.settings().integrator;
        verify(mission, scenario, integrator, translation, reorientation, &Deadline::never())
    }

    /// Trajectory of the centre of mass in the planner.
    pub fn translation(&self) -> &TranslationTrajectory<NODES> {
        self.workspace.translation()
    }

    /// Trajectory of attitude and arm in the planner: [`InitialGuess::User`] of another plan, for example.
    pub fn reorientation(&self) -> &ReorientationTrajectory<NODES, NL> {
        self.workspace.reorientation()
    }
}

/// A plan of the mission's arm, borrowed from its planner's memory.
pub type Plan<'p, S = EmbeddedSolver> = ArmPlan<'p, LINKS, { size::NX }, { size::NU }, S>;

/// A plan, borrowed from its planner's memory.
#[must_use]
pub struct ArmPlan<'p, const NL: usize, const NX: usize, const NU: usize, S = ArmSolver<NX, NU>> {
    planner: &'p ArmPlanner<NL, NX, NU, S>,
    grid: Grid,
    integrator: Integrator,
    /// Whether the gravity gradient turns the target.
    has_gradient: bool,
    report: Report,
}

impl<S: Solver<NX, NU>, const NL: usize, const NX: usize, const NU: usize>
    ArmPlan<'_, NL, NX, NU, S>
{
    /// Whether the independent verifier found every constraint satisfied, at nodes and between them: the
    /// plan can be flown.
    #[must_use]
    pub fn is_verified(&self) -> bool {
        self.report.is_verified()
    }

    /// The verdict: optimal, verified but not converged, or not flyable.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.report.verdict()
    }

    /// Positions of the centre of mass at the nodes, RTN [m].
    pub fn positions(&self) -> &[Vector3<f64>] {
        self.planner.translation().position.get(..self.grid.nodes).unwrap_or_default()
    }

    /// Velocities of the centre of mass at the nodes, relative to RTN, in RTN [m/s].
    pub fn velocities(&self) -> &[Vector3<f64>] {
        self.planner.translation().velocity.get(..self.grid.nodes).unwrap_or_default()
    }

    /// Forces over the intervals, RTN [N].
    pub fn forces(&self) -> &[Vector3<f64>] {
        self.planner.translation().force.get(..self.grid.last()).unwrap_or_default()
    }

    /// Attitude, joint angles and rates at the nodes.
    pub fn states(&self) -> &[State<NL>] {
        self.planner.reorientation().states.get(..self.grid.nodes).unwrap_or_default()
    }

    /// Torques of bus and joints over the intervals [N m].
    pub fn controls(&self) -> &[Control<NL>] {
        self.planner.reorientation().controls.get(..self.grid.last()).unwrap_or_default()
    }

    /// The plan as the initial guess of the next one.
    #[must_use]
    pub fn nominal(&self) -> Nominal<NL> {
        let Grid { nodes, duration, .. } = self.grid;
        Nominal { reorientation: *self.planner.reorientation(), nodes, duration }
    }

    /// The plan as [`Guidance`](crate::guidance::Guidance) flies it, its first node at time `begins` [s].
    ///
    /// # Errors
    /// A plan made with Euler's step, or one that the verifier did not find flyable.
    pub fn flight_plan(&self, begins: f64) -> Result<FlightPlan<NL>, NotFlyable> {
        if !self.is_verified() {
            return Err(NotFlyable::Unverified);
        }
        let workspace = &self.planner.workspace;
        let trajectories = (workspace.translation(), workspace.reorientation());
        let (integrator, has_gradient) = (self.integrator, self.has_gradient);
        let target = &workspace.target;
        FlightPlan::of_parts(integrator, has_gradient, &self.grid, trajectories, target)
            .map(|plan| plan.beginning_at(begins))
    }

    /// Status, residuals, clearances, iterations, times.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The solve record to file with the plan: inputs, settings and output by checksum, and statuses.
    pub fn record(&self) -> &SolveRecord {
        &self.report.record
    }
}

/// An initial guess from a trajectory, such as an earlier plan's.
impl<'a, const NL: usize> From<&'a ReorientationTrajectory<NODES, NL>> for InitialGuess<'a, NL> {
    fn from(reorientation: &'a ReorientationTrajectory<NODES, NL>) -> Self {
        Self::User(reorientation)
    }
}
