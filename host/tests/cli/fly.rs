//! `remora fly`, with `--rerun` and `--safety`, `remora mission errors`

use super::bench::Bench;
use serde_json::{Value, json};
use std::fs;

const FLY: &str =
    "fly a.plan.json --errors a.errors.toml --runs 4 --seed 3 --guidance-rate 1 --quiet";

/// A bench with a plan and typical errors.
fn flying() -> Bench {
    let bench = Bench::new();
    bench.solves("plan --scenarios set.scenarios.json --out a.plan.json");
    let errors = bench.solves("mission errors typical");
    bench.write("a.errors.toml", &errors.out);
    bench
}

/// The journal's rows by run.
fn rows(bench: &Bench, folder: &str) -> Vec<Value> {
    let text = bench.read(&format!("{folder}/flights.journal.jsonl"));
    let mut rows: Vec<Value> =
        text.lines().skip(1).map(|line| serde_json::from_str(line).unwrap()).collect();
    rows.sort_by_key(|row| row["run"].as_u64());
    rows
}

// Verifies REM-FLY-001.
#[test]
fn threads_kills_and_reruns_change_no_row() {
    let bench = flying();
    for jobs in ["1", "2"] {
        let run = bench.run(&format!("{FLY} --jobs {jobs} --out runs/{jobs}"));
        assert!(run.status < 2, "{}", run.err);
    }
    let first = rows(&bench, "runs/1");
    assert_eq!(first.len(), 4);
    assert_eq!(first, rows(&bench, "runs/2"));
    let table = |folder: &str| fs::read(bench.path(&format!("{folder}/flights.parquet"))).unwrap();
    assert_eq!(table("runs/1"), table("runs/2"));
    // Killed after two runs, in the middle of a line.
    let journal = bench.read("runs/2/flights.journal.jsonl");
    let lines: Vec<&str> = journal.lines().collect();
    let torn = format!("{}\n{}\n{}\n{}", lines[0], lines[1], lines[2], &lines[3][..40]);
    bench.write("runs/2/flights.journal.jsonl", &torn);
    fs::remove_file(bench.path("runs/2/flights.parquet")).unwrap();
    bench.run(&format!("{FLY} --out runs/2"));
    assert_eq!(table("runs/1"), table("runs/2"));
    // One of them again.
    let again = bench.solves("fly runs/1 --rerun 2 --json");
    assert_eq!(serde_json::from_str::<Value>(&again.out).unwrap(), first[2]);
    assert!(bench.path("runs/1/history/2.parquet").is_file());
    assert!(bench.path("runs/1/history/2.jsonl").is_file());
    let page = bench.read("runs/1/flights.html");
    // Four runs are too few to show the share of any error.
    assert!(page.contains("Here nothing stands out in 4 runs"));
    assert!(page.contains("<svg") && !page.contains("src=") && !page.contains("<link"));
    // Runs are drawn each for itself.
    assert_ne!(first[0]["flown"]["drawn"], first[1]["flown"]["drawn"]);
}

#[test]
fn a_plan_without_errors_ends_at_the_port() {
    let bench = flying();
    let run = bench.solves("fly a.plan.json --json --out runs/none");
    let summary: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(summary["endings"][0][1]["count"], 1);
    let row = &rows(&bench, "runs/none")[0]["flown"];
    assert!(row["arrival"]["miss_m"].as_f64().unwrap() < 3e-4, "{row}");
    assert!(row["arrival"]["angle_rad"].as_f64().unwrap() < 4e-4, "{row}");
    assert_eq!(row["violations"], Value::Array(Vec::new()));
    let servo = bench.solves("fly a.plan.json --joints servo --out runs/servo");
    assert!(servo.out.contains("captured"), "{}", servo.out);
}

#[test]
fn another_arm_flies_and_plans_again() {
    let bench = flying();
    let mission = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/arms/two.mission.toml");
    fs::copy(mission, bench.path("two.mission.toml")).unwrap();
    bench.solves("draw --mission two.mission.toml --count 1 --seed 1 --out two.scenarios.json");
    let run = bench.run(
        "fly --mission two.mission.toml --scenarios two.scenarios.json --controller replan:400 \
         --warm-start heuristic --out runs/two",
    );
    assert!(run.status < 2, "{}{}", run.out, run.err);
    let row = &rows(&bench, "runs/two")[0]["flown"];
    assert!(row["arrival"]["miss_m"].as_f64().unwrap() < 1e-3, "{row}");
    assert!(row["replans"][1].as_u64().unwrap() >= 1, "{row}");
}

