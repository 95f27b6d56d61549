//! `remora mission import`

use super::bench::Bench;
use serde_json::Value;

/// A URDF of `fixtures/urdf`.
fn urdf(name: &str) -> String {
    format!("{}/../fixtures/urdf/{name}.urdf", env!("CARGO_MANIFEST_DIR"))
}

/// The flags without which the gripper is refused.
const GRIPPER: &str = "--end-effector tool --hold head_turn=0 --hold left=0.01 --hold right=0.01 \
                       --limit forearm_pitch=-2,2,0.05,10 --axis 1,0,0";

fn imported(bench: &Bench, arguments: &str) -> Value {
    let run = bench.solves(&format!("mission import {arguments} --json"));
    serde_json::from_str(&run.out).unwrap()
}

/// A bare arm goes onto the built-in bus, and its mission can be planned for.
#[test]
fn a_bare_arm_gets_a_bus_and_is_planned_for() {
    let bench = Bench::new();
    let run = bench.solves(&format!("mission import {}", urdf("planar")));
    for text in [
        "robot planar: an arm of 2 joints\n",
        "\n1      shoulder         0.00           0.00\n",
        "\n- the bus is the built-in mission's; --bus FILE gives another\n",
        "\n- the arm's root is mounted at (0, 0, 0.5) m, on the face",
        "\n4 notes on the file: --explain tells them\n",
        "\nreach ",
        "\nnothing forbids an approach to end\nwritten: planar.mission.toml\n",
    ] {
        assert!(run.out.contains(text), "{text:?} in\n{}", run.out);
    }
    let text = bench.read("planar.mission.toml");
    assert!(
        text.starts_with("# Made by `remora mission import` of planar.urdf, robot planar.\n"),
        "{text}"
    );
    assert!(text.contains("\ncapture = \"pose\"\nend_effector_axis = [0.0, 0.0, 1.0]\n"), "{text}");
    // The same again, and not over what is there.
    bench.refuses(
        &format!("mission import {}", urdf("planar")),
        "planar.mission.toml: exists; --force",
    );
    bench.solves(&format!("mission import {} --out b.mission.toml", urdf("planar")));
    assert_eq!(bench.read("b.mission.toml"), text);
    let out = bench.solves(&format!("mission import {} --out -", urdf("planar"))).out;
    assert_eq!(out, text);
    bench.solves("mission show planar.mission.toml");
    let plan =
        "plan --mission planar.mission.toml --scenarios set.scenarios.json --integrator euler";
    bench.solves(&format!("{plan} --warm-start heuristic --out a.plan.json"));
}

/// The URDF's own bus, its camera on the side where the arm is of use: there the bus has its +z.
#[test]
fn a_whole_servicer_keeps_its_bus() {
    let bench = Bench::new();
    let told = imported(&bench, &format!("{} --end-effector tip", urdf("spatial")));
    assert_eq!((&told["format"], &told["robot"]), (&"remora-import/1".into(), &"spatial".into()));
    let servicer = &told["mission"]["servicer"];
    assert_eq!(servicer["bus_mass_kg"], 426.0);
    assert_eq!(servicer["boresight"], serde_json::json!([0.0, 0.0, 1.0]));
    // Its +x is the bus's +z: the box of 1, 1 and 1.1 m, about the centre of mass.
    let half: Vec<f64> = serde_json::from_value(servicer["bus_half_extents_m"].clone()).unwrap();
    assert!((half[1] - 0.5583).abs() < 1e-3 && (half[2] - 0.5239).abs() < 1e-3, "{half:?}");
    assert_eq!(told["joints"].as_array().map(Vec::len), Some(6));
    assert_eq!(told["joints"][5]["name"], "j6");
    assert_eq!(told["vehicle"]["refused"], Value::Null);
    let decided = told["decided"].to_string();
    assert!(decided.contains("the camera looks along (1, 0, 0) of the URDF's bus"), "{decided}");
    assert!(decided.contains("scenarios start about 6 m in front of the port"), "{decided}");
    // What it found is what reading the mission finds.
    let run = bench.solves("mission show spatial.mission.toml --json");
    let vehicle: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(vehicle, told["vehicle"]);
}

