//! `cargo xtask firmware`

use super::options::RootArgs;
use crate::audit::firmware::{Extent, Firmware, Target, parts_tables, report_tables};
use remora_cli::cli::Output;
use remora_cli::cli::options::{JsonArgs, choice};
use remora_cli::cli::progress::tell;
use remora_host::choice::Choice;
use remora_host::error::Error;
use std::fmt::Write as _;

/// Build the planner's images for flight processors, run them under QEMU, compare them with this machine.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Extent of the images' plans [default: one]
    #[arg(long, value_name = "EXTENT", value_parser = choice::<Extent>())]
    extent: Option<Extent>,
    /// This processor only (may be repeated) [default: all; LEON3 with one scenario alone]
    #[arg(long, value_name = "TARGET", value_parser = choice::<&'static Target>())]
    target: Vec<&'static Target>,
    /// Run each image again: it must print the same, instruction counts included
    #[arg(long)]
    twice: bool,
    /// Print what the parts of a plan take besides
    #[arg(long)]
    phases: bool,
    #[command(flatten)]
    root: RootArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  cargo xtask firmware                                        does it plan on four processors?
  cargo xtask firmware --target thumbv7em-none-eabihf --phases
  cargo xtask firmware --extent corpus                        what the audit reports

Needs QEMU, and a compiler for each target: `rustup target add TARGET`, or Debian's. What is missing is
named; nothing is installed. Images, logs and report.json go to target/firmware in the checkout.

Exit status: 0 all plans have the bits of this machine, no panic can be reached and every bar is kept,
1 something is broken, 2 bad input or something missing.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let extent = self.extent.unwrap_or_default();
        let targets = match (self.target.is_empty(), extent) {
            (false, _) => self.target,
            (true, Extent::One) => <&Target>::ALL.to_vec(),
            (true, _) => Target::audited().collect(),
        };
        let root = self.root.checkout()?;
        let images = Firmware { root, targets, plans: extent.plans(), is_repeated: self.twice };
        let measured = images.run(&mut |line| tell(line))?;
        let is_sound = measured.broken.is_empty();
        let mut tables = report_tables(&measured.report);
        if self.phases {
            tables.extend(parts_tables(&measured.report));
        }
        let mut text = String::new();
        for (heading, table) in &tables {
            let _ = writeln!(text, "{heading}\n\n{table}");
        }
        text.push_str("The estimate is instructions over clock rate, as if each took one cycle: no measurement.\n");
        for line in &measured.broken {
            let _ = writeln!(text, "BROKEN: {line}");
        }
        Output::new(text, is_sound).or_json(self.json.json, &measured.report)
    }
}
