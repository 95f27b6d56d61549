//! Parts that are killed at any time, and made again.

use super::{Bench, CAMPAIGN, gathered, make, table};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Sends a signal.
fn send(signal: &str, process: u32) {
    Command::new("kill").args([signal, &process.to_string()]).status().unwrap();
}

/// Numbers without pattern, the same in every run.
struct Draws(u64);

impl Draws {
    fn below(&mut self, end: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

/// Makes a part with so many kills on the way; those that came in time.
fn make_with_kills(bench: &Bench, line: &str, kills: u64, draws: &mut Draws) -> u64 {
    let mut killed = 0;
    for _ in 0..kills {
        let mut child =
            bench.command(line).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(5 + draws.below(60)));
        send(["-TERM", "-KILL", "-INT"][draws.below(3) as usize], child.id());
        let status = child.wait().unwrap();
        // A number of their own where the program ended itself, none where it was killed.
        assert!(matches!(status.code(), None | Some(0 | 130 | 143)), "{status}");
        killed += u64::from(status.code() != Some(0));
    }
    bench.solves(line);
    killed
}

/// The rows of a campaign in these numbers of parts are those of it in one piece, whoever was killed so many times
/// in each.
fn same_rows(campaign: &str, parts: [u64; 3], kills: u64) {
    let bench = Bench::new();
    make(&bench, campaign, 1, "whole");
    let expected = table::rows(&bench, "whole");
    let mut draws = Draws(kills);
    for of in parts {
        let mut killed = 0;
        for number in 1..=of {
            let line = format!("{campaign} --jobs 1 --part {number}/{of} --out killed/{of}");
            let own = kills / of + u64::from(number <= kills % of);
            killed += make_with_kills(&bench, &line, own, &mut draws);
        }
        assert!(killed > 0);
        println!("{of} parts: {killed} of {kills} kills came in time");
        let out = format!("killed/{of}");
        let is_left = |name: &String| name.contains(".journal.") || name.ends_with(".partial");
        assert!(!bench.names(&out).iter().any(is_left));
        assert_eq!(table::rows(&bench, &out), expected, "{of} parts");
        assert_eq!(gathered(&bench, &out)["checksum"], gathered(&bench, "whole")["checksum"]);
    }
}

// Verifies REM-CMP-002.
#[test]
#[cfg(unix)]
fn kills_and_the_number_of_parts_change_no_row() {
    same_rows(CAMPAIGN, [1, 3, 6], 9);
}

/// Some minutes: `cargo test --test cli thousand -- --ignored --nocapture`.
#[test]
#[ignore = "nightly: minutes of planning"]
#[cfg(unix)]
fn a_thousand_parts_and_fifty_kills_change_no_row() {
    same_rows("campaign --count 2000 --seed 3 --integrator euler", [1, 7, 1000], 50);
}

/// Asked to end, the program finishes the plan in hand, says so, and leaves what it has.
// Verifies REM-CMP-002.
#[test]
#[cfg(unix)]
fn a_part_that_is_asked_to_end_goes_on_where_it_stopped() {
    let bench = Bench::new();
    let line = "campaign --count 40 --seed 3 --integrator euler --jobs 1 --part 1/1 --out parts";
    let log = bench.path("parts/part-00001-of-00001.journal.jsonl");
    for (signal, code, at) in [("-TERM", 143, 3), ("-INT", 130, 6)] {
        let child =
            bench.command(line).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        let rows = || std::fs::read_to_string(&log).unwrap_or_default().lines().count();
        while rows() < at {
            std::thread::sleep(Duration::from_millis(2));
        }
        send(signal, child.id());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code));
        let told = String::from_utf8(output.stderr).unwrap();
        let last = told.lines().last().unwrap();
        let message =
            format!("error: interrupted by signal {}: what is finished is kept", code - 128);
        assert!(last.starts_with(&message), "{told}");
        let text = std::fs::read_to_string(&log).unwrap();
        assert!(text.ends_with('\n') && text.lines().count() > at - 1);
        for end in ["jsonl", "parquet"] {
            assert!(!bench.path(&format!("parts/part-00001-of-00001.{end}")).exists());
        }
    }
    let there = std::fs::read_to_string(&log).unwrap().lines().count() - 1;
    let run = bench.solves(line);
    let told = format!("part 1/1: 40 rows, {} planned now\n", 40 - there);
    assert!(run.out.starts_with(&told), "{} of {told}", run.out);
    assert!(!log.exists());
}

/// A journal of other work is not gone on with, and is left alone.
#[test]
fn another_journal_is_refused() {
    let bench = Bench::new();
    let part = "--part 1/1 --out parts";
    let log = "parts/part-00001-of-00001.journal.jsonl";
    std::fs::create_dir(bench.path("parts")).unwrap();
    bench.write(log, "{}\n{}\n");
    bench.refuses(&format!("{CAMPAIGN} {part}"), &format!("{log}: line 1: missing field"));
}
