//! `remora view`

use super::Output;
use super::options::{ForceArgs, is_stdout};
use remora_flight::history;
use remora_host::error::Error;
use remora_host::formats::{Limit, PlanFile, plan_stem, read_text, write_atomically};
use remora_web::{MARK, PageError, Shown, page};
use std::path::{Path, PathBuf};

/// Make a page of plans, to look at them in a browser and to plan on there.
///
/// The page is one file that loads nothing: target and servicer in three dimensions over time, all
/// that has limits, what the verifier found, and the planner itself, for arms of three joints.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan files (*.plan.json)
    #[arg(required = true, value_name = "PLAN")]
    plans: Vec<PathBuf>,
    /// Flight of one of the plans (DIR/history/RUN.jsonl), shown against what was planned; may be
    /// given several times
    #[arg(long, value_name = "HISTORY")]
    flight: Vec<PathBuf>,
    /// Page to write, - for standard output [default: beside the plan, where there is one]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora view runs/pub-000.plan.json
  remora view runs/pub-000.plan.json --flight runs/flown/history/0.jsonl --out flown.html
  remora view runs/a/plans/*.plan.json --out runs/a/plans.html

Without --out the page of a.plan.json is a.html beside it. A file that is there is replaced only where it
is such a page, or with --force. `remora fly` and `remora campaign --write report` make pages of notable runs.

Exit status: 0 written, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let out = self.place()?;
        let plans: Vec<PlanFile> =
            self.plans.iter().map(|file| PlanFile::read(file)).collect::<Result<_, _>>()?;
        let mut shown: Vec<Shown<'_>> =
            plans.iter().map(|plan| Shown { plan, flights: Vec::new() }).collect();
        for file in &self.flight {
            let (scenario, flown) = history::read(file)?;
            let of = shown.iter_mut().find(|shown| shown.plan.scenario == scenario);
            let reason = || format!("is a flight of {scenario:?}: none of the plans is for that");
            of.ok_or_else(|| Error::input(file, "scenario", reason()))?.flights.push(flown);
        }
        let wrong = |error: PageError| error.error.at(&self.plans[error.plan]);
        let text = page(&shown).map_err(wrong)?;
        if is_stdout(&out) {
            return Ok(Output::data(text));
        }
        if !is_page(&out) {
            self.force.keep(&out)?;
        }
        write_atomically(&out, text.as_bytes())?;
        Ok(Output::new(format!("written: {}\n", out.display()), true))
    }

    /// Where the page goes: beside the plan, where there is one.
    fn place(&self) -> Result<PathBuf, Error> {
        match (&self.out, self.plans.as_slice()) {
            (Some(out), _) => Ok(out.clone()),
            (None, [plan]) => Ok(beside(plan)),
            (None, _) => Err(Error::argument("--out", "several plans need a name for their page")),
        }
    }
}

/// The page of a plan, beside it: `a.html` for `a.plan.json`.
fn beside(plan: &Path) -> PathBuf {
    plan.with_file_name(format!("{}.html", plan_stem(plan)))
}

/// Whether a file is a page made before, which a new one may replace.
fn is_page(file: &Path) -> bool {
    read_text(file, Limit::DOCUMENT).is_ok_and(|text| text.contains(MARK))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_stand_beside_their_plans() {
        for (plan, page) in [
            ("runs/a.plan.json", "runs/a.html"),
            ("a.json", "a.html"),
            ("a.plan.postcard", "a.html"),
            ("b", "b.html"),
            ("../x.y.plan.json", "../x.y.html"),
        ] {
            assert_eq!(beside(Path::new(plan)), Path::new(page));
        }
    }
}
