//! One convention for the command line: every option is explained and means one thing, and pages name
//! commands that exist.

#[path = "../../../../tests/documents/commands.rs"]
mod commands;
#[path = "../../../../tests/documents/pages.rs"]
mod pages;

use super::Cli;
use clap::{Arg, Command, CommandFactory};
use commands::{Written, fault, in_help, on_pages};
use std::collections::BTreeMap;

#[test]
fn every_option_and_command_is_explained() {
    Cli::command().debug_assert();
    for command in Cli::command().get_subcommands() {
        assert!(command.get_about().is_some(), "{}", command.get_name());
        assert!(command.get_after_help().is_some(), "{}", command.get_name());
        for arg in command.get_arguments() {
            assert!(arg.get_help().is_some(), "{}: {}", command.get_name(), arg.get_id());
        }
    }
}

#[test]
fn an_option_means_the_same_in_every_command() {
    let program = Cli::command();
    let mut seen: BTreeMap<String, String> = BTreeMap::new();
    for arg in program.get_subcommands().flat_map(|command| command.get_arguments()) {
        // Outputs are named by their kind: a model here, a directory there.
        let Some(name) = arg.get_long().filter(|name| *name != "out") else { continue };
        let said = seen.entry(name.into()).or_insert_with(|| meaning(arg));
        assert_eq!(meaning(arg), *said, "--{name}");
    }
    assert!(seen.len() > 10, "{seen:?}");
}

/// The help without what it says of a default, which may differ.
fn meaning(arg: &Arg) -> String {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    help.split(" [default").next().unwrap_or_default().to_string()
}

/// The program whose commands are looked at.
fn programs() -> [Command; 1] {
    [Cli::command()]
}

#[test]
fn pages_and_help_name_commands_that_exist() {
    let (faults, called) = on_pages();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let own = called.iter().filter(|program| **program == "remora-train").count();
    assert!(own >= 5, "only {own} were found");
    let (faults, seen) = in_help();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(seen >= 5, "only {seen} examples were found");
    assert!(fault("remora-train network --no-such-option", Written::Mention).is_some());
    assert_eq!(fault("remora plan", Written::Whole), None);
}
