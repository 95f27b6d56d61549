//! `remora generate`

use super::{Output, options};
use clap_complete::aot::{Shell, generate};
use clap_mangen::Man;
use remora_host::choice::choices;
use remora_host::error::Error;
use std::io;
use std::path::Path;

choices! {
    /// Kinds of text for shells, `man` and editors.
    enum Help {
        /// Completions for bash.
        Bash = "bash",
        /// Completions for zsh.
        Zsh = "zsh",
        /// Completions for fish.
        Fish = "fish",
        /// Manual pages of all commands, one after the other.
        Man = "man",
        /// JSON Schema of mission files (*.mission.toml).
        MissionSchema = "mission-schema",
        /// JSON Schema of scenario sets (*.scenarios.json).
        ScenariosSchema = "scenarios-schema",
        /// JSON Schema of errors files (*.errors.toml).
        ErrorsSchema = "errors-schema",
    }
}

/// Print completions, the manual, or a schema for editors.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Text to print
    #[arg(value_name = "KIND", value_parser = options::choice::<Help>())]
    kind: Help,
}

const AFTER_HELP: &str = "\
Examples:
  remora generate bash > remora.bash                     completions: source this file
  remora generate man > remora.1                         the manual
  remora generate mission-schema > mission.schema.json   what an editor checks mission files by";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let text = match self.kind {
            Help::Bash => completions(Shell::Bash),
            Help::Zsh => completions(Shell::Zsh),
            Help::Fish => completions(Shell::Fish),
            Help::Man => {
                manual().map_err(|cause| Error::output(Path::new("standard output"), &cause))?
            }
            Help::MissionSchema => include_str!("../../schemas/mission.schema.json").into(),
            Help::ScenariosSchema => include_str!("../../schemas/scenarios.schema.json").into(),
            Help::ErrorsSchema => include_str!("../../schemas/errors.schema.json").into(),
        };
        Ok(Output::data(text))
    }
}

fn completions(shell: Shell) -> String {
    let mut script = Vec::new();
    generate(shell, &mut super::command(), "remora", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

/// The pages of the program and all its commands.
fn manual() -> io::Result<String> {
    fn render(command: &clap::Command, pages: &mut Vec<u8>) -> io::Result<()> {
        Man::new(command.clone()).render(pages)?;
        command.get_subcommands().try_for_each(|below| render(below, pages))
    }
    let mut program = super::command().disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    render(&program, &mut pages)?;
    Ok(String::from_utf8_lossy(&pages).into_owned())
}
