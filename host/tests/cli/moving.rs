//! Scenarios that begin in the middle of a motion.

use super::bench::Bench;
use serde_json::json;

/// The first public scenario with its arm moving too fast, and less time to go.
fn bench() -> Bench {
    let bench = Bench::new();
    let set = json!({
        "format": "remora-scenarios/1",
        "scenarios": [{
            "id": "later",
            "target": { "attitude": [0.0, 0.0, 0.0, 1.0], "rate": [1e-4, 0.0, -3e-4] },
            "servicer": {
                "position": [0.1, 0.0, 4.5],
                "velocity": [0.0, 1e-3, -2e-3],
                "bus_attitude_body_to_rtn": [1.0, 0.0, 0.0, 0.0],
                "bus_rate_rtn_rad_s": [0.0, 2e-4, 0.0],
                "joint_angle_rad": [-0.4, 0.7, -0.1],
                "joint_rate_rad_s": [0.0, 0.0, 7e-3],
            },
            "duration_s": 900.0,
        }],
    });
    bench.write("later.scenarios.json", &set.to_string());
    bench
}

// Verifies REM-PLN-016.
#[test]
fn a_moving_start_is_planned_checked_and_recorded() {
    let bench = bench();
    let plan = "plan --scenarios later.scenarios.json --id later --integrator rk4:4";
    let run = bench.solves(&format!("{plan} --out a.plan.json"));
    assert!(run.out.contains("led back: joint_rate"), "{}", run.out);
    let plan = bench.json("a.plan.json");
    assert_eq!(plan["inputs"]["scenario"]["joint_rate_rad_s"], json!([0.0, 0.0, 7e-3]));
    assert_eq!(plan["inputs"]["scenario"]["duration_s"], 900.0);
    let dt = plan["grid"]["dt_s"].as_f64().unwrap();
    assert!((dt - 900.0 / 59.0).abs() < 1e-9, "{dt}");
    assert_eq!(bench.json("a.evidence.json")["recovered"], json!(["joint_rate"]));
    assert_eq!(plan["stage2"]["joint_rate_rad_s"][0], json!([0.0, 0.0, 7e-3]));
    bench.solves("check --strict a.plan.json");
    bench.solves("check --strict --scenarios later.scenarios.json a.plan.json");
}

// Verifies REM-PLN-019.
#[test]
fn fewer_nodes_are_planned_checked_and_read_again() {
    let bench = bench();
    let text = bench.read("later.scenarios.json").replace("900.0", "900.0, \"nodes\": 31");
    bench.write("few.scenarios.json", &text);
    bench.write("few.mission.toml", "[horizon]\nnodes = 46\n");
    for qp in ["embedded", "clarabel"] {
        let plan = format!("plan --qp {qp} --integrator rk4:4 --mission few.mission.toml");
        bench
            .solves(&format!("{plan} --scenarios few.scenarios.json --id later --out a.plan.json"));
        let plan = bench.json("a.plan.json");
        assert_eq!((&plan["grid"]["nodes"], &plan["grid"]["dt_s"]), (&json!(31), &json!(30.0)));
        let rows = |stage: &str, key: &str| plan[stage][key].as_array().unwrap().len();
        assert_eq!(rows("stage1", "position_rtn_m"), 31);
        assert_eq!(rows("stage2", "joint_torque_n_m"), 30);
        assert_eq!(rows("target", "rate_rtn_rad_s"), 31);
        bench.solves("check --strict a.plan.json");
    }
    let run = bench.solves("plan --mission few.mission.toml --integrator euler --out b.plan.json");
    assert_eq!(bench.json("b.plan.json")["grid"]["nodes"], 46);
    assert_eq!(bench.json("b.plan.json")["warm_start"], "fallback", "{}", run.out);
    assert!(run.out.contains("nodes, joints, roll or features differ"), "{}", run.out);
    let refused = "few.mission.toml: horizon.nodes: is 46; this command needs 60";
    bench.refuses("learn dataset --count 1 --seed 1 --out d --mission few.mission.toml", refused);
}

#[test]
fn a_campaign_keeps_the_starts() {
    let bench = bench();
    let arguments = "campaign --scenarios later.scenarios.json --integrator rk4:4 --out runs";
    bench.solves(arguments);
    let kept = bench.json("runs/campaign.scenarios.json");
    assert_eq!(kept["format"], "remora-scenarios/1");
    assert_eq!(kept["scenarios"][0]["duration_s"], 900.0);
}

#[test]
fn nonsense_in_a_start_is_named() {
    let bench = bench();
    let refuses = |from: &str, to: &str, message: &str| {
        let text = bench.read("later.scenarios.json");
        assert!(text.contains(from), "{from}");
        bench.write("bad.scenarios.json", &text.replace(from, to));
        let message = format!("bad.scenarios.json: {message}");
        bench.refuses("plan --scenarios bad.scenarios.json --id later --out x.json", &message);
    };
    refuses("900.0", "0.1", "scenarios[0].duration_s: must lie in [1, 1e6] s");
    refuses("900.0", "900.0, \"nodes\": 61", "scenarios[0].nodes: must lie in [4, 60]");
    refuses("900.0", "900.0, \"nodes\": 3", "scenarios[0].nodes: must lie in [4, 60]");
    refuses("scenarios/1", "scenarios/2", "format: unknown format");
    refuses("0.7,", "700.0,", "scenarios[0].servicer.joint_angle_rad: each component");
    refuses("joint_rate_rad_s", "joint_rate", "scenarios[0].servicer.joint_rate: unknown field");
}
