//! `remora export --format qp`, and `--qp` of the commands that plan.

use super::bench::{Bench, timeless};
use super::polish::polish;
use remora_core::advanced::qp::QpSolver;
use remora_core::advanced::time::Deadline;
use remora_host::backend::ClarabelQp;
use remora_host::kkt::{Kkt, objective};
use remora_host::qp_file::QpFile;
use std::fs;

const EXPORT: &str =
    "export --format qp --scenarios set.scenarios.json --id s1-001 --integrator euler";
const PLAN: &str = "plan --scenarios set.scenarios.json --id s1-001 --integrator euler";

#[test]
fn either_solver_plans_and_the_embedded_one_is_the_default() {
    let bench = Bench::new();
    for (option, name) in
        [("", "embedded"), ("--qp embedded", "embedded"), ("--qp clarabel", "clarabel")]
    {
        let run = bench.solves(&format!("{PLAN} {option}"));
        let plan = bench.json("runs/s1-001.plan.json");
        assert_eq!(plan["qp"], name);
        assert!(run.out.contains(&format!("euler, {name}\n")), "{}", run.out);
    }
    let campaign = "campaign --scenarios set.scenarios.json --integrator euler --out";
    bench.solves(&format!("{campaign} runs/a"));
    bench.solves(&format!("{campaign} runs/b --qp clarabel"));
    assert_eq!(bench.json("runs/a/summary.json")["qp"], "embedded");
    assert_eq!(bench.json("runs/b/summary.json")["qp"], "clarabel");
    bench.refuses(&format!("{campaign} runs/a --qp clarabel"), "runs/a/journal.jsonl: qp: this");
}

/// The solvers differ in the last digits of flat programs, and the loop may take another path from
/// there: its plans are local optima, settled to 1e-3 an iteration.
#[test]
fn both_solvers_find_the_same_plan() {
    let bench = Bench::new();
    let cost = |solver: &str| {
        bench.solves(&format!("{PLAN} --qp {solver} --out {solver}.plan.json"));
        let plan = bench.json(&format!("{solver}.plan.json"));
        ["stage1", "stage2"].map(|stage| plan[stage]["cost"].as_f64().unwrap())
    };
    for (ours, theirs) in cost("embedded").into_iter().zip(cost("clarabel")) {
        assert!((ours / theirs - 1.0).abs() < 3e-2, "{ours} {theirs}");
    }
}

/// What is written is what was solved: the same program and its solution, for anyone.
#[test]
fn every_subproblem_is_written_with_its_solution() {
    let bench = Bench::new();
    let run = bench.solves(&format!("{EXPORT} --out programs"));
    assert!(run.out.contains("scenario s1-001: solved"), "{}", run.out);
    assert!(run.out.contains("written: programs\n"), "{}", run.out);
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    bench.solves(PLAN);
    let plan = bench.json("runs/s1-001.plan.json");
    let names = bench.names("programs");
    for (stage, iterations) in ["stage1", "stage2"].map(|s| (s, plan[s]["iterations"].as_u64())) {
        let own = |name: &&String| name.starts_with(stage) && !name.contains("correction");
        assert_eq!(names.iter().filter(own).count() as u64, iterations.unwrap(), "{names:?}");
        assert!(names.contains(&format!("{stage}-001.qp.json")), "{names:?}");
    }
    for name in names {
        let file = QpFile::read(&bench.path(&format!("programs/{name}"))).unwrap();
        assert_eq!(file.name(), name);
        assert_eq!((file.scenario.as_str(), file.qp.as_str()), ("s1-001", "embedded"));
        holds::<60, 12, 6, 4>(&file);
    }
}

/// The solution is optimal for the program as read back, and another solver, its point made exact where
/// that is found, finds its objective.
fn holds<const N: usize, const NX: usize, const NU: usize, const NG: usize>(file: &QpFile) {
    let (qp, point) = (file.program::<N, NX, NU, NG>().unwrap(), file.point().unwrap());
    let kkt = Kkt::of(&qp, &point);
    assert!(kkt.worst() <= 1e-8, "{}: {kkt:?}", file.name());
    assert_eq!(objective(&qp, &point), file.solution.point.as_ref().unwrap().objective);
    let mut other = point.clone();
    let outcome = ClarabelQp::with_tolerance(1e-14).solve(&qp, &mut other, &Deadline::never());
    assert!(outcome.status.is_usable(), "{}: {outcome:?}", file.name());
    // Now and then Clarabel stops early, above the optimum by more than its tolerance.
    let exact = polish(&qp, &other).unwrap_or(other);
    let (ours, theirs) = (objective(&qp, &point), objective(&qp, &exact));
    assert!((ours - theirs).abs() <= 1e-8 * (1.0 + theirs.abs()), "{ours} {theirs}");
}

