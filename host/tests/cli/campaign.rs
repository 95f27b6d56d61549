//! `remora campaign`

use super::bench::{Bench, IDS, timeless};
use serde_json::Value;
use std::fs;
use std::time::Duration;

const CAMPAIGN: &str = "campaign --scenarios set.scenarios.json --integrator euler --write csv";

/// The columns of a CSV file that are not times, and those that are.
fn columns(bench: &Bench, directory: &str) -> (Vec<Vec<String>>, Vec<Vec<String>>) {
    let text = bench.read(&format!("{directory}/results.csv"));
    let rows: Vec<Vec<String>> =
        text.lines().map(|line| line.split(',').map(String::from).collect()).collect();
    // When bodies are nearest is a time of the plan, not of the machine.
    let measured = |name: &String| {
        let is_time = name.ends_with("time_s") || name == "inference_s";
        is_time && !name.starts_with("clearance_")
    };
    let is_time: Vec<bool> = rows[0].iter().map(measured).collect();
    let pick = |wanted: bool| -> Vec<Vec<String>> {
        let cells = |row: &Vec<String>| {
            let cells = row.iter().zip(&is_time).filter(|(_, time)| **time == wanted);
            cells.map(|(cell, _)| cell.clone()).collect()
        };
        rows.iter().map(cells).collect()
    };
    (pick(false), pick(true))
}

fn journal(bench: &Bench, directory: &str) -> Vec<String> {
    let text = bench.read(&format!("{directory}/journal.jsonl"));
    text.lines().map(String::from).collect()
}

#[test]
fn one_thread_or_two_give_the_same_rows_and_plans() {
    let bench = Bench::new();
    for jobs in ["1", "2"] {
        let run =
            bench.solves(&format!("{CAMPAIGN} --write plans --jobs {jobs} --out runs/{jobs}"));
        assert!(run.out.contains("3 scenarios: 3 solved (100.00 %)"), "{}", run.out);
        assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    }
    let (rows, times) = columns(&bench, "runs/1");
    assert_eq!(rows, columns(&bench, "runs/2").0);
    assert_eq!(rows.len(), 4);
    let names = ["stage1_time_s", "stage2_time_s", "inference_s", "time_s", "cpu_time_s"];
    assert_eq!(times[0], names);
    for (row, id) in rows[1..].iter().zip(IDS) {
        assert_eq!((row[0].as_str(), row[1].as_str()), (id, "solved"));
        let plan = |jobs: &str| timeless(bench.json(&format!("runs/{jobs}/plans/{id}.plan.json")));
        assert_eq!(plan("1"), plan("2"));
    }
    let summary = |jobs: &str| timeless(bench.json(&format!("runs/{jobs}/summary.json")));
    assert_eq!(summary("1"), summary("2"));
    assert_eq!(summary("1")["success_rate"], 1.0);
    let expected = [
        "campaign.scenarios.json",
        "journal.jsonl",
        "plans",
        "results.csv",
        "results.csv-metadata.json",
        "results.parquet",
        "summary.json",
    ];
    assert_eq!(bench.names("runs/1"), expected);
    assert_eq!(bench.names("runs/1/plans").len(), 3);
}

/// Every capture has the end effector at its port, so a plan's distance is that of all other bodies.
#[test]
fn the_smallest_distance_of_a_campaign_is_not_the_capture_itself() {
    let bench = Bench::new();
    let run = bench.solves(&format!("{CAMPAIGN} --write report --out runs"));
    let text = bench.read("runs/results.csv");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let cell = |row: &Vec<&str>, name: &str| {
        row[names.iter().position(|found| *found == name).unwrap()].to_string()
    };
    let number = |row: &Vec<&str>, name: &str| cell(row, name).parse::<f64>().unwrap();
    let mut smallest = Vec::new();
    for row in &rows {
        let at_port = number(row, "clearance_end_effector_m");
        assert_eq!(at_port, number(row, "clearance_arm_m"));
        assert!((at_port - 1e-3).abs() < 1e-4, "{at_port}");
        assert!((1100.0..=1200.0).contains(&number(row, "clearance_end_effector_time_s")));
        let (distance, pair) =
            (number(row, "clearance_smallest_m"), cell(row, "clearance_smallest_pair"));
        assert!(distance > 0.01, "{distance} {pair}");
        assert!(pair.ends_with(":target") || pair.ends_with(":bus"), "{pair}");
        assert!((0.0..=1200.0).contains(&number(row, "clearance_smallest_time_s")));
        smallest.push((distance, pair));
    }
    smallest.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(smallest[0].0 < smallest[2].0, "{smallest:?}");
    let (distance, pair) = &smallest[0];
    let nearest = &bench.json("runs/summary.json")["nearest"];
    assert_eq!((&nearest["distance_m"], &nearest["pair"]), (&(*distance).into(), &pair[..].into()));
    let told = format!("smallest distance, end effector left out: {distance:.3} m, {pair}, at ");
    assert!(run.out.contains(&told), "{}", run.out);
    let page = bench.read("runs/report.html");
    assert!(page.contains(&format!("{distance:.3} {pair}")), "{pair}");
}

