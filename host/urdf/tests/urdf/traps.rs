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
    assert!((0.08..0.0801).contains(&shoulder.capsule.radius), "{}", shoulder.capsule.radius);
    assert_eq!(elbow.capsule.radius, remora_urdf::DEFAULT_RADIUS);
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
    assert_eq!(arm.joints[1].capsule.radius, remora_urdf::DEFAULT_RADIUS);
    assert!(says(&arm.notes, "link `tool`: collision meshes that are not read: 1"));
}

/// Faults in unused parts, which `urdfdom` and Pinocchio read too.
#[test]
fn what_a_strict_parser_refuses_in_parts_that_are_not_used_is_read() {
    let planar = text("planar.urdf");
    let expected = read(&planar, "").unwrap();
    let flange = "<child link=\"tool\"/>";
    assert!(planar.contains(flange));
    let dtd = |subset: &str| format!("<!DOCTYPE robot{subset}>\n<robot name");
    for (from, to) in [
        ("<link name=\"tool\"/>", "<link name='tool'><gz:x gz:y='1'/></link>"),
        ("<link name=\"tool\"/>", "<link name='tool' drake:y='1'/><drake:link name='tool'/>"),
        ("<link name=\"tool\"/>", "<link name='tool'><a b='x<y&z'c=''/></link>"),
        ("<link name=\"tool\"/>", "<link name='tool'>&nbsp; a & b</link>"),
        ("</robot>", "<!-- a -- b ---></robot>"),
        ("</robot>", "<!-- ----- <joint name='> --></robot>"),
        ("</robot>", "<!----></robot>"),
        ("<robot name", &dtd("")),
        ("<robot name", &dtd(" SYSTEM \"urdf>.dtd\"")),
        (
            "<robot name",
            &dtd(" [<!ELEMENT robot (link|joint)*><!ATTLIST a b CDATA '>'><!-- <!ENTITY -->]"),
        ),
        ("<robot name", "<robot xmlns='http://www.ros.org' name"),
        (flange, "<child link='tool'/><axis xyz='0 0'/>"),
        (flange, "<child link='tool'/><axis xyz='nothing'/><axis/>"),
        (
            flange,
            "<child link='tool'/><axis/><limit lower='x'/><mimic multiplier='y'/><dynamics damping='z'/>",
        ),
    ] {
        let changed = planar.replacen(from, to, 1);
        assert_ne!(changed, planar, "{from}");
        let found = read(&changed, "").unwrap_or_else(|error| panic!("{to}: {error}"));
        assert_eq!(found, expected, "{to}");
    }
    let declared = planar.find("<?xml").map_or(planar.clone(), |_| format!("\n{planar}"));
    assert_eq!(read(&declared, "").unwrap(), expected);
    // A comment in another encoding.
    let mut bytes = planar.replacen("<robot", "<!-- M\u{fc}nchen --><robot", 1).into_bytes();
    let at = bytes.iter().position(|byte| *byte == 0xc3).unwrap();
    bytes.splice(at..at + 2, [0xfc]);
    assert_eq!(remora_urdf::import("a", &bytes, &options("")).unwrap(), expected);
    // An axis that is used is still needed.
    let used = planar.replacen("axis xyz=\"0 1 0\"", "axis xyz=\"0 1\"", 1);
    assert!(read(&used, "").unwrap_err().to_string().contains("`axis/xyz` is \"0 1\""));
}

#[test]
fn soft_limits_are_kept_where_they_are_narrower() {
    let limited = |safety: &str| {
        let limit = "velocity=\"0.05\" effort=\"10\"/>";
        let safety = format!("{limit}<safety_controller k_velocity='1' {safety}/>");
        let arm = read(&text("planar.urdf").replacen(limit, &safety, 1), "").unwrap();
        let limits = arm.joints[0].limits;
        ((limits.lower, limits.upper), arm.notes)
    };
    let (range, notes) = limited("soft_lower_limit='-1.25' soft_upper_limit='1.75'");
    assert_eq!(range, (-1.25, 1.5));
    assert!(says(&notes, "joint `shoulder`: limits -1.25 to 1.5 by its <safety_controller>"));
    assert_eq!(limited("soft_upper_limit='0.5'").0, (-1.5, 0.5));
    for wider in ["", "soft_lower_limit='-2' soft_upper_limit='2'"] {
        let (range, notes) = limited(wider);
        assert!(range == (-1.5, 1.5) && !says(&notes, "safety_controller"));
    }
    let (range, notes) = limited("soft_lower_limit='0' soft_upper_limit='0'");
    assert!(range == (-1.5, 1.5) && says(&notes, "its <safety_controller> leaves no range"));
    let flag = "--end-effector tip --limit j3=-3,3,0.1,9";
    assert!(!says(&read(&text("spatial.urdf"), flag).unwrap().notes, "safety_controller"));
}

