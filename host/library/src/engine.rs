//! The core's planner in the two sizes that this program is built for: the built-in mission's arm, and
//! room for any other. The only module that calls the core's planner.

use crate::backend::{ClarabelQp, Recorder, Solve};
use crate::formats::{self, MAX_JOINTS, Motion, resized_motion};
use crate::learned::Memories;
use crate::memory::on_heap;
use crate::method::{Deadline, Integrator, Qp};
use crate::padded::PaddedPolicy;
use crate::request::{Guess, PlanRequest};
use crate::settings::plan_settings;
use crate::threads::Threads;
use remora_core::advanced::model::{Mission, Refusal, Scenario};
use remora_core::advanced::planner::{
    self, ArmSolver, ArmWorkspace, EmbeddedSolver, InitialGuess, Nominal, Options, PlanSettings,
    Platform, Report, Session, Solver, StageReport, Workspace,
};
use remora_core::advanced::stages::{
    LINKS, Mode, NODES, ReorientationTrajectory, TranslationTrajectory, Verification, size, verify,
};
use remora_core::advanced::time::{Clock, Deadline as Until, NoClock};
use remora_core::advanced::warmstart;
use std::sync::Arc;

// A learned start has room for every arm that there is an engine for.
const _: () = assert!(MAX_JOINTS <= warmstart::MAX_JOINTS);

/// Seed of learned starts that draw.
pub const SEED: u64 = 0;

/// No clock and one core, as the executor of all plans: another would compile the planner once more.
const ONE_CORE: Platform<'static, Threads> = Platform { clock: &NoClock, executor: &Threads::One };

/// One subproblem of an engine's plan with its solver's answer.
pub type ArmSubproblem<'a, const NX: usize, const NU: usize> =
    Solve<'a, NODES, NX, NU, { size::NG }>;

/// The engine of the built-in mission's arm.
pub type DefaultArmEngine = Engine<LINKS, { size::NX }, { size::NU }>;

/// The engine of all other arms: joints that an arm does not have stand still, see
/// [`Mission::resized`].
pub type AnyArmEngine =
    Engine<MAX_JOINTS, { size::states(MAX_JOINTS) }, { size::controls(MAX_JOINTS) }>;

/// The core's planner for arms of up to `M` joints, with its memory: 1 MiB on the heap for three joints,
/// 2 MiB for seven, and a few more once Clarabel has planned.
pub struct Engine<const M: usize, const NX: usize, const NU: usize> {
    /// Where the last plan is.
    pub workspace: Box<ArmWorkspace<M, NX, NU>>,
    embedded: Box<ArmSolver<NX, NU>>,
    clarabel: ClarabelQp,
    /// Memory for models.
    memories: Memories,
    /// Clock of plans made in flight, which ends them once it reads [`Deadline::FAR`]; none leaves them
    /// unlimited.
    pub clock: Option<Arc<dyn Clock + Send>>,
}

/// The core's code in one size. It is implemented for each size by name, so that the core is compiled in
/// this crate, twice and no more, whoever calls.
pub trait Build<const M: usize, const NX: usize, const NU: usize> {
    /// Plans with the solver that the request names; `watch` looks at each subproblem.
    fn run(
        &mut self,
        clock: &dyn Clock,
        request: &PlanRequest,
        scenario: &formats::Scenario,
        watch: &mut dyn FnMut(ArmSubproblem<'_, NX, NU>),
    ) -> Report;

    /// Plans Stage 1 alone, with no deadline: the translation is left in the workspace with the target's
    /// motion.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    fn translate(
        &mut self,
        mission: &Mission<M>,
        scenario: &Scenario<M>,
        integrator: Integrator,
    ) -> Result<StageReport, Refusal>;

    /// Plans the rest of a plan in force with the embedded solver. That plan is the guess, and only a stopped
    /// clock is a deadline.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    fn replan(
        &mut self,
        mission: &Mission<M>,
        scenario: &Scenario<M>,
        integrator: Integrator,
        guess: (&Nominal<M>, f64),
    ) -> Result<Report, Refusal>;

    /// Runs the independent verifier.
    fn verify(
        mission: &Mission<M>,
        scenario: &Scenario<M>,
        integrator: Integrator,
        translation: &TranslationTrajectory<NODES>,
        motion: &ReorientationTrajectory<NODES, M>,
    ) -> Verification;
}

