//! The stages, callable one by one.

use super::run::Run;
use super::{GuessRecord, Options, Solver, StageReport, Workspace};
use crate::executor::ForkJoin;
use crate::model::{Mission, Refusal, Scenario};
use crate::stages::{Formulation, LINKS, NODES};
use remora_qp::Valid;
use remora_qp::time::Deadline;

/// Mission, scenario and options of a stage.
pub(crate) struct Session<'a, P> {
    pub mission: &'a Valid<Mission<LINKS>>,
    pub scenario: &'a Scenario,
    pub options: &'a Options<'a, P>,
}

impl<P: ForkJoin> Session<'_, P> {
    /// Plans Stage 1 as [`super::plan`] does.
    pub fn translate<S: Solver>(
        &self,
        solver: &mut S,
        workspace: &mut Workspace,
    ) -> Result<StageReport, Refusal> {
        let mut run = self.run(solver, workspace)?;
        run.propagate_target();
        Ok(run.translate_held().report)
    }

    /// Plans Stage 2 along the translation in the workspace as [`super::plan`] does.
    pub fn reorient<S: Solver>(
        &self,
        solver: &mut S,
        workspace: &mut Workspace,
    ) -> Result<(StageReport, GuessRecord), Refusal> {
        let mut run = self.run(solver, workspace)?;
        run.propagate_target();
        let (stage, guess) = run.reorient_from(self.options.initial_guess());
        Ok((stage.report, guess))
    }

    fn run<'s, S: Solver>(
        &'s self,
        solver: &'s mut S,
        workspace: &'s mut Workspace,
    ) -> Result<Run<'s, 's, S, P>, Refusal> {
        let (settings, platform) = (self.options.settings(), self.options.platform());
        self.mission.check::<NODES>(self.scenario, settings.integrator)?;
        let deadline = Deadline::after(platform.clock, settings.deadline_s);
        let formulation = Formulation {
            deadline,
            ..Formulation::new(self.mission, self.scenario, settings.integrator)
        };
        let (options, executor) = (settings, platform.executor);
        Ok(Run { formulation, deadline, options, solver, executor, workspace })
    }
}
