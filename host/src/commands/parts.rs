//! Functions of all commands that make parts: which part, by what arguments, and ending when asked to.

use super::Cli;
use super::Command;
use clap::Parser;
use remora_host::error::Error;
use remora_host::part::Part;
use std::ffi::OsString;
use std::path::Path;

/// One of many parts of the work.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct PartArgs {
    /// Make part I of N alone, into a directory that other parts share [default: all in one]
    #[arg(long, value_name = "I/N")]
    pub(super) part: Option<Part>,
}

/// The program's arguments without those that differ from part to part or from machine to machine.
///
/// # Errors
/// One that is no text, which no part can keep.
pub(super) fn arguments() -> Result<Vec<String>, Error> {
    without_own(std::env::args_os().skip(1))
}

/// Options of one part or machine, with a value each.
const OWN: [&str; 3] = ["--part", "--out", "--jobs"];

fn without_own(arguments: impl Iterator<Item = OsString>) -> Result<Vec<String>, Error> {
    let mut kept = Vec::new();
    let mut arguments = arguments.filter(|argument| argument != "-q" && argument != "--quiet");
    while let Some(argument) = arguments.next() {
        let text = argument.to_string_lossy();
        let name = text.split('=').next().unwrap_or_default();
        match OWN.contains(&name) {
            true if name == text => drop(arguments.next()),
            true => {}
            false => kept.push(argument.into_string().map_err(|argument| {
                let reason = format!(
                    "{argument:?} is not valid UTF-8, and a part keeps its command as text"
                );
                Error::argument("--part", reason)
            })?),
        }
    }
    Ok(kept)
}

/// The command that made parts in a directory, parsed again.
pub(super) fn command(arguments: &[String], directory: &Path) -> Result<Command, Error> {
    // Any part: some options are for parts alone.
    let mut out = OsString::from("--out=");
    out.push(directory);
    let own = ["--part=1/1".into(), out];
    let words = arguments.iter().map(|word| word.clone().into());
    let words = std::iter::once("remora".into()).chain(words).chain(own);
    let parsed = Cli::try_parse_from(words).ok().and_then(|cli| cli.command);
    parsed.ok_or_else(|| {
        let reason = format!("is no command of this program: {}", arguments.join(" "));
        Error::input(directory, "remora.command", reason)
    })
}

/// Lets work end well when the system asks the program to: what is finished is kept. Asked twice, the
/// program ends at once.
pub(super) fn end_when_asked() {
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGINT, SIGTERM};
        use signal_hook::flag;
        use std::sync::Arc;
        use std::sync::atomic::AtomicBool;
        for signal in [SIGINT, SIGTERM] {
            let is_second = Arc::new(AtomicBool::new(false));
            // Where there is no listening, the signal ends the program as ever; the journal is whole.
            let _ = flag::register_conditional_shutdown(signal, 128 + signal, is_second.clone());
            let _ = flag::register(signal, is_second);
            let number = usize::try_from(signal).unwrap_or(0);
            let _ = flag::register_usize(signal, remora_host::interrupt::flag(), number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_from_part_to_part_is_left_out() {
        let words = |line: &str| line.split(' ').map(String::from).collect::<Vec<_>>();
        let own_left_out =
            |line: Vec<String>| without_own(line.into_iter().map(OsString::from)).unwrap();
        let line = "campaign --count 9 --part 1/3 --jobs=2 -q --seed 1 --out=a --out b --jobs 1";
        assert_eq!(own_left_out(words(line)), words("campaign --count 9 --seed 1"));
        let kept = words("campaign --count 9 --seed 1");
        for directory in ["a", "-a", "--a"] {
            assert!(matches!(command(&kept, Path::new(directory)), Ok(Command::Campaign(_))));
        }
        let error = command(&words("campaign --seeds 1"), Path::new("a")).unwrap_err();
        assert!(error.to_string().contains("is no command of this program"), "{error}");
    }
}