/// Implements [`Build`] for engines of `M` joints.
macro_rules! build {
    ($joints:expr) => {
        impl Build<{ $joints }, { size::states($joints) }, { size::controls($joints) }>
            for Engine<{ $joints }, { size::states($joints) }, { size::controls($joints) }>
        {
            fn run(
                &mut self,
                clock: &dyn Clock,
                request: &PlanRequest,
                scenario: &formats::Scenario,
                watch: &mut dyn FnMut(
                    ArmSubproblem<'_, { size::states($joints) }, { size::controls($joints) }>,
                ),
            ) -> Report {
                let Self { workspace, embedded, clarabel, memories, .. } = self;
                let solver: &mut dyn Solver<
                    { size::states($joints) },
                    { size::controls($joints) },
                > = match request.method.qp {
                    Qp::Embedded => &mut **embedded,
                    Qp::Clarabel => clarabel,
                };
                let mut solver = Recorder::new(solver, watch);
                run(clock, request, scenario, &mut solver, workspace, memories)
            }

            fn translate(
                &mut self,
                mission: &Mission<{ $joints }>,
                scenario: &Scenario<{ $joints }>,
                integrator: Integrator,
            ) -> Result<StageReport, Refusal> {
                let settings = PlanSettings::new(Mode::Optimal, integrator);
                let guess = InitialGuess::Heuristic;
                let options = &Options::from_parts(settings, guess, ONE_CORE);
                let mut solver: &mut dyn Solver<
                    { size::states($joints) },
                    { size::controls($joints) },
                > = &mut *self.embedded;
                let session = Session { mission, scenario, options };
                session.translate(&mut solver, &mut self.workspace)
            }

            fn replan(
                &mut self,
                mission: &Mission<{ $joints }>,
                scenario: &Scenario<{ $joints }>,
                integrator: Integrator,
                (plan, elapsed): (&Nominal<{ $joints }>, f64),
            ) -> Result<Report, Refusal> {
                mission.check::<NODES>(scenario, integrator)?;
                let settings = PlanSettings::new(Mode::Optimal, integrator);
                let guess = InitialGuess::Nominal { plan, elapsed };
                let (deadline_s, platform) = match &self.clock {
                    None => (f64::INFINITY, ONE_CORE),
                    Some(clock) => {
                        let platform = Platform { clock: &**clock, ..ONE_CORE };
                        (Deadline::FAR.seconds(), platform)
                    }
                };
                let settings = PlanSettings { deadline_s, ..settings };
                let options = Options::from_parts(settings, guess, platform);
                let mut solver: &mut dyn Solver<
                    { size::states($joints) },
                    { size::controls($joints) },
                > = &mut *self.embedded;
                let workspace = &mut self.workspace;
                Ok(planner::plan(mission, scenario, &options, &mut solver, workspace))
            }

            fn verify(
                mission: &Mission<{ $joints }>,
                scenario: &Scenario<{ $joints }>,
                integrator: Integrator,
                translation: &TranslationTrajectory<NODES>,
                motion: &ReorientationTrajectory<NODES, { $joints }>,
            ) -> Verification {
                verify(mission, scenario, integrator, translation, motion, &Until::never())
            }
        }
    };
}

build!(LINKS);
build!(MAX_JOINTS);

impl<const M: usize, const NX: usize, const NU: usize> Default for Engine<M, NX, NU> {
    /// An engine that has planned nothing yet.
    fn default() -> Self {
        Self {
            workspace: on_heap(ArmWorkspace::new),
            embedded: on_heap(ArmSolver::new),
            clarabel: ClarabelQp::default(),
            memories: Memories::default(),
            clock: None,
        }
    }
}

impl<const M: usize, const NX: usize, const NU: usize> Engine<M, NX, NU> {
    /// Whether its clock was stopped.
    pub fn is_stopped(&self) -> bool {
        self.clock.as_ref().is_some_and(|clock| clock.seconds() >= Deadline::FAR.seconds())
    }

    /// Bus and arm of the last plan.
    pub fn reorientation(&self) -> Motion {
        resized_motion(self.workspace.reorientation())
    }
}

/// The core's verifier, in the size that plans for the mission's arm.
pub fn verified(
    mission: &formats::Mission,
    scenario: &formats::Scenario,
    integrator: Integrator,
    translation: &TranslationTrajectory<NODES>,
    motion: &Motion,
) -> Verification {
    match mission.joints() {
        LINKS => DefaultArmEngine::verify(
            &mission.sized(),
            &scenario.resized(),
            integrator,
            translation,
            &resized_motion(motion),
        ),
        _ => {
            let mission = &mission.sized();
            AnyArmEngine::verify(mission, scenario, integrator, translation, motion)
        }
    }
}

