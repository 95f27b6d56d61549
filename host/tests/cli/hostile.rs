//! Files that nobody should have given: what never ends, what is far too large, what is nested without
//! end, and places that take no more. One line each, status 2, nothing half written.
#![cfg(unix)]

use super::bench::Bench;
use std::fs::{self, File};
use std::process::{Command, Stdio};

/// Each command that reads a file, with the file in the place of `{}`.
const READERS: [&str; 14] = [
    "plan --scenarios {}",
    "plan --mission {}",
    "plan --model {}",
    "check {}",
    "check --scenarios {} a.plan.json",
    "view {}",
    "fly {} --out runs",
    "fly a.plan.json --errors {} --out runs",
    "fly {} --safety planned",
    "mission import {}",
    "mission show {}",
    "learn quantise {} b.model",
    "export a.plan.json --epoch 2026-11-23T00:00:00 --chief {} --out out --format oem",
    "export {} --epoch 2026-11-23T00:00:00 --chief a.chief.toml --out out --format oem",
];

/// A bench with a folder beside it, which holds what must not be read to its end.
fn hostile() -> (Bench, tempfile::TempDir) {
    (Bench::new(), tempfile::tempdir().unwrap())
}

/// Each reader that is asked refuses a file with this reason.
fn refuse_all(bench: &Bench, file: &str, reason: &str, is_asked: impl Fn(&str) -> bool) {
    for reader in READERS.into_iter().filter(|reader| is_asked(reader)) {
        let line = reader.replace("{}", file);
        // Where a plan is named beside it, either may be found wrong first.
        let run = bench.run(&line);
        assert_eq!(run.status, 2, "{line}\n{}{}", run.out, run.err);
        assert_eq!(run.err.lines().count(), 1, "{line}\n{}", run.err);
        let named = run.err.contains(reason) || run.err.contains("a.plan.json: no such file");
        assert!(named, "{line}\n{}not: {reason}", run.err);
    }
}

/// A plan whose model is none starts from the heuristic, and says so.
fn is_no_model(reader: &str) -> bool {
    !reader.contains("--model")
}

// Verifies REM-IO-004.
#[test]
fn what_never_ends_is_not_read() {
    let (bench, beside) = hostile();
    let pipe = beside.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for file in [pipe.to_str().unwrap(), "/dev/zero"] {
        refuse_all(&bench, file, &format!("{file}: is not a regular file"), |_| true);
    }
}

/// Work that resumes does not wait for a pipe in the place of what it left.
// Verifies REM-IO-004.
#[test]
fn what_work_left_is_a_file_or_refused() {
    let (bench, _) = hostile();
    for (line, left) in [
        ("campaign --count 1 --seed 1 --out runs", "journal.jsonl"),
        ("learn dataset --count 1 --seed 1 --out runs", "dataset.json"),
        ("fly runs --rerun 0", "flights.json"),
    ] {
        drop(fs::remove_dir_all(bench.path("runs")));
        fs::create_dir(bench.path("runs")).unwrap();
        let pipe = bench.path("runs").join(left);
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let run = bench.run(line);
        assert_eq!(run.status, 2, "{line}\n{}", run.err);
        assert_eq!(run.err, format!("error: runs/{left}: is not a regular file\n"), "{line}");
    }
}

// Verifies REM-IO-004.
#[test]
fn what_is_far_too_large_is_not_read() {
    let (bench, beside) = hostile();
    let large = beside.path().join("large");
    File::create(&large).unwrap().set_len((1 << 30) + 1).unwrap();
    // A URDF has a limit of its own, which is told otherwise.
    let is_asked = |reader: &str| reader != "mission import {}";
    refuse_all(&bench, large.to_str().unwrap(), "large: has 1073741825 bytes; ", is_asked);
    bench
        .refuses(&format!("mission import {}", large.display()), &format!("{}: ", large.display()));
    // A million lines that TOML takes for keys.
    let keys = beside.path().join("keys");
    fs::write(&keys, "=\n".repeat(8 << 20)).unwrap();
    let line = format!("plan --mission {}", keys.display());
    bench.refuses(&line, &format!("{}: has 16777216 bytes; ", keys.display()));
    // Zeros in what may be as large as this.
    let zeros = beside.path().join("zeros");
    File::create(&zeros).unwrap().set_len(8 << 20).unwrap();
    refuse_all(&bench, zeros.to_str().unwrap(), "zeros: ", is_no_model);
}

// Verifies REM-IO-004.
#[test]
fn what_is_nested_without_end_is_refused() {
    let (bench, beside) = hostile();
    let brackets = beside.path().join("brackets");
    for text in ["[".repeat(1_000_000), format!("{{\"format\": {}", "[".repeat(1_000_000))] {
        fs::write(&brackets, text).unwrap();
        refuse_all(&bench, brackets.to_str().unwrap(), "brackets: ", is_no_model);
    }
    let keys = format!("a = {}", "[".repeat(1_000_000));
    fs::write(&brackets, keys).unwrap();
    refuse_all(&bench, brackets.to_str().unwrap(), "brackets: ", is_no_model);
}

/// A file that outgrows what the shell allows is an error of that file, and leaves nothing.
// Verifies REM-IO-002.
#[test]
fn a_file_that_may_not_grow_is_not_left_half_written() {
    let bench = Bench::new();
    let program = env!("CARGO_BIN_EXE_remora");
    // In blocks of 512 bytes, or of 1024: less than a plan in either.
    let plan = "plan --integrator euler --mode feasible --out a.plan.json";
    let line = format!("ulimit -f 16; exec {program} {plan}");
    let mut shell = Command::new("sh");
    let output = shell.args(["-c", &line]).current_dir(bench.path("")).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.starts_with("error: a.plan.json: "), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    let left = bench.names("");
    assert!(left.iter().all(|name| !name.contains("partial") && name != "a.plan.json"), "{left:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn what_standard_output_does_not_take_is_said() {
    let bench = Bench::new();
    for line in ["plan --list", "--help", "draw --count 3 --seed 1 --out -"] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut command = bench.command(line);
        let output = command.stdout(full).stderr(Stdio::piped()).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}\n{told}");
        assert!(told.starts_with("error: standard output: "), "{line}\n{told}");
    }
}

/// A link to a file elsewhere stays a link.
#[test]
fn a_link_is_written_through() {
    let bench = Bench::new();
    fs::create_dir(bench.path("far")).unwrap();
    std::os::unix::fs::symlink("far/b.plan.json", bench.path("a.plan.json")).unwrap();
    fs::write(bench.path("far/b.plan.json"), "").unwrap();
    bench.solves("plan --integrator euler --mode feasible --out a.plan.json --force");
    assert!(fs::symlink_metadata(bench.path("a.plan.json")).unwrap().is_symlink());
    bench.solves("check far/b.plan.json");
}
