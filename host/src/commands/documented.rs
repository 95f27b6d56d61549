//! Commands that pages and help texts name are commands of this program.

#[path = "../../tests/documents/pages.rs"]
mod pages;

use super::Cli;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

/// Whether a command is written out in full, or only mentioned.
#[derive(Clone, Copy, PartialEq)]
enum Written {
    Whole,
    Mention,
}

/// What is wrong with a command line, if it is one of this program.
fn fault(line: &str, written: Written) -> Option<String> {
    let arguments = arguments(line)?;
    let has_train = cfg!(feature = "training");
    let is_training = |word: &String| ["train", "learn"].contains(&word.as_str());
    if !has_train && arguments.first().is_some_and(is_training) {
        return None;
    }
    let words = std::iter::once("remora".to_string()).chain(arguments);
    let kind = match Cli::try_parse_from(words) {
        Ok(_) => return None,
        Err(error) => error.kind(),
    };
    let is_fine = match kind {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => true,
        ErrorKind::MissingRequiredArgument => written == Written::Mention,
        // The shell puts the value there.
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => line.contains('$'),
        _ => false,
    };
    (!is_fine).then(|| format!("{line}: {kind}"))
}

/// The arguments that a line of a shell gives to the program, if it calls it.
fn arguments(line: &str) -> Option<Vec<String>> {
    let line = line.split(" #").next()?.trim();
    let line = first_command(line).trim();
    let rest = match line.strip_prefix("cargo run") {
        Some(rest) if rest.contains("--bin") || rest.contains("--example") => return None,
        Some(rest) => rest.split_once(" -- ").map_or("", |(_, rest)| rest),
        None => line.strip_prefix("target/release/").unwrap_or(line).strip_prefix("remora")?,
    };
    // Another word that begins so, such as `remora-core`.
    if !rest.is_empty() && !rest.starts_with(' ') && !line.starts_with("cargo") {
        return None;
    }
    let words = words(rest).into_iter().filter(|word| word != "...");
    Some(words.map(|word| word.trim_matches('"').to_string()).collect())
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

#[test]
fn pages_name_commands_that_exist() {
    let (mut faults, mut seen) = (Vec::new(), 0);
    for page in pages::all().iter().filter(|page| !page.is_generated()) {
        let mut look = |line: &str, written| {
            seen += usize::from(arguments(line).is_some());
            faults.extend(fault(line, written).map(|text| format!("{}: {text}", page.path)));
        };
        for fence in page.fences().iter().filter(|fence| fence.language == "sh") {
            let text = fence.lines.join("\n").replace("\\\n", " ");
            text.lines().for_each(|line| look(line.trim(), Written::Whole));
        }
        page.inline_code().iter().for_each(|code| look(code, Written::Mention));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(seen > 80, "only {seen} commands were found");
}

#[test]
fn help_names_commands_that_exist() {
    let program = Cli::command();
    let mut seen = 0;
    for command in program.get_subcommands().chain([&program]) {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for line in help.lines().filter(|line| line.starts_with("  remora")) {
            let line = line.trim().split("  ").next().unwrap_or_default();
            assert_eq!(fault(line, Written::Whole), None);
            seen += 1;
        }
    }
    assert!(seen > 20, "only {seen} examples were found");
}

#[test]
fn what_does_not_exist_is_named() {
    assert!(fault("remora plan --no-such-option", Written::Mention).is_some());
    assert!(fault("remora plan --integrator rk5 # a comment", Written::Whole).is_some());
    assert!(fault("remora draw --count 3", Written::Whole).is_some());
    assert_eq!(fault("remora draw --count 3", Written::Mention), None);
    assert_eq!(fault("remora-core", Written::Whole), None);
}
