//! `remora check`

use super::bench::Bench;
use serde_json::{Value, json};

const CHECK: &str = "check --scenarios set.scenarios.json";

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
fn what_was_planned_is_feasible_and_says_so() {
    for integrator in ["euler", "rk4:4"] {
        let bench = planned(integrator);
        let run = bench.solves(&format!("{CHECK} --strict a.plan.json"));
        assert!(run.out.contains("verdict: feasible\n"), "{}", run.out);
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
        ("/stage1/position/20/0", 1e-3),
        ("/stage1/velocity/59/2", 1e-4),
        ("/stage1/force/11/1", 1e-2),
        ("/stage2/joint_angle/30/1", 1e-3),
        ("/stage2/rate/59/0", 1e-5),
        ("/stage2/joint_rate/57/2", 1e-5),
        ("/stage2/bus_torque/5/2", 1e-3),
        ("/stage2/joint_torque/58/0", 1.0),
    ] {
        tampered(&bench, |plan| {
            let number = plan.pointer_mut(path).unwrap();
            *number = json!(number.as_f64().unwrap() + by);
        });
        let run = bench.run(&format!("{CHECK} a.plan.json b.plan.json"));
        assert_eq!(run.status, 1, "{path}\n{}{}", run.out, run.err);
        assert!(run.out.contains("TOO LARGE"), "{path}\n{}", run.out);
        assert!(run.out.contains("disagrees: status: says solved"), "{path}\n{}", run.out);
        assert!(run.out.contains("2 plans: 1 feasible, 1 in agreement"), "{path}\n{}", run.out);
    }
}

#[test]
fn what_a_plan_says_of_itself_is_recomputed() {
    let bench = planned("euler");
    let changes: [(&str, Value); 8] = [
        ("/stage1/cost", json!(1e-9)),
        ("/stage2/cost", json!(0.01)),
        ("/residuals/pointing", json!(5e-5)),
        ("/target/rate/3/1", json!(2e-3)),
        ("/target/attitude/59", json!([1.0, 0.0, 0.0, 0.0])),
        ("/stage2/status", json!("deadline")),
        ("/verdict", json!("verified_not_converged")),
        ("/clearances/bus/distance_m", json!(77.5)),
    ];
    for (path, value) in changes {
        tampered(&bench, |plan| *plan.pointer_mut(path).unwrap() = value);
        let run = bench.solves(&format!("{CHECK} b.plan.json"));
        assert!(run.out.contains("verdict: feasible, but not what it says"), "{path}\n{}", run.out);
        let run = bench.run(&format!("{CHECK} --strict b.plan.json"));
        assert_eq!(run.status, 1, "{path}\n{}", run.out);
    }
}

/// A plan of an older version says neither what it is good for nor how near bodies come.
#[test]
fn an_older_plan_is_judged_as_well() {
    let bench = planned("euler");
    tampered(&bench, |plan| {
        let fields = plan.as_object_mut().unwrap();
        assert!(fields.remove("verdict").is_some() && fields.remove("clearances").is_some());
    });
    let run = bench.solves(&format!("{CHECK} --strict b.plan.json"));
    assert!(run.out.contains("verdict: feasible\n"), "{}", run.out);
}

#[test]
fn either_sign_of_a_quaternion_is_the_same_plan() {
    let bench = planned("euler");
    tampered(&bench, |plan| {
        for path in ["/stage2/attitude/30", "/target/attitude/30"] {
            for number in plan.pointer_mut(path).unwrap().as_array_mut().unwrap() {
                *number = json!(-number.as_f64().unwrap());
            }
        }
    });
    let run = bench.solves(&format!("{CHECK} --strict b.plan.json"));
    assert!(run.out.contains("verdict: feasible\n"), "{}", run.out);
}

#[test]
fn bad_plans_are_refused_by_field() {
    let bench = planned("euler");
    let refuses = |change: fn(&mut Value), message: &str| {
        tampered(&bench, change);
        bench.refuses(&format!("{CHECK} a.plan.json b.plan.json"), message);
    };
    refuses(|p| p["format"] = json!("remora-plan/2"), "b.plan.json: format: unknown format");
    refuses(|p| p["scenario"] = json!("s1-999"), "b.plan.json: scenario: \"s1-999\" is not in");
    refuses(|p| p["colour"] = json!("red"), "b.plan.json: colour: unknown field");
    refuses(|p| p["integrator"] = json!("rk4:2"), "b.plan.json: integrator: rk4 needs at least 4");
    refuses(
        |p| p["stage2"]["rate"][3][1] = Value::Null,
        "b.plan.json: stage2.rate[3][1]: invalid type: null",
    );
    refuses(
        |p| p["stage2"]["attitude"][3] = json!([0, 0, 0, 1.1]),
        "b.plan.json: stage2.attitude[3]: not a unit quaternion",
    );
    refuses(
        |p| drop(p["stage1"]["force"].as_array_mut().unwrap().pop()),
        "b.plan.json: stage1.force: has 58 rows; the horizon has 59",
    );
    refuses(
        |p| drop(p["residuals"].as_object_mut().unwrap().remove("joint")),
        "b.plan.json: residuals: missing field `joint`",
    );
    bench.refuses(&format!("{CHECK} none.plan.json"), "none.plan.json: no such file");
    bench.refuses("check --scenarios set.scenarios.json", "the following required arguments");
    bench.write("b.plan.json", &bench.read("a.plan.json")[..3000]);
    bench.refuses(&format!("{CHECK} b.plan.json"), "b.plan.json: stage1: EOF while parsing");
}
