//! Commands that pages and help texts name are commands of the program that they name.

#[path = "../../../tests/documents/commands.rs"]
mod commands;
#[path = "../../../tests/documents/pages.rs"]
mod pages;

use super::programs;
use commands::{Written, fault, in_help, on_pages};

#[test]
fn pages_name_commands_that_exist() {
    let (faults, called) = on_pages();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let tools = called.iter().filter(|program| **program == "xtask").count();
    assert!(called.len() > 80 && tools > 10, "only {called:?} were found");
}

#[test]
fn help_names_commands_that_exist() {
    let (faults, seen) = in_help();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(seen > 20, "only {seen} examples were found");
}

#[test]
fn what_does_not_exist_is_named() {
    assert!(fault("remora plan --no-such-option", Written::Mention).is_some());
    assert!(fault("remora plan --integrator rk5 # a comment", Written::Whole).is_some());
    assert!(fault("remora draw --count 3", Written::Whole).is_some());
    assert_eq!(fault("remora draw --count 3", Written::Mention), None);
    assert_eq!(fault("remora-core", Written::Whole), None);
    for line in
        ["cargo xtask audit --check", "cargo run --release --bin xtask -- firmware", "xtask"]
    {
        assert_eq!(fault(line, Written::Whole), None);
    }
    assert_eq!(fault("cargo xtask", Written::Mention), None);
    for line in ["cargo xtask adit", "target/release/xtask plan", "remora audit"] {
        assert!(fault(line, Written::Mention).is_some(), "{line}");
    }
}
