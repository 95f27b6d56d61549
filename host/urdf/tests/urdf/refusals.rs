//! Files that give no arm: what is said of them.

use crate::{GRIPPER, read, text};
use remora_urdf::{Options, explain};

/// The message of a planar arm with one change.
fn changed(from: &str, to: &str, flags: &str) -> String {
    let before = text("planar.urdf");
    let after = before.replacen(from, to, 1);
    assert_ne!(before, after, "{from}");
    read(&after, flags).unwrap_err().to_string()
}

#[track_caller]
fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "no `{part}` in: {message}");
    }
}

#[test]
fn what_is_no_urdf_is_named_with_what_to_run_first() {
    let refused = |text: &str| read(text, "").unwrap_err().to_string();
    for xacro in [
        "<robot name='a' xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:macro name='x'/></robot>",
        "<robot name='a'><xacro:property name='x'/></robot>",
        "<robot name='a'><link name='${prefix}base'/></robot>",
    ] {
        assert_says(&refused(xacro), &["`xacro FILE.xacro > arm.urdf`"]);
    }
    assert_says(&refused("<sdf version='1.9'><model name='a'/></sdf>"), &["SDF", "sdformat_urdf"]);
    assert_says(&refused("<html/>"), &["<html>", "<robot>"]);
    assert_says(&refused("solid mesh"), &["arm.urdf: not XML:"]);
    assert_says(&refused("<robot name='a'/>"), &["there is no link"]);
}

#[test]
fn limits_that_are_missing_or_useless_are_not_zeros() {
    let flag = "--limit shoulder=lower,upper,rate,torque";
    let limit = "<limit lower=\"-1.5\" upper=\"1.5\" velocity=\"0.05\" effort=\"10\"/>";
    let with = |limit_instead: &str| changed(limit, limit_instead, "");
    assert_says(&with(""), &["joint `shoulder`: has no `<limit>`", flag]);
    assert_says(&with("<limit velocity='1' effort='1'/>"), &["neither `lower` nor `upper`", flag]);
    let two = with("<limit lower='-1' upper='1' velocity='0'/>");
    assert_says(&two, &["`velocity` is \"0\"", "`effort` is not written", flag]);
    for huge in ["NaN", "inf", "1e300", "x", ""] {
        let message = with(&format!("<limit lower='-1' upper='{huge}' velocity='1' effort='1'/>"));
        assert_says(&message, &[&format!("`upper` is \"{huge}\""), flag]);
    }
    assert_says(
        &with("<limit lower='1' upper='-1' velocity='1' effort='1'/>"),
        &["1 to -1 rad", flag],
    );
    let wide = with("<limit lower='-1e6' upper='1e6' velocity='1' effort='1'/>");
    assert_says(&wide, &["-1000000 to 1000000 rad", flag]);
    let without = text("planar.urdf").replacen(limit, "", 1);
    let arm = read(&without, "--limit shoulder=-1,1,0.1,2").unwrap();
    assert_eq!(arm.joints[0].limits.torque, 2.0);
}

#[test]
fn impossible_bodies_are_named_with_their_numbers() {
    let message = changed("izz=\"0.06\"", "izz=\"3\"", "");
    assert_says(&message, &["link `upper`: no body has this inertia", "1.030000e0", "3.000000e0"]);
    assert_says(&changed("izz=\"0.06\"", "izz=\"-0.06\"", ""), &["link `upper`", "-6.000000e-2"]);
    assert_says(
        &changed("ixy=\"0\"", "ixy=\"2\"", ""),
        &["link `upper`: no body has this inertia"],
    );
    assert_says(&changed("mass value=\"12\"", "mass value=\"-1\"", ""), &["mass is -1 kg"]);
    assert_says(&changed("mass value=\"12\"", "mass value=\"0\"", ""), &["an inertia but no mass"]);
    let point = "<inertia ixx=\"1.03\" ixy=\"0\" ixz=\"0\" iyy=\"1.03\" iyz=\"0\" izz=\"0.06\"/>";
    let zeros = "<inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/>";
    assert_says(
        &changed(point, zeros, ""),
        &["link `upper`: with what is fixed to it", "positive definite"],
    );
}

