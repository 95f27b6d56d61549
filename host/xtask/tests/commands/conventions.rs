//! One convention for the command lines: the same option has the same meaning in every command of both programs.

use super::programs;
use clap::{Arg, Command};
use std::collections::{BTreeMap, BTreeSet};

/// Defaults that differ, and why.
const OTHER_DEFAULTS: [(&str, &str, &str); 6] = [
    ("envelope", "warm-start", "built-in models know the built-in mission alone"),
    ("envelope", "seed", "its map is one that can be made again"),
    ("reproduce", "seed", "its tables can be made again"),
    ("reproduce", "count", "as many as the published tables have"),
    ("inject", "seed", "its cases can be drawn again"),
    (
        "reproduce",
        "jobs",
        "more than one would share the memory's bandwidth, and times are measured",
    ),
];

/// Commands that need or make other things than the rest: what is said of a default in brackets may
/// differ.
fn meaning(arg: &Arg) -> String {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    help.split(" [default").next().unwrap_or_default().to_string()
}

fn default(arg: &Arg) -> Vec<String> {
    arg.get_default_values().iter().map(|value| value.to_string_lossy().into()).collect()
}

/// Name of the value: two options of one name that take different things are not the same.
fn value(arg: &Arg) -> String {
    let names = arg.get_value_names().unwrap_or_default();
    if arg.get_action().takes_values() { names.join(" ") } else { String::new() }
}

/// All commands, those of groups too.
fn commands() -> Vec<Command> {
    fn collect(command: &Command, all: &mut Vec<Command>) {
        for below in command.get_subcommands() {
            all.push(below.clone());
            collect(below, all);
        }
    }
    let mut all = Vec::new();
    programs().iter().for_each(|program| collect(program, &mut all));
    all
}

fn options(command: &Command) -> Vec<&Arg> {
    let is_ours =
        |arg: &&Arg| arg.get_long().is_some_and(|long| !["help", "version"].contains(&long));
    command.get_arguments().filter(is_ours).collect()
}

#[test]
fn an_option_means_the_same_in_every_command() {
    let commands = commands();
    let mut seen: BTreeMap<(String, String), (String, String)> = BTreeMap::new();
    for command in &commands {
        for arg in options(command) {
            let name = arg.get_long().unwrap().to_string();
            // A file that is written is named by what it is.
            if name == "out" && value(arg) == "FILE" {
                continue;
            }
            let is = (command.get_name().to_string(), meaning(arg));
            let (other, said) = seen.entry((name.clone(), value(arg))).or_insert(is);
            let at = format!("--{name} of {} and {other}", command.get_name());
            assert_eq!(meaning(arg), *said, "{at}");
        }
    }
    let mut kinds: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (name, value) in seen.keys() {
        kinds.entry(name).or_default().push(value);
    }
    kinds.retain(|_, values| values.len() > 1);
    assert!(kinds.is_empty(), "options that take different things: {kinds:?}");
}

#[test]
fn an_option_has_the_same_default_in_every_command() {
    let commands = commands();
    let is_other = |command: &Command, name: &str| {
        let named = |(other, option, _): &(&str, &str, &str)| {
            *other == command.get_name() && *option == name
        };
        OTHER_DEFAULTS.iter().any(named)
    };
    let mut seen: BTreeMap<String, (String, Vec<String>)> = BTreeMap::new();
    for command in &commands {
        for arg in options(command).into_iter().filter(|arg| arg.get_action().takes_values()) {
            let name = arg.get_long().unwrap();
            // One without a value here says what stands in its place in its help.
            if default(arg).is_empty() || is_other(command, name) {
                continue;
            }
            let is = (command.get_name().to_string(), default(arg));
            let (other, said) = seen.entry(name.into()).or_insert(is);
            assert_eq!(default(arg), *said, "--{name} of {} and {other}", command.get_name());
        }
    }
    assert_eq!(seen["integrator"].1, ["rk4"]);
}

/// Nothing has a second name that its help doesn't say.
#[test]
fn no_name_is_hidden() {
    for command in commands() {
        assert_eq!(command.get_all_aliases().count(), 0, "{}", command.get_name());
        for arg in command.get_arguments() {
            assert_eq!(arg.get_all_aliases(), None, "{}: {}", command.get_name(), arg.get_id());
        }
    }
}

/// A command or an option more of the operator's program makes room first.
#[test]
fn the_program_stays_small() {
    let mut program = remora_cli::command();
    program.build();
    let longs = |command: &Command| -> BTreeSet<String> {
        command.get_arguments().filter_map(Arg::get_long).map(String::from).collect()
    };
    let (mut named, mut all) = (0, longs(&program));
    for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
        named += 1;
        all.extend(longs(command));
        command.get_subcommands().for_each(|below| all.extend(longs(below)));
    }
    assert!(named <= 12, "{named} commands");
    assert!(all.len() <= 60, "{} options: {all:?}", all.len());
    let campaign = longs(program.find_subcommand("campaign").unwrap());
    assert!(campaign.len() <= 18, "{} options: {campaign:?}", campaign.len());
}

#[test]
fn every_option_and_command_is_explained() {
    programs().into_iter().for_each(Command::debug_assert);
    for command in commands() {
        assert!(command.get_about().is_some(), "{}", command.get_name());
        assert!(command.get_after_help().is_some(), "{}", command.get_name());
        for arg in command.get_arguments() {
            assert!(arg.get_help().is_some(), "{}: {}", command.get_name(), arg.get_id());
        }
    }
}
