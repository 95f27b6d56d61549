//! The page of commands, made from the help of the program.

use super::pages::root;
use clap::error::{ContextKind, ContextValue};
use clap::{Arg, Command};
use std::collections::BTreeMap;
use std::fs;

/// Page that the test compares, and writes.
const PAGE: &str = "docs/reference/commands.md";

/// Columns of a line of prose.
const WIDTH: usize = 120;

const BEFORE: &str = "\
# Commands

<!-- Written from the help texts: REMORA_WRITE_COMMANDS=1 cargo test -p remora-cli --test documents -->

After this page you can call every command of `remora` with the options that you need.
";

const AFTER: &str = "\
Add `--help` to a command for more about its files. `--quiet` leaves out reports and progress.

## Exit status

|status|meaning|
|---|---|
|0|Done: all plans are optimal, all checks passed.|
|1|A plan is not flyable, or a check failed.|
|2|The input is bad, or output cannot be written. Standard error has one line.|
|3|All plans are verified, some are not converged.|
|130, 143|A signal ended the work. The same command resumes it.|

## Shared options

Two or more commands take these options, with the same default. Each section names its own.
";

const TABLE: &str = "\
|option|value|default|meaning|
|---|---|---|---|
";

/// An option, or an argument without a name, as a row of a table.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Row {
    name: String,
    value: String,
    default: String,
    meaning: String,
}

/// A command with a section of its own.
struct Section<'a> {
    name: String,
    command: &'a Command,
    rows: Vec<Row>,
}

impl Row {
    fn new(arg: &Arg, required: &[String]) -> Self {
        let (meaning, told) = split_default(&text(arg.get_help()));
        let placeholder = text(arg.get_value_names().and_then(<[_]>::first));
        let name = match (arg.get_short(), arg.get_long()) {
            (Some(short), Some(long)) => format!("-{short}, --{long}"),
            (_, Some(long)) => format!("--{long}"),
            _ => placeholder.clone(),
        };
        let begins = [format!("--{} ", arg.get_long().unwrap_or_default()), format!("<{name}>")];
        let is_required =
            required.iter().any(|of| begins.iter().any(|begin| of.starts_with(begin)));
        let given: Vec<_> =
            arg.get_default_values().iter().map(|of| of.to_string_lossy()).collect();
        let default = match told {
            _ if is_required => "required".into(),
            Some(told) => told,
            None if !arg.get_action().takes_values() => "off".into(),
            None if given.is_empty() => "none".into(),
            None => given.join(","),
        };
        Self { value: value(arg, placeholder), name, default, meaning }
    }

    fn is_option(&self) -> bool {
        self.name.starts_with('-')
    }

    fn line(&self) -> String {
        let cells = [&self.value, &self.default, &self.meaning];
        // Signs that Markdown would take for its own.
        let cells = cells.map(|cell| cell.replace('|', "\\|").replace('*', "\\*"));
        format!("|`{}`|{}|\n", self.name, cells.join("|"))
    }
}

