//! The stages, callable one by one.

use super::run::Run;
use super::scrub::Scrubbed;
use super::{ArmWorkspace, GuessRecord, Options, Solver, StageReport};
use crate::executor::ForkJoin;
use crate::model::{Mission, Refusal, Scenario};
use crate::stages::{Formulation, NODES};
use remora_qp::time::Deadline;

/// Mission, scenario and options of a stage.
pub struct Session<'a, P, const NL: usize> {
    /// The mission; valid.
    pub mission: &'a Mission<NL>,
    /// The scenario.
    pub scenario: &'a Scenario<NL>,
    /// The options.
    pub options: &'a Options<'a, P, NL>,
}

impl<P: ForkJoin, const NL: usize> Session<'_, P, NL> {
    /// Plans Stage 1 as [`super::plan`] does.
    ///
    /// # Errors
    /// A scenario that is infeasible before planning.
    pub fn translate<S: Solver<NX, NU>, const NX: usize, const NU: usize>(
        &self,
        solver: &mut S,
        workspace: &mut ArmWorkspace<NL, NX, NU>,
    ) -> Result<StageReport, Refusal> {
        let mut run = self.run(solver, workspace)?;
        run.propagate_target();
        Ok(run.translate_held().report)
    }

    /// Plans Stage 2 along the translation in the workspace as [`super::plan`] does.
    ///
    /// # Errors
    /// As [`Session::translate`].
    pub fn reorient<S: Solver<NX, NU>, const NX: usize, const NU: usize>(
        &self,
        solver: &mut S,
        workspace: &mut ArmWorkspace<NL, NX, NU>,
    ) -> Result<(StageReport, GuessRecord), Refusal> {
        let mut run = self.run(solver, workspace)?;
        run.propagate_target();
        let (stage, guess) = run.reorient_from(self.options.initial_guess());
        Ok((stage.report, guess))
    }

    fn run<'s, S: Solver<NX, NU>, const NX: usize, const NU: usize>(
        &'s self,
        solver: &'s mut S,
        workspace: &'s mut ArmWorkspace<NL, NX, NU>,
    ) -> Result<Run<'s, 's, S, P, NL, NX, NU>, Refusal> {
        let (settings, platform) = (self.options.settings(), self.options.platform());
        self.mission.check::<NODES>(self.scenario, settings.integrator)?;
        let deadline = Deadline::after(platform.clock, settings.deadline_s);
        let formulation = Formulation {
            deadline,
            ..Formulation::new(self.mission, self.scenario, settings.integrator)
        };
        let (options, executor) = (settings, platform.executor);
        let solver = Scrubbed::off(solver);
        Ok(Run { formulation, deadline, options, solver, executor, workspace })
    }
}