#[test]
fn joints_that_move_nothing_need_their_mass_or_to_be_held() {
    let body = "<inertial>\n      <origin xyz=\"0 0 0.5\"/>\n      <mass value=\"12\"/>\n      <inertia ixx=\"1.03\" \
                ixy=\"0\" ixz=\"0\" iyy=\"1.03\" iyz=\"0\" izz=\"0.06\"/>\n    </inertial>";
    let message = changed(body, "", "");
    assert_says(&message, &["joint `shoulder`: moves no mass", "`upper`", "--hold shoulder=ANGLE"]);
    let arm = read(&text("planar.urdf").replacen(body, "", 1), "--hold shoulder=0.5").unwrap();
    assert_eq!(arm.joints.len(), 1);
}

#[test]
fn trees_that_are_none_are_refused() {
    let child = "<child link=\"lower\"/>";
    assert_says(
        &changed(child, "<child link='nobody'/>", ""),
        &["joint `elbow`: there is no link `nobody`"],
    );
    let looped = changed(child, "<child link='upper'/>", "");
    assert_says(&looped, &["`upper` is the child of joints `shoulder` and `elbow`"]);
    assert_says(
        &changed("<parent link=\"mount\"/>", "<parent link='lower'/>", ""),
        &["`upper`", "loop"],
    );
    let twice = changed("<link name=\"tool\"/>", "<link name='tool'/><link name='tool'/>", "");
    assert_says(&twice, &["link `tool` is there twice"]);
    assert_says(
        &changed("name=\"elbow\"", "name='shoulder'", ""),
        &["joint `shoulder` is there twice"],
    );
    let two = changed("<link name=\"tool\"/>", "<link name='tool'/><link name='lost'/>", "");
    assert_says(&two, &["2 links have no parent: `mount`, `lost`", "--base-link LINK"]);
    assert_says(
        &changed("<link name=\"tool\"/>", "<link name='tool'/><link/>", ""),
        &["a <link> has no name"],
    );
}

#[test]
fn joints_that_cannot_be_planned_for_are_refused_unless_held() {
    for kind in ["prismatic", "planar", "floating", "spherical"] {
        let kind_of = format!("type='{kind}'");
        let message =
            changed("name=\"elbow\" type=\"revolute\"", &format!("name='elbow' {kind_of}"), "");
        assert_says(&message, &[&format!("joint `elbow`: is {kind}"), "--hold elbow=VALUE"]);
    }
    let planar =
        changed("name=\"elbow\" type=\"revolute\"", "name='elbow' type='planar'", "--hold elbow=1");
    assert_says(&planar, &["`--hold elbow=1`: a planar joint can only be held at 0"]);
    let message =
        changed("<child link=\"lower\"/>", "<child link='lower'/><mimic joint='shoulder'/>", "");
    assert_says(&message, &["joint `elbow`: mimics `shoulder`", "--hold elbow=ANGLE"]);
    assert_says(
        &changed("type=\"fixed\"", "type='screw'", ""),
        &["joint `flange`: type is \"screw\""],
    );
    let all = read(&text("planar.urdf"), "--hold shoulder=0 --hold elbow=0").unwrap_err();
    assert_says(&all.to_string(), &["no revolute joint moves the end effector `tool`"]);
}

#[test]
fn more_than_seven_joints_are_too_many() {
    let mut chain = "<robot name='a'><link name='l0'/>".to_owned();
    for i in 1..=9 {
        let before = i - 1;
        chain += &format!(
            "<link name='l{i}'/><joint name='j{i}' type='revolute'><parent link='l{before}'/><child link='l{i}'/></joint>"
        );
    }
    let message = read(&(chain + "</robot>"), "").unwrap_err().to_string();
    assert_says(&message, &["9 revolute joints", "at most 7", "`j9`", "--hold JOINT=ANGLE"]);
}

