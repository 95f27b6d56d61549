//! Quaternions and unit vectors as people write them: with four or five decimals.

use super::bench::Bench;
use serde_json::{Value, json};
use std::path::Path;

/// The numbers of an array, times a factor.
fn scaled(array: &Value, by: f64) -> Value {
    array.as_array().unwrap().iter().map(|x| x.as_f64().unwrap() * by).collect::<Vec<_>>().into()
}

/// The built-in mission with every direction that there is a key for; with `capture` by joints or pose.
fn mission(capture: &str) -> Value {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/missions");
    let text = std::fs::read_to_string(fixtures.join("default.mission.toml")).unwrap();
    let mut mission: Value = toml::from_str(&text).unwrap();
    let servicer = &mut mission["servicer"];
    servicer["arm_base_rotation"] = json!([0.0, 0.0, 0.0, 1.0]);
    if capture == "pose" {
        servicer["capture"] = capture.into();
        servicer["end_effector_axis"] = json!([0.0, 0.0, 1.0]);
        servicer.as_object_mut().unwrap().remove("capture_joint_angle_rad");
    } else {
        mission["roll"] = json!({"end_effector": [0.0, 1.0, 0.0], "port": [0.0, 1.0, 0.0]});
    }
    mission
}

#[test]
fn a_missions_directions_with_four_decimals_are_normalised_and_said() {
    let bench = Bench::new();
    let told = |mission: &Value| {
        bench.write("a.mission.toml", &toml::to_string(mission).unwrap());
        bench.run("mission show a.mission.toml --json")
    };
    for (capture, pointer, key) in [
        ("joints", "/target/port_normal", "target.port_normal"),
        ("joints", "/servicer/boresight", "servicer.boresight"),
        ("joints", "/servicer/links/1/axis", "servicer.links[1].axis"),
        ("joints", "/servicer/arm_base_rotation", "servicer.arm_base_rotation"),
        ("joints", "/roll/end_effector", "roll.end_effector"),
        ("joints", "/roll/port", "roll.port"),
        ("pose", "/servicer/end_effector_axis", "servicer.end_effector_axis"),
    ] {
        let exact = told(&mission(capture));
        for by in [0.9995, 1.0005, 0.99, 2.0] {
            let mut changed = mission(capture);
            let array = changed.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}"));
            let whole = array.clone();
            *array = scaled(array, by);
            let run = told(&changed);
            let numbers = whole.as_array().unwrap().iter().map(|x| x.as_f64().unwrap().to_string());
            let unit = format!("[{}]", numbers.collect::<Vec<_>>().join(", "));
            if f64::abs(by - 1.0) < 1e-3 {
                assert_eq!(
                    (run.status, &run.out),
                    (exact.status, &exact.out),
                    "{key}\n{}",
                    run.err
                );
                let note = format!("note: {key}: its norm is {by}; taken as {unit}\n");
                assert_eq!(run.err, note + &exact.err);
            } else {
                assert_eq!(run.status, 2, "{key} times {by}");
                let begins = format!("error: a.mission.toml: {key}: ");
                assert!(run.err.starts_with(&begins), "{}", run.err);
                let ends = format!("its norm is {by}; normalised {unit}\n");
                assert!(run.err.ends_with(&ends), "{}not: {ends}", run.err);
            }
        }
    }
}

#[test]
fn attitudes_of_scenarios_and_plans_with_four_decimals_are_normalised_and_said() {
    let bench = Bench::new();
    let mut set = bench.json("set.scenarios.json");
    let plan = "plan --integrator euler --mode feasible --id s1-000 --scenarios a.scenarios.json";
    bench.write("a.scenarios.json", &set.to_string());
    let run = bench.run(&format!("{plan} --out exact.plan.json"));
    assert!(run.status != 2 && run.err.is_empty(), "{}", run.err);
    for scenario in set["scenarios"].as_array_mut().unwrap() {
        scenario["target"]["attitude"] = scaled(&scenario["target"]["attitude"], 1.0005);
    }
    bench.write("a.scenarios.json", &set.to_string());
    let rounded = bench.run(&format!("{plan} --out rounded.plan.json"));
    assert_eq!(rounded.status, run.status, "{}", rounded.err);
    // One note for the key, for any number of scenarios.
    assert_eq!(rounded.err.lines().count(), 1, "{}", rounded.err);
    let note = "note: target.attitude: its norm is 1.0005";
    assert!(rounded.err.starts_with(note), "{}", rounded.err);
    // The plan stands alone: its scenario is normalised again to the same bits.
    let again = bench.run("check rounded.plan.json");
    assert_eq!(again.status, run.status, "{}{}", again.out, again.err);

    let mut plan = bench.json("exact.plan.json");
    let row = &mut plan["stage2"]["attitude_body_to_rtn"][3];
    *row = scaled(row, 0.9995);
    bench.write("b.plan.json", &plan.to_string());
    let run = bench.run("check b.plan.json");
    assert_eq!(run.status, again.status, "{}{}", run.out, run.err);
    let note = "note: stage2.attitude_body_to_rtn[3]: its norm is 0.9995";
    assert!(run.err.starts_with(note), "{}", run.err);
    let row = &mut plan["stage2"]["attitude_body_to_rtn"][3];
    *row = scaled(row, 1.1);
    bench.write("b.plan.json", &plan.to_string());
    let begins = "b.plan.json: stage2.attitude_body_to_rtn[3]: not a unit quaternion: its norm is ";
    bench.refuses("check b.plan.json", begins);
    assert!(bench.run("check b.plan.json").err.contains("; normalised ["));
}
