//! Programs run with floating-point traps enabled, as a host may enable them.
#![allow(dead_code, reason = "each program of tests uses a part")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The library that enables traps in a program into which it is loaded.
fn collector() -> &'static Path {
    static BUILT: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, library) = BUILT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("trapping.so");
        let source = folder.path().join("trapping.c");
        std::fs::write(&source, include_str!("trapping.c")).unwrap();
        let mut command = Command::new("cc");
        command.args(["-std=gnu99", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]);
        let built =
            command.arg(source).arg("-o").arg(&library).args(["-lm", "-ldl"]).status().unwrap();
        assert!(built.success());
        (folder, library)
    });
    library
}

/// Counts traps by function and line of the flight code.
fn places(errors: &str) -> BTreeMap<String, u64> {
    let mut found = BTreeMap::new();
    for line in errors.lines().filter_map(|line| line.strip_prefix("trap ")) {
        let words: Vec<&str> = line.split(' ').collect();
        let &[file, offset, count] = words.as_slice() else { panic!("{line}") };
        let output = Command::new("addr2line").args(["-Cfipe", file, offset]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let place = text.lines().map(str::trim).collect::<Vec<_>>().join(" < ");
        *found.entry(format!("{place} [{offset}]")).or_insert(0) += count.parse::<u64>().unwrap();
    }
    found
}

/// Runs a program with traps of divisions by zero, invalid operations and overflow, and returns its output. Fails
/// if anything traps.
pub fn run(command: &mut Command) -> String {
    let output = command.env("LD_PRELOAD", collector()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    let traps = places(&errors);
    let is_sound = output.status.success() || output.status.code() == Some(86);
    assert!(is_sound, "{command:?}: {}\n{text}{errors}", output.status);
    assert!(traps.is_empty(), "{command:?} traps:\n{traps:#?}");
    text
}

/// Runs a test of this program, which is ignored otherwise, with traps.
pub fn run_test(name: &str) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let text = run(command.args(["--exact", name, "--ignored", "--nocapture"]));
    assert!(text.contains("1 passed"), "{name}: {text}");
}
