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
        std::thread::sleep(Duration::from_millis(20 + draws.below(200)));
        send(["-TERM", "-KILL", "-INT"][draws.below(3) as usize], child.id());
        let status = child.wait().unwrap();
        // A number of their own where the program ended itself, none where it was killed.
        assert!(matches!(status.code(), None | Some(0 | 130 | 143)), "{status}");
        killed += u64::from(status.code() != Some(0));
    }
    bench.solves(line);
    killed
}

// Verifies REM-CMP-002.
#[test]
#[cfg(unix)]
fn kills_and_the_number_of_parts_change_no_row() {
    let bench = Bench::new();
    // By hand with more: REMORA_KILLS=50.
    let kills = std::env::var("REMORA_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(9);
    make(&bench, CAMPAIGN, 1, "whole");
    let expected = table::rows(&bench, "whole");
    let mut draws = Draws(kills);
    for of in [1, 3, 6] {
        let mut killed = 0;
        for number in 1..=of {
            let line = format!("{CAMPAIGN} --jobs 1 --part {number}/{of} --out killed/{of}");
            killed += make_with_kills(&bench, &line, kills / of, &mut draws);
        }
        assert!(killed > 0);
        let out = format!("killed/{of}");
        assert!(bench.names(&out).iter().all(|name| name.ends_with(".parquet")));
        assert_eq!(table::rows(&bench, &out), expected, "{of} parts");
        assert_eq!(gathered(&bench, &out)["checksum"], gathered(&bench, "whole")["checksum"]);
    }
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
        assert!(!bench.path("parts/part-00001-of-00001.parquet").exists());
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
