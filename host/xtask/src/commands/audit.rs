//! `cargo xtask audit`

use super::options::RootArgs;
use crate::audit::{Audit, Section, Watcher, check, firmware, summary_table};
use indicatif::{ProgressBar, ProgressStyle};
use remora_cli::cli::Output;
use remora_cli::cli::options::{JobsArgs, JsonArgs, choice};
use remora_cli::cli::progress::{Bar, is_shown_live, tell};
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::progress::Progress;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

/// Measure what a review asks for, and write it as a page: memory, latency, instructions, faults.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Measure this part only; the others stay what they are (may be repeated)
    #[arg(long, value_name = "PART", value_parser = choice::<Section>())]
    only: Vec<Section>,
    /// Measure nothing: are budgets kept, and is the page what today's code would make?
    #[arg(long, conflicts_with = "only")]
    check: bool,
    /// Directory of the results; made where it does not exist [default: docs/evidence in the checkout
    /// for the page, target/audit for all numbers]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    root: RootArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  cargo xtask audit                      all parts, about a quarter of an hour on two cores
  cargo xtask audit --only latency       one part again; leave the machine alone meanwhile
  cargo xtask audit --check              what CI does

Builds and emulates firmware images, as `cargo xtask firmware` does; what that needs and is not there is
named, nothing is installed. An audit that was interrupted goes on where it stopped.

Exit status: 0 done and no hard bar or budget broken, 1 something is broken or stale, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let root = self.root.checkout()?;
        // All numbers are kept out of the sources, but beside the page where --out names a folder.
        let target = firmware::folder(&root).with_file_name("audit");
        let numbers = self.out.clone().unwrap_or(target);
        let out = self.out.unwrap_or_else(|| root.join("docs/evidence"));
        let jobs = self.jobs.jobs();
        let mut screen = Screen { bar: Bar::named("audit"), spinner: None };
        if self.check {
            let checked = check(&root, &out, jobs, super::inject::hung, &mut screen)?;
            screen.clear();
            let text = checked.looked_at.iter().map(|line| format!("looked at: {line}\n"));
            let text = text.collect::<String>() + &faults(&checked.faults);
            return Output::new(text, checked.faults.is_empty()).or_json(self.json.json, &checked);
        }
        let sections = if self.only.is_empty() { Section::ALL.to_vec() } else { self.only };
        let audit = Audit { root, out, numbers, sections, jobs, alarm: super::inject::hung };
        let audited = audit.run(&mut screen)?;
        screen.clear();
        let mut text = format!("{}\n", summary_table(&audited.bars));
        for file in &audited.files {
            let _ = writeln!(text, "written: {}", file.display());
        }
        text += &faults(&audited.faults);
        Output::new(text, audited.faults.is_empty()).or_json(self.json.json, &audited)
    }
}

fn faults(faults: &[String]) -> String {
    match faults.len() {
        0 => "no hard bar and no budget is broken\n".into(),
        _ => faults.iter().map(|fault| format!("BROKEN: {fault}\n")).collect(),
    }
}

/// Progress on standard error: the part, then what it does.
struct Screen {
    bar: Bar,
    spinner: Option<ProgressBar>,
}

impl Screen {
    fn clear(&mut self) {
        if let Some(spinner) = self.spinner.take() {
            spinner.finish_and_clear();
        }
    }
}

impl Progress for Screen {
    fn begin(&mut self, total: usize, done: usize) {
        self.clear();
        self.bar.begin(total, done);
    }

    fn done(&mut self, is_solved: bool) {
        self.bar.done(is_solved);
    }

    fn end(&mut self) {
        self.bar.end();
    }
}

impl Watcher for Screen {
    fn section(&mut self, section: Section, number: usize, of: usize) {
        self.clear();
        tell(&format!("{number}/{of}  {}", section.name()));
    }

    fn resumed(&mut self, section: Section) {
        tell(&format!("resuming: {} is there already", section.name()));
    }

    fn line(&mut self, text: &str) {
        if !is_shown_live() {
            return tell(&format!("  {text}"));
        }
        let spinner = self.spinner.get_or_insert_with(|| {
            let spinner = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed}  {wide_msg}") {
                spinner.set_style(style);
            }
            spinner.enable_steady_tick(Duration::from_millis(200));
            spinner
        });
        spinner.set_message(text.to_string());
    }

    fn progress(&mut self) -> &mut (dyn Progress + Send) {
        self
    }
}
