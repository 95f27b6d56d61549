//! Mistakes of new users: a mistyped word, and a file of another kind.

use super::bench::Bench;
use std::path::Path;

#[test]
fn a_mistyped_word_is_answered_with_the_one_that_was_meant() {
    let bench = Bench::new();
    for (line, meant) in [
        ("paln", "'plan'"),
        ("chekc a.plan.json", "'check'"),
        ("plan --misison a.mission.toml", "'--mission'"),
        ("plan --warm-start heuristik", "'heuristic'"),
        ("fly --controller trak --out out", "'track'"),
        ("campaign gathr a", "'gather'"),
        ("mission shwo", "'show'"),
    ] {
        let run = bench.run(line);
        assert_eq!(run.status, 2, "{line}\n{}", run.err);
        assert_eq!(run.err.lines().count(), 1, "{line}\n{}", run.err);
        assert!(run.err.contains("; tip: ") && run.err.contains(meant), "{line}\n{}", run.err);
        assert!(!run.err.contains("Usage"), "{line}\n{}", run.err);
    }
}

/// Each command takes the built-in names in the place of `{}`.
fn take_typical_and_none(bench: &Bench, lines: &[&str]) {
    bench.solves("plan --id pub-000 --out a.plan.json");
    for errors in ["typical", "none"] {
        for line in lines {
            let line = line.replace("{}", errors);
            let run = bench.run(&line);
            assert!(run.status != 2, "{line}\n{}", run.err);
        }
    }
}

#[test]
#[ignore = "nightly: ways out of 120 nodes flown, a minute"]
fn typical_and_none_are_taken_where_ways_out_are_flown() {
    take_typical_and_none(&Bench::new(), &["fly a.plan.json --safety flown --errors {}"]);
}

#[test]
fn typical_and_none_are_taken_wherever_an_error_file_is() {
    let bench = Bench::new();
    bench.solves("campaign --count 1 --seed 1 --integrator rk4 --write plans --out runs/planned");
    let lines = [
        "fly a.plan.json --out runs/fly-{} --errors {}",
        "fly runs/planned --out runs/campaign-{} --errors {}",
    ];
    take_typical_and_none(&bench, &lines);
    let text =
        "error: typcal: no such file or directory; the built-in names are none and typical\n";
    assert_eq!(bench.run("fly a.plan.json --out runs/b --errors typcal").err, text);
}

/// Each way to name a file, with the file in the place of `{}`, and what it takes.
const TAKES: [(&str, &str, &str); 22] = [
    ("check {}", "check", "a plan"),
    ("view {}", "view", "a plan"),
    ("fly {} --out out", "fly", "a plan"),
    ("fly {} --safety planned", "fly", "a plan"),
    (
        "export {} --epoch 2026-11-23T00:00:00 --chief state.chief.toml --format oem --out out",
        "export",
        "a plan",
    ),
    ("check --scenarios {} a.plan.json", "check --scenarios", "a scenario set"),
    ("plan --scenarios {}", "plan --scenarios", "a scenario set"),
    ("campaign --scenarios={} --out out", "campaign --scenarios", "a scenario set"),
    ("mission show {}", "mission show", "a mission file"),
    ("plan --mission {}", "plan --mission", "a mission file"),
    ("check --mission {} a.plan.json", "check --mission", "a mission file"),
    ("draw --mission {} --count 1 --seed 1 --out b.json", "draw --mission", "a mission file"),
    ("campaign envelope --mission {} --out out", "campaign envelope --mission", "a mission file"),
    ("mission import planar.urdf --bus {}", "mission import --bus", "a mission file"),
    ("fly a.plan.json --errors {} --out out", "fly --errors", "an errors file"),
    ("fly a.plan.json --safety flown --errors {}", "fly --errors", "an errors file"),
    ("fly planned --out out --errors {}", "fly --errors", "an errors file"),
    (
        "export a.plan.json --epoch 2026-11-23T00:00:00 --out out --format oem --chief {}",
        "export --chief",
        "a chief file",
    ),
    ("plan --model {}", "plan --model", "a model"),
    ("learn quantise {} b.model", "learn quantise", "a model"),
    ("mission import {}", "mission import", "a URDF file"),
    ("view a.plan.json --flight {} --out b.html", "view --flight", "the history of a flight"),
];

/// A file of each kind, and the name of the kind.
fn kinds(bench: &Bench) -> Vec<(&'static str, &'static str)> {
    bench.solves("plan --id pub-000 --out a.plan.json");
    bench.solves("plan --id pub-000 --out a.plan.postcard");
    bench.solves("view a.plan.json --out a.html");
    bench.solves("fly a.plan.json --keep all --out flown");
    bench.solves("campaign --count 1 --seed 1 --integrator rk4 --write plans --out planned");
    bench.write("a.errors.toml", &bench.solves("mission errors typical").out);
    bench.write("a.vehicle.json", &bench.solves("mission show --json").out);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures");
    for (name, from) in [
        ("default.mission.toml", "missions/default.mission.toml"),
        ("small.mission.toml", "missions/small.mission.toml"),
        ("dawn.chief.toml", "chiefs/dawn.chief.toml"),
        ("state.chief.toml", "chiefs/state.chief.toml"),
        ("rk4.model", "models/rk4.model"),
        ("rk4.toml", "models/rk4.toml"),
        ("rk4.lineage.toml", "models/rk4.lineage.toml"),
        ("planar.urdf", "urdf/planar.urdf"),
        ("public.csv", "golden/public.csv"),
    ] {
        std::fs::copy(fixtures.join(from), bench.path(name)).unwrap();
    }
    vec![
        ("a.plan.json", "a plan"),
        ("a.plan.postcard", "a plan"),
        ("set.scenarios.json", "a scenario set"),
        ("default.mission.toml", "a mission file"),
        ("small.mission.toml", "a mission file"),
        ("a.errors.toml", "an errors file"),
        ("dawn.chief.toml", "a chief file"),
        ("rk4.model", "a model"),
        ("rk4.toml", "a training's configuration"),
        ("rk4.lineage.toml", "a model's lineage"),
        ("planar.urdf", "a URDF file"),
        ("flown/flights.parquet", "a Parquet table"),
        ("flown/history/0.jsonl", "the history of a flight"),
        ("flown/flights.json", "the settings of a folder of flights"),
        ("a.html", "a page"),
        ("a.vehicle.json", "the output of mission show"),
        ("public.csv", "a CSV table"),
    ]
}

#[test]
fn a_file_of_another_kind_is_told_with_its_kind_and_what_is_taken() {
    let bench = Bench::new();
    let kinds = kinds(&bench);
    for (line, what, takes) in TAKES {
        for (file, kind) in kinds.iter().filter(|(_, kind)| *kind != takes) {
            let line = line.replace("{}", file);
            bench.refuses(&line, &format!("{file}: this is {kind}; {what} takes {takes}\n"));
        }
    }
}
