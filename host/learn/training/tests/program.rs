//! The program itself, run as a user runs it.

#[allow(dead_code, reason = "the tests of the program `remora` use all of it")]
#[path = "../../../tests/cli/bench.rs"]
mod bench;

use bench::Bench;
use remora_host::draw;
use remora_host::formats::read_mission;
use remora_host::learned::Learned;
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use remora_learn::reproduce::Card;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_remora-train");

/// Hours so few that only the least is done.
const LEARN: &str = "mission mine.mission.toml --hours 0.000001 --integrator euler --seed 1000";

fn bench() -> Bench {
    let bench = Bench::empty();
    bench.write("mine.mission.toml", "[servicer]\nbus_mass_kg = 450\n");
    bench
}

/// Killed after the first shard of the dataset, it goes on; a model that is lost is made again of what
/// is there.
#[test]
fn a_killed_one_goes_on_to_a_model_that_plans() {
    let bench = bench();
    let line = format!("{LEARN} --out mine.model");
    let mut child = bench.command(&line).stderr(Stdio::null()).spawn().unwrap();
    let second = bench.path("mine.model.work/dataset/shard-00001.bin");
    while !second.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let refuses = |line: &str, field: &str| {
        let message = format!("mine.model.work/learn.jsonl: {field}: ");
        bench.refuses(&format!("{line} --out mine.model"), &message);
    };
    refuses(&LEARN.replace("0.000001", "1"), "hours");
    refuses(&LEARN.replace("1000", "1001"), "seed");
    refuses(&LEARN.replace("euler", "rk4"), "integrator");
    refuses(&LEARN.replace("mine.mission.toml", ""), "mission");
    refuses(&format!("{LEARN} --anew"), "anew");

    let run = bench.solves(&line);
    assert!(run.err.contains("of 300 are there already"), "{}", run.err);
    assert!(run.out.contains("300 of 300 scenarios solved to learn from, 50 steps"), "{}", run.out);
    assert!(run.out.contains("Test on 20 other scenarios (seed 1001)"), "{}", run.out);
    assert!(run.out.ends_with("written: mine.model\nwritten: mine.lineage.toml\n"), "{}", run.out);
    // It went on from the built-in model, whose own lineage comes first.
    let lineage = bench.read("mine.lineage.toml");
    let built_in = include_str!("../../../../fixtures/models/euler.lineage.toml");
    let (_, before) = built_in.split_once("[[training]]").unwrap();
    for part in [before.trim(), "name = \"mine\"", "learnt_from = \"s1000:300\""] {
        assert!(lineage.contains(part), "{lineage}");
    }

    let model = fs::read(bench.path("mine.model")).unwrap();
    fs::remove_file(bench.path("mine.model")).unwrap();
    let run = bench.solves(&format!("{line} --json"));
    assert!(fs::read(bench.path("mine.model")).unwrap() == model);
    let learnt: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!((&learnt["scenarios"], &learnt["steps"]), (&300.into(), &50.into()));
    assert_eq!(learnt["test"]["model"]["success"]["of"], 20);
    assert!(learnt["test"]["judgement"].is_string(), "{learnt}");

    // Its features would be another mission's.
    let config = "mine.model.work/training/mine/config.toml";
    bench.refuses(
        &format!("network --config {config} --out again"),
        "mine.model.work/dataset/dataset.json: mission: was made for another mission; --mission",
    );
    serves(&bench.path("mine.model"), &bench.path("mine.mission.toml"));
}

/// A plan of the mission starts from the model, unless that is worse; scenarios of seed 1000, which it has
/// learnt from, are not for its evaluation.
fn serves(model: &Path, mission: &Path) {
    let mission = read_mission(Some(mission)).unwrap();
    let integrator = Integrator::Euler;
    let scenario = draw::first(&mission, integrator).unwrap();
    let method = Method { integrator, ..Method::default() };
    let guess = Learned::usable(model).unwrap().into();
    let request = PlanRequest { mission, method, guess, ..Default::default() };
    let plan = || Planner::new().plan(&request, &scenario);
    let planned = on_large_stack(plan).unwrap();
    let used = &planned.file.warm_start;
    assert!(used == "model" || used == "fallback", "{used}");
    let known = draw::draw(2, 1000, &mission).unwrap().scenarios;
    assert!(Card::read(model).unwrap().lineage.learnt(&known).is_some());
}

#[test]
fn what_cannot_be_learnt_is_refused() {
    let bench = bench();
    let refuses = |line: &str, message: &str| bench.refuses(&format!("mission {line}"), message);
    refuses("--out a.model", "the following required arguments were not provided: --hours <H>");
    for hours in ["0", "-1", "nan", "inf", "soon"] {
        let message = format!("invalid value '{hours}' for '--hours <H>'");
        refuses(&format!("--hours {hours} --out a.model"), &message);
    }
    bench.write("few.mission.toml", "[horizon]\nnodes = 40\n");
    let message = "few.mission.toml: horizon.nodes: is 40; this command needs 60";
    refuses("few.mission.toml --hours 1 --out a.model", message);
    bench.write("roll.mission.toml", "[roll]\nend_effector = [1, 0, 0]\nport = [0, 1, 0]\n");
    refuses("roll.mission.toml --hours 1 --out a.model", "MISSION: fixes the end effector's roll");
    refuses("none.mission.toml --hours 1 --out a.model", "none.mission.toml: no such file");
    refuses("--hours 1 --out none/a.model", "none/a.model: no such file or directory");
    bench.write("a.model", "somebody's");
    refuses("--hours 1 --out a.model", "a.model: exists; --force replaces it");
    bench.refuses("", "'remora-train' requires a subcommand but one was not provided");
    bench.refuses("network --config none.toml", "none.toml: no such file");
}
