//! The component for F Prime: its model by the tools of FPP, its code on the base class that they generate, against
//! a stub of the framework, run.

mod common;
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
mod trapping;

use common::{SANITIZED, golden, output, prefix, root};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Warnings that the component itself is compiled with.
const WARNINGS: [&str; 7] =
    ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wshadow", "-Wconversion", "-Wold-style-cast"];

fn component() -> PathBuf {
    root().join("docs/examples/fprime/RemoraPlanner")
}

fn stub() -> PathBuf {
    root().join("core/capi/tests/fprime_stub")
}

/// The files of a folder with an ending, sorted.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let found: BTreeSet<PathBuf> =
        all.filter(|file| file.extension().is_some_and(|end| end == ending)).collect();
    found.into_iter().collect()
}

/// Generates the base class with what it needs into a folder.
fn generate(folder: &Path) {
    let models = [stub().join("stub.fpp"), component().join("RemoraPlanner.fpp")];
    output(Command::new("fpp-check").args(&models));
    let prefixes =
        [folder.to_path_buf(), stub(), component()].map(|path| path.display().to_string());
    let mut command = Command::new("fpp-to-cpp");
    command.current_dir(folder).arg("-p").arg(prefixes.join(","));
    output(command.args(["-d", "."]).args(&models));
}

/// Each header that generated code includes and nobody has leads to the stub.
fn forward(folder: &Path) {
    for file in ["hpp", "cpp", "h"].iter().flat_map(|ending| files(folder, ending)) {
        let text = std::fs::read_to_string(file).unwrap();
        let quoted = text.lines().filter_map(|line| line.strip_prefix("#include \""));
        for name in quoted.filter_map(|rest| rest.strip_suffix('"')) {
            assert!(!name.starts_with('/'), "{name} is not relative to what is generated");
            let header = folder.join(name);
            if !header.exists() {
                std::fs::create_dir_all(header.parent().unwrap()).unwrap();
                std::fs::write(header, "#include \"fprime.hpp\"\n").unwrap();
            }
        }
    }
}

/// A compiler with its flags and folders.
fn compiler(folder: &Path, flags: &[&str]) -> Command {
    let mut command = Command::new("c++");
    command.current_dir(folder).args(["-std=c++14", "-g"]).args(flags);
    for include in [folder, &stub(), &component(), &root().join("docs/examples/c/m7")] {
        command.arg("-I").arg(include);
    }
    // As CMake has it for what another package brings.
    command.arg("-isystem").arg(prefix().join("include"));
    command
}

/// The component with its test, built with these flags in a folder of its own, and the plans that it prints where
/// something runs it.
fn plans(flags: &[&str], run: impl Fn(&mut Command) -> String) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let folder = &folder.path().canonicalize().unwrap();
    generate(folder);
    forward(folder);
    let compile = || compiler(folder, flags);
    output(compile().args(["-Wall", "-c"]).args(files(folder, "cpp")));
    output(compile().args(WARNINGS).arg("-c").arg(component().join("RemoraPlanner.cpp")));
    let mut link = compile();
    link.args(["-Wall", "-Wextra", "-Werror", "-o", "fprime"]);
    link.arg(root().join("core/capi/tests/fprime.cpp")).args(files(folder, "o"));
    output(link.arg("-L").arg(prefix().join("lib")).arg("-lremora"));
    let model = root().join("fixtures/models/rk4.model");
    let text = run(Command::new(folder.join("fprime")).arg(model));
    text.lines().filter_map(|line| line.strip_prefix("plan ")).map(String::from).collect()
}

// Verifies REM-DOR-002.
#[test]
#[ignore = "needs the tools of FPP: ci/c.sh"]
fn the_component_runs_clean_and_plans_what_rust_plans() {
    let golden = &golden()[0];
    assert_eq!(plans(&SANITIZED, output), [&*golden[5], &*golden[4]]);
}

#[test]
#[ignore = "needs the tools of FPP: ci/c.sh"]
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
fn the_component_runs_where_the_host_traps() {
    let golden = &golden()[0];
    assert_eq!(plans(&[], trapping::run), [&*golden[5], &*golden[4]]);
}
