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
    ] {
        println!("cargo:rustc-env=REMORA_{name}={value}");
    }
}
