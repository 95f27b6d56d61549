//! The corpora's files with changes that are drawn: what a fuzzer does, without its instruments.

use crate::{corpus, in_time};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, TestRunner};
use remora_fuzz::{TARGETS, Target};
use std::{fmt, fs};

/// Files with changes a target, in percent of what a night takes. Planning, which the door does, takes milliseconds.
fn cases(target: &Target, percent: u32) -> u32 {
    percent * if target.name == "door" { 10 } else { 100 }
}

/// The most bytes that one change takes, doubles or brings.
const LENGTH: usize = 64;

/// What readers of numbers and structure trip over.
const WORDS: [&str; 20] = [
    "NaN",
    "inf",
    "null",
    "1e999",
    "1e308",
    "1e-400",
    "-0",
    "-1",
    "4294967296",
    "18446744073709551616",
    "-9223372036854775809",
    "[",
    "{",
    "}",
    "\"",
    "=",
    "\n",
    "\0",
    "\u{feff}",
    "<a>",
];

/// A change at a place.
#[derive(Clone, Debug)]
enum Change {
    /// A bit is flipped.
    Flip(u8),
    /// A byte becomes another.
    Set(u8),
    /// So many bytes are missing.
    Cut(usize),
    /// So many bytes stand twice.
    Double(usize),
    /// The file ends here.
    End,
    /// A word stands here.
    Word(&'static str),
    /// So many bytes of another file stand here, from a place of it on.
    Splice(Index, Index, usize),
}

fn change() -> impl Strategy<Value = (Index, Change)> {
    let length = 1..=LENGTH;
    let change = prop_oneof![
        (0..8_u8).prop_map(Change::Flip),
        any::<u8>().prop_map(Change::Set),
        length.clone().prop_map(Change::Cut),
        length.clone().prop_map(Change::Double),
        Just(Change::End),
        prop::sample::select(&WORDS[..]).prop_map(Change::Word),
        (any::<Index>(), any::<Index>(), length).prop_map(|(a, b, c)| Change::Splice(a, b, c)),
    ];
    (any::<Index>(), change)
}

/// So many bytes of a file, from a place of it on.
fn part(bytes: &[u8], from: usize, length: usize) -> Vec<u8> {
    bytes.iter().skip(from).take(length).copied().collect()
}

fn make(bytes: &mut Vec<u8>, at: Index, change: &Change, files: &[Vec<u8>]) {
    if bytes.is_empty() {
        return;
    }
    let at = at.index(bytes.len());
    let put = match change {
        Change::Flip(bit) => return bytes[at] ^= 1 << bit,
        Change::Set(byte) => return bytes[at] = *byte,
        Change::End => return bytes.truncate(at),
        Change::Cut(length) => {
            let end = bytes.len().min(at + length);
            bytes.drain(at..end);
            return;
        }
        Change::Double(length) => part(bytes, at, *length),
        Change::Word(word) => word.as_bytes().to_vec(),
        Change::Splice(file, from, length) => {
            let other = &files[file.index(files.len())];
            part(other, from.index(other.len().max(1)), *length)
        }
    };
    bytes.splice(at..at, put);
}

/// A file with its changes; shown as text, so that whoever sees it fail can write it.
struct Changed(Vec<u8>);

impl fmt::Debug for Changed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0.escape_ascii())
    }
}

/// One of the files, with one to five changes.
fn changed(files: &[Vec<u8>]) -> impl Strategy<Value = Changed> {
    (any::<Index>(), vec(change(), 1..6)).prop_map(|(file, changes)| {
        let mut bytes = files[file.index(files.len())].clone();
        changes.iter().for_each(|(at, change)| make(&mut bytes, *at, change, files));
        Changed(bytes)
    })
}

// Verifies REM-IO-006.
#[test]
fn changed_corpora_are_answered() {
    answered(10);
}

#[test]
#[ignore = "nightly: 141,000 files, half a minute"]
fn corpora_changed_ten_times_as_often_are_answered() {
    answered(100);
}

/// Changes files and has them answered, in percent of what a night takes.
fn answered(percent: u32) {
    for target in &TARGETS {
        let files: Vec<_> =
            corpus(target.name).iter().map(|file| fs::read(file).unwrap()).collect();
        let config = Config {
            cases: cases(target, percent),
            failure_persistence: None,
            ..Config::default()
        };
        let answered = TestRunner::new(config).run(&changed(&files), |Changed(bytes)| {
            in_time(target, &bytes, "a changed file");
            Ok(())
        });
        answered.unwrap_or_else(|fault| panic!("{}: {fault}", target.name));
    }
}