#[test]
fn a_campaign_flies_what_it_plans() {
    let bench = flying();
    let planned = bench.run("campaign --scenarios set.scenarios.json --write plans --out runs/all");
    assert_ne!(planned.status, 2, "{}", planned.err);
    let fly = "fly runs/all --errors a.errors.toml --runs 2 --guidance-rate 1";
    let run = bench.run(&format!("{fly} --out runs/all"));
    assert!(run.status < 2, "{}{}", run.out, run.err);
    let all = rows(&bench, "runs/all");
    assert_eq!(all.len(), 6);
    assert_eq!(all[5]["scenario"], "s1-002");
    assert!(run.out.contains("what to improve first"), "{}", run.out);
    // Elsewhere the same plans have the same flights.
    assert!(bench.run(&format!("{fly} --out runs/beside")).status < 2);
    assert_eq!(rows(&bench, "runs/beside"), all);
    assert_eq!(bench.names("runs/beside/plans"), bench.names("runs/all/plans"));
}

/// A folder whose plans are not all there is none to fly, nor is one of another kind.
#[test]
fn a_campaign_without_its_plans_is_not_flown() {
    let bench = Bench::new();
    let campaign = "campaign --scenarios set.scenarios.json --mode feasible";
    bench.solves(&format!("{campaign} --out runs/none"));
    let makes = "`remora campaign --write plans` makes them";
    bench.refuses(
        "fly runs/none --out runs/flown",
        &format!("runs/none/plans: holds 0 plans of 3: {makes}"),
    );
    bench.solves(&format!("{campaign} --write plans --out runs/all"));
    fs::remove_file(bench.path("runs/all/plans/s1-001.plan.json")).unwrap();
    bench.refuses(
        "fly runs/all --out runs/all",
        &format!("runs/all/plans: holds 2 plans of 3: {makes}"),
    );
    fs::remove_file(bench.path("runs/all/summary.json")).unwrap();
    bench.refuses("fly runs/all --out runs/all", "runs/all/summary.json: no such file");
    fs::create_dir(bench.path("empty")).unwrap();
    bench.refuses("fly empty --out empty", "empty/campaign.scenarios.json: no such file");
    bench.solves(
        "campaign --scenarios set.scenarios.json --integrator euler --write plans --out runs/euler",
    );
    let euler = "runs/euler/plans/s1-000.plan.json: integrator: is euler";
    bench.refuses("fly runs/euler --out runs/euler", euler);
}

// Verifies REM-FLY-002.
#[test]
fn bad_input_is_one_line_and_nothing_written() {
    let bench = flying();
    let fly = "fly a.plan.json --out runs/bad";
    bench.solves("plan --scenarios set.scenarios.json --integrator euler --out e.plan.json");
    bench.refuses("fly e.plan.json --out runs/bad", "e.plan.json: integrator: is euler");
    bench.refuses("fly --integrator euler --out runs/bad", "--integrator: euler plans say nothing");
    bench.refuses("fly missing.plan.json --out runs/bad", "missing.plan.json");
    bench.refuses(&format!("{fly} --keep best=3"), "invalid value 'best=3'");
    bench.refuses(&format!("{fly} --until miss_m"), "invalid value 'miss_m'");
    bench.refuses(&format!("{fly} --guidance-rate 50"), "invalid value '50'");
    for option in ["--errors", "--seed"] {
        let message = format!("{option}: has no use without --safety flown");
        bench.refuses(&format!("fly a.plan.json --safety planned {option} 1"), &message);
    }
    bench.refuses("fly runs --rerun 3", "runs/flights.json");
    let errors = bench.read("a.errors.toml");
    let bad = |from: &str, to: &str, message: &str| {
        assert!(errors.contains(from), "{from}");
        bench.write("b.errors.toml", &errors.replacen(from, to, 1));
        bench.refuses(&format!("{fly} --errors b.errors.toml"), message);
    };
    bad("[mass]", "[mass]\nmas = 1.0", "b.errors.toml: mass");
    bad("[orbit]", "[orbits]", "b.errors.toml");
    bad("period_s = 1.0", "period_s = nan", "b.errors.toml: thrusters.period_s");
    bad("rate_hz = 10.0", "rate_hz = -1.0", "b.errors.toml: sensors");
    let stuck = "[faults.joint_stuck]\njoint = 3\ntime_s = 5.0\n";
    bench.write("b.errors.toml", &format!("{errors}{stuck}"));
    bench.refuses(&format!("{fly} --errors b.errors.toml"), "b.errors.toml: faults");
    // Other flights in the same folder.
    bench.run("fly a.plan.json --guidance-rate 0.2 --out runs/a");
    let run = bench.run("fly a.plan.json --guidance-rate 0.5 --out runs/a");
    assert_eq!(run.status, 2);
    assert!(run.err.contains("other plans, errors, options or runs"), "{}", run.err);
    bench.refuses(
        "fly runs/a --rerun 1",
        "runs/a/flights.json: runs: there is no run 1: runs are 0 to 0",
    );
}

