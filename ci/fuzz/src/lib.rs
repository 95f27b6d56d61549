//! All that reads files or memory of others, a function each that takes any bytes: for a fuzzer, and for tests
//! that replay what it has found.
//!
//! A target asks its reader for an answer. A refusal must be one line; what is taken must be what the reader
//! promises, and the same once it is written and read again. Checksums are made right beforehand: whoever
//! forges a file does so too.
//!
//! - `texts`: JSON, TOML, XML;
//! - `binaries`: packets, models, shards;
//! - `door`: the functions for C;
//! - [`seeds`]: what a fuzzer begins with, and files that are hostile to all readers.

mod binaries;
mod door;
pub mod seeds;
mod texts;

use remora_host::error::FieldError;

/// A reader by its name.
#[derive(Clone, Copy)]
pub struct Target {
    /// Name of the fuzzer's program and of the corpus.
    pub name: &'static str,
    /// Gives it bytes.
    pub run: fn(&[u8]),
}

const fn target(name: &'static str, run: fn(&[u8])) -> Target {
    Target { name, run }
}

/// All readers.
pub const TARGETS: [Target; 15] = [
    target("chief", texts::chief),
    target("door", door::run),
    target("errors", texts::errors),
    target("evidence", binaries::evidence),
    target("flights", texts::flights),
    target("import", texts::import),
    target("journal", texts::journal),
    target("manifest", texts::manifest),
    target("mission", texts::mission),
    target("model", binaries::model),
    target("plan", binaries::plan),
    target("qp", texts::qp),
    target("scenarios", texts::scenarios),
    target("shard", binaries::shard),
    target("urdf", texts::urdf),
];

/// Gives bytes to a reader by its name.
///
/// # Panics
/// Where there is none of this name, and where the reader has a fault.
pub fn run(name: &str, bytes: &[u8]) {
    let found = TARGETS.iter().find(|target| target.name == name);
    (found.expect("a target's name").run)(bytes);
}

/// Value of an input that is taken. Checks that a refusal is one line.
fn taken<T>(answer: Result<T, FieldError>) -> Option<T> {
    answer.map_err(|error| one_line(&format!("{}: {}", error.field, error.reason))).ok()
}

fn one_line(told: &str) {
    assert!(!told.contains('\n'), "a refusal of several lines: {told:?}");
}

/// Replaces the last four bytes by the CRC-32 of all before.
fn with_checksum(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes.truncate(bytes.len().saturating_sub(4));
    let crc = crc32fast::hash(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}
