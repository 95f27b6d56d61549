//! The images: built and run by `ci/firmware.sh`, which anyone can run by hand too.

use remora_host::error::{Error, io_reason};
use remora_host::formats::make_directory;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The script, from the root of the checkout.
const SCRIPT: &str = "ci/firmware.sh";

/// Where the script leaves images, remarks and report.
pub fn folder(root: &Path) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    target.unwrap_or_else(|| root.join("target")).join("firmware")
}

/// What the images are to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plans {
    /// All that the audit reports.
    Corpus,
    /// One scenario, to have the images.
    One,
}

/// Builds the images and runs them. What the script prints goes to `log`, and line by line to
/// `watch`.
///
/// # Errors
/// A script that cannot be started or that ends with an error: a bar it holds itself is broken, or
/// something is missing that it cannot install. Its last lines are the reason.
pub fn run(
    root: &Path,
    plans: Plans,
    log: &Path,
    watch: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let script = root.join(SCRIPT);
    let failed = |cause: std::io::Error| Error::input(&script, "", io_reason(&cause));
    if let Some(parent) = log.parent() {
        make_directory(parent)?;
    }
    let mut kept = File::create(log).map_err(|cause| Error::output(log, &cause))?;
    let mut child = Command::new("bash")
        .args(["-c", "exec \"$0\" \"$@\" 2>&1"])
        .arg(&script)
        .args(match plans {
            Plans::Corpus => &["--corpus"][..],
            Plans::One => &["--scenarios", "1"][..],
        })
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let mut last = Vec::new();
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            writeln!(kept, "{line}").map_err(|cause| Error::output(log, &cause))?;
            watch(&line);
            last.push(line);
            last.drain(..last.len().saturating_sub(4));
        }
    }
    match child.wait().map_err(failed)? {
        status if status.success() => Ok(()),
        status => {
            let reason = format!("{status}, after: {}; see {}", last.join(" / "), log.display());
            Err(Error::input(&script, "", reason))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_script(text: &str) -> (Result<(), Error>, Vec<String>, String) {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("ci")).unwrap();
        let script = dir.path().join(SCRIPT);
        std::fs::write(&script, text).unwrap();
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(&script, mode).unwrap();
        let (log, mut lines) = (dir.path().join("out/log"), Vec::new());
        let ran = run(dir.path(), Plans::Corpus, &log, &mut |line| lines.push(line.to_string()));
        (ran, lines, std::fs::read_to_string(log).unwrap_or_default())
    }

    #[test]
    fn what_the_script_prints_is_kept() {
        let (ran, lines, log) = with_script("#!/bin/sh\necho \"$1\"\necho two >&2\n");
        assert_eq!(ran, Ok(()));
        assert_eq!(lines, ["--corpus", "two"]);
        assert_eq!(log, "--corpus\ntwo\n");
    }

    #[test]
    fn its_last_lines_are_the_reason_where_it_fails() {
        let (ran, ..) = with_script("#!/bin/sh\necho BROKEN: image of 3\nexit 1\n");
        let reason = ran.unwrap_err().to_string();
        assert!(reason.contains("exit status: 1, after: BROKEN: image of 3"), "{reason}");
    }
}
