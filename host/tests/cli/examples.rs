//! Examples of the help texts, each run as printed in a folder with the files that it names.

use super::bench::Bench;
use super::{PROGRAM, quantise};
use std::path::Path;
use std::process::Output;

/// Commands that make what an example names, for examples with these words.
const READY: [(&str, &str); 21] = [
    ("runs/pub-000.plan.json", "remora plan"),
    ("a.scenarios.json", "remora draw --count 8 --seed 1 --out a.scenarios.json"),
    ("light.mission.toml", "cp $FIXTURES/missions/small.mission.toml light.mission.toml"),
    ("--mission mine.mission.toml", "cp $FIXTURES/missions/default.mission.toml mine.mission.toml"),
    ("bus.mission.toml", "cp $FIXTURES/missions/default.mission.toml bus.mission.toml"),
    ("mine.model", "cp $FIXTURES/models/rk4.model mine.model"),
    ("mine.model", "cp $FIXTURES/models/rk4.lineage.toml mine.lineage.toml"),
    ("first.model", "cp $FIXTURES/models/euler.model first.model"),
    ("first.model", "cp $FIXTURES/models/euler.lineage.toml first.lineage.toml"),
    ("--errors mine.errors.toml", "remora mission errors typical > mine.errors.toml"),
    ("s1-007.plan.json", "remora draw --count 8 --seed 1 --out a.json"),
    ("s1-007.plan.json", "remora plan --scenarios a.json --id s1-007 --out s1-007.plan.json"),
    ("a.plan.json --format", "remora plan --out a.plan.json"),
    ("b.chief.toml", "cp $FIXTURES/chiefs/dawn.chief.toml b.chief.toml"),
    ("history/0.jsonl", "remora fly runs/pub-000.plan.json --keep all --out runs/flown"),
    (
        "gather shared",
        "remora campaign --count 4 --seed 9 --integrator euler --part 1/1 --out shared",
    ),
    (
        "gather data/own",
        "remora learn dataset --count 4 --seed 9 --integrator euler --model first.model --part 1/1 --out data/own",
    ),
    ("small.f32.model", "mv in.model small.f32.model"),
    ("arm.urdf", "cp $FIXTURES/urdf/planar.urdf arm.urdf"),
    ("--hold finger", "cp $FIXTURES/urdf/hold4.urdf arm.urdf"),
    ("servicer.urdf", "cp $FIXTURES/urdf/planar.urdf servicer.urdf"),
];

/// Campaigns with plans, and flights of a plan, of which examples take one.
const MORE: [(&str, &str); 3] = [
    ("runs/a/plans", "remora campaign --count 2 --seed 1 --write plans --out runs/a"),
    ("fly runs/a ", "remora campaign --count 2 --seed 1 --write plans --out runs/a"),
    (
        "runs/mine --rerun",
        "remora plan && { remora fly runs/pub-000.plan.json --errors typical --runs 18 --out runs/mine || [ $? = 1 ]; }",
    ),
];

/// Words of examples that take more than seconds.
const SLOW: [&str; 7] = [
    "campaign --count",
    "campaign envelope",
    "dataset --count",
    "--runs 100",
    "--runs 200",
    "--runs 5000",
    "--safety flown",
];

/// An hour: its coarse form, another example, does the same with less.
const TOO_LONG: &str = "remora campaign envelope";

/// Examples of a command and all below it, without their comments.
fn examples(command: &clap::Command) -> Vec<String> {
    let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let lines = help.lines().filter_map(|line| line.strip_prefix("  remora"));
    let own = lines.map(|rest| format!("remora{}", rest.split("  ").next().unwrap_or_default()));
    let own: Vec<String> = own.map(|line| line.trim().into()).collect();
    assert!(!own.is_empty(), "{} has no example", command.get_name());
    own.into_iter().chain(command.get_subcommands().flat_map(examples)).collect()
}

fn shell(bench: &Bench, line: &str) -> Output {
    let programs = Path::new(PROGRAM).parent().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures");
    let mut command = bench.shell(line);
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    command.env("PATH", path).env("FIXTURES", fixtures).output().unwrap()
}

/// Runs the examples that are, or are not, slow.
fn run(is_slow: bool) -> usize {
    let all = examples(&remora_cli::command());
    let is_asked = |line: &&String| SLOW.iter().any(|words| line.contains(words)) == is_slow;
    let asked = all.iter().filter(is_asked).filter(|line| *line != TOO_LONG);
    let mut count = 0;
    for line in asked {
        let bench = quantise::bench();
        for (_, ready) in READY.iter().chain(&MORE).filter(|(words, _)| line.contains(words)) {
            let made = shell(&bench, ready);
            assert!(made.status.success(), "{line}: {ready}\n{made:?}");
        }
        let output = shell(&bench, line);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        // Plans and flights of an example may be of any kind.
        let is_fine = output.status.code().is_some_and(|status| [0, 1, 3].contains(&status));
        assert!(is_fine && !told.contains("error:"), "{line}\n{told}");
        assert!(!output.stdout.is_empty() || line.contains('>'), "{line}");
        count += 1;
    }
    count
}

#[test]
fn examples_of_help_texts_run_as_printed() {
    let count = run(false);
    assert!(count > 35, "{count}");
}

#[test]
#[ignore = "minutes: ci/nightly.sh runs it"]
fn slow_examples_of_help_texts_run_as_printed() {
    let count = run(true);
    assert!(count > 12, "{count}");
}