/// A plan of a campaign is the plan of `remora plan`.
#[test]
fn a_campaigns_plan_is_a_plan() {
    let bench = Bench::new();
    bench.solves(&format!("{CAMPAIGN} --write plans --jobs 1 --out runs"));
    bench.solves("plan --scenarios set.scenarios.json --id s1-002 --integrator euler");
    let plan = bench.json("runs/s1-002.plan.json");
    assert_eq!(timeless(plan), timeless(bench.json("runs/plans/s1-002.plan.json")));
    bench.solves("check --strict runs/plans/s1-000.plan.json runs/plans/s1-001.plan.json");
    let set = "runs/campaign.scenarios.json";
    assert_eq!(bench.json(set), bench.json("set.scenarios.json"));
    bench.solves(&format!("check --strict --scenarios {set} runs/plans/s1-000.plan.json"));
}

#[test]
fn finished_rows_are_not_planned_again() {
    let bench = Bench::new();
    bench.solves(&format!("{CAMPAIGN} --jobs 1 --out runs"));
    let (rows, times) = columns(&bench, "runs");
    // As a kill in the middle of writing the third row leaves it.
    let lines = journal(&bench, "runs");
    assert_eq!(lines.len(), 4);
    let torn = format!("{}\n{}\n{}\n{}", lines[0], lines[1], lines[2], &lines[3][..50]);
    bench.write("runs/journal.jsonl", &torn);
    bench.write("runs/.results.csv.1.partial", "scen");
    fs::remove_file(bench.path("runs/results.parquet")).unwrap();
    let run = bench.solves(&format!("{CAMPAIGN} --jobs 1 --out runs"));
    assert!(run.out.contains("1 planned in"), "{}", run.out);
    assert!(run.out.contains("2 taken from the journal"), "{}", run.out);
    assert!(run.err.contains("resuming: 2 of 3"), "{}", run.err);
    let (rows_after, times_after) = columns(&bench, "runs");
    assert_eq!(rows, rows_after);
    assert_eq!(times[..3], times_after[..3]);
    assert_ne!(times[3], times_after[3]);
    assert_eq!(journal(&bench, "runs").len(), 4);
    let expected = [
        "campaign.scenarios.json",
        "journal.jsonl",
        "results.csv",
        "results.csv-metadata.json",
        "results.parquet",
        "summary.json",
    ];
    assert_eq!(bench.names("runs"), expected);
    // A campaign that is complete plans nothing.
    let run = bench.solves(&format!("{CAMPAIGN} --jobs 2 --out runs"));
    assert!(run.out.contains("0 planned in"), "{}", run.out);
    assert_eq!(columns(&bench, "runs"), (rows_after, times_after));
}

/// Somebody has written into the journal: what no plan of this campaign came to is not taken.
// Verifies REM-IO-005.
#[test]
fn forged_rows_are_refused() {
    let bench = Bench::new();
    bench.solves(&format!("{CAMPAIGN} --jobs 1 --out runs"));
    let whole = bench.read("runs/journal.jsonl");
    let refuses = |from: &str, to: &str, reason: &str| {
        assert!(whole.contains(from), "{from}");
        bench.write("runs/journal.jsonl", &whole.replacen(from, to, 1));
        let message = format!("runs/journal.jsonl: line 2: {reason}");
        bench.refuses(&format!("{CAMPAIGN} --jobs 1 --out runs"), &message);
    };
    refuses("s1-000", "s1-999", "scenario: \"s1-999\" is no scenario of this campaign");
    let first = whole.find("\"residuals\":[").unwrap() + "\"residuals\":[".len();
    let value = &whole[first..first + whole[first..].find(',').unwrap()];
    let residual = format!("\"residuals\":[{value}");
    refuses(&residual, "\"residuals\":[1e9", "residuals.dynamics1: is 1000000000 of ");
    refuses(&residual, "\"residuals\":[null", "residuals.dynamics1: is NaN of ");
    refuses(
        "\"verdict\":\"optimal\"",
        "\"verdict\":\"verified_not_converged\"",
        "verdict: contradicts the status",
    );
}

