//! `remora submit`

use super::{Cli, Command, Output};
use clap::Parser;
use remora_host::error::Error;
use remora_host::part::MOST;
use std::fmt::Write;

/// Print the job by which a cluster makes all parts of a command.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
#[command(group = clap::ArgGroup::new("engine").required(true))]
pub(super) struct Args {
    /// As an array job of Slurm, for sbatch
    #[arg(long, group = "engine")]
    slurm: bool,
    /// As a line of GNU parallel, for a shell
    #[arg(long, group = "engine")]
    parallel: bool,
    /// As an indexed job of Kubernetes, for kubectl
    #[arg(long, group = "engine")]
    kubernetes: bool,
    /// Number of parts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST))]
    parts: u64,
    /// The program on the machines that work
    #[arg(long, value_name = "FILE", default_value = "remora")]
    program: String,
    /// campaign, dataset or fly, with its arguments but --part and --jobs
    #[arg(last = true, required = true, value_name = "COMMAND")]
    command: Vec<String>,
}

const AFTER_HELP: &str = "\
Examples:
  remora submit --slurm --parts 1000 -- campaign --count 1000000 --seed 9 --out /shared/a | sbatch
  remora submit --parallel --parts 100 -- campaign --count 10000 --seed 1 --out runs/a | sh
  remora submit --kubernetes --parts 100 -- campaign --count 10000 --seed 1 --out /shared/a

Tasks are parts, not scenarios: arrays of Slurm end at 1000 unless MaxArraySize says otherwise. A part that was
ended goes on where it stopped when its task is run again; one that is there is left as it is. Any other engine does
with --part I/N, I from 1 to N.

Exit status: 0 done, 2 bad input.";

/// The last index of an array of Slurm, where MaxArraySize has its default.
const LAST_OF_ARRAY: u64 = 1000;

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        self.check()?;
        let text = match (self.slurm, self.parallel) {
            (true, _) => self.for_slurm()?,
            (_, true) => self.for_parallel(),
            _ => self.for_kubernetes(),
        };
        Ok(Output::data(text))
    }

    /// Refuses what no part can be made by.
    fn check(&self) -> Result<(), Error> {
        let own = [format!("--part=1/{}", self.parts), "--jobs=1".into()];
        let words = std::iter::once("remora").chain(self.command.iter().map(String::as_str));
        let parsed = Cli::try_parse_from(words.chain(own.iter().map(String::as_str)));
        let refused = |reason: String| Err(Error::argument("COMMAND", reason));
        if let Some(word) = self.command.iter().find(|word| self.parallel && word.contains('{')) {
            return refused(format!(
                "{word:?} holds a brace, by which GNU parallel puts in what it reads"
            ));
        }
        let tasks = match parsed.map(|cli| cli.command) {
            Ok(Some(Command::Campaign(campaign))) => campaign.drawn()?,
            Ok(Some(Command::Dataset(dataset))) => Some(dataset.files()),
            Ok(Some(Command::Fly(fly))) => match fly.runs() {
                None => return refused("lists scenarios, of which there are no parts".into()),
                runs => runs,
            },
            Ok(_) => return refused("is not campaign, dataset or fly".into()),
            Err(error) if !error.use_stderr() => return refused("asks for help".into()),
            Err(error) => return refused(super::usage_line(&error)),
        };
        match tasks.filter(|tasks| *tasks < self.parts) {
            Some(most) => {
                let reason = format!("is {}, and of this there can be {most} at most", self.parts);
                Err(Error::argument("--parts", reason))
            }
            None => Ok(()),
        }
    }

    /// The command of a shell, with the part as the shell finds it.
    fn line(&self, part: &str) -> String {
        let words = std::iter::once(&self.program).chain(&self.command);
        let words: Vec<String> = words.map(|word| quoted(word)).collect();
        format!("{} --part {part}", words.join(" "))
    }

    fn for_slurm(&self) -> Result<String, Error> {
        let parts = self.parts;
        if parts > LAST_OF_ARRAY {
            let reason = format!(
                "is {parts}, and arrays of Slurm end at {LAST_OF_ARRAY}: make fewer, larger parts"
            );
            return Err(Error::argument("--parts", reason));
        }
        Ok(format!(
            "#!/bin/sh\n\
             #SBATCH --job-name=remora\n\
             #SBATCH --array=1-{parts}\n\
             #SBATCH --cpus-per-task=1\n\
             # A minute before its time is up, or when it is to be requeued, the program keeps what it has.\n\
             #SBATCH --signal=B:TERM@60\n\
             exec {}\n",
            self.line(&format!(
                "\"$SLURM_ARRAY_TASK_ID/{parts}\" --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\""
            ))
        ))
    }

    fn for_parallel(&self) -> String {
        let parts = self.parts;
        let line = self.line(&format!("{{}}/{parts} --jobs 1"));
        format!("seq {parts} | parallel --quote {line}\n")
    }

    fn for_kubernetes(&self) -> String {
        let parts = self.parts;
        let script =
            format!("exec \"$0\" \"$@\" --part \"$((JOB_COMPLETION_INDEX + 1))/{parts}\" --jobs 1");
        let mut text = format!(
            "# Put in the image, and the volume that holds --out.\n\
             apiVersion: batch/v1\n\
             kind: Job\n\
             metadata:\n  name: remora\n\
             spec:\n  completions: {parts}\n  parallelism: {parts}\n  completionMode: Indexed\n  \
             template:\n    spec:\n      restartPolicy: OnFailure\n      containers:\n      \
             - name: remora\n        image: IMAGE\n        command:\n"
        );
        let words = ["/bin/sh", "-c", &script, &self.program].into_iter();
        for word in words.chain(self.command.iter().map(String::as_str)) {
            // A string of JSON is one of YAML.
            let _ = writeln!(text, "        - {}", serde_json::Value::from(word));
        }
        text
    }
}

/// A word as a shell takes it whole.
fn quoted(word: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || "-_./:=+,@%".contains(c);
    match !word.is_empty() && word.chars().all(is_safe) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
