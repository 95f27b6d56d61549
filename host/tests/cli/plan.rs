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
    assert_eq!(plan["warm_start"], "heuristic");
    for text in ["scenario pub-000: solved", "reorientation", "ee_angle", "written: pub-000.plan"] {
        assert!(run.out.contains(text), "{text} in\n{}", run.out);
    }
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    assert_eq!(run.out.matches(" ok ").count(), 11, "{}", run.out);
}

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
        text.lines().filter(|line| !line.contains("time_s")).map(String::from).collect()
    };
    assert_eq!(lines("a.plan.json"), lines("b.plan.json"));
    assert_eq!(bench.read("a.evidence.json"), bench.read("b.evidence.json"));
    let evidence = bench.json("a.evidence.json");
    assert_eq!(evidence["format"], "remora-evidence/1");
    assert_eq!((&evidence["scenario"], &evidence["status"]), (&plan["scenario"], &plan["status"]));
    assert_eq!(evidence["is_verified"], true);
    assert_eq!(evidence["gains"].as_array().map(Vec::len), Some(59));
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