#[test]
fn names_of_flags_are_looked_up() {
    let refused = |flags: &str| read(&text("planar.urdf"), flags).unwrap_err().to_string();
    assert_says(&refused("--hold knee=1"), &["`--hold knee`: the file has no such joint"]);
    assert_says(&refused("--limit knee=-1,1,1,1"), &["`--limit knee`: the file has no such joint"]);
    assert_says(&refused("--hold flange=1"), &["`--hold flange`: is a fixed joint"]);
    assert_says(
        &refused("--end-effector knee"),
        &["`--end-effector knee`: the file has no such link"],
    );
    assert_says(&refused("--end-effector mount"), &["is not beyond the root `mount`"]);
    assert_says(&refused("--base-link knee"), &["`--base-link knee`: the file has no such link"]);
}

#[test]
fn a_joint_held_beyond_its_range_is_refused_unless_a_limit_allows_it() {
    let hold = |flags: &str| read(&text("hold4.urdf"), &format!("--end-effector tip {flags}"));
    let refused = |flags: &str| hold(flags).unwrap_err().to_string();
    for value in ["0.4", "-0.001", "0.041"] {
        let parts =
            ["joint `finger`: held at ", value, "beyond its range 0 to 0.04 m", "--limit finger="];
        assert_says(&refused(&format!("--hold finger={value}")), &parts);
    }
    for value in ["0", "0.04", "0.02"] {
        assert_eq!(hold(&format!("--hold finger={value}")).unwrap().joints.len(), 3);
    }
    let wider = hold("--hold finger=0.4 --limit finger=0,0.5,0.1,10").unwrap();
    assert!((wider.joints[2].body.mass - 4.2).abs() < 1e-12);
    let narrower = refused("--hold finger=0.03 --limit finger=0,0.02,0.1,10");
    assert_says(&narrower, &["beyond its range 0 to 0.02 m"]);
    let turned = refused("--hold finger=0 --hold wrist=2.6");
    assert_says(&turned, &["joint `wrist`: held at 2.6 rad, beyond its range -2.5 to 2.5 rad"]);
}

#[test]
fn a_joint_that_follows_a_held_one_beyond_its_own_range_is_refused() {
    let mimic = |multiplier: &str, flags: &str| {
        let finger = "<joint name='second' type='prismatic'><parent link='hand'/><child link='f2'/>\
                      <axis xyz='1 0 0'/><limit lower='-0.04' upper='0.012' velocity='1' effort='1'/>";
        let follows =
            format!("<mimic joint='finger' multiplier='{multiplier}'/></joint><link name='f2'/>");
        let both = text("hold4.urdf").replace("</robot>", &format!("{finger}{follows}</robot>"));
        read(&both, &format!("--end-effector tip --hold finger=0.04 {flags}"))
    };
    assert!(mimic("-1", "").is_ok());
    // Rounding exceeds the range, which is not a fault.
    assert!(mimic("0.3", "").is_ok());
    let message = mimic("-2", "").unwrap_err().to_string();
    assert_says(
        &message,
        &["joint `second`: held at -0.08 m", "beyond its range -0.04 to 0.012 m"],
    );
    assert!(mimic("-2", "--limit second=-0.1,0.1,1,1").is_ok());
    assert!(mimic("-2", "--hold second=-0.04").is_ok());
}

