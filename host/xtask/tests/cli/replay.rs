//! `cargo xtask replay`. That all doors of a machine make the same plan is a check of its own in CI: here the doors
//! are none, or made up.

use super::bench::{Bench, Run};
use super::remora;
use serde_json::Value;
use std::fs;

/// A bench with a plan.
fn planned(how: &str) -> Bench {
    let bench = Bench::new();
    let plan = "plan --scenarios @/set.scenarios.json --mode feasible --integrator euler";
    remora(&bench, &format!("{plan} --out @/a.plan.json {how}"));
    bench
}

/// Runs on a machine that has only the programs in a folder of the bench.
fn alone(bench: &Bench, folder: &str, arguments: &str) -> Run {
    let output = bench.command(arguments).env("PATH", bench.path(folder)).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Run {
        status: output.status.code().unwrap(),
        out: text(output.stdout),
        err: text(output.stderr),
    }
}

/// What a run says of each door: name and outcome.
fn outcomes(run: &Run) -> Vec<(String, String)> {
    let told: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(told["format"], "remora-replay/1");
    let word = |row: &Value, key: &str| row[key].as_str().unwrap().to_string();
    let doors = told["doors"].as_array().unwrap();
    doors.iter().map(|row| (word(row, "door"), word(row, "outcome"))).collect()
}

#[test]
fn a_plan_is_made_again_and_one_that_was_changed_is_noticed() {
    for how in
        ["--warm-start heuristic", "--warm-start model", "--qp clarabel --warm-start heuristic"]
    {
        let bench = planned(how);
        let run = bench.solves("replay a.plan.json");
        assert!(run.out.contains("program  ") && run.out.contains("  same  "), "{}", run.out);
        let mut plan = bench.json("a.plan.json");
        let torque = &mut plan["stage2"]["joint_torque_n_m"][30][1];
        *torque = Value::from(torque.as_f64().unwrap().next_up());
        bench.write("b.plan.json", &plan.to_string());
        let run = bench.run("replay b.plan.json");
        assert_eq!(run.status, 1, "{}", run.err);
        assert!(run.out.contains("DIFFERS"), "{}", run.out);
    }
}

/// The checksum is that of the record beside the plan.
#[test]
fn the_checksum_is_the_records() {
    let bench = planned("--warm-start model");
    let run = bench.solves("replay a.plan.json --json");
    let told: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(told["checksum"], bench.json("a.evidence.json")["output"]);
    assert_eq!(told["checksum"], told["doors"][0]["checksum"]);
}

// Verifies REM-DOR-006.
#[test]
fn doors_that_are_not_there_are_named_and_no_fault() {
    let bench = planned("--warm-start heuristic");
    fs::create_dir(bench.path("bare")).unwrap();
    let run = alone(&bench, "bare", "replay a.plan.json --everywhere --json");
    assert_eq!(run.status, 0, "{}{}", run.out, run.err);
    let doors = outcomes(&run);
    assert_eq!(doors[0], ("program".into(), "same".into()));
    let names = ["c", "python", "node", "cortex-m7", "cortex-a53", "riscv64", "leon3"];
    assert_eq!(doors[1..], names.map(|name| (name.to_string(), "missing".to_string())));
    let run = alone(&bench, "bare", "replay a.plan.json --everywhere");
    for reason in
        ["c: no archive", "python: there is no python3", "node: there is no node", "checkout"]
    {
        assert!(run.out.contains(reason), "{reason}: {}", run.out);
    }
}

// Verifies REM-DOR-006.
#[cfg(unix)]
#[test]
fn a_door_with_another_plan_or_none_is_a_fault() {
    use std::os::unix::fs::PermissionsExt;
    let bench = planned("--warm-start heuristic");
    fs::create_dir(bench.path("fake")).unwrap();
    let cases = [
        ("echo 0123456789abcdef", "differs"),
        ("echo nothing", "failed"),
        ("case \"$2\" in import*) exit 0;; *) exit 3;; esac", "failed"),
        ("exit 1", "missing"),
    ];
    for (line, expected) in cases {
        bench.write("fake/python3", &format!("#!/bin/sh\n{line}\n"));
        let script = bench.path("fake/python3");
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
        let run = alone(&bench, "fake", "replay a.plan.json --door python --json");
        assert_eq!(outcomes(&run), [("python".to_string(), expected.to_string())], "{line}");
        assert_eq!(run.status, i32::from(expected != "missing"), "{line}");
    }
}

#[test]
fn other_arms_are_planned_where_there_is_room_for_them() {
    let mission = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/arms/two.mission.toml");
    let bench = planned(&format!("--warm-start heuristic --mission {mission}"));
    fs::create_dir(bench.path("bare")).unwrap();
    let run = alone(&bench, "bare", "replay a.plan.json --door program --door c --door leon3");
    assert_eq!(run.status, 0, "{}{}", run.out, run.err);
    assert_eq!(run.out.matches("three joints only").count(), 2, "{}", run.out);
}

#[test]
fn what_cannot_be_made_again_is_refused() {
    let bench = planned("--warm-start heuristic");
    bench.refuses("replay a.plan.json --model a.model", "--model: has no use");
    bench.refuses("replay none.plan.json", "none.plan.json: no such file");
    bench.refuses("replay a.plan.json --root .", ".: is no checkout");
    bench.refuses("replay a.plan.json --door window", "invalid value 'window'");
    let text = bench.read("a.plan.json");
    let with = |from: &str, to: &str| bench.write("b.plan.json", &text.replace(from, to));
    with("\"warm_start\": \"heuristic\"", "\"warm_start\": \"nominal\"");
    bench.refuses("replay b.plan.json", "b.plan.json: warm_start: is \"nominal\": the guess");
    with("\"qp\": \"embedded\"", "\"qp\": \"abacus\"");
    bench.refuses("replay b.plan.json", "b.plan.json: qp: is \"abacus\"");
    let mut plan = bench.json("a.plan.json");
    plan.as_object_mut().unwrap().remove("inputs").unwrap();
    bench.write("b.plan.json", &plan.to_string());
    bench.refuses("replay b.plan.json", "b.plan.json: missing field `inputs`");
}