#[test]
fn twice_the_same_is_the_same() {
    let bench = Bench::new();
    bench.solves(&format!("{EXPORT} --out a"));
    bench.solves(&format!("{EXPORT} --out b"));
    let run = bench.solves(&format!("{EXPORT} --json --out b --force"));
    let stages: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    let written: u64 = (0..2).map(|i| stages[i]["programs"].as_u64().unwrap()).sum();
    assert_eq!(written as usize, bench.names("b").len());
    assert_eq!(bench.names("a"), bench.names("b"));
    for name in bench.names("a") {
        assert!(bench.read(&format!("a/{name}")) == bench.read(&format!("b/{name}")), "{name}");
    }
}

#[test]
fn an_earlier_export_is_replaced_and_nothing_else_is_touched() {
    let bench = Bench::new();
    bench.solves(&format!("{EXPORT} --out deep/programs"));
    let names = bench.names("deep/programs");
    // One of a longer plan, and what a kill leaves.
    bench.write("deep/programs/stage2-099-correction-2.qp.json", "{}");
    fs::create_dir(bench.path("deep/programs/.qp-export.77")).unwrap();
    bench.write("deep/programs/.qp-export.77/stage1-001.qp.json", "{");
    bench.solves(&format!("{EXPORT} --out deep/programs"));
    assert_eq!(bench.names("deep/programs"), names);

    bench.write("deep/programs/notes.txt", "mine");
    let out = "--out deep/programs";
    let message = "deep/programs: holds \"notes.txt\", which is no subproblem; see --force";
    bench.refuses(&format!("{EXPORT} {out}"), message);
    bench.solves(&format!("{EXPORT} {out} --force"));
    assert_eq!(bench.read("deep/programs/notes.txt"), "mine");
    assert_eq!(bench.names("deep/programs").len(), names.len() + 1);
}

#[test]
fn two_exports_at_once_do_not_share_a_directory() {
    let bench = Bench::new();
    fs::create_dir(bench.path("programs")).unwrap();
    let other = fs::File::open(bench.path("programs")).unwrap();
    other.lock().unwrap();
    let message = "programs: another export is running in this directory";
    bench.refuses(&format!("{EXPORT} --out programs"), message);
    drop(other);
    bench.solves(&format!("{EXPORT} --out programs"));
}

#[test]
fn what_is_not_solved_is_written_all_the_same() {
    let bench = Bench::new();
    // Not so little that it is refused before anything is solved.
    bench.write("weak.mission.toml", "[servicer]\nbus_torque_limit_n_m = 1e-6\n");
    let run = bench.run(&format!("{EXPORT} --mission weak.mission.toml --out programs"));
    assert_eq!(run.status, 1, "{}{}", run.out, run.err);
    let first = bench.json("programs/stage1-001.qp.json");
    assert_eq!(first["format"], "remora-qp/1");
    assert_eq!(timeless(first)["stage"], 1);
}

#[test]
fn bad_input_is_refused() {
    let bench = Bench::new();
    bench.write("file", "");
    bench.refuses(
        "export --format qp --id s1-000 --out a",
        "built-in scenarios: scenarios: there is no",
    );
    bench.refuses(
        "export --format qp --scenarios set.scenarios.json --id x --out a",
        "set.scenarios.json: scenarios: there is no scenario with id \"x\"",
    );
    bench.refuses("export --format qp --scenarios none.json --out a", "none.json: no such file");
    bench.refuses("export --format qp --mission none.toml --out a", "none.toml: no such file");
    bench.refuses(
        "export --format qp",
        "the following required arguments were not provided: --out <DIR>",
    );
    bench.refuses("export --format qp --qp osqp --out a", "invalid value 'osqp' for '--qp <QP>'");
    bench.refuses("export --format qp --out file", "file: is not a directory");
    bench.refuses(
        "export --format qp --out file/a",
        "file/a: a part of the path is not a directory",
    );
    bench.refuses("export --format qp --out .", ".: holds ");
    // Subproblems are of a scenario that is planned, other files of a plan.
    bench.refuses(
        "export --format qp,oem --out a",
        "PLAN: is missing; --format qp alone needs none",
    );
    bench.refuses("export a.plan.json --format qp --out a", "--format: qp takes no plan");
}
