//! What files in the wild do, and what becomes of it.

use crate::{GRIPPER, options, read, text};
use nalgebra::{Matrix3, Vector3};
use remora_urdf::{Note, explain};
use std::f64::consts::PI;

fn says(notes: &[Note], part: &str) -> bool {
    notes.iter().any(|note| note.to_string().contains(part))
}

#[test]
fn a_planar_arm_is_what_its_file_says() {
    let arm = read(&text("planar.urdf"), "").unwrap();
    assert!(arm.base.is_none() && says(&arm.notes, "a bare arm"));
    assert_eq!((arm.name.as_str(), arm.arm_base), ("planar", Vector3::new(0.0, 0.0, 0.1)));
    let [shoulder, elbow] = &arm.joints[..] else { panic!() };
    assert_eq!((shoulder.axis, shoulder.tip), (Vector3::y(), Vector3::z()));
    assert!((elbow.tip - Vector3::z() * 0.8).norm() < 1e-15);
    assert_eq!(shoulder.body.inertia, Matrix3::from_diagonal(&Vector3::new(1.03, 1.03, 0.06)));
    let limits = shoulder.limits;
    assert_eq!((limits.lower, limits.upper, limits.rate, limits.torque), (-1.5, 1.5, 0.05, 10.0));
    // The cylinder's rim is a polygon outside of it.
    assert!((0.08..0.0801).contains(&shoulder.radius), "{}", shoulder.radius);
    assert_eq!(elbow.radius, remora_urdf::DEFAULT_RADIUS);
    assert!(says(&arm.notes, "link `lower`: its collision shapes are not all known"));
}

#[test]
fn a_bus_that_floats_and_what_is_bolted_to_it_are_one_body() {
    let arm = read(&text("spatial.urdf"), "--end-effector tip").unwrap();
    let base = arm.base.unwrap();
    assert_eq!((base.link.as_str(), base.body.mass), ("bus", 426.0));
    let bounds = base.bounds.unwrap();
    assert!((bounds.lower - Vector3::new(-0.5, -0.5, -0.5)).norm() < 1e-12);
    assert!((bounds.upper - Vector3::new(0.5, 0.5, 0.6)).norm() < 1e-12);
    assert!(says(&arm.notes, "link `bus` floats free of `world`"));
    assert!(says(&arm.notes, "link `camera`, 1.2 kg, is part of `l2`"));
    let masses: Vec<f64> = arm.joints.iter().map(|joint| joint.body.mass).collect();
    assert_eq!(masses, [9.5, 15.2, 8.0, 11.0, 5.0, 4.5]);
}

#[test]
fn rounded_values_are_taken_as_they_stand_and_said() {
    let arm = read(&text("spatial.urdf"), "--end-effector tip").unwrap();
    assert_eq!((arm.joints[0].limits.lower, arm.joints[0].limits.upper), (-3.14149, 3.14149));
    assert!(says(&arm.notes, "joint `j1`: `upper` 3.14149 is taken as it stands, not as 1 pi"));
    assert!(says(&arm.notes, "joint `j1`: `origin/rpy` 3.1416 is taken as it stands"));
    assert!(says(&arm.notes, "joint `j2`: `origin/rpy` -1.570796 is taken as it stands"));
    let exact = text("spatial.urdf").replace("3.14149", "3.141592653589793");
    let arm = read(&exact, "--end-effector tip").unwrap();
    assert!(!says(&arm.notes, "`upper` 3.1"));
}

#[test]
fn continuous_joints_have_half_a_turn_each_way_unless_told_otherwise() {
    let arm = read(&text("spatial.urdf"), "--end-effector tip").unwrap();
    let limits = arm.joints[2].limits;
    assert_eq!((limits.lower, limits.upper, limits.rate, limits.torque), (-PI, PI, 0.094, 40.0));
    assert!(says(&arm.notes, "joint `j3` is continuous: limits of -pi and +pi are assumed"));
    let arm = read(&text("spatial.urdf"), "--end-effector tip --limit j3=-1,2,0.1,3").unwrap();
    assert_eq!(arm.joints[2].limits.upper, 2.0);
    assert!(!says(&arm.notes, "continuous") && says(&arm.notes, "joint `j3`: limits by --limit"));
}