/// The call into the core.
fn run<const M: usize, const NX: usize, const NU: usize>(
    clock: &dyn Clock,
    request: &PlanRequest,
    scenario: &formats::Scenario,
    mut solver: &mut dyn Solver<NX, NU>,
    workspace: &mut ArmWorkspace<M, NX, NU>,
    memories: &mut Memories,
) -> Report {
    let PlanRequest { mission, method, guess, threads, is_scrubbed } = request;
    let (joints, sized) = (mission.joints(), (mission.sized(), scenario.resized()));
    threads.prepare();
    let platform = Platform { clock, executor: threads };
    let mut planned = |start: &InitialGuess<'_, M>| {
        let asked = plan_settings(method);
        let options = Options::from_parts(asked, *start, platform);
        let options = options.scrubbing(*is_scrubbed);
        // Its code is compiled once for all solvers.
        let mut report = planner::plan(&sized.0, &sized.1, &options, &mut solver, workspace);
        if method.deadline == Some(Deadline::FAR) {
            let asked = PlanSettings { deadline_s: f64::INFINITY, ..asked };
            report.record.settings = planner::settings_checksum(&asked, start, &solver);
        }
        report
    };
    let mut report = match guess {
        Guess::Heuristic => planned(&InitialGuess::Heuristic),
        Guess::Given(motion) => planned(&InitialGuess::User(&own_motion(motion, joints))),
        Guess::Left(plan, elapsed) => {
            let reorientation = own_motion(&plan.reorientation, joints);
            let Nominal { nodes, duration, .. } = **plan;
            let plan = &Nominal { reorientation, nodes, duration };
            planned(&InitialGuess::Nominal { plan, elapsed: *elapsed })
        }
        Guess::Model(model) => model.at_work(memories, |policy| match policy {
            None => planned(&InitialGuess::Refused),
            Some(policy) if joints == M => planned(&InitialGuess::Learned { policy, seed: SEED }),
            Some(policy) => {
                let policy = &PaddedPolicy { policy, joints, room: M };
                planned(&InitialGuess::Learned { policy, seed: SEED })
            }
        }),
    };
    // Checksums of what the caller gave and gets, without joints that are not there.
    if joints != M {
        let motion = resized_motion(workspace.reorientation());
        let nodes = mission.grid(scenario).nodes;
        report.record.input = mission.input_checksum(scenario);
        report.record.output = mission.output_checksum(nodes, workspace.translation(), &motion);
    }
    report
}

/// A motion of an arm of so many joints, which may come from a longer one: all others stand at zero.
fn own_motion<const M: usize>(motion: &Motion, joints: usize) -> ReorientationTrajectory<NODES, M> {
    let mut own: ReorientationTrajectory<NODES, M> = resized_motion(motion);
    for j in joints..M {
        own.states.iter_mut().for_each(|x| (x.joint_angle[j], x.joint_rate[j]) = (0.0, 0.0));
        own.controls.iter_mut().for_each(|u| u.joint_torque[j] = 0.0);
    }
    own
}

/// The solver that flies, on the heap and called through a pointer: its code, too, is compiled once.
pub fn embedded_solver() -> Box<dyn Solver + Send> {
    on_heap(EmbeddedSolver::new)
}

/// [`planner::plan`] with a solver known at run time, for the built-in mission's arm.
pub fn plan_with(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &Options<'_, Threads>,
    mut solver: &mut dyn Solver,
    workspace: &mut Workspace,
) -> Report {
    planner::plan(mission, scenario, options, &mut solver, workspace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guess_keeps_the_arms_own_joints_alone() {
        let mut motion = Motion::ZERO;
        motion.states[2].joint_angle.fill(0.5);
        motion.controls[2].joint_torque.fill(0.25);
        let own: ReorientationTrajectory<NODES, MAX_JOINTS> = own_motion(&motion, 4);
        assert_eq!((own.states[2].joint_angle.sum(), own.states[2].joint_angle[4]), (2.0, 0.0));
        assert_eq!(own.controls[2].joint_torque.sum(), 1.0);
        let cut: ReorientationTrajectory<NODES, LINKS> = own_motion(&motion, LINKS);
        assert_eq!(cut.states[2].joint_angle.sum(), 1.5);
    }
}