#[test]
fn a_bus_of_another_mission_carries_the_arm() {
    let bench = Bench::new();
    bench.write(
        "bus.mission.toml",
        "[servicer]\nbus_mass_kg = 200\nbus_half_extents_m = [0.4, 0.4, 0.3]\nforce_limit_n = 5\n\
         [horizon]\nduration_s = 1000\n[approach]\nkeep_out_far_m = 9\n",
    );
    let flags = format!("{} --bus bus.mission.toml", urdf("planar"));
    let told = imported(&bench, &flags);
    let mission = &told["mission"];
    assert_eq!(
        (&mission["servicer"]["bus_mass_kg"], &mission["horizon"]["duration_s"]),
        (&200.0.into(), &1000.0.into())
    );
    assert_eq!(mission["servicer"]["force_limit_n"], 5.0);
    assert_eq!(mission["servicer"]["arm_base_m"], serde_json::json!([0.0, 0.0, 0.4]));
    // What follows from the arm follows from this one.
    assert_eq!(mission["approach"]["keep_out_far_m"], "auto");
    assert!(told["decided"].to_string().contains("is of another arm: keep_out_far_m"));
    let told = imported(&bench, &format!("{flags} --mount 0,0,0.35 --force"));
    let base = told["mission"]["servicer"]["arm_base_m"][2].as_f64().unwrap();
    assert!((base - 0.45).abs() < 1e-15, "{base}");
    // A base that has mass is fixed to it.
    let told = imported(&bench, &format!("{} {GRIPPER} --bus bus.mission.toml", urdf("gripper")));
    assert_eq!(told["mission"]["servicer"]["bus_mass_kg"], 260.0);
    bench.write("bus.mission.toml", "[servicer]\nbus_mass_kg = -1\n");
    bench.refuses(
        &format!("mission import {flags} --force"),
        "bus.mission.toml: servicer.bus_mass_kg: must be positive",
    );
}

#[test]
fn all_faults_are_told_at_once_with_what_mends_them() {
    let bench = Bench::new();
    let gripper = urdf("gripper");
    bench.refuses(
        &format!("mission import {gripper}"),
        &format!("{gripper}: several links end the tree:"),
    );
    let run = bench.run(&format!("mission import {gripper} --end-effector tool"));
    for flag in ["--hold head_turn=VALUE", "--hold left=VALUE", "--limit forearm_pitch=lower"] {
        assert!(run.err.contains(flag), "{flag} in {}", run.err);
    }
    let run = bench.run(&format!("mission import {gripper} --end-effector tool --explain"));
    assert_eq!((run.status, run.err.as_str()), (1, ""));
    assert!(run.out.contains("\nfaults\n\n- joint `head_turn`: is continuous"), "{}", run.out);
    assert!(run.out.ends_with("\nnot imported\n"), "{}", run.out);
    let run = bench.run(&format!("mission import {gripper} --end-effector tool --explain --json"));
    let told: Value = serde_json::from_str(&run.out).unwrap();
    assert!(run.status == 1 && told["faults"].as_array().is_some_and(|faults| faults.len() >= 3));
    // An axis that no arm at capture has: the one that would do is named.
    let without_axis = GRIPPER.replace("--axis 1,0,0", "");
    let run = bench.run(&format!("mission import {gripper} {without_axis}"));
    assert!(run.status == 2 && run.err.contains("would do --axis 1,0,0"), "{}", run.err);
}

#[test]
fn an_explanation_writes_nothing() {
    let bench = Bench::new();
    let before = bench.names(".");
    let run = bench.solves(&format!("mission import {} {GRIPPER} --explain", urdf("gripper")));
    for text in [
        "radii of gyration",
        "\njoints, from the bus outwards",
        "\nnotes\n",
        "\n2      pitch ",
        "the box of the bus is that of an even body of its inertia",
        "\nextension ",
        "\ntorques of bus and joints",
        "\nnothing forbids an approach to end\n",
    ] {
        assert!(run.out.contains(text), "{text:?} in\n{}", run.out);
    }
    assert_eq!(bench.names("."), before);
}

#[test]
fn flags_that_make_no_sense_are_refused() {
    let bench = Bench::new();
    let planar = urdf("planar");
    let refuses = |flags: &str, message: &str| {
        bench.refuses(&format!("mission import {planar} {flags}"), message);
    };
    refuses("--limit shoulder=1,2", "--limit: `shoulder=1,2`: expects JOINT=lower,upper,rate");
    refuses("--hold shoulder", "--hold: `shoulder`: expects JOINT=angle");
    refuses("--mount 0,0", "--mount: `0,0`: expects x,y,z");
    refuses("--axis 0,0,0", "--axis: must be a direction");
    refuses("--axis 0,0", "--axis: `0,0`: expects three numbers");
    refuses("--boresight 0,nan,1", "--boresight: `0,nan,1`: expects finite numbers");
    refuses("--start 0", "--start: one number for each of 2 joints, not 1");
    refuses("--start 0,9", "--start: [1] must lie within the joint's stops");
    refuses("--start -1.5,-2.4", "--start: is 0.");
    refuses("--armature 1,2,3", "--armature: one number, or one for each of 2 joints, not 3");
    refuses("--armature 0.1,-0.2", "--armature: -0.2 must not be negative");
    refuses("--armature 0.1,inf", "--armature: `0.1,inf`: expects finite numbers");
    refuses(
        "--end-effector hand",
        &format!("{planar}: `--end-effector hand`: the file has no such"),
    );
    refuses("--bus none.toml", "none.toml: no such file or directory");
    refuses("--out no/such.mission.toml", "no/such.mission.toml: ");
    bench.refuses("mission import none.urdf", "none.urdf: no such file or directory");
    bench.write("a.xacro", "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:arm/></robot>");
    bench.refuses("mission import a.xacro", "a.xacro: a xacro, not yet a URDF");
}

