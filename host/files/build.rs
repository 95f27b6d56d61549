//! Tells the program its commit, which files name as what made them.

use std::env::var;
use std::process::Command;

/// The commit is what `REMORA_COMMIT` says. Only a release build asks git itself, since the answer
/// goes stale with the next change of the sources.
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=REMORA_COMMIT");
    let told = var("REMORA_COMMIT").ok().filter(|commit| !commit.is_empty());
    let asked = || var("PROFILE").is_ok_and(|profile| profile == "release").then(head).flatten();
    let commit = told.or_else(asked).unwrap_or_else(|| "unknown".into());
    println!("cargo:rustc-env=REMORA_COMMIT={commit}");
    let built = match commit.as_str() {
        "unknown" => "not a release build of a checkout".into(),
        commit => format!("commit {commit}"),
    };
    let version = var("CARGO_PKG_VERSION").unwrap_or_default();
    println!("cargo:rustc-env=REMORA_VERSION={version} ({built})");
}

/// The checkout's commit, with a mark where tracked files differ from it.
fn head() -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_string())
    };
    println!("cargo:rerun-if-changed={}", git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    let commit = git(&["rev-parse", "HEAD"])?;
    let is_clean = git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if is_clean { commit } else { commit + "+changes" })
}