#[test]
fn degrees_and_millimetres_are_noted() {
    let planar = text("planar.urdf");
    let doubts = |text: &str, flags: &str| -> Vec<String> {
        let notes = read(text, flags).unwrap_or_else(|error| panic!("{error}")).notes;
        notes.iter().filter(|note| note.is_doubt()).map(ToString::to_string).collect()
    };
    assert!(doubts(&planar, "").is_empty());
    assert!(doubts(&text("spatial.urdf"), "--end-effector tip").is_empty());
    let turns =
        planar.replacen("lower=\"-1.5\" upper=\"1.5\"", "lower='-6.28319' upper='6.28319'", 1);
    assert!(doubts(&turns, "").is_empty());
    let degrees = planar.replacen("lower=\"-1.5\" upper=\"1.5\"", "lower='-90' upper='90'", 1);
    let found = doubts(&degrees, "");
    assert!(
        found[0].contains("joint `shoulder`: the range -90 to 90 rad is more than two turns"),
        "{found:?}"
    );
    assert!(doubts(&degrees, "--limit shoulder=-1.5,1.5,0.05,10").is_empty());
    assert_eq!(doubts(&planar, "--limit shoulder=-90,90,0.05,10").len(), 1);
    let turned = planar.replacen("xyz=\"0 0 1\"", "rpy='0 90 0' xyz='0 0 1'", 1);
    assert!(
        doubts(&turned, "")[0]
            .contains("joint `elbow`: `origin/rpy` 90 rad is more than two turns")
    );
    let long = planar.replacen("xyz=\"0 0 1\"", "xyz='0 0 1000'", 1);
    let found = doubts(&long, "");
    assert!(found.iter().any(|note| note.contains("the arm reaches 1001 m")), "{found:?}");
}

#[test]
fn an_inertia_that_six_digits_make_impossible_is_mended_and_said() {
    let planar = text("planar.urdf");
    let rod = "ixx=\"1.03\" ixy=\"0\" ixz=\"0\" iyy=\"1.03\" iyz=\"0\" izz=\"0.06\"";
    assert!(planar.contains(rod));
    let with = |moments: [&str; 6]| {
        let [ixx, ixy, ixz, iyy, iyz, izz] = moments;
        let inertia =
            format!("ixx='{ixx}' ixy='{ixy}' ixz='{ixz}' iyy='{iyy}' iyz='{iyz}' izz='{izz}'");
        read(&planar.replacen(rod, &inertia, 1), "")
    };
    // A plate: exactly, then rounded to six significant digits, and to six decimals.
    for (moments, slack) in [
        (["0.166667", "0", "0", "0.0833333", "0", "0.250001"], 1e-6),
        (["1.23457", "0", "0", "0.765432", "0", "2.00001"], 1e-5),
        (["0.000002", "0", "0", "0.000001", "0", "0.000004"], 1e-6),
        (["0.5000000000000001", "0.0", "0.0", "0.5", "0.0", "1.000004"], 5e-6),
        (["0.749999", "0.250000", "0", "0.749999", "0", "1.50000"], 4e-6),
    ] {
        let arm = with(moments).unwrap_or_else(|error| panic!("{error}"));
        assert!(says(&arm.notes, "link `upper`: its inertia misses the triangle inequality"));
        let found = arm.joints[0].body;
        let [a, b, c] = found.principal_moments();
        assert!(a + b >= c * (1.0 - 1e-9) && a >= 0.0, "{a} {b} {c}");
        let written = moments.map(|text| text.parse::<f64>().unwrap());
        let [ixx, ixy, _, iyy, _, izz] = written;
        for (at, written) in [((0, 0), ixx), ((0, 1), ixy), ((1, 1), iyy), ((2, 2), izz)] {
            assert!((found.inertia[at] - written).abs() <= slack, "{at:?} {found:?}");
        }
    }
    // A larger error than rounding makes.
    for moments in [
        ["0.1", "0", "0", "0.1", "0", "0.3"],
        ["1.23457", "0", "0", "0.765432", "0", "2.0002"],
        ["2e-6", "0", "0", "1.0e-6", "0", "4.00000e-6"],
    ] {
        let message = with(moments).unwrap_err().to_string();
        assert!(message.contains("link `upper`: no body has this inertia"), "{message}");
    }
    assert!(!says(&read(&planar, "").unwrap().notes, "triangle"));
}

/// A tube beside the line between its joints has its capsule there, of its own radius.
#[test]
fn a_tube_beside_the_line_between_its_joints_has_its_capsule_there() {
    let arm = read(&text("offset.urdf"), "").unwrap();
    let told =
        "link `upper_arm`: its shapes are beside the line between its joints: its capsule is there";
    assert!(says(&arm.notes, told), "{:?}", arm.notes);
    let (capsule, tip) = (&arm.joints[1].capsule, arm.joints[1].tip);
    assert!((0.055..0.0552).contains(&capsule.radius), "{}", capsule.radius);
    assert!((tip - Vector3::new(0.0, -0.1325, 0.612)).norm() < 1e-12, "{tip}");
    assert!(capsule.start.norm() < 1e-6, "{capsule:?}");
    assert!((capsule.end - Vector3::new(0.0, 0.0, 0.612)).norm() < 1e-6, "{capsule:?}");
}
