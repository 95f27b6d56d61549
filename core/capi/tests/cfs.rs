//! The app for the core Flight System, compiled against a stub of it and run.

mod common;
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
mod trapping;

use common::{SANITIZED, STRICT, golden, link, output, prefix, root};
use std::path::PathBuf;
use std::process::Command;

/// Warnings that cFE's own build turns on besides.
const CFE: [&str; 3] = ["-Wstrict-prototypes", "-Wpointer-arith", "-Wcast-align=strict"];

/// The app with its tables, the stub and the test, with extra stack for the planner's task.
fn program(name: &str, flags: &[&str], extra_stack: usize) -> PathBuf {
    let tests = root().join("core/capi/tests");
    let app = root().join("docs/examples/cfs/remora_app/fsw");
    let mut sources = vec![tests.join("cfs.c")];
    for folder in [app.join("src"), app.join("tables"), tests.join("cfe_stub")] {
        let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        sources.extend(files.filter(|file| file.extension().is_some_and(|end| end == "c")));
    }
    let mut command = Command::new("cc");
    command.arg("-std=c99").args(STRICT).args(CFE).args(flags).args(sources).arg("-pthread");
    command.arg(format!("-DSTUB_EXTRA_STACK={extra_stack}"));
    let scenarios = root().join("docs/examples/c/m7");
    for folder in [app.join("inc"), app.join("src"), tests.join("cfe_stub"), tests, scenarios] {
        command.arg("-I").arg(folder);
    }
    link(&mut command, prefix(), prefix().join(name))
}

/// Prints of plans, with the model's file in the folder of the flight software.
fn plans(program: &PathBuf) -> Vec<String> {
    plans_by(program, output)
}

/// Prints of plans, with the program run by `run`.
fn plans_by(program: &PathBuf, run: impl Fn(&mut Command) -> String) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("cf")).unwrap();
    let model = root().join("fixtures/models/rk4.model");
    std::fs::copy(model, folder.path().join("cf/remora.model")).unwrap();
    let text = run(Command::new(program).arg(folder.path()));
    text.lines().filter_map(|line| line.strip_prefix("plan ")).map(String::from).collect()
}

// Verifies REM-DOR-002.
#[test]
fn the_app_runs_clean_and_plans_what_rust_plans() {
    let golden = &golden()[0];
    let program = program("cfs-sanitized", &SANITIZED, 1 << 18);
    assert_eq!(plans(&program), [&*golden[5], &*golden[4]]);
}

/// The two tasks share nothing that the mutex does not guard.
#[test]
fn the_app_has_no_data_race() {
    let program = program("cfs-threads", &["-fsanitize=thread"], 1 << 18);
    assert_eq!(plans(&program).len(), 2);
}

/// The planner's task has 48 KiB and no more, and the app's main task guides meanwhile.
#[test]
fn the_app_plans_on_the_stack_that_it_asks_for() {
    let program = program("cfs", &[], 0);
    assert_eq!(plans(&program).len(), 2);
}

/// cFE's own start-up code for a processor may enable traps.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
fn the_app_runs_where_the_host_traps() {
    let golden = &golden()[0];
    let program = program("cfs-traps", &[], 0);
    assert_eq!(plans_by(&program, trapping::run), [&*golden[5], &*golden[4]]);
}

#[test]
fn the_app_does_not_start_with_a_damaged_table() {
    let program = program("cfs-table", &SANITIZED, 1 << 18);
    output(Command::new(program).args([".", "bad-table"]));
}