#[test]
fn an_impossible_inertia_outside_the_arm_can_be_taken_as_a_points() {
    let camera =
        "<inertia ixx=\"0.001\" ixy=\"0\" ixz=\"0\" iyy=\"0.001\" iyz=\"0\" izz=\"0.001\"/>";
    let before = text("spatial.urdf");
    let at = before.find("<link name=\"camera\"").unwrap();
    let inertia = before[at..].find("<inertia ").unwrap() + at;
    let end = before[inertia..].find("/>").unwrap() + inertia + 2;
    let wrong = format!(
        "{}{}{}",
        &before[..inertia],
        camera.replace("0.001\"/>", "0.1\"/>"),
        &before[end..]
    );
    let refused =
        |flags: &str| read(&wrong, &format!("--end-effector tip {flags}")).unwrap_err().to_string();
    let flag = "--point-mass camera";
    assert_says(&refused(""), &["link `camera`: no body has this inertia", flag]);
    let arm = read(&wrong, &format!("--end-effector tip {flag}")).unwrap();
    assert!(
        arm.notes
            .iter()
            .any(|n| n.to_string().contains("link `camera`, 1.2 kg, is taken as a point"))
    );
    let right = read(&before, "--end-effector tip").unwrap();
    for (found, expected) in arm.joints.iter().zip(&right.joints) {
        assert_eq!(found.body.mass, expected.body.mass);
        assert!((found.body.center_of_mass - expected.body.center_of_mass).norm() < 1e-15);
        assert!((found.body.inertia - expected.body.inertia).norm() < 0.05);
    }
    // A link that a joint moves needs its inertia.
    assert_says(&refused("--point-mass l2"), &["`--point-mass l2`: moves by a joint of its own"]);
    assert_says(&refused("--point-mass l9"), &["`--point-mass l9`: the file has no such link"]);
    let mended = changed("izz=\"0.06\"", "izz=\"3\"", "");
    assert!(!mended.contains("--point-mass"), "{mended}");
}

#[test]
fn numbers_are_numbers() {
    for bad in ["NaN", "inf", "1e300", "1,5", "", "1 2"] {
        let message = changed("mass value=\"12\"", &format!("mass value=\"{bad}\""), "");
        assert_says(
            &message,
            &["link `upper`: `mass/value` is", &format!("\"{bad}\""), "one number"],
        );
    }
    assert_says(
        &changed("xyz=\"0 0 1\"", "xyz=\"0 0 x 1\"", ""),
        &["joint `elbow`: `origin/xyz`", "three numbers"],
    );
    assert_says(&changed("ixy=\"0\" ", "", ""), &["link `upper`: no `inertia/ixy` is written"]);
    assert_says(
        &changed("<parent link=\"upper\"/>", "", ""),
        &["joint `elbow`: no `parent` is written"],
    );
    assert_says(
        &changed("axis xyz=\"0 1 0\"", "axis xyz='0 0 0'", ""),
        &["joint `shoulder`: the axis is a zero vector"],
    );
    let twice = "<mass value='12'/><mass value=\"12\"";
    assert_says(
        &changed("<mass value=\"12\"", twice, ""),
        &["link `upper`: <mass> is written twice"],
    );
    let negative = changed("radius=\"0.08\"", "radius='-0.08'", "");
    assert_says(&negative, &["`cylinder/radius` is -0.08: must not be negative"]);
}

#[test]
fn all_that_is_wrong_is_said_at_once() {
    let wrong = text("planar.urdf")
        .replacen("izz=\"0.06\"", "izz=\"3\"", 1)
        .replacen("mass value=\"8\"", "mass value=\"eight\"", 1)
        .replacen("velocity=\"0.05\"", "velocity=\"0\"", 1);
    let refusal = read(&wrong, "--hold knee=1").unwrap_err();
    let message = refusal.to_string();
    assert_says(
        &message,
        &["link `upper`: no body", "\"eight\"", "`velocity` is \"0\"", "--hold knee"],
    );
    assert_eq!(refusal.faults.len(), 4, "{message}");
    assert!(message.lines().all(|line| line.starts_with("arm.urdf: ")), "{message}");
    let told = explain("arm.urdf", wrong.as_bytes(), &Options::default());
    assert_says(&told, &["radii of gyration", "impossible", "faults\n\n- link `lower`"]);
    let three =
        read(&text("gripper.urdf"), &GRIPPER.replace("--hold left=0.02 --hold head_turn=0.7", ""));
    assert_eq!(three.unwrap_err().faults.len(), 3);
}