/// A finger that is held beyond its range, and one with a wider range.
#[test]
fn a_finger_held_beyond_its_range_is_refused_and_a_limit_allows_it() {
    let bench = Bench::new();
    let import = format!("mission import {} --end-effector tip --explain", urdf("hold4"));
    bench.refuses(
        &import.replace(" --explain", " --hold finger=0.4"),
        &format!("{}: joint `finger`: held at 0.4 m, beyond its range 0 to 0.04 m", urdf("hold4")),
    );
    bench.solves(&format!("{import} --hold finger=0.04"));
    bench.solves(&format!("{import} --hold finger=0.4 --limit finger=0,0.5,0.1,10"));
}

/// Probably wrong units are reported without --explain.
#[test]
fn degrees_are_told_in_the_report_and_beside_an_error() {
    let bench = Bench::new();
    let planar = std::fs::read_to_string(urdf("planar")).unwrap();
    let degrees = planar.replacen("lower=\"-1.5\" upper=\"1.5\"", "lower='-90' upper='90'", 1);
    bench.write("degrees.urdf", &degrees);
    let told =
        "joint `shoulder`: the range -90 to 90 rad is more than two turns: is it in degrees?";
    let run = bench.solves("mission import degrees.urdf");
    assert!(run.out.contains(&format!("\nlook at\n- {told}\n")), "{}", run.out);
    let run = bench.run("mission import degrees.urdf --axis 0,1,0 --force");
    assert!(run.status == 2 && run.err.contains(told), "{}", run.err);
}

/// A camera of the bus with an impossible inertia.
#[test]
fn a_link_of_the_bus_with_an_impossible_inertia_can_be_a_point() {
    let bench = Bench::new();
    let spatial = std::fs::read_to_string(urdf("spatial")).unwrap();
    let camera = "<link name='bad'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' \
                  izz='9'/></inertial></link><joint name='bad_bolts' type='fixed'><origin xyz='0 0 0.3'/>\
                  <parent link='bus'/><child link='bad'/></joint></robot>";
    bench.write("bad.urdf", &spatial.replace("</robot>", camera));
    bench.refuses(
        "mission import bad.urdf --end-effector tip",
        "bad.urdf: link `bad`: no body has this inertia",
    );
    let run = bench.run("mission import bad.urdf --end-effector tip");
    assert!(run.err.contains("or take it as a point with `--point-mass bad`"), "{}", run.err);
    let told = imported(&bench, "bad.urdf --end-effector tip --point-mass bad");
    assert_eq!(told["mission"]["servicer"]["bus_mass_kg"], 428.0);
    assert!(told["notes"].to_string().contains("link `bad`, 2 kg, is taken as a point"));
}

/// Rotors are in no URDF; what they weigh in stands with the links, and nothing else changes.
#[test]
fn rotors_are_given_by_a_flag() {
    let bench = Bench::new();
    let armatures = |flags: &str| {
        let told = imported(&bench, &format!("{} --explain {flags}", urdf("planar")));
        let links = told["mission"]["servicer"]["links"].clone();
        let of = |link: &Value| link.get("armature_kg_m2").and_then(Value::as_f64).unwrap_or(0.0);
        links.as_array().unwrap().iter().map(of).collect::<Vec<f64>>()
    };
    assert_eq!(armatures(""), [0.0, 0.0]);
    assert_eq!(armatures("--armature 0.25"), [0.25, 0.25]);
    assert_eq!(armatures("--armature 0.25,0"), [0.25, 0.0]);
    bench.solves(&format!(
        "mission import {} --armature 0.4,0.1 --out a.mission.toml",
        urdf("planar")
    ));
    let text = bench.read("a.mission.toml");
    assert!(
        text.contains("armature_kg_m2 = 0.4\n") && text.contains("armature_kg_m2 = 0.1\n"),
        "{text}"
    );
    bench.solves("mission show a.mission.toml");
}

/// An arm as short as a hand leaves the bus no room: said, and written for whoever mends it.
#[test]
fn what_cannot_end_is_named() {
    let bench = Bench::new();
    bench.write("fast.mission.toml", "[scenarios]\nrate_norm_deg_s = 3.0\n");
    let run = bench.run(&format!("mission import {} --bus fast.mission.toml", urdf("planar")));
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("\ninfeasible\ntumble: "), "{}", run.out);
    assert!(run.out.ends_with("written: planar.mission.toml\n"), "{}", run.out);
}
