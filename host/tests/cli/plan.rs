//! `remora plan`

use super::bench::{Bench, timeless};

#[test]
fn without_arguments_it_plans_a_built_in_scenario() {
    let bench = Bench::new();
    let run = bench.solves("");
    let plan = bench.json("pub-000.plan.json");
    assert_eq!(plan["format"], "remora-plan/1");
    assert_eq!((&plan["status"], &plan["mode"]), (&"solved".into(), &"optimal".into()));
    assert_eq!((&plan["integrator"], &plan["qp"]), (&"rk4".into(), &"embedded".into()));
    assert_eq!(plan["warm_start"], "model");
    for text in ["scenario pub-000: solved", "reorientation", "ee_angle", "written: pub-000.plan"] {
        assert!(run.out.contains(text), "{text} in\n{}", run.out);
    }
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    assert_eq!(run.out.matches(" ok ").count(), 11, "{}", run.out);
}

// Verifies REM-PLN-005.
#[test]
fn twice_the_same_is_the_same_but_for_times() {
    let bench = Bench::new();
    let plan = "plan --scenarios set.scenarios.json --id s1-001 --integrator euler --out";
    bench.solves(&format!("{plan} a.plan.json"));
    bench.solves(&format!("{plan} b.plan.json"));
    let plan = bench.json("a.plan.json");
    assert_eq!(plan["scenario"], "s1-001");
    assert_eq!(timeless(plan.clone()), timeless(bench.json("b.plan.json")));
    let lines = |name: &str| -> Vec<String> {
        let text = bench.read(name);
        text.lines().filter(|line| !line.contains("_s\":")).map(String::from).collect()
    };
    assert_eq!(lines("a.plan.json"), lines("b.plan.json"));
    assert_eq!(bench.read("a.evidence.json"), bench.read("b.evidence.json"));
    let evidence = bench.json("a.evidence.json");
    assert_eq!(evidence["format"], "remora-evidence/2");
    assert_eq!((&evidence["scenario"], &evidence["status"]), (&plan["scenario"], &plan["status"]));
    assert_eq!(evidence["is_verified"], true);
    assert_eq!(evidence["gains"].as_array().map(Vec::len), Some(59));
}

// Verifies REM-PLN-006.
#[test]
fn two_threads_write_the_same_plan_but_for_times() {
    let bench = Bench::new();
    for integrator in ["euler", "rk4:4"] {
        for threads in ["1", "2"] {
            let plan = format!("plan --mode feasible --integrator {integrator}");
            bench.solves(&format!("{plan} --threads {threads} --out {threads}.plan.json"));
        }
        assert_eq!(timeless(bench.json("1.plan.json")), timeless(bench.json("2.plan.json")));
        assert_eq!(bench.read("1.evidence.json"), bench.read("2.evidence.json"));
    }
}

#[test]
fn a_deadline_that_is_not_reached_changes_nothing() {
    let bench = Bench::new();
    let plan = "plan --mode feasible --integrator euler --out";
    bench.solves(&format!("{plan} a.plan.json"));
    bench.solves(&format!("{plan} b.plan.json --deadline 1e6"));
    assert_eq!(timeless(bench.json("a.plan.json")), timeless(bench.json("b.plan.json")));
}

#[test]
fn out_of_time_it_writes_what_it_has() {
    let bench = Bench::new();
    let set = "--scenarios set.scenarios.json";
    for qp in ["embedded", "clarabel"] {
        let run = bench.run(&format!("plan {set} --deadline 1e-6 --qp {qp}"));
        assert_eq!(run.status, 1, "{}", run.err);
        assert!(run.out.contains("scenario s1-000: deadline\n"), "{}", run.out);
        assert_eq!(bench.json("s1-000.plan.json")["status"], "deadline");
        let check = bench.run(&format!("check {set} s1-000.plan.json"));
        assert_eq!(check.status, 1, "{}", check.err);
        assert!(check.out.contains("verdict: NOT feasible\n"), "{}", check.out);
    }
}

#[test]
fn verbose_shows_the_iterations() {
    let bench = Bench::new();
    let run = bench.solves("plan -v --mode feasible --integrator euler");
    for text in [
        "Stage 1, translation",
        "Stage 2, reorientation",
        "QP status",
        "feasible mode",
        "time: start",
    ] {
        assert!(run.out.contains(text), "{text} in\n{}", run.out);
    }
    assert_eq!(bench.json("pub-000.plan.json")["mode"], "feasible");
}

#[test]
fn what_is_not_solved_is_written_all_the_same() {
    let bench = Bench::new();
    bench.write("short.mission.toml", "[horizon]\nduration_s = 60\n");
    let run = bench.run("plan --mission short.mission.toml --integrator euler");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("TOO LARGE"), "{}", run.out);
    assert_ne!(bench.json("pub-000.plan.json")["status"], "solved");
    bench.write(
        "public.scenarios.json",
        include_str!("../../../fixtures/scenarios/public.scenarios.json"),
    );
    let check = bench.run(
        "check --scenarios public.scenarios.json --mission short.mission.toml pub-000.plan.json",
    );
    assert_eq!(check.status, 1, "{}", check.err);
    assert!(check.out.contains("verdict: NOT feasible\n"), "{}", check.out);
}

#[test]
fn every_command_has_help_with_an_example() {
    let bench = Bench::new();
    for command in ["", "plan", "campaign", "check", "draw", "qp-export"] {
        let run = bench.solves(&format!("{command} --help"));
        assert!(run.out.contains("Examples:\n  remora"), "{}", run.out);
        assert!(run.out.contains(&format!("remora {command}")), "{}", run.out);
    }
    assert!(bench.solves("--version").out.starts_with("remora "));
}
