//! The bits of plans: checksums of all public scenarios, both integrators, both modes, from both
//! starts, against `fixtures/golden/public.csv`.
//!
//! A change that moves bits says so and why, and writes the file again:
//! `REMORA_WRITE_GOLDEN=1 cargo test --test golden`.

use remora_core::advanced::model::Mission;
use remora_host::formats::{NamedScenario, ScenarioSet};
use remora_host::learned::Learned;
use remora_host::memory::STACK_BYTES;
use remora_host::method::{Integrator, Method, Mode, WarmStart};
use remora_host::planning::Planner;
use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/golden/public.csv");

/// All ways of planning, in the order of the columns.
fn methods() -> Vec<(String, Method)> {
    let mut methods = Vec::new();
    for integrator in ["euler", "rk4:4"] {
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

/// The row of one scenario: the checksum of each of its plans.
fn row(planner: &mut Planner, scenario: &NamedScenario) -> String {
    let mut row = scenario.id.clone();
    for (_, method) in methods() {
        let learned = method.warm_start == WarmStart::Model;
        let model = learned.then(|| Learned::built_in(method.integrator));
        let report = planner.plan_in_place(&Mission::default(), scenario, &method, model.as_ref());
        write!(row, ",{:016x}", report.record.output).unwrap();
    }
    row
}

#[test]
fn plans_have_the_bits_they_had() {
    let scenarios = ScenarioSet::built_in().unwrap().scenarios;
    let (next, rows) = (AtomicUsize::new(0), Mutex::new(vec![String::new(); scenarios.len()]));
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
    let names: Vec<String> = methods().into_iter().map(|(name, _)| name).collect();
    let mut found = format!("scenario,{}\n", names.join(","));
    rows.into_inner().unwrap().iter().for_each(|row| writeln!(found, "{row}").unwrap());
    if std::env::var_os("REMORA_WRITE_GOLDEN").is_some() {
        std::fs::write(FILE, &found).unwrap();
    }
    let golden = std::fs::read_to_string(FILE).unwrap();
    let differing: Vec<_> = golden.lines().zip(found.lines()).filter(|(a, b)| a != b).collect();
    assert!(differing.is_empty(), "{} of 60 scenarios: {:#?}", differing.len(), differing.first());
    assert_eq!(golden.lines().count(), found.lines().count());
}