/// Two series begun at once: the one that comes second leaves what the first says of itself.
// Verifies REM-FLY-002.
#[test]
fn flights_beside_others_write_nothing_of_theirs() {
    let bench = flying();
    let fly = "fly a.plan.json --guidance-rate 0.2 --keep sample=0 --out runs/a";
    fs::create_dir_all(bench.path("runs/a")).unwrap();
    let journal = fs::File::create(bench.path("runs/a/flights.journal.jsonl")).unwrap();
    journal.lock().unwrap();
    let is_refused = || {
        let run = bench.run(fly);
        assert_eq!(run.status, 2, "{}{}", run.out, run.err);
        assert!(run.err.contains("another series of flights is running"), "{}", run.err);
    };
    is_refused();
    assert_eq!(bench.names("runs/a"), ["flights.journal.jsonl", "plans"]);
    bench.write("runs/a/flights.json", "the first one's");
    is_refused();
    assert_eq!(bench.read("runs/a/flights.json"), "the first one's");
    drop(journal);
    // A kill between journal and flights.json: the same command writes it.
    bench.run(fly);
    let asked = bench.read("runs/a/flights.json");
    fs::remove_file(bench.path("runs/a/flights.json")).unwrap();
    bench.run(fly);
    assert_eq!(bench.read("runs/a/flights.json"), asked);
}

/// Runs of another plan of the same scenario are not put among those that are there.
#[test]
fn another_plan_is_not_flown_where_flights_have_begun() {
    let bench = flying();
    let fly = "--guidance-rate 0.2 --keep sample=0 --quiet --out runs";
    bench.run(&format!("fly a.plan.json {fly}"));
    let [name] = &bench.names("runs/plans")[..] else { panic!("one plan") };
    let flown = bench.read(&format!("runs/plans/{name}"));
    bench.solves("plan --scenarios set.scenarios.json --mode feasible --out b.plan.json");
    let message = format!(
        "runs/plans/{name}: is another plan, of the flights that have begun there: choose another --out"
    );
    bench.refuses(&format!("fly b.plan.json {fly}"), &message);
    assert_eq!(bench.read(&format!("runs/plans/{name}")), flown);
    // The same plan, made again, took another time.
    bench.solves("plan --scenarios set.scenarios.json --out a.plan.json --force");
    assert!(bench.run(&format!("fly a.plan.json {fly}")).status < 2);
    assert_eq!(bench.read(&format!("runs/plans/{name}")), flown);
}

/// What is flown again is what a command could have asked for, and no other: a rate of 10^15 steps a second would
/// never end.
// Verifies REM-FLY-002.
#[test]
fn forged_flights_are_refused() {
    let bench = flying();
    bench.run("fly a.plan.json --guidance-rate 0.2 --keep sample=0 --out runs/a");
    let sound = bench.json("runs/a/flights.json");
    for (place, value, reason) in [
        ("/runs", json!(0), "runs: must be from 1 to 1000000"),
        ("/runs", json!(1_000_000_000_000_000_u64), "runs: must be from 1 to 1000000"),
        ("/joints", json!(8), "joints: arms of 1 to 7 joints are planned for"),
        ("/options/rate_hz", json!(1e15), "options.rate_hz: must lie between 0.2 and 20"),
        ("/options/rate_hz", json!(-1.0), "options.rate_hz: must lie between 0.2 and 20"),
        ("/options/camera_s", json!(-1.0), "options.camera_s: must not be negative"),
        ("/options/replan_every_s", json!(0.0), "options.replan_every_s: must be positive"),
        ("/plans/0", json!("/etc/passwd"), "plans[0]: \"/etc/passwd\" is no file in the folder"),
        ("/plans/0", json!("../../a.plan.json"), "plans[0]: \"../../a.plan.json\" is no file"),
        ("/plans/0", json!("plans/../../x"), "plans[0]: \"plans/../../x\" is no file in the"),
        ("/plans/0", json!(""), "plans[0]: \"\" is no file in the folder of the flights"),
        ("/errors/mass/mass", json!(-0.1), "errors.mass.mass: is -0.1: must be finite"),
    ] {
        let mut forged = sound.clone();
        *forged.pointer_mut(place).unwrap() = value;
        bench.write("runs/a/flights.json", forged.to_string().as_bytes());
        for command in ["fly runs/a --rerun 0", "campaign gather runs/a"] {
            bench.refuses(command, &format!("runs/a/flights.json: {reason}"));
        }
    }
}

