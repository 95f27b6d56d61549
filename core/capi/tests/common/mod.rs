//! What the tests of the archive share: the installation, compilers, public scenarios and their checksums.
#![allow(dead_code, reason = "each program of tests uses a part")]

use remora_core::advanced::math::quaternion;
use remora_core::prelude::*;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The repository's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// What a command prints, which must succeed.
pub fn output(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{text}{errors}", output.status);
    text
}

/// The folder that everything is installed below, once for all tests.
pub fn prefix() -> &'static Path {
    static PREFIX: OnceLock<tempfile::TempDir> = OnceLock::new();
    PREFIX
        .get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            output(Command::new(root().join("ci/install-c.sh")).arg(folder.path()));
            folder
        })
        .path()
}

/// Compiler flags that pass for strict.
pub const STRICT: [&str; 5] = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-g"];
/// Sanitizers, which end a program.
pub const SANITIZED: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

/// Runs a compiler that makes a program of sources and the archive installed below a folder.
pub fn link(compiler: &mut Command, installed: &Path, program: PathBuf) -> PathBuf {
    compiler.arg("-I").arg(installed.join("include")).arg("-o").arg(&program);
    output(compiler.arg("-L").arg(installed.join("lib")).arg("-lremora"));
    program
}

/// A public scenario: its name, attitude and rate of the target, position and velocity.
pub type Public = (String, [f64; 13]);

/// The public scenarios as the host reads them: attitudes normalised.
pub fn public_scenarios() -> Vec<Public> {
    let file = root().join("fixtures/scenarios/public.scenarios.json");
    let file: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let scenario = |scenario: &Value| {
        let (target, servicer) = (&scenario["target"], &scenario["servicer"]);
        let attitude = Vector4::from_iterator(numbers(&target["attitude"]));
        let mut all: Vec<f64> = quaternion::normalized(&attitude).iter().copied().collect();
        all.extend(numbers(&target["rate"]));
        all.extend(numbers(&servicer["position"]));
        all.extend(numbers(&servicer["velocity"]));
        (scenario["id"].as_str().unwrap().to_string(), all.try_into().unwrap())
    };
    file["scenarios"].as_array().unwrap().iter().map(scenario).collect()
}

/// The checksums of their plans, a row each, in the order of the scenarios and of the file's columns: Euler
/// before RK4, the optimum before the first feasible plan, the heuristic before the model.
pub fn golden() -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(root().join("fixtures/golden/public.csv")).unwrap();
    let rows = text.lines().skip(1);
    rows.map(|row| row.split(',').skip(1).map(String::from).collect()).collect()
}