// Verifies REM-IO-003.
#[test]
fn a_killed_campaign_resumes() {
    let bench = Bench::new();
    let campaign = "campaign --count 6 --seed 3 --integrator euler --jobs 1 --write csv --out runs";
    let mut child = bench.command(campaign).stderr(std::process::Stdio::null()).spawn().unwrap();
    let rows = || fs::read_to_string(bench.path("runs/journal.jsonl")).unwrap_or_default();
    while rows().lines().count() < 3 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let finished: Vec<String> = rows().split_inclusive('\n').map(String::from).collect();
    bench.solves(campaign);
    let after = journal(&bench, "runs");
    assert_eq!(after.len(), 7);
    for (before, after) in finished.iter().filter(|line| line.ends_with('\n')).zip(&after) {
        assert_eq!(before.trim_end(), after);
    }
    let metadata = bench.json("runs/results.csv-metadata.json");
    assert_eq!((&metadata["remora:seed"], &metadata["url"]), (&"3".into(), &"results.csv".into()));
    let csv = bench.read("runs/results.csv");
    let ids: Vec<&str> = csv.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(ids, ["s3-000", "s3-001", "s3-002", "s3-003", "s3-004", "s3-005"]);
}

/// Two campaigns begun at once: the one that comes second changes nothing, whatever the first has written so far.
// Verifies REM-IO-003.
#[test]
fn a_campaign_beside_another_writes_nothing() {
    let bench = Bench::new();
    let of = |seed: u32| format!("campaign --count 1 --seed {seed} --integrator euler --out runs");
    fs::create_dir(bench.path("runs")).unwrap();
    let journal = fs::File::create(bench.path("runs/journal.jsonl")).unwrap();
    journal.lock().unwrap();
    let busy = "runs/journal.jsonl: another campaign is running in this directory";
    bench.refuses(&of(2), busy);
    bench.write("runs/campaign.scenarios.json", "the first one's");
    bench.refuses(&of(2), busy);
    drop(journal);
    bench.solves(&of(1));
    // A kill between journal and scenarios: the same command writes them.
    let scenarios = bench.read("runs/campaign.scenarios.json");
    fs::remove_file(bench.path("runs/campaign.scenarios.json")).unwrap();
    bench.refuses(&of(2), "runs/journal.jsonl: scenarios: this campaign was begun with other");
    bench.solves(&of(1));
    assert_eq!(bench.read("runs/campaign.scenarios.json"), scenarios);
}

/// What a kill has left half-written is swept away by the campaign that goes on, once it has the journal; what
/// others write in the same directory is not.
// Verifies REM-IO-003.
#[test]
fn a_campaign_sweeps_up_what_it_writes_itself() {
    let bench = Bench::new();
    let campaign = "campaign --count 1 --seed 1 --integrator euler --write plans --out runs";
    fs::create_dir_all(bench.path("runs/plans")).unwrap();
    let own =
        [".summary.json.1.partial", ".results.csv.1.partial", "plans/.s1-000.plan.json.1.partial"];
    let others = [".part-00001-of-00002.parquet.1.partial", "plans/.s2-000.plan.json.1.partial"];
    let all = || own.iter().chain(&others).map(|name| bench.path("runs").join(name));
    all().for_each(|file| fs::write(file, "half").unwrap());
    let journal = fs::File::create(bench.path("runs/journal.jsonl")).unwrap();
    journal.lock().unwrap();
    bench.refuses(campaign, "runs/journal.jsonl: another campaign is running in this directory");
    assert!(all().all(|file| file.exists()));
    drop(journal);
    bench.solves(campaign);
    let left: Vec<bool> = all().map(|file| file.exists()).collect();
    assert_eq!(left, [false, false, false, true, true]);
}

#[test]
fn a_row_without_its_plan_file_is_planned_again() {
    let bench = Bench::new();
    bench.solves(&format!("{CAMPAIGN} --write plans --out runs"));
    fs::remove_file(bench.path("runs/plans/s1-001.plan.json")).unwrap();
    let run = bench.solves(&format!("{CAMPAIGN} --write plans --out runs"));
    assert!(run.out.contains("1 planned in"), "{}", run.out);
    assert_eq!(bench.names("runs/plans").len(), 3);
}

