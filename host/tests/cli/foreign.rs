//! Plans that another program made: the independent reference solutions of `fixtures/oracle`.

use super::bench::Bench;
use remora_core::advanced::model::TargetState;
use remora_host::formats::{Mission, PlanGrid, PlanInputs, ScenarioSet};
use remora_host::method::Integrator;
use serde_json::{Value, json};

const REFERENCE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/oracle/reference_public.json");
const SCENARIOS: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/scenarios/public.scenarios.json");

/// Columns of an array of rows.
fn columns(rows: &Value, from: usize, to: usize) -> Value {
    let row = |row: &Value| Value::from(row.as_array().unwrap()[from..to].to_vec());
    rows.as_array().unwrap().iter().map(row).collect()
}

/// The tumble at the nodes: attitudes and rates.
fn tumble(set: &ScenarioSet, id: &str) -> (Value, Value) {
    let (mission, scenario) = (Mission::default(), set.get(id).unwrap().scenario());
    let mut nodes = [TargetState::ZERO; 60];
    let dt = mission.approach.duration_s / 59.0;
    let (attitude, rate) = (&scenario.target_attitude, &scenario.target_rate);
    let (euler, n) = (Integrator::Euler, mission.mean_motion());
    mission.target.tumble(euler, n, attitude, rate, dt, &mut nodes);
    let attitudes = nodes.iter().map(|x| json!(x.attitude.as_slice())).collect();
    let rates = nodes.iter().map(|x| json!(x.rate.as_slice())).collect();
    (attitudes, rates)
}

/// A plan file of a reference solution, which claims the reference's own costs.
fn plan(set: &ScenarioSet, reference: &Value) -> Value {
    let id = reference["id"].as_str().unwrap();
    let (one, two) = (&reference["stage1"], &reference["rate_limited"]);
    let (states, controls) = (&two["states"], &two["controls"]);
    let (attitude, rate) = tumble(set, id);
    let (mission, scenario) = (Mission::default(), set.get(id).unwrap());
    json!({
        "format": "remora-plan/2", "scenario": id, "status": "solved", "mode": "optimal",
        "warm_start": "section 9 guess", "qp": "ipopt", "integrator": "euler",
        "inputs": PlanInputs::new(&mission, scenario, Integrator::Euler),
        "grid": PlanGrid::of(&mission, &scenario.scenario()),
        "stage1": {
            "status": "solved", "iterations": one["iters"], "cost": one["cost"], "time_s": 0,
            "position_rtn_m": columns(&one["states"], 0, 3),
            "velocity_rtn_m_s": columns(&one["states"], 3, 6),
            "force_rtn_n": one["f"],
        },
        "stage2": {
            "status": "solved", "iterations": two["iters"], "cost": two["cost"], "time_s": 0,
            "inference_s": 0,
            "attitude_body_to_rtn": columns(states, 0, 4),
            "joint_angle_rad": columns(states, 4, 7),
            "rate_rtn_rad_s": columns(states, 7, 10),
            "joint_rate_rad_s": columns(states, 10, 13),
            "bus_torque_body_n_m": columns(controls, 0, 3),
            "joint_torque_n_m": columns(controls, 3, 6),
        },
        "target": { "attitude_body_to_rtn": attitude, "rate_rtn_rad_s": rate },
        "residuals": {
            "dynamics1": 0, "keep_out": 0, "dynamics2": 0, "control": 0, "joint": 0,
            "joint_rate": 0, "pointing": 0, "preset": 0, "terminal_rate": 0,
            "ee_position": 0, "ee_angle": 0,
        },
    })
}

/// The verifier finds that the reference solutions can be flown and their costs as large as they say.
// Verifies REM-PLN-004.
#[test]
fn the_reference_solutions_are_verified() {
    let bench = Bench::new();
    let text = std::fs::read_to_string(REFERENCE).unwrap();
    let reference: Value = serde_json::from_str(&text).unwrap();
    let set = ScenarioSet::built_in().unwrap();
    let whole: Vec<&Value> = reference["scenarios"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|scenario| scenario["rate_limited"]["states"].is_array())
        .collect();
    assert_eq!(whole.len(), 5);
    let mut check = format!("check --strict --scenarios {SCENARIOS}");
    for scenario in whole {
        let name = format!("{}.plan.json", scenario["id"].as_str().unwrap());
        bench.write(&name, &plan(&set, scenario).to_string());
        check.push(' ');
        check.push_str(&name);
    }
    let run = bench.solves(&check);
    assert!(
        run.out.contains(
            "5 plans: 5 optimal, 0 verified but not converged, 0 not flyable; 5 in agreement"
        ),
        "{}",
        run.out
    );
}
