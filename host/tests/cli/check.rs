//! `remora check`

use super::bench::{Bench, SLOW};
use serde_json::{Value, json};

const CHECK: &str = "check";

fn planned(integrator: &str) -> Bench {
    let bench = Bench::new();
    let plan = "plan --scenarios set.scenarios.json --id s1-001 --out a.plan.json --integrator";
    bench.solves(&format!("{plan} {integrator}"));
    bench
}

fn tampered(bench: &Bench, change: impl FnOnce(&mut Value)) {
    let mut plan = bench.json("a.plan.json");
    change(&mut plan);
    bench.write("b.plan.json", &plan.to_string());
}

#[test]
fn what_was_planned_can_be_flown_and_says_so() {
    for integrator in ["euler", "rk4:4"] {
        let bench = planned(integrator);
        let run = bench.solves(&format!("{CHECK} --strict a.plan.json"));
        assert!(run.out.contains("verdict: verified and locally optimal\n"), "{}", run.out);
        assert!(run.out.contains(integrator), "{}", run.out);
    }
}

#[test]
fn the_integrator_is_the_plans_unless_another_is_asked_for() {
    let bench = planned("euler");
    let run = bench.run(&format!("{CHECK} --integrator rk4 a.plan.json"));
    assert_eq!(run.status, 1, "an Euler plan does not fly:\n{}", run.out);
    assert!(run.out.contains("rk4"), "{}", run.out);
    assert!(!run.out.contains("disagrees"), "{}", run.out);
}

// Verifies REM-PLN-003.
#[test]
fn one_number_changed_is_one_plan_refused() {
    let bench = planned("euler");
    for (path, by) in [
        ("/stage1/position_rtn_m/20/0", 1e-3),
        ("/stage1/velocity_rtn_m_s/59/2", 1e-4),
        ("/stage1/force_rtn_n/11/1", 1e-2),
        ("/stage2/joint_angle_rad/30/1", 1e-3),
        ("/stage2/rate_rtn_rad_s/59/0", 1e-5),
        ("/stage2/joint_rate_rad_s/57/2", 1e-5),
        ("/stage2/bus_torque_body_n_m/5/2", 1e-3),
        ("/stage2/joint_torque_n_m/58/0", 1.0),
    ] {
        tampered(&bench, |plan| {
            let number = plan.pointer_mut(path).unwrap();
            *number = json!(number.as_f64().unwrap() + by);
        });
        let run = bench.run(&format!("{CHECK} a.plan.json b.plan.json"));
        assert_eq!(run.status, 1, "{path}\n{}{}", run.out, run.err);
        let says = "disagrees: b.plan.json: status: says solved";
        assert!(run.out.contains(says), "{path}\n{}", run.out);
        let counts =
            "2 plans: 1 optimal, 0 verified but not converged, 1 not flyable; 1 in agreement";
        assert!(run.out.contains(counts), "{path}\n{}", run.out);
        let run = bench.run(&format!("{CHECK} b.plan.json"));
        assert!(run.out.contains("TOO LARGE"), "{path}\n{}", run.out);
    }
}

#[test]
fn what_a_plan_says_of_itself_is_recomputed() {
    let bench = planned("euler");
    let changes: [(&str, Value); 9] = [
        ("/stage1/cost", json!(1e-9)),
        ("/stage2/cost", json!(0.01)),
        ("/residuals/pointing", json!(5e-5)),
        ("/target/rate_rtn_rad_s/3/1", json!(2e-3)),
        ("/target/attitude_body_to_rtn/59", json!([1.0, 0.0, 0.0, 0.0])),
        ("/stage2/status", json!("deadline")),
        ("/status", json!("iteration_limit")),
        ("/verdict", json!("verified_not_converged")),
        ("/clearances/bus/distance_m", json!(77.5)),
    ];
    for (path, value) in changes {
        tampered(&bench, |plan| *plan.pointer_mut(path).unwrap() = value);
        let run = bench.run(&format!("{CHECK} b.plan.json"));
        // What a plan's stages say is believed: who did not converge is verified and no more.
        let (status, verdict) = match path {
            "/status" => (3, "verified but not converged"),
            _ => (0, "verified and locally optimal"),
        };
        assert_eq!(run.status, status, "{path}\n{}", run.out);
        let verdict = format!("verdict: {verdict}, but not what it says");
        assert!(run.out.contains(&verdict), "{path}\n{}", run.out);
        let run = bench.run(&format!("{CHECK} --strict b.plan.json"));
        assert_eq!(run.status, 1, "{path}\n{}", run.out);
    }
}