#[test]
fn another_campaign_is_not_resumed() {
    let bench = Bench::new();
    bench.write("one.scenarios.json", &first_of(&bench).to_string());
    let one = "campaign --scenarios one.scenarios.json --integrator euler";
    bench.solves(&format!("{one} --out runs"));
    let refuses = |arguments: &str, field: &str| {
        let message = format!("runs/journal.jsonl: {field}: this campaign was begun with");
        bench.refuses(&format!("{arguments} --out runs"), &message);
    };
    refuses("campaign --scenarios one.scenarios.json", "integrator");
    refuses(&format!("{one} --mode feasible"), "mode");
    refuses(&format!("{one} --write plans"), "plans");
    refuses(&format!("{one} --deadline 1e3"), "settings");
    refuses(CAMPAIGN, "scenarios");
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    refuses(&format!("{one} --mission heavy.mission.toml"), "mission");
    bench.write("runs/journal.jsonl", "{}\n{}\n");
    bench.refuses(&format!("{one} --out runs"), "runs/journal.jsonl: line 1: missing field");
}

#[test]
fn what_is_not_solved_is_listed_and_told_by_the_status() {
    let bench = Bench::new();
    bench.write("one.scenarios.json", &first_of(&bench).to_string());
    bench.write("short.mission.toml", "[horizon]\nduration_s = 60\n");
    let run = bench.run(
        "campaign --scenarios one.scenarios.json --mission short.mission.toml --integrator euler \
         --write csv,plans --out runs",
    );
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("1 scenarios: 0 solved (0.00 %)"), "{}", run.out);
    assert!(run.out.contains("  not flyable                      1\n"), "{}", run.out);
    assert!(run.out.contains("refused before planning: 1"), "{}", run.out);
    let (rows, _) = columns(&bench, "runs");
    let cell = |name: &str| {
        let at = rows[0].iter().position(|column| column == name).unwrap();
        rows[1][at].as_str()
    };
    assert_eq!((cell("status"), cell("verdict")), ("infeasible", "not_flyable"));
    assert_eq!((cell("reason"), cell("clearance_arm_m")), ("joint_rate", "inf"));
    assert_eq!(bench.names("runs/plans"), Vec::<String>::new());
    let summary = bench.json("runs/summary.json");
    assert_eq!(summary["by_reason"], serde_json::json!({ "joint_rate": 1 }));
    assert_eq!(summary["refused"], 1);
    // It is not looked at again.
    let again = bench.run(
        "campaign --scenarios one.scenarios.json --mission short.mission.toml --integrator euler \
         --write csv,plans --out runs",
    );
    assert!(again.out.contains("0 planned in"), "{}", again.out);
    assert!(run.out.contains("not solved:\n  s1-000\n"), "{}", run.out);
    assert_eq!(bench.json("runs/summary.json")["unsolved"], serde_json::json!(["s1-000"]));
}

#[test]
fn another_deadline_is_another_campaign() {
    let bench = Bench::new();
    let late = format!("{CAMPAIGN} --deadline 1e-6");
    for planned in ["3 planned in", "0 planned in"] {
        let run = bench.run(&format!("{late} --out runs"));
        assert_eq!(run.status, 1, "{}", run.err);
        assert!(run.out.contains(planned), "{}", run.out);
    }
    assert_eq!(bench.json("runs/summary.json")["by_status"], serde_json::json!({ "deadline": 3 }));
    let message = "runs/journal.jsonl: settings: this campaign was begun with another --model";
    for other in [CAMPAIGN, &format!("{CAMPAIGN} --deadline 2e-6")] {
        bench.refuses(&format!("{other} --out runs"), message);
    }
}

/// The set with its first scenario alone.
fn first_of(bench: &Bench) -> Value {
    let mut set = bench.json("set.scenarios.json");
    set["scenarios"].as_array_mut().unwrap().truncate(1);
    set
}

/// The built-in model for RK4 descends from one that learnt from seed 1000.
#[test]
fn a_model_is_not_judged_by_what_an_ancestor_has_learnt() {
    let bench = Bench::new();
    let models = [("euler", "euler", 1000), ("rk4:4", "rk4", 1000), ("rk4", "rk4", 4000)];
    for (integrator, model, seed) in models {
        bench.refuses(
            &format!("campaign --count 1 --seed {seed} --integrator {integrator} --out runs"),
            &format!(
                "--model: {model}.model (built in) or a model that it descends from has learnt \
                 from s{seed}-000: choose another seed, or --warm-start heuristic"
            ),
        );
    }
    assert!(!bench.path("runs").exists());
    let heuristic = "--integrator euler --mode feasible --warm-start heuristic";
    bench.solves(&format!("campaign --count 1 --seed 1000 {heuristic} --out runs"));
}
