//! `cargo xtask inject`

use super::bench::Bench;
use std::fs;
use std::process::Stdio;
use std::time::Duration;

const INJECT: &str = "inject --scenarios set.scenarios.json --integrator euler --cases 30";

#[test]
fn help_shows_how_to_use_it() {
    let run = Bench::new().solves("inject --help");
    assert!(run.out.contains("Examples:\n  cargo xtask inject"), "{}", run.out);
}

#[test]
fn one_thread_or_two_give_the_same_tables_and_files() {
    let bench = Bench::new();
    let out = |jobs: &str| {
        let run = bench.solves(&format!("{INJECT} --jobs {jobs} --out runs/{jobs} --csv"));
        assert!(run.out.lines().all(|line| line.chars().count() <= 100), "{}", run.out);
        run.out.replace(&format!("runs/{jobs}"), "runs")
    };
    let text = out("1");
    assert_eq!(text, out("2"));
    assert!(
        text.starts_with("30 cases of seed 1 in 3 scenarios: 0 wrong, hung or panicked\n"),
        "{text}"
    );
    for file in ["inject.json", "inject.csv"] {
        assert_eq!(bench.read(&format!("runs/1/{file}")), bench.read(&format!("runs/2/{file}")));
    }
    assert_eq!(bench.names("runs/1"), ["inject.csv", "inject.json"]);
    let exists = "runs/1/inject.json: exists; --force replaces it";
    bench.refuses(&format!("{INJECT} --out runs/1"), exists);
    let found = bench.json("runs/1/inject.json");
    assert_eq!((&found["format"], &found["seed"]), (&"remora-injection/2".into(), &1.into()));
    assert_eq!(found["total"]["cases"], 30);
    assert_eq!(found["total"]["classes"]["wrong"], 0);
    assert_eq!(found["sites"][0]["site"], "weights_before_check");
    assert_eq!(found["sites"][0]["classes"]["detected"], 2);
    let rows = bench.read("runs/1/inject.csv");
    assert_eq!(rows.lines().count(), 31);
    let columns = rows.lines().next().unwrap().split(',').count();
    assert!(rows.lines().all(|row| row.split(',').count() == columns));
}

/// Killed and gone on with, it has the same files.
#[test]
fn a_killed_one_resumes_to_the_same_files() {
    let bench = Bench::new();
    bench.solves(&format!("{INJECT} --jobs 1 --out whole --csv"));
    let killed = format!("{INJECT} --jobs 1 --out killed --csv");
    let mut child = bench.command(&killed).stderr(Stdio::null()).spawn().unwrap();
    let path = bench.path("killed/inject.journal.jsonl");
    let lines = || fs::read_to_string(&path).unwrap_or_default().lines().count();
    while lines() < 5 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(lines() >= 5);
    let other = "killed/inject.journal.jsonl: seed: this injection was begun with another seed";
    bench.refuses(&format!("{INJECT} --seed 2 --out killed"), other);
    let run = bench.solves(&killed);
    assert!(run.err.contains("resuming: "), "{}", run.err);
    assert_eq!(bench.names("killed"), ["inject.csv", "inject.json"]);
    for file in ["inject.json", "inject.csv"] {
        assert_eq!(bench.read(&format!("whole/{file}")), bench.read(&format!("killed/{file}")));
    }
}

/// What is said of a case run alone is its row.
#[test]
fn a_case_is_run_again_alone() {
    let bench = Bench::new();
    bench.solves(&format!("{INJECT} --seed 5 --out runs --csv"));
    let rows = bench.read("runs/inject.csv");
    let row: Vec<&str> = rows.lines().nth(7).unwrap().split(',').collect();
    let case = format!(
        "inject --scenarios set.scenarios.json --integrator euler --seed 5 --case {}",
        row[0]
    );
    let run = bench.solves(&format!("{case} -v"));
    assert!(run.out.contains("Stage 2, reorientation"), "{}", run.out);
    assert!(run.out.contains(&format!("case {}: {}\n", row[0], row[8])), "{}", run.out);
    assert!(run.out.contains(&format!("checksum {}", row[16])), "{}", run.out);
    assert!(!bench.solves(&case).out.contains("Stage 2, reorientation"));
}

#[test]
fn sites_are_chosen_by_name() {
    let bench = Bench::new();
    let run = bench.solves(&format!("{INJECT} --site kv_cache,qp_data"));
    let counts: Vec<Vec<&str>> = (run.out.lines().skip(7).take(3))
        .map(|line| line.split_whitespace().take(2).collect())
        .collect();
    assert_eq!(counts, [["kv_cache", "15"], ["qp_data", "15"], ["all", "30"]], "{}", run.out);
}

#[test]
fn arguments() {
    let bench = Bench::new();
    let refuses = |options: &str, message: &str| {
        bench.refuses(&format!("inject --scenarios set.scenarios.json {options}"), message);
    };
    refuses("--cases 0", "invalid value '0' for '--cases <CASES>'");
    refuses("--jobs 0", "invalid value '0' for '--jobs <J>'");
    refuses("--site weights", "invalid value 'weights' for '--site <SITE>'");
    refuses("--csv", "the following required arguments were not provided: --out <DIR>");
    refuses("-v", "the following required arguments were not provided: --case <N>");
    refuses(
        "--case 3 --cases 4",
        "the argument '--case <N>' cannot be used with '--cases <CASES>'",
    );
    refuses("--case -1", "");
    refuses("--integrator heun", "invalid value 'heun' for '--integrator <NAME>'");
    refuses("--seed x", "invalid value 'x' for '--seed <S>'");
    bench.refuses("inject --scenarios none.json", "none.json: no such file or directory");
    bench.write("file", "");
    refuses("--out file", "file: is not a directory");
    bench.write("short.mission.toml", "[horizon]\nduration_s = 60\n");
    let reason = "--scenarios: scenario s1-000 is not solved without a fault";
    refuses("--jobs 1 --integrator euler --mission short.mission.toml", reason);
}
