//! `remora export`. What the files hold is held to the plan by others' readers: `ci/export.sh`.

use super::bench::{Bench, Run};
use std::fs;

const EXPORT: &str =
    "export a.plan.json --epoch 2026-11-23T00:00:00 --chief a.chief.toml --out out";
pub const CHIEF: &str = "[elements]\nascending_node_deg = 10.0\nargument_of_perigee_deg = 20.0\n\
                     true_anomaly_deg = 30.0\n";

/// A bench with a plan and a chief.
fn planned(integrator: &str) -> Bench {
    let bench = Bench::new();
    let plan = "plan --scenarios set.scenarios.json --mode feasible --out a.plan.json --integrator";
    bench.solves(&format!("{plan} {integrator}"));
    bench.write("a.chief.toml", CHIEF);
    bench
}

/// Runs at a given time of day.
fn exported(bench: &Bench, arguments: &str) -> Run {
    let mut command = bench.command(arguments);
    let output = command.env("SOURCE_DATE_EPOCH", "1700000000").output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Run {
        status: output.status.code().unwrap(),
        out: text(output.stdout),
        err: text(output.stderr),
    }
}

/// Rows of an ephemeris: time and numbers.
fn rows(bench: &Bench, name: &str) -> Vec<(String, Vec<f64>)> {
    let text = bench.read(name);
    let row = |line: &str| {
        let (time, numbers) = line.split_once(' ')?;
        let words = numbers.split_whitespace();
        let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
        numbers.map(|numbers| (time.to_string(), numbers))
    };
    text.lines().filter(|line| line.starts_with("20")).filter_map(row).collect()
}

// Verifies REM-DOR-007.
#[test]
fn a_plan_becomes_five_files_and_the_same_again() {
    let bench = planned("rk4");
    let all = format!("{EXPORT} --format oem --format aem --format mcap --format oem");
    let run = exported(&bench, &all);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    let names = ["mcap", "servicer.aem", "servicer.oem", "target.aem", "target.oem"];
    let names = names.map(|name| format!("s1-000.{name}"));
    assert_eq!(bench.names("out"), names);
    // A row a second, and one at each node: 1200 s, 60 nodes of which the ends are whole seconds.
    for name in &names[1..] {
        let rows = rows(&bench, &format!("out/{name}"));
        assert_eq!(rows.len(), 1201 + 58, "{name}");
        assert_eq!(rows[0].0, "2026-11-23T00:00:00.000000");
        assert_eq!(rows[1258].0, "2026-11-23T00:20:00.000000");
        assert!(rows.windows(2).all(|pair| pair[0].0 < pair[1].0), "{name}");
    }
    // The spacecraft are metres apart, thousands of kilometres from the Earth's centre.
    let (one, other) =
        (rows(&bench, "out/s1-000.target.oem"), rows(&bench, "out/s1-000.servicer.oem"));
    for ((_, target), (_, servicer)) in one.iter().zip(&other) {
        let distance =
            |of: &dyn Fn(usize) -> f64| (0..3).map(|i| of(i).powi(2)).sum::<f64>().sqrt();
        let apart = distance(&|i| servicer[i] - target[i]);
        assert!((1e-3..1e-2).contains(&apart), "{apart} km");
        assert!((distance(&|i| target[i]) - 6800.0).abs() < 7.0);
    }
    let before = names.each_ref().map(|name| fs::read(bench.path(&format!("out/{name}"))).unwrap());
    let refused = exported(&bench, &all);
    assert_eq!(refused.status, 2);
    assert!(refused.err.contains("out/s1-000.target.oem: exists; --force"), "{}", refused.err);
    assert_eq!(exported(&bench, &format!("{all} --force")).status, 0);
    let after = names.each_ref().map(|name| fs::read(bench.path(&format!("out/{name}"))).unwrap());
    assert!(before == after);
}

#[test]
fn steps_are_the_users_and_eulers_plans_have_nodes_alone() {
    let bench = planned("rk4");
    bench.solves(&format!("{EXPORT} --format aem --step 7.5"));
    assert_eq!(rows(&bench, "out/s1-000.target.aem").len(), 161 + 58);
    for step in ["0", "-1", "1e-9", "nan"] {
        bench.refuses(&format!("{EXPORT} --format oem --step {step}"), "--step: expected a step");
    }
    // A step longer than the plan leaves its nodes.
    for step in ["1200", "1e15", "1e300", "inf"] {
        bench.solves(&format!("{EXPORT} --format aem --step {step} --force"));
        assert_eq!(rows(&bench, "out/s1-000.target.aem").len(), 60, "{step}");
    }
    let bench = planned("euler");
    let run = bench.solves(&format!("{EXPORT} --format oem --json"));
    let told: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(
        (&told["format"], &told["files"][0]["rows"]),
        (&"remora-export/1".into(), &60.into())
    );
    assert_eq!(rows(&bench, "out/s1-000.target.oem").len(), 60);
    assert!(bench.read("out/s1-000.target.oem").contains("COMMENT Rows at the nodes alone"));
    let said = "a.plan.json: integrator: made with Euler's step";
    bench.refuses(&format!("{EXPORT} --format oem --step 1 --force"), said);
}

