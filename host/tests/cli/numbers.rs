//! Sound files in which one number is another. A reader that takes it does not see what it asks for: ten to the
//! fifteenth steps a second, a spin that nothing can follow. The program ends all the same.

use super::bench::Bench;
use super::export::CHIEF;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, TestRunner};
use std::fs;
use std::io::Read;
use std::ops::Range;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// A file, and a command that does what it says; both write below `out`.
const WORKS: [(&str, &str); 8] = [
    ("a.plan.json", "fly a.plan.json --guidance-rate 0.2 --keep sample=0 --quiet --out out"),
    (
        "a.errors.toml",
        "fly a.plan.json --errors a.errors.toml --guidance-rate 0.2 --keep sample=0 --quiet --out out",
    ),
    ("runs/flights.json", "fly runs --rerun 0"),
    (
        "a.mission.toml",
        "plan --mission a.mission.toml --integrator euler --quiet --force --out b.plan.json",
    ),
    (
        "set.scenarios.json",
        "plan --scenarios set.scenarios.json --integrator euler --quiet --force --out b.plan.json",
    ),
    ("set/dataset.json", "campaign gather set --quiet"),
    ("rows/journal.jsonl", "campaign --count 2 --seed 1 --integrator euler --quiet --out rows"),
    (
        "a.chief.toml",
        "export a.plan.json --epoch 2026-11-23T00:00:00 --chief a.chief.toml --format oem --out out",
    ),
];

/// Time within which a command ends, be the machine as busy as it may [s]: alone all take less than one.
const LIMIT: Duration = Duration::from_secs(120);

const NUMBERS: [&str; 8] =
    ["1e300", "1e15", "1000000000000000", "100000.0", "1e-300", "0", "-1", "-1e5"];

/// Where the numbers of a text stand.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let is_of_number = |byte: u8| byte.is_ascii_digit() || b"+-.e".contains(&byte);
    let is_of_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let (bytes, mut found, mut at) = (text.as_bytes(), Vec::new(), 0);
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|byte| is_of_number(**byte)).count();
        let has_digit = bytes[at..at + length].iter().any(u8::is_ascii_digit);
        let end = at + length.max(1);
        let is_alone = |byte: Option<&u8>| byte.is_none_or(|byte| !is_of_word(*byte));
        let before = at.checked_sub(1).and_then(|i| bytes.get(i));
        if has_digit && is_alone(before) && is_alone(bytes.get(end)) {
            found.push(at..end);
        }
        at = end;
    }
    found
}

/// How a program ended, if it did in time, and its errors.
fn ended(mut child: Child) -> Option<(Option<i32>, String)> {
    let begun = Instant::now();
    while begun.elapsed() < LIMIT {
        if let Some(status) = child.try_wait().unwrap() {
            let mut errors = String::new();
            child.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
            return Some((status.code(), errors));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    None
}

/// A bench with all the files.
fn working() -> Bench {
    let bench = Bench::new();
    bench.solves("plan --scenarios set.scenarios.json --integrator rk4:4 --out a.plan.json");
    let errors = bench.solves("mission errors typical");
    bench.write("a.errors.toml", &errors.out);
    bench.run("fly a.plan.json --guidance-rate 0.2 --keep sample=0 --out runs");
    let mission = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/missions/default.mission.toml");
    bench.write("a.mission.toml", &fs::read(mission).unwrap());
    bench.solves("learn dataset --count 2 --seed 1 --integrator euler --out set");
    bench.solves("campaign --count 2 --seed 1 --integrator euler --out rows");
    bench.write("a.chief.toml", CHIEF);
    bench
}

// Verifies REM-IO-006.
#[test]
fn whatever_a_number_is_the_program_ends() {
    end(4);
}

#[test]
#[ignore = "nightly: 200 runs of the program"]
fn whatever_more_numbers_are_the_program_ends() {
    end(25);
}

/// Runs each command on so many forged files.
fn end(cases: u32) {
    let bench = working();
    for (file, command) in WORKS {
        let sound = bench.read(file);
        let places = numbers(&sound);
        let forged = (any::<Index>(), select(&NUMBERS[..]));
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        let answered = TestRunner::new(config).run(&forged, |(place, number)| {
            let Range { start, end } = places[place.index(places.len())].clone();
            bench.write(file, &format!("{}{number}{}", &sound[..start], &sound[end..]));
            let child = bench
                .command(command)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let ended = ended(child);
            drop(fs::remove_dir_all(bench.path("out")));
            let line = sound[..start].lines().count();
            prop_assert!(ended.is_some(), "{number} in line {line} does not end");
            let (status, errors) = ended.unwrap();
            prop_assert!(matches!(status, Some(0..=3)), "{number} in line {line}: {errors}");
            if status == Some(2) {
                let is_one_line = errors.starts_with("error: ") && errors.lines().count() == 1;
                prop_assert!(is_one_line, "{number} in line {line}: {errors}");
            }
            Ok(())
        });
        answered.unwrap_or_else(|fault| panic!("{file}: {fault}"));
        bench.write(file, &sound);
    }
}
