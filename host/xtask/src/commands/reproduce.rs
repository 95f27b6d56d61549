//! `cargo xtask reproduce`

use remora_cli::cli::Output;
use remora_cli::cli::options::{
    COUNT, IntegratorArgs, JsonArgs, MissionArgs, SEED, choice, drawn, jobs, of_all_nodes,
};
use remora_cli::cli::progress::Bar;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::formats::ScenarioSet;
use remora_learn::reproduce::{Bench, Table, fit_for_evaluation, read_cards};
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Compute the paper's tables for learned starts, beside the published numbers.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Which table or figure
    #[arg(value_parser = choice::<Table>())]
    table: Table,
    /// Directory of models (*.model)
    #[arg(long, value_name = "DIR", default_value = "fixtures/models/tables")]
    models: PathBuf,
    /// Scenario set (*.scenarios.json) [default: those drawn]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["count", "seed"])]
    scenarios: Option<PathBuf>,
    #[arg(long, value_name = "N", default_value_t = 300, help = COUNT)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    #[arg(long, value_name = "S", default_value_t = 7, help = SEED)]
    seed: u64,
    #[command(flatten)]
    integrator: IntegratorArgs,
    #[command(flatten)]
    mission: MissionArgs,
    /// Worker threads
    #[arg(long, value_name = "J", value_parser = jobs(), default_value_t = NonZeroUsize::MIN)]
    jobs: NonZeroUsize,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  cargo xtask reproduce decoders --integrator euler --out runs/paper
  cargo xtask reproduce feasibility --models my-models --out runs/paper

The integrator decides which models are compared. No scenario may be one that a model was trained on.
More than one job share the memory's bandwidth and take longer a plan. Writes DIR/TABLE.md, .json and .svg. Interrupt it at any time: the same command goes on where it
stopped, and tables that need the same plans share them. Plans of all starts are made scenario by
scenario, so that their times are measured under the same load.

Exit status: 0 done, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = of_all_nodes(self.mission.of_default_arm()?, self.mission.file())?;
        let set = match &self.scenarios {
            Some(file) => ScenarioSet::read(file)?,
            None => drawn(self.count, self.seed, &mission)?,
        };
        let (integrator, jobs) = (self.integrator.integrator, self.jobs);
        let scenarios = set.scenarios;
        let models = fit_for_evaluation(read_cards(&self.models)?, integrator, &scenarios)?;
        let count = scenarios.len();
        let progress = &mut Bar::named("reproduce");
        let mut bench = Bench { scenarios, mission, integrator, jobs, out: &self.out, progress };
        let mut findings = self.table.reproduce(&models, &mut bench)?;
        findings.notes.push(format!("{count} scenarios, {integrator}, {jobs} at a time."));
        let mut text = findings.text();
        for file in findings.write(&self.out, self.table.name())? {
            let _ = writeln!(text, "written: {}", file.display());
        }
        Output::new(text, true).or_json(self.json.json, &findings.numbers)
    }
}
