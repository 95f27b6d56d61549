//! The bits of plans: checksums of all public scenarios, both integrators, both modes, from both
//! starts, against `fixtures/golden/public.csv`; and their verdicts, with the default integrator too,
//! against `fixtures/golden/verdicts.csv`.
//!
//! A change that moves bits says so and why, and writes the files again:
//! `REMORA_WRITE_GOLDEN=1 cargo test --test all golden`.

use remora_core::advanced::scp::Status;
use remora_host::formats::{NamedScenario, ScenarioSet};
use remora_host::learned::Learned;
use remora_host::memory::STACK_BYTES;
use remora_host::method::{Integrator, Method, Mode, WarmStart};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/golden/public.csv");
const VERDICTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/golden/verdicts.csv");

/// Ways of planning whose checksums are held: the first ones.
const HELD: usize = 8;

/// All ways of planning, in the order of the columns.
fn methods() -> Vec<(String, Method)> {
    let mut methods = Vec::new();
    for integrator in ["euler", "rk4:4", "rk4"] {
        for mode in [Mode::Optimal, Mode::Feasible] {
            for warm_start in [WarmStart::Heuristic, WarmStart::Model] {
                let name = format!("{integrator} {} {}", mode.name(), warm_start.name());
                let integrator: Integrator = integrator.parse().unwrap();
                methods.push((name, Method { integrator, mode, warm_start, ..Method::default() }));
            }
        }
    }
    methods
}

/// The plans of one scenario.
#[derive(Clone, Default)]
struct Row {
    /// The checksum of each that is held.
    text: String,
    /// The verdict of each.
    verdicts: String,
    /// Stage 2's cost of the first: Euler, optimal, from the heuristic. None where it is not solved
    /// and verified.
    cost: Option<f64>,
}

fn row(planner: &mut Planner, scenario: &NamedScenario) -> Row {
    let mut row = Row { text: scenario.id.clone(), verdicts: scenario.id.clone(), cost: None };
    for (k, (_, method)) in methods().into_iter().enumerate() {
        let learned = method.warm_start == WarmStart::Model;
        let guess = learned.then(|| Learned::built_in(method.integrator)).into();
        let request = PlanRequest { method, guess, ..PlanRequest::default() };
        let report = planner.plan_in_place(&request, scenario);
        if k < HELD {
            write!(row.text, ",{:016x}", report.record.output).unwrap();
        }
        write!(row.verdicts, ",{}", report.verdict()).unwrap();
        if k == 0 && report.status == Status::Solved && report.is_verified() {
            row.cost = Some(report.reorientation.cost);
        }
    }
    row
}

/// The plans of all public scenarios, made once for all tests.
fn rows() -> &'static [Row] {
    static ROWS: OnceLock<Vec<Row>> = OnceLock::new();
    ROWS.get_or_init(plan_all)
}

fn plan_all() -> Vec<Row> {
    let scenarios = ScenarioSet::built_in().unwrap().scenarios;
    let (next, rows) = (AtomicUsize::new(0), Mutex::new(vec![Row::default(); scenarios.len()]));
    std::thread::scope(|scope| {
        let work = || {
            let mut planner = Planner::new();
            while let Some(i) = Some(next.fetch_add(1, Ordering::Relaxed)) {
                let Some(scenario) = scenarios.get(i) else { break };
                let row = row(&mut planner, scenario);
                rows.lock().unwrap()[i] = row;
            }
        };
        for _ in 0..2 {
            let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
            thread.spawn_scoped(scope, work).unwrap();
        }
    });
    rows.into_inner().unwrap()
}

/// Holds a table of `columns` ways of planning to its file.
fn compare(file: &str, columns: usize, text: fn(&Row) -> &str) {
    let names: Vec<String> = methods().into_iter().take(columns).map(|(name, _)| name).collect();
    let mut found = format!("scenario,{}\n", names.join(","));
    rows().iter().for_each(|row| writeln!(found, "{}", text(row)).unwrap());
    if std::env::var_os("REMORA_WRITE_GOLDEN").is_some() {
        std::fs::write(file, &found).unwrap();
    }
    let golden = std::fs::read_to_string(file).unwrap();
    let differing: Vec<_> = golden.lines().zip(found.lines()).filter(|(a, b)| a != b).collect();
    assert!(differing.is_empty(), "{} of 60 scenarios: {:#?}", differing.len(), differing.first());
    assert_eq!(golden.lines().count(), found.lines().count());
}

#[test]
fn plans_have_the_bits_they_had() {
    compare(FILE, HELD, |row| &row.text);
}

/// Pages say that all public scenarios are optimal, whatever the integrator, the start and the mode.
#[test]
fn every_public_scenario_has_the_verdict_of_the_table_whichever_way_it_is_planned() {
    compare(VERDICTS, usize::MAX, |row| &row.verdicts);
}

/// Costs of Stage 2 that another program found, Euler, in the scenarios' order.
fn references() -> Vec<f64> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/oracle/reference_public.json");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let cost = |case: &serde_json::Value| case["rate_limited"]["cost"].as_f64().unwrap();
    json["scenarios"].as_array().unwrap().iter().map(cost).collect()
}

// Verifies REM-PLN-002.
#[test]
fn stage_2_solves_every_public_scenario_near_the_reference() {
    let (rows, references) = (rows(), references());
    assert_eq!((rows.len(), references.len()), (60, 60));
    let unsolved: Vec<&str> =
        rows.iter().filter(|row| row.cost.is_none()).map(|row| &row.text[..7]).collect();
    assert_eq!(unsolved, [""; 0]);
    let ours: f64 = rows.iter().filter_map(|row| row.cost).sum();
    let theirs: f64 = references.iter().sum();
    println!("{ours} against {theirs}");
    assert!(ours <= 1.05 * theirs, "{ours} against {theirs}");
}
