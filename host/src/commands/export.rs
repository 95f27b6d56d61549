//! `remora export`

use super::Output;
use super::options::{ForceArgs, JsonArgs, choice};
use super::programs::ProgramsArgs;
use crate::report;
use remora_export::epoch::Epoch;
use remora_export::job::{Export, Format};
use remora_host::choice::Choice;
use remora_host::error::Error;
use std::path::PathBuf;

/// Write a plan as files of other tools: CCSDS ephemerides, recordings for viewers, its subproblems.
///
/// A plan is in axes that turn with the target's orbit, from time zero on. Ephemerides are in inertial
/// axes and have dates: they need the epoch of the first node, and the target's orbit at that time.
///
/// Subproblems are those that are solved while a scenario is planned: one quadratic program a file with its
/// solution, matrices and bounds node by node, so that any other solver can be run on it.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json); none with --format qp, for which a scenario is planned
    #[arg(value_name = "PLAN", conflicts_with_all = OF_PROGRAMS)]
    plan: Option<PathBuf>,
    /// Kind of file
    #[arg(long, value_name = "FORMAT", value_parser = choice::<Kind>(), value_delimiter = ',')]
    #[arg(required_unless_present = "list")]
    format: Vec<Kind>,
    /// When the plan begins, UTC; oem and aem need it [default: 1970-01-01T00:00:00]
    #[arg(long, value_name = "TIME", requires = "plan")]
    epoch: Option<Epoch>,
    /// The target's orbit at that time (*.chief.toml); oem and aem need it [default: none]
    #[arg(long, value_name = "FILE", requires = "plan")]
    chief: Option<PathBuf>,
    /// From row to row between the nodes, which have rows too [default: 1; Euler's plans: nodes alone]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, requires = "plan")]
    step: Option<f64>,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath, required_unless_present = "list")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
    // Kept last: its heading holds for all options below it.
    #[command(flatten)]
    programs: ProgramsArgs,
}

/// Options that say what is planned, which have no use beside a plan.
const OF_PROGRAMS: [&str; 9] =
    ["scenarios", "id", "list", "mission", "mode", "warm_start", "model", "integrator", "qp"];

/// A kind of file: one of a plan, or the subproblems.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Plan(Format),
    Programs,
}

impl Choice for Kind {
    const ALL: &'static [Self] = &[
        Self::Plan(Format::Oem),
        Self::Plan(Format::Aem),
        Self::Plan(Format::Mcap),
        Self::Programs,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Plan(format) => format.name(),
            Self::Programs => "qp",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Plan(format) => format.help(),
            Self::Programs => "Every convex subproblem that is solved while a scenario is planned",
        }
    }
}

const AFTER_HELP: &str = "\
Examples:
  remora export runs/pub-000.plan.json --format mcap --out runs/shown
  remora export a.plan.json --format oem,aem --epoch 2026-11-23T00:00:00 --chief b.chief.toml --out c
  remora export --format qp --scenarios a.scenarios.json --id s1-007 --out programs
  remora export --format qp --integrator euler --qp clarabel --out programs

--format may be repeated. Writes DIR/ID.mcap, and DIR/ID.servicer.oem, DIR/ID.target.oem, DIR/ID.servicer.aem, DIR/ID.target.aem.
What stands in them, and in the chief's file, is told in docs/guides/export.md.

--format qp stands alone. It writes DIR/stage1-001.qp.json and so on: stage, iteration and, after it,
second-order correction; docs/reference/plan-file.md describes the form. Subproblems that stand in DIR from before are
replaced; with anything else in it DIR is refused, unless --force is given.

Exit status: 0 written, 2 bad input; with --format qp 0 plan optimal, 1 not flyable, 3 verified but not
converged (the subproblems are written all the same).";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        if let Some(list) = self.programs.scenario.listed()? {
            return Ok(Output::data(list));
        }
        let out = self.out.unwrap_or_default();
        let Some(plan) = self.plan else {
            let wants_a_plan = |kind: &Kind| *kind != Kind::Programs;
            if self.format.iter().any(wants_a_plan) {
                return Err(Error::argument("PLAN", "is missing; --format qp alone needs none"));
            }
            return self.programs.write(out, self.force.force, self.json);
        };
        let mut formats = Vec::new();
        for kind in self.format {
            match kind {
                Kind::Programs => {
                    let reason = "qp takes no plan: it plans a scenario, by --scenarios and --id";
                    return Err(Error::argument("--format", reason));
                }
                Kind::Plan(format) if !formats.contains(&format) => formats.push(format),
                Kind::Plan(_) => {}
            }
        }
        if self.chief.is_some() && !formats.iter().any(|format| format.is_inertial()) {
            return Err(Error::argument("--chief", "has no use without oem or aem"));
        }
        let (epoch, chief, step) = (self.epoch, self.chief, self.step);
        let export = Export { plan, formats, epoch, chief, step, out };
        let exported = export.run(|file| self.force.keep(file))?;
        Output::new(report::exported_report(&exported), true).or_json(self.json.json, &exported)
    }
}
