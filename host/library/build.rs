//! Tells the program how it was built, for its reports.

use std::env::var;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let rustc = var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let version = Command::new(rustc).arg("--version").output();
    let version = version.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    let flags = var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default().replace('\u{1f}', " ");
    let level = var("OPT_LEVEL").unwrap_or_default();
    let profile = format!("{}, opt-level {level}", var("PROFILE").unwrap_or_default());
    for (name, value) in [
        ("COMPILER", version.unwrap_or_default().trim().to_string()),
        ("FLAGS", flags),
        ("PROFILE", profile),
        ("TARGET", var("TARGET").unwrap_or_default()),
        ("COMMIT", commit()),
    ] {
        println!("cargo:rustc-env=REMORA_{name}={value}");
    }
}

/// The commit that files name as their program's: what `REMORA_COMMIT` says. Only a release build
/// asks git itself, since the answer goes stale with the next change of the sources.
fn commit() -> String {
    println!("cargo:rerun-if-env-changed=REMORA_COMMIT");
    let told = var("REMORA_COMMIT").ok().filter(|commit| !commit.is_empty());
    told.or_else(|| {
        if var("PROFILE").is_ok_and(|profile| profile == "release") { head() } else { None }
    })
    .unwrap_or_else(|| "unknown".into())
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