/// A plan is called optimal if the check finds it so, not because its file says so.
#[test]
fn a_plan_that_was_edited_to_be_optimal_is_not_called_so() {
    let bench = planned("euler --mode feasible --warm-start heuristic");
    let run = bench.solves(&format!("{CHECK} a.plan.json"));
    assert!(run.out.contains("\nno optimum was asked for: feasible mode\n"), "{}", run.out);
    tampered(&bench, |plan| plan["mode"] = json!("optimal"));
    let run = bench.run(&format!("{CHECK} b.plan.json"));
    assert_eq!(run.status, 3, "{}", run.out);
    for text in [
        "\nverified: yes\nlocally optimal to: ",
        "\nthe file says: solved\n",
        "\ndisagrees: status: says solved, is locally optimal to ",
        "\ndisagrees: verdict: says optimal, is verified but not converged\n",
        "\nverdict: verified but not converged, but not what it says\n",
    ] {
        assert!(run.out.contains(text), "{text:?} in\n{}", run.out);
    }
    assert_eq!(bench.run(&format!("{CHECK} --strict b.plan.json")).status, 1);

    // Verified and not converged after all iterations: the file's claim alone makes it optimal.
    bench.takes_too_many_iterations();
    let plan = format!("plan {SLOW} --id s1-000 --force --out a.plan.json");
    assert_eq!(bench.run(&plan).status, 3);
    let run = bench.run(&format!("{CHECK} a.plan.json"));
    assert_eq!(run.status, 3, "{}", run.out);
    tampered(&bench, |plan| {
        for path in ["/status", "/stage2/status"] {
            *plan.pointer_mut(path).unwrap() = json!("solved");
        }
        plan["verdict"] = json!("optimal");
    });
    let run = bench.run(&format!("{CHECK} b.plan.json"));
    for text in ["\nlocally optimal to: ", "\nthe file says: solved\n", "\nverdict: verified"] {
        assert!(run.out.contains(text), "{text:?} in\n{}", run.out);
    }
    assert!(!run.out.contains("verdict: optimal"), "{}", run.out);
}

/// Plans that the planner calls optimal pass the check, from every start, with a margin.
#[test]
fn what_was_planned_is_locally_optimal() {
    let bench = Bench::new();
    for method in ["--integrator euler", "--integrator rk4:4", "--warm-start heuristic"] {
        let plan = format!("campaign --scenarios set.scenarios.json {method} --write plans");
        let out = format!("runs/{}", method.replace(' ', ""));
        bench.solves(&format!("{plan} --out {out}"));
        let plans = |id: &str| format!("{out}/plans/{id}.plan.json");
        let plans = super::bench::IDS.map(plans).join(" ");
        let run = bench.solves(&format!("{CHECK} --strict --json {plans}"));
        let found: Value = serde_json::from_str(&run.out).unwrap();
        for plan in found["plans"].as_array().unwrap() {
            let optimality = &plan["optimality"];
            assert_eq!(optimality["is_converged"], true, "{plan}");
            assert!(optimality["stage1"].as_f64().unwrap() < 0.01, "{optimality}");
            assert!(optimality["stage2"].as_f64().unwrap() < 0.01, "{optimality}");
        }
    }
}

/// A plan holds what it was made for, and is not held to anything else.
#[test]
fn another_scenario_or_mission_is_named() {
    let bench = planned("euler");
    bench.solves("check --scenarios set.scenarios.json a.plan.json");
    let mut set = bench.json("set.scenarios.json");
    set["scenarios"][1]["servicer"]["position"][0] = json!(0.25);
    bench.write("moved.scenarios.json", &set.to_string());
    set["scenarios"][1]["id"] = json!("other");
    bench.write("other.scenarios.json", &set.to_string());
    bench.refuses(
        "check --scenarios other.scenarios.json a.plan.json",
        "a.plan.json: scenario: \"s1-001\" is not in the scenario set other.scenarios.json",
    );
    bench.refuses(
        "check --scenarios moved.scenarios.json a.plan.json",
        "a.plan.json: inputs.scenario_checksum: the plan was made for a scenario of checksum ",
    );
    bench.write("same.mission.toml", "[servicer]\nbus_mass_kg = 500\n");
    bench.solves("check --mission same.mission.toml a.plan.json");
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    bench.refuses(
        "check --mission heavy.mission.toml a.plan.json",
        "a.plan.json: inputs.mission_checksum: the plan was made for a mission of checksum ",
    );
    tampered(&bench, |plan| plan["inputs"]["mission"]["servicer"]["bus_mass_kg"] = json!(501));
    bench.refuses("check b.plan.json", "b.plan.json: inputs.mission_checksum: says ");
}

