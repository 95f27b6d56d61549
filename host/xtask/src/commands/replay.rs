//! `cargo xtask replay`

use super::options::RootArgs;
use crate::doors::door::Door;
use crate::doors::input::Input;
use crate::doors::replay::Replay;
use crate::doors::report::replay_report;
use remora_cli::cli::Output;
use remora_cli::cli::options::{JsonArgs, choice};
use remora_cli::cli::progress::tell;
use remora_host::choice::Choice;
use remora_host::error::Error;
use std::path::PathBuf;

/// Make a plan again and compare it bit for bit, here or behind every door of this machine.
///
/// A plan file holds mission, scenario and options. Whatever plans the same from them, in this program or
/// another, on this processor or an emulated one, must come to the same bits.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json)
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Behind every door of this machine; what is not there is named
    #[arg(long)]
    everywhere: bool,
    /// Behind this door only (may be repeated) [default: this program]
    #[arg(long, value_name = "DOOR", value_parser = choice::<Door>(), conflicts_with = "everywhere")]
    door: Vec<Door>,
    /// Learned model (*.model) [default: the built-in one for the integrator]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    #[command(flatten)]
    root: RootArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  cargo xtask replay runs/pub-000.plan.json
  cargo xtask replay runs/pub-000.plan.json --everywhere
  cargo xtask replay runs/pub-000.plan.json --door c --door node

Doors that need the sources (an archive, a module or an image to build) find them in the checkout around the
working folder, and build what is not built yet: the first time takes minutes. docs/evidence/verification.md
tells what each door needs.

Exit status: 0 the same bits behind every door that is there, 1 some door made another plan or none, 2 bad
input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let doors = match (self.everywhere, self.door.is_empty()) {
            (true, _) => Door::ALL.to_vec(),
            (false, true) => vec![Door::Program],
            (false, false) => self.door,
        };
        let input = Input::read(&self.plan, self.model)?;
        // Without a checkout there is less behind some doors, and they say so.
        let root = match self.root.is_given() {
            true => Some(self.root.checkout()?),
            false => self.root.checkout().ok(),
        };
        let replay = Replay { input, doors, root };
        let replays = replay.run(&mut |line| tell(line))?;
        let report = replay_report(&replays);
        Output::new(report, replays.all_same()).or_json(self.json.json, &replays)
    }
}