/// Errors without bound make a world that nothing can follow: the flight ends, and its run is named.
// Verifies REM-FLY-002.
#[test]
fn a_world_that_moves_too_fast_is_left() {
    let bench = flying();
    let errors = bench.read("a.errors.toml");
    let (from, to) = ("friction_n_m = ", "friction_n_m = 1e3 # ");
    assert!(errors.contains(from));
    bench.write("b.errors.toml", errors.replacen(from, to, 1).as_bytes());
    let run = bench.run("fly a.plan.json --errors b.errors.toml --out runs/b");
    assert_eq!(run.status, 2, "{}{}", run.out, run.err);
    let told = run.err.lines().last().unwrap();
    let told =
        told.strip_prefix("error: --errors: run 0: the world cannot be flown in: ").expect(told);
    assert!(told.ends_with("it takes too many steps"), "{told}");
    // Nothing was flown: the same folder takes the errors that are put right.
    assert!(!bench.path("runs/b/flights.json").exists());
    let run = bench.run("fly a.plan.json --errors a.errors.toml --guidance-rate 1 --out runs/b");
    assert!(run.status < 2, "{}{}", run.out, run.err);
    // Where a folder says it, the folder is named.
    let mut forged = bench.json("runs/b/flights.json");
    let friction = forged.pointer_mut("/errors/joints/friction_n_m").unwrap();
    *friction = json!(1e3);
    bench.write("runs/b/flights.json", forged.to_string().as_bytes());
    let message = "runs/b/flights.json: errors: run 0: the world cannot be flown in: ";
    bench.refuses("fly runs/b --rerun 0", message);
}

// Verifies REM-GUI-005.
#[test]
fn ways_out_are_told_node_by_node_and_flown() {
    let bench = flying();
    let run = bench.solves("fly a.plan.json --safety flown --json");
    let ways: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(ways["point_of_no_return"], Value::Null);
    let nodes = ways["nodes"].as_array().unwrap();
    let plan: Value = serde_json::from_str(&bench.read("a.plan.json")).unwrap();
    assert_eq!(nodes.len() as u64, plan["nodes"].as_u64().unwrap_or(60));
    for (k, node) in nodes.iter().enumerate() {
        assert_eq!(node["escape"]["clears"], true, "{k}: {node}");
        assert_eq!(node["flown"]["escape_clears"], true, "{k}: {node}");
        // The planner's world and the truth are two programs, and without errors one world.
        let [planned, flown] = [&node["drift"]["distance"], &node["flown"]["drift_distance_m"]];
        let off = planned.as_f64().unwrap() - flown.as_f64().unwrap();
        assert!(off.abs() < 0.05, "{k}: {off} {node}");
    }
    let text = bench.solves("fly a.plan.json --safety planned");
    assert!(text.out.contains("point of no return: none"), "{}", text.out);
    let euler =
        bench.run("plan --scenarios set.scenarios.json --integrator euler --out e.plan.json");
    assert_eq!(euler.status, 0, "{}", euler.err);
    let refused = bench.run("fly e.plan.json --safety planned");
    assert_eq!(refused.status, 2);
    assert!(refused.err.contains("e.plan.json: integrator"), "{}", refused.err);
}

/// A plan about the Moon is flown about the Moon, and refuses the Earth's oblateness.
#[test]
fn a_plan_about_the_moon_is_flown_about_the_moon() {
    let bench = Bench::new();
    let moon = include_str!("../../../fixtures/missions/moon.mission.toml");
    bench.write("a.mission.toml", moon);
    bench.solves(
        "plan --scenarios set.scenarios.json --mission a.mission.toml --integrator rk4 \
         --warm-start heuristic --out a.plan.json",
    );
    bench.solves("fly a.plan.json --out runs/moon");
    let row = &rows(&bench, "runs/moon")[0]["flown"];
    assert_eq!(row["ending"], "captured", "{row}");
    assert!(row["arrival"]["miss_m"].as_f64().unwrap() < 3e-4, "{row}");
    bench.refuses("fly a.plan.json --gravity j2 --out runs/oblate", "--gravity: is the Earth's");
}