/// A mission of its own, with degrees and a derived radius, goes with the plan.
#[test]
fn a_plan_holds_its_mission() {
    let bench = Bench::new();
    let mission =
        "[approach]\nfield_of_view_half_angle_deg = 21.3\n[servicer]\nbus_mass_kg = 450\n";
    bench.write("own.mission.toml", mission);
    let plan = "plan --integrator euler --mission own.mission.toml --out a.plan.json";
    bench.solves(plan);
    bench.solves("check --strict a.plan.json");
    bench.solves("check --strict --mission own.mission.toml a.plan.json");
    let plan = bench.json("a.plan.json");
    let mission = &plan["inputs"]["mission"];
    assert_eq!(mission["approach"]["field_of_view_half_angle_deg"], 21.3);
    assert_eq!(mission["servicer"]["bus_mass_kg"], 450.0);
    assert!(mission["approach"]["keep_out_far_m"].is_f64(), "{}", mission["approach"]);
    assert_eq!(plan["inputs"]["in_force"]["clearance"], false);
    assert_eq!((&plan["grid"]["nodes"], &plan["grid"]["preset_node"]), (&json!(60), &json!(55)));
    assert!(plan["program"]["version"].is_string() && plan["frames"]["rtn"].is_string());
}

#[test]
fn either_sign_of_a_quaternion_is_the_same_plan() {
    let bench = planned("euler");
    tampered(&bench, |plan| {
        for path in ["/stage2/attitude_body_to_rtn/30", "/target/attitude_body_to_rtn/30"] {
            for number in plan.pointer_mut(path).unwrap().as_array_mut().unwrap() {
                *number = json!(-number.as_f64().unwrap());
            }
        }
    });
    let run = bench.solves(&format!("{CHECK} --strict b.plan.json"));
    assert!(run.out.contains("verdict: verified and locally optimal\n"), "{}", run.out);
}

#[test]
fn bad_plans_are_refused_by_field() {
    let bench = planned("euler");
    let refuses = |change: fn(&mut Value), message: &str| {
        tampered(&bench, change);
        bench.refuses(&format!("{CHECK} a.plan.json b.plan.json"), message);
    };
    refuses(|p| p["format"] = json!("remora-plan/9"), "b.plan.json: format: unknown format");
    refuses(|p| p["scenario"] = json!("a/b"), "b.plan.json: scenario: \"a/b\": an id is");
    refuses(
        |p| drop(p.as_object_mut().unwrap().remove("grid")),
        "b.plan.json: missing field `grid`",
    );
    refuses(|p| p["format"] = json!("remora-plan/1"), "b.plan.json: format: unknown format");
    refuses(|p| p["colour"] = json!("red"), "b.plan.json: colour: unknown field");
    refuses(|p| p["integrator"] = json!("rk4:2"), "b.plan.json: integrator: rk4 needs at least 4");
    refuses(
        |p| p["stage2"]["rate_rtn_rad_s"][3][1] = Value::Null,
        "b.plan.json: stage2.rate_rtn_rad_s[3][1]: invalid type: null",
    );
    refuses(
        |p| p["stage2"]["attitude_body_to_rtn"][3] = json!([0, 0, 0, 1.1]),
        "b.plan.json: stage2.attitude_body_to_rtn[3]: not a unit quaternion",
    );
    refuses(
        |p| drop(p["stage1"]["force_rtn_n"].as_array_mut().unwrap().pop()),
        "b.plan.json: stage1.force_rtn_n: has 58 rows; the horizon has 59",
    );
    refuses(
        |p| drop(p["residuals"].as_object_mut().unwrap().remove("joint")),
        "b.plan.json: residuals: missing field `joint`",
    );
    bench.refuses(&format!("{CHECK} none.plan.json"), "none.plan.json: no such file");
    bench.refuses("check", "the following required arguments");
    // Cut where a number has ended: the head's times, which are before it, have lengths by chance.
    let text = bench.read("a.plan.json");
    let stage = text.rfind("\"stage1\": {").unwrap();
    let within = stage + text[stage..].find("position_rtn_m").unwrap() + 500;
    let end = text[..within].rfind(',').unwrap();
    bench.write("b.plan.json", &text[..=end]);
    bench.refuses(
        &format!("{CHECK} b.plan.json"),
        "b.plan.json: stage1.position_rtn_m: EOF while parsing",
    );
}
