//! Corpora of the fuzzers, given to every reader again (`docs/evidence/verification.md`): an answer in time, and no
//! panic. `ci/fuzz.sh` finds more.

mod changed;

use remora_fuzz::{TARGETS, seeds};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a reader may take for a megabyte; far more than it does, for machines are busy.
const MOST: Duration = Duration::from_secs(10);

fn corpora() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../ci/fuzz/corpus")
}

fn corpus(target: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(corpora().join(target)).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

#[track_caller]
fn in_time(target: &remora_fuzz::Target, bytes: &[u8], what: &str) {
    let started = Instant::now();
    (target.run)(bytes);
    let took = started.elapsed();
    assert!(took < MOST, "{}: {what} takes {took:?}", target.name);
}

// Verifies REM-IO-006.
#[test]
fn corpora_are_answered() {
    for target in &TARGETS {
        let files = corpus(target.name);
        assert!(!files.is_empty(), "{}", target.name);
        for file in files {
            in_time(target, &fs::read(&file).unwrap(), &file.display().to_string());
        }
    }
}

/// Puts seeds into a corpus: a fuzzer's own files have other names.
fn write(target: &str, seeds: &[Vec<u8>]) {
    let folder = corpora().join(target);
    fs::create_dir_all(&folder).unwrap();
    for (i, seed) in seeds.iter().enumerate() {
        fs::write(folder.join(format!("seed-{i}")), seed).unwrap();
    }
}

/// Sound files are taken by their readers, and no reader trips over another's.
// Verifies REM-IO-006.
#[test]
fn seeds_are_answered_by_every_reader() {
    for kind in &TARGETS {
        let seeds = seeds::seeds(kind.name);
        assert!(!seeds.is_empty(), "{}", kind.name);
        if std::env::var_os("REMORA_WRITE_SEEDS").is_some() {
            write(kind.name, &seeds);
        }
        for seed in seeds {
            TARGETS.iter().for_each(|target| in_time(target, &seed, kind.name));
        }
    }
}

// Verifies REM-IO-006.
#[test]
fn what_is_hostile_to_all_is_answered_by_all() {
    for (i, bytes) in seeds::hostile().iter().enumerate() {
        TARGETS.iter().for_each(|target| in_time(target, bytes, &format!("hostile {i}")));
    }
}

/// Each target has a program for the fuzzer and a corpus, and there are no others.
#[test]
fn targets_are_whole() {
    let names: BTreeSet<String> = TARGETS.iter().map(|target| target.name.to_string()).collect();
    assert_eq!(names.len(), TARGETS.len());
    let found = |folder: &str, end: &str| -> BTreeSet<String> {
        let entries = fs::read_dir(corpora().join("..").join(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.map(|name| name.trim_end_matches(end).to_string()).collect()
    };
    assert_eq!(found("fuzz_targets", ".rs"), names);
    assert_eq!(found("corpus", ""), names);
    for name in names {
        let program = corpora().join("../fuzz_targets").join(format!("{name}.rs"));
        assert!(fs::read_to_string(program).unwrap().contains(&format!("run(\"{name}\"")));
    }
}
