//! The stages one by one.

use super::run::Run;
use super::{GuessRecord, Options, Solver, StageReport, Workspace};
use crate::model::{Mission, Refusal, Scenario};
use crate::pair::Pair;
use crate::stages::{Formulation, LINKS, NODES};
use remora_qp::Valid;
use remora_qp::time::Deadline;

/// What a stage is planned for.
pub(crate) struct Session<'a, P> {
    pub mission: &'a Valid<Mission<LINKS>>,
    pub scenario: &'a Scenario,
    pub options: &'a Options<'a, P>,
}

impl<P: Pair> Session<'_, P> {
    /// Stage 1, as [`super::plan`] does it.
    pub fn translate<S: Solver>(
        &self,
        solver: &mut S,
        workspace: &mut Workspace,
    ) -> Result<StageReport, Refusal> {
        let mut run = self.run(solver, workspace)?;
        run.propagate_target();
        Ok(run.translate_held().report)
    }

    /// Stage 2 along the path in the workspace, as [`super::plan`] does it.
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
        let (settings, environment) = (self.options.settings(), self.options.environment());
        self.mission.check::<NODES>(self.scenario, settings.integrator)?;
        let deadline = Deadline::after(environment.clock, settings.deadline_s);
        let formulation =
            Formulation { deadline, ..Formulation::new(self.mission, settings.integrator) };
        let (scenario, options, pair) = (self.scenario, settings, environment.pair);
        Ok(Run { formulation, deadline, scenario, options, solver, pair, workspace })
    }
}
