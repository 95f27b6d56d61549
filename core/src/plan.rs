//! The front door: a planner with its memory, and the plan it leaves.

use crate::dynamics::{Control, State};
use crate::model::{Mission, Refusal, Scenario};
use crate::pair::Pair;
use crate::planner::{
    self, EmbeddedSolver, Evidence, Gain, GuessRecord, InitialGuess, Options, Report, Session,
    Solver, StageReport, Verdict, Workspace,
};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory, Verification, verify,
};
use nalgebra::Vector3;
use remora_qp::Valid;
use remora_qp::time::Deadline;

/// A planner: workspace and solver, for any number of plans one after the other.
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
///     velocity: Vector3::zeros(),
/// };
/// let options = Options::builder().mode(Mode::Feasible).integrator(Integrator::RK4).build()?;
/// let plan = planner.plan(&mission, &scenario, &options)?;
/// assert!(plan.is_verified());
/// assert_eq!(plan.states().len(), plan.controls().len() + 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct Planner<S = EmbeddedSolver> {
    workspace: Workspace,
    solver: S,
}

impl Planner {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// A planner that has planned nothing yet.
    pub const fn new() -> Self {
        Self { workspace: Workspace::new(), solver: EmbeddedSolver::new() }
    }
}

impl<S: Solver> Planner<S> {
    /// A planner with another solver of the subproblems.
    pub const fn with_solver(solver: S) -> Self {
        Self { workspace: Workspace::new(), solver }
    }

    /// Plans one approach. The plan's bits follow from mission, scenario, settings and initial guess
    /// alone, as far as no deadline passes; nothing that was planned before matters.
    ///
    /// A stage that fails leaves its best iterate, so that there is always something to look at:
    /// [`Plan::is_verified`] tells whether it can be flown. Cost: 50 to 300 ms on a desktop with RK4,
    /// 0.8 to 12 thousand million instructions on a Cortex-M7 (`docs/audit/instructions.md`).
    ///
    /// # Errors
    /// A scenario that no plan can end well, by name of the constraint and its numbers; then nothing
    /// has been planned.
    pub fn plan<P: Pair>(
        &mut self,
        mission: &Valid<Mission<LINKS>>,
        scenario: &Scenario,
        options: &Options<'_, P>,
    ) -> Result<Plan<'_, S>, Refusal> {
        let (settings, guess) = (options.settings(), options.initial_guess());
        let environment = options.environment();
        let Self { workspace, solver } = self;
        let report =
            planner::plan(mission, scenario, settings, guess, solver, environment, workspace);
        match report.refusal {
            Some(refusal) => Err(refusal),
            None => Ok(Plan { planner: self, mission: **mission, report }),
        }
    }

    /// Stage 1 alone: the path of the centre of mass, left in the planner.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn translate<P: Pair>(
        &mut self,
        mission: &Valid<Mission<LINKS>>,
        scenario: &Scenario,
        options: &Options<'_, P>,
    ) -> Result<StageReport, Refusal> {
        let session = Session { mission, scenario, options };
        session.translate(&mut self.solver, &mut self.workspace)
    }

    /// Stage 2 alone, from the options' initial guess and, where that leads nowhere, from the
    /// heuristic: attitude and arm along the path that [`Planner::translate`] left.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn reorient<P: Pair>(
        &mut self,
        mission: &Valid<Mission<LINKS>>,
        scenario: &Scenario,
        options: &Options<'_, P>,
    ) -> Result<(StageReport, GuessRecord), Refusal> {
        let session = Session { mission, scenario, options };
        session.reorient(&mut self.solver, &mut self.workspace)
    }

    /// The independent verifier alone, on what the planner holds.
    pub fn verify<P: Pair>(
        &self,
        mission: &Valid<Mission<LINKS>>,
        scenario: &Scenario,
        options: &Options<'_, P>,
    ) -> Verification {
        let (path, motion) = (self.workspace.path(), self.workspace.motion());
        let integrator = options.settings().integrator;
        verify(mission, scenario, integrator, path, motion, &Deadline::never())
    }

    /// The path of the centre of mass that the planner holds.
    pub fn path(&self) -> &TranslationTrajectory<NODES> {
        self.workspace.path()
    }

    /// Attitude and arm that the planner holds: of use as [`InitialGuess::User`] of another plan.
    pub fn motion(&self) -> &ReorientationTrajectory<NODES, LINKS> {
        self.workspace.motion()
    }
}

/// A plan, in its planner's memory.
#[must_use]
pub struct Plan<'p, S = EmbeddedSolver> {
    planner: &'p Planner<S>,
    mission: Mission<LINKS>,
    report: Report,
}

impl<S: Solver> Plan<'_, S> {
    /// Whether the independent verifier found every constraint kept, at nodes and between them: such
    /// a plan can be flown.
    #[must_use]
    pub fn is_verified(&self) -> bool {
        self.report.is_verified()
    }

    /// What the plan is good for.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.report.verdict()
    }

    /// Centre of mass at the nodes, RTN [m].
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.planner.path().position
    }

    /// Its velocity relative to RTN, in RTN [m/s].
    pub fn velocities(&self) -> &[Vector3<f64>] {
        &self.planner.path().velocity
    }

    /// Force over each interval, RTN [N].
    pub fn forces(&self) -> &[Vector3<f64>] {
        self.planner.path().force.get(..NODES - 1).unwrap_or_default()
    }

    /// Attitude, arm and rates at the nodes.
    pub fn states(&self) -> &[State<LINKS>] {
        &self.planner.motion().states
    }

    /// Torques of bus and joints over each interval [N m].
    pub fn controls(&self) -> &[Control<LINKS>] {
        self.planner.motion().controls.get(..NODES - 1).unwrap_or_default()
    }

    /// Feedback gain of an interval, to track the plan with: see [`planner::feedback_gain`]. None
    /// where the solver has none.
    #[must_use]
    pub fn gain(&self, interval: usize) -> Option<Gain> {
        // Where Stage 2 solved nothing, the solver's last program was Stage 1's.
        if self.report.reorientation.outcome.iterations == 0 {
            return None;
        }
        planner::feedback_gain(&self.mission, &self.planner.solver, interval)
    }

    /// Status, residuals, clearances, iterations, times.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The record to file with the plan: what it was made from, by what, what came out.
    pub fn record(&self) -> &Evidence {
        &self.report.evidence
    }
}

/// An initial guess from a plan's motion, such as an earlier plan's.
impl<'a> From<&'a ReorientationTrajectory<NODES, LINKS>> for InitialGuess<'a> {
    fn from(motion: &'a ReorientationTrajectory<NODES, LINKS>) -> Self {
        Self::User(motion)
    }
}
