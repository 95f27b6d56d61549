//! Commands that pages and help texts name: whether the programs have them.

use super::{pages, programs};
use clap::Command;
use clap::error::ErrorKind;

/// Whether a command is written out in full, or only mentioned.
#[derive(Clone, Copy, PartialEq)]
pub enum Written {
    Whole,
    Mention,
}

/// A call of a program.
pub struct Call {
    pub program: &'static str,
    arguments: Vec<String>,
}

/// Fault of a command line, if it calls a program of ours.
pub fn fault(line: &str, written: Written) -> Option<String> {
    let Call { program, arguments } = call(line)?;
    let program = programs().into_iter().find(|known| known.get_name() == program)?;
    let words = std::iter::once(program.get_name().to_string()).chain(arguments);
    let kind = match program.clone().try_get_matches_from(words) {
        Ok(_) => return None,
        Err(error) => error.kind(),
    };
    let is_fine = match kind {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => true,
        ErrorKind::MissingRequiredArgument | ErrorKind::MissingSubcommand => {
            written == Written::Mention
        }
        // The shell puts the value there.
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => line.contains('$'),
        _ => false,
    };
    (!is_fine).then(|| format!("{line}: {kind}"))
}

/// The call that a line of a shell makes, if it is one of ours.
fn call(line: &str) -> Option<Call> {
    let line = line.split(" #").next()?.trim();
    let line = first_command(line).trim();
    let line = line.strip_prefix("exec ").unwrap_or(line);
    let (program, rest) = match line.strip_prefix("cargo run") {
        Some(rest) => {
            let (own, rest) = rest.split_once(" -- ").unwrap_or((rest, ""));
            let is_tool = own.split_whitespace().any(|word| word == "xtask");
            if !is_tool && (own.contains("--bin") || own.contains("--example")) {
                return None;
            }
            (if is_tool { "xtask" } else { "remora" }, rest)
        }
        None => {
            let plain = line.strip_prefix("target/release/").unwrap_or(line);
            let trains = plain.strip_prefix("remora-train");
            match plain.strip_prefix("remora") {
                Some(_) if trains.is_some() => ("remora-train", trains?),
                Some(rest) => ("remora", rest),
                // By itself it is the name of a crate.
                None if line.starts_with("xtask") => return None,
                None => {
                    ("xtask", line.strip_prefix("cargo ").unwrap_or(plain).strip_prefix("xtask")?)
                }
            }
        }
    };
    // Another word that begins so, such as `remora-core`.
    if !rest.is_empty() && !rest.starts_with(' ') && !line.starts_with("cargo run") {
        return None;
    }
    let words = words(rest).into_iter().filter(|word| word != "...");
    let arguments = words.map(|word| word.trim_matches('"').to_string()).collect();
    Some(Call { program, arguments })
}

/// A line up to what a shell takes for another command or a file, outside of single quotes.
fn first_command(line: &str) -> &str {
    let mut is_quoted = false;
    let end = line.find(|c: char| {
        is_quoted ^= c == '\'';
        !is_quoted && matches!(c, ';' | '|' | '>' | '&')
    });
    &line[..end.unwrap_or(line.len())]
}

/// The words of a line; what stands in single quotes is one.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (i, part) in line.split('\'').enumerate() {
        match i % 2 {
            0 => words.extend(part.split_whitespace().map(String::from)),
            _ => words.push(part.to_string()),
        }
    }
    words
}

/// Faults of commands on all pages, and the programs that these commands call.
pub fn on_pages() -> (Vec<String>, Vec<&'static str>) {
    let (mut faults, mut called) = (Vec::new(), Vec::new());
    for page in pages::all().iter().filter(|page| page.is_current()) {
        let mut look = |line: &str, written| {
            called.extend(call(line).map(|call| call.program));
            faults.extend(fault(line, written).map(|text| format!("{}: {text}", page.path)));
        };
        for fence in page.fences().iter().filter(|fence| fence.is_shell()) {
            let text = fence.lines.join("\n").replace("\\\n", " ");
            text.lines().for_each(|line| look(line.trim(), Written::Whole));
        }
        page.inline_code().iter().for_each(|code| look(code, Written::Mention));
    }
    (faults, called)
}

/// A command, and all commands below it.
fn with_below(command: &Command) -> Vec<&Command> {
    let below = command.get_subcommands().flat_map(with_below);
    std::iter::once(command).chain(below).collect()
}

/// Faults of the examples in the help of the programs, and how many examples there are.
pub fn in_help() -> (Vec<String>, usize) {
    let (mut faults, mut seen) = (Vec::new(), 0);
    for program in programs() {
        for command in with_below(&program) {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let is_example =
                |line: &&str| line.starts_with("  remora") || line.starts_with("  cargo xtask");
            if !help.lines().any(|line| is_example(&line)) {
                faults.push(format!("{}: no example", command.get_name()));
            }
            for line in help.lines().filter(is_example) {
                let line = line.trim().split("  ").next().unwrap_or_default();
                faults.extend(fault(line, Written::Whole));
                seen += 1;
            }
        }
    }
    (faults, seen)
}