// Verifies REM-DOR-007.
#[test]
fn what_a_plan_does_not_say_must_be_given() {
    let bench = planned("rk4");
    let bare = "export a.plan.json --out out --format";
    bench.refuses(&format!("{bare} oem"), "--chief: is needed for inertial axes");
    bench.refuses(&format!("{bare} aem --chief a.chief.toml"), "--epoch: is needed");
    bench.refuses(&format!("{bare} mcap --chief a.chief.toml"), "--chief: has no use");
    bench.refuses(&format!("{bare} mcap --epoch tomorrow"), "invalid value 'tomorrow'");
    bench.solves(&format!("{bare} mcap"));
    assert_eq!(&fs::read(bench.path("out/s1-000.mcap")).unwrap()[..8], b"\x89MCAP0\r\n");
    bench.refuses(
        &format!("{bare} oem --epoch 2026-11-23T00:00:00 --chief none"),
        "none: no such file",
    );
    bench.write("b.chief.toml", &CHIEF.replace("ascending_node", "node"));
    let with = "--epoch 2026-11-23T00:00:00 --chief b.chief.toml";
    bench.refuses(&format!("{bare} oem {with}"), "b.chief.toml: elements.node_deg: unknown field");
    bench.write("b.chief.toml", &format!("{CHIEF}semi_major_axis_m = 7.2e6\n"));
    bench.refuses(&format!("{bare} oem {with}"), "b.chief.toml: elements.semi_major_axis_m: its");
    let mut plan = bench.json("a.plan.json");
    plan.as_object_mut().unwrap().remove("inputs").unwrap();
    bench.write("a.plan.json", &plan.to_string());
    bench.refuses(&format!("{bare} mcap --force"), "a.plan.json: missing field `inputs`");
}

#[test]
fn rows_after_a_leap_second_are_on_time() {
    let bench = planned("rk4");
    let at = |epoch: &str| {
        let told = EXPORT.replace("2026-11-23T00:00:00", epoch);
        bench.solves(&format!("{told} --format oem --format aem --format mcap --force"));
        ["servicer.oem", "target.aem"].map(|name| rows(&bench, &format!("out/s1-000.{name}")))
    };
    for found in at("2016-12-31T23:50:00") {
        // 600 s after the epoch, with a row at each whole second, and at nodes between them.
        assert!(found.iter().any(|(time, _)| time == "2016-12-31T23:59:60.000000"));
        assert!(found.iter().any(|(time, _)| time == "2017-01-01T00:00:00.000000"));
        assert_eq!(found[1258].0, "2017-01-01T00:09:59.000000");
    }
    assert_eq!(at("2016-12-31T23:59:60.5")[0][1258].0, "2017-01-01T00:19:59.500000");
    let early = EXPORT.replace("2026-11-23T00:00:00", "1971-12-31T23:59:59");
    let said = "invalid value '1971-12-31T23:59:59' for '--epoch <TIME>'";
    bench.refuses(&format!("{early} --format oem --force"), said);
}

/// A bench with a plan for a mission, and a chief on its orbit.
fn planned_for(mission: &str) -> Bench {
    let bench = Bench::new();
    bench.write("a.mission.toml", mission);
    bench.solves(
        "plan --scenarios set.scenarios.json --mode feasible --mission a.mission.toml \
         --warm-start heuristic --integrator rk4 --out a.plan.json",
    );
    bench.write("a.chief.toml", CHIEF);
    bench
}

#[test]
fn an_ephemeris_names_the_body_that_its_orbit_is_about() {
    const MOON: &str = include_str!("../../../fixtures/missions/moon.mission.toml");
    let bench = planned_for(MOON);
    bench.refuses(
        &format!("{EXPORT} --format oem"),
        "a.plan.json: inputs.mission.orbit.body: is missing",
    );
    bench.solves(&format!("{} --format mcap", EXPORT.replace("--chief a.chief.toml ", "")));
    let bench = planned_for(&format!("{MOON}body = \"Moon\"\nbody_radius_m = 1737400.0\n"));
    bench.solves(&format!("{EXPORT} --format oem --format aem"));
    for name in ["servicer.oem", "target.oem", "servicer.aem", "target.aem"] {
        let text = bench.read(&format!("out/s1-000.{name}"));
        assert!(text.contains("\nCENTER_NAME = MOON\n"), "{name}");
    }
}

#[test]
fn a_chief_below_the_surface_or_too_far_from_a_circle_is_refused() {
    let bench = planned("rk4");
    let underground = include_str!("../../../fixtures/chiefs/underground.chief.toml");
    bench.write("a.chief.toml", underground);
    let said = "a.chief.toml: elements.eccentricity: the perigee is 2040000 m from the body's";
    bench.refuses(&format!("{EXPORT} --format oem"), said);
    let bench = planned_for("[orbit]\nsemi_major_axis_m = 2.4e7\n");
    bench.write("a.chief.toml", &format!("{CHIEF}eccentricity = 0.6\n"));
    let said = "a.chief.toml: elements.eccentricity: with an eccentricity of 0.6000 the plan";
    bench.refuses(&format!("{EXPORT} --format oem"), said);
}