impl<'a> Section<'a> {
    fn new(program: &Command, path: &[&'a Command]) -> Self {
        let names: Vec<&str> = path.iter().map(|command| command.get_name()).collect();
        let required = required(program, &names);
        let command = path[path.len() - 1];
        let rows = command.get_arguments().map(|arg| Row::new(arg, &required)).collect();
        Self { name: names.join(" "), command, rows }
    }

    /// Text of the section; options of the first table stand there by their names.
    fn text(&self, shared: &[Row]) -> String {
        let level = if self.name.contains(' ') { "###" } else { "##" };
        let about = text(self.command.get_about());
        let about = wrapped(about.trim_end_matches('.'));
        let mut text = format!("\n{level} remora {}\n\n{about}.\n", self.name);
        let (named, own): (Vec<&Row>, Vec<&Row>) =
            self.rows.iter().partition(|row| shared.contains(row));
        if !own.is_empty() {
            let lines: String = own.into_iter().map(Row::line).collect();
            text += &format!("\n{TABLE}{lines}");
        }
        if !named.is_empty() {
            let named: Vec<String> = named.iter().map(|row| format!("`{}`", row.name)).collect();
            let named = format!("[Shared](#shared-options): {}.", named.join(", "));
            text += &format!("\n{}\n", wrapped(&named));
        }
        // A command that only has commands below shows no example twice.
        if !self.command.is_subcommand_required_set() {
            text += &examples(self.command);
        }
        text
    }
}

fn text(of: Option<&impl ToString>) -> String {
    of.map(ToString::to_string).unwrap_or_default()
}

/// Help without its default, and the default.
fn split_default(help: &str) -> (String, Option<String>) {
    let split = || {
        let (before, default) = help.strip_suffix(']')?.rsplit_once("default: ")?;
        let (meaning, unit) = before.rsplit_once('[')?;
        let unit = unit.trim_end_matches("; ");
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        Some((format!("{}{unit}", meaning.trim_end()), Some(default.to_string())))
    };
    split().unwrap_or_else(|| (help.to_string(), None))
}

/// Choices of an option, or the placeholder of its value.
fn value(arg: &Arg, placeholder: String) -> String {
    if !arg.get_action().takes_values() {
        return String::new();
    }
    let choices = arg.get_possible_values();
    let names: Vec<&str> = choices.iter().map(|choice| choice.get_name()).collect();
    match names.is_empty() || arg.is_hide_possible_values_set() {
        // An argument without a name stands by its placeholder already.
        true if arg.is_positional() => String::new(),
        true => placeholder,
        false => names.join(", "),
    }
}

/// Arguments that a command asks for where it has none.
fn required(program: &Command, path: &[&str]) -> Vec<String> {
    let words = std::iter::once(program.get_name()).chain(path.iter().copied());
    let Err(error) = program.clone().try_get_matches_from(words) else { return Vec::new() };
    match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::Strings(names)) => names.clone(),
        _ => Vec::new(),
    }
}

/// Examples of a command's help, with comments as a shell has them.
fn examples(command: &Command) -> String {
    let help = text(command.get_after_help());
    let lines = help.lines().filter(|line| line.starts_with("  remora"));
    let lines: Vec<String> = lines
        .map(|line| match line.trim().split_once("  ") {
            Some((command, comment)) => format!("{command}  # {}\n", comment.trim()),
            None => format!("{}\n", line.trim()),
        })
        .collect();
    if lines.is_empty() { String::new() } else { format!("\n```sh\n{}```\n", lines.concat()) }
}

/// Text in lines of at most [`WIDTH`] columns.
fn wrapped(text: &str) -> String {
    let (mut lines, mut line) = (Vec::new(), String::new());
    for word in text.split_whitespace() {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(std::mem::take(&mut line));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push(line);
    lines.join("\n")
}

fn sections(program: &Command) -> Vec<Section<'_>> {
    let mut sections = Vec::new();
    for command in program.get_subcommands() {
        sections.push(Section::new(program, &[command]));
        let below = command.get_subcommands();
        sections.extend(below.map(|below| Section::new(program, &[command, below])));
    }
    sections
}

/// Options that two commands or more take, with the same default and meaning.
fn shared(sections: &[Section]) -> Vec<Row> {
    let mut seen: BTreeMap<&Row, usize> = BTreeMap::new();
    for row in sections.iter().flat_map(|section| &section.rows) {
        *seen.entry(row).or_default() += 1;
    }
    let shared = seen.into_iter().filter(|(row, times)| row.is_option() && *times > 1);
    shared.map(|(row, _)| row.clone()).collect()
}

fn page(program: &Command) -> String {
    let sections = sections(program);
    let shared = shared(&sections);
    let table: String = shared.iter().map(Row::line).collect();
    let sections: String = sections.iter().map(|section| section.text(&shared)).collect();
    format!("{BEFORE}{}\n{AFTER}\n{TABLE}{table}{sections}", examples(program))
}

/// The page is written anew where `REMORA_WRITE_COMMANDS` is set.
#[test]
fn the_page_of_commands_is_the_help_of_the_program() {
    let made = page(&remora_cli::command());
    let file = root().join(PAGE);
    if std::env::var_os("REMORA_WRITE_COMMANDS").is_some() {
        fs::write(&file, &made).unwrap();
    }
    let kept = fs::read_to_string(&file).unwrap_or_default();
    assert!(kept == made, "{PAGE} is stale: REMORA_WRITE_COMMANDS=1 writes it");
}