/// Each message names the flag that mends it: with those flags the file is read.
#[test]
fn messages_lead_to_the_flags_that_a_file_needs() {
    let mut flags = String::new();
    for expected in [
        "`head`, `left_finger`, `right_finger`, `tool`; name the end effector with `--end-effector LINK`",
        "joint `head_turn`: is continuous and moves `head`, beside the way to the end effector; hold it \
         with `--hold head_turn=VALUE`",
        "joint `left`: is prismatic",
        "`--limit forearm_pitch=lower,upper,rate,torque`",
    ] {
        let refusal = read(&text("gripper.urdf"), &flags).unwrap_err().to_string();
        assert!(refusal.contains(expected), "{refusal}");
        flags = match flags.split_whitespace().count() {
            0 => "--end-effector tool".to_owned(),
            2 => format!("{flags} --hold head_turn=0.7"),
            4 => format!("{flags} --hold left=0.02"),
            _ => flags,
        };
    }
    let arm = read(&text("gripper.urdf"), GRIPPER).unwrap();
    assert_eq!(arm.joints.len(), 3);
    assert!(says(&arm.notes, "joint `right` follows `left`: held at 0.02"));
    assert!((arm.joints[2].body.mass - 2.2).abs() < 1e-12);
}

#[test]
fn a_root_further_out_leaves_the_links_before_it_out() {
    let arm = read(&text("spatial.urdf"), "--base-link l2 --end-effector tip").unwrap();
    assert_eq!((arm.joints.len(), arm.base.as_ref().unwrap().link.as_str()), (4, "l2"));
    assert!(says(&arm.notes, "links before the root `l2` are left out, 435.5 kg of them"));
}

#[test]
fn an_inertia_about_the_links_frame_can_be_seen_beside_its_extent() {
    // The upper link's about its joint instead of its centre of mass.
    let wrong = text("planar.urdf").replace("1.03", "4.03");
    let arm = read(&wrong, "").unwrap();
    assert!(says(&arm.notes, "link `upper`: the largest radius of gyration is 0.5795 m"));
    assert!(!says(&read(&text("planar.urdf"), "").unwrap().notes, "gyration"));
}

#[test]
fn the_explanation_is_the_same_each_time_and_tells_all() {
    let flags = options("--end-effector tip");
    let explained = || explain("spatial.urdf", text("spatial.urdf").as_bytes(), &flags);
    let told = explained();
    assert_eq!(told, explained());
    for part in
        ["part of", "j6", "camera", "ixx iyy izz", "notes", "first joint at", "spatial.urdf\n"]
    {
        assert!(told.contains(part), "{told}");
    }
    assert!(!told.contains("faults") && !told.contains("-0.0000 "), "{told}");
}

#[test]
fn what_other_programs_add_is_no_hindrance() {
    let added = text("planar.urdf")
        .replace("<robot name", "<robot xmlns:xacro='http://www.ros.org/wiki/xacro' name")
        .replace(
            "</robot>",
            "<transmission name='t'><joint name='elbow'/></transmission><gazebo reference='upper'><a>$(x)</a></gazebo>\
             <material name='m'/><material/></robot>",
        )
        .replace("<link name=\"tool\"/>", "<link name='tool'><visual/><sensor x='&lt;'/><![CDATA[x]]></link>");
    let added = added.replace(
        "<child link=\"tool\"/>",
        "<child link='tool'/><axis xyz='0 0 0'/><limit/><mimic joint='elbow'/>",
    );
    assert_eq!(read(&added, "").unwrap(), read(&text("planar.urdf"), "").unwrap());
    let marked = format!("\u{feff}{}", text("planar.urdf"));
    assert!(read(&marked, "").is_ok());
}

#[test]
fn a_mesh_beside_a_shape_does_not_shrink_the_link() {
    let mesh = "<collision><geometry><mesh filename='x.stl'/></geometry></collision></link>";
    let shape = "<collision><geometry><sphere radius='0.001'/></geometry></collision>";
    let both = text("planar.urdf")
        .replace("<link name=\"tool\"/>", &format!("<link name='tool'>{shape}{mesh}"));
    let arm = read(&both, "").unwrap();
    assert_eq!(arm.joints[1].radius, remora_urdf::DEFAULT_RADIUS);
    assert!(says(&arm.notes, "link `tool`: collision meshes that are not read: 1"));
}
