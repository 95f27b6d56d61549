//! Tests of mission files: their meaning, and the errors of bad ones.

use super::mission_file::MissionFile;
use super::radius::Radius;
use super::{MAX_JOINTS, Mission, MissionCapture, capture_search};
use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::model;
use remora_core::advanced::model::forms::degrees::{degrees, radians};

const DEFAULT: &str = include_str!("../../../../fixtures/missions/default.mission.toml");
const PAGE: &str = include_str!("../../../../docs/reference/mission-file.md");

fn on_page() -> impl Iterator<Item = &'static str> {
    PAGE.split("```toml\n").skip(1).map(|block| block.split_once("```").unwrap().0)
}

/// Every bit of a mission: `Debug` shows the shortest number that reads back the same.
fn bits(mission: &Mission) -> String {
    format!("{mission:?}")
}

#[test]
fn the_default_is_the_built_in_one() {
    let built_in = Mission::default();
    assert_eq!(bits(&MissionFile::default().mission().unwrap()), bits(&built_in));
    let file = MissionFile::parse(DEFAULT).unwrap();
    assert_eq!(bits(&file.mission().unwrap()), bits(&built_in));
    assert_eq!(bits(&MissionFile::parse("").unwrap().mission().unwrap()), bits(&built_in));
    // The page's second block has all keys but those of links.
    let page: Vec<MissionFile> = on_page().map(|text| MissionFile::parse(text).unwrap()).collect();
    let [_, all, link] = &page[..] else { panic!("{} blocks", page.len()) };
    assert_eq!(bits(&all.mission().unwrap()), bits(&built_in));
    assert_eq!(link.joints(), 1);
}

#[test]
fn a_mission_survives_being_written() {
    let mut missions = vec![Mission::default()];
    for text in [
        include_str!("../../../../fixtures/missions/small.mission.toml"),
        include_str!("../../../../fixtures/missions/strong.mission.toml"),
        include_str!("../../../../fixtures/missions/tumble-5.mission.toml"),
    ] {
        missions.push(MissionFile::parse(text).unwrap().mission().unwrap());
    }
    let mut typical = Mission::default();
    typical.typical_magnitudes = Some(typical.typical());
    missions.push(typical);
    missions.push(general());
    for mission in missions {
        let file = MissionFile::of(&mission);
        assert_eq!(bits(&file.mission().unwrap()), bits(&mission));
        let text = serde_json::to_string(&file).unwrap();
        let read: MissionFile = serde_json::from_str(&text).unwrap();
        assert_eq!(bits(&read.mission().unwrap()), bits(&mission));
    }
}

/// A servicer of which every joint, axis and link differs, in the long forms.
fn general() -> Mission {
    let mut mission = Mission::default();
    let s = &mut mission.servicer;
    s.bus_inertia_kg_m2 = Matrix3::new(80.0, 1.5, -2.0, 1.5, 85.0, 0.1, -2.0, 0.1, 90.0);
    s.min_joint_angle_rad = super::each(&[-3.0, 0.1, -1.75]);
    s.joint_rate_limit_rad_s[1] = 4e-3;
    s.force_limit_n.y = 0.3;
    s.bus_torque_limit_n_m.z = 1e-3;
    s.joint_torque_limit_n_m[2] = 2e-3;
    s.links[2].armature_kg_m2 = 0.3;
    s.links[0].inertia_kg_m2[(2, 0)] = 1e-3;
    s.links[0].inertia_kg_m2[(0, 2)] = 1e-3;
    mission
}

#[test]
fn the_long_forms_are_written_where_the_short_ones_do_not_say_it_all() {
    let file = MissionFile::of(&general());
    let value = serde_json::to_value(&file).unwrap();
    let s = &value["servicer"];
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    assert_eq!(s["bus_inertia_kg_m2"], json("[80.0, 85.0, 90.0, 1.5, -2.0, 0.1]"));
    assert_eq!(s["joint_angle_limit_rad"][0], json("[-3.0, 3.141592653589793]"));
    assert_eq!(s["joint_angle_limit_rad"][2], json("1.75"));
    assert_eq!(s["joint_rate_limit_rad_s"], json("[5e-3, 4e-3, 5e-3]"));
    assert_eq!(s["force_limit_n"], json("[2.5, 0.3, 2.5]"));
    assert_eq!(s["links"][2]["armature_kg_m2"], 0.3);
    assert!(s["links"][1].get("armature_kg_m2").is_none());
    assert_eq!(s["links"][1]["inertia_kg_m2"].as_array().map(Vec::len), Some(3));
    let written = crate::formats::toml_text::to_text(&file).unwrap();
    assert_eq!(MissionFile::parse(&written).unwrap(), file);
    let default = serde_json::to_value(MissionFile::default()).unwrap();
    assert_eq!(default["servicer"]["force_limit_n"], 2.5);
    assert_eq!(default["servicer"]["joint_angle_limit_rad"][2], 1.75);
}

/// Servicers that each change one number have different checksums. The unchanged one has the
/// checksum of the default.
#[test]
fn every_number_of_a_servicer_counts_in_its_checksum() {
    type Change = fn(&mut model::Servicer<MAX_JOINTS>);
    let changes: [Change; 12] = [
        |_| (),
        |s| s.min_joint_angle_rad[0] = -3.0,
        |s| s.joint_rate_limit_rad_s[2] = 4e-3,
        |s| s.force_limit_n.z = 4e-3,
        |s| s.bus_torque_limit_n_m.z = 4e-3,
        |s| s.joint_torque_limit_n_m[2] = 4e-3,
        |s| (s.bus_inertia_kg_m2[(0, 1)], s.bus_inertia_kg_m2[(1, 0)]) = (1e-3, 1e-3),
        |s| (s.bus_inertia_kg_m2[(2, 1)], s.bus_inertia_kg_m2[(1, 2)]) = (1e-3, 1e-3),
        |s| (s.links[0].inertia_kg_m2[(0, 1)], s.links[0].inertia_kg_m2[(1, 0)]) = (1e-3, 1e-3),
        |s| (s.links[2].inertia_kg_m2[(0, 1)], s.links[2].inertia_kg_m2[(1, 0)]) = (1e-3, 1e-3),
        |s| s.links[0].armature_kg_m2 = 1e-3,
        |s| s.links[2].armature_kg_m2 = 1e-3,
    ];
    let sums = changes.map(|change| {
        let mut mission = Mission::default();
        change(&mut mission.servicer);
        mission.validate().unwrap();
        mission.checksum()
    });
    assert_eq!(sums[0], 0x7841_7d2a_80d6_76ca);
    let distinct: std::collections::BTreeSet<_> = sums.into_iter().collect();
    assert_eq!(distinct.len(), changes.len());
}

#[test]
fn a_turned_arm_is_folded_into_its_links() {
    let text = "[servicer]\narm_base_rotation = [0.5, 0.5, 0.5, 0.5]";
    let arm = MissionFile::parse(text).and_then(|file| file.mission()).unwrap().servicer;
    let default = Mission::default().servicer;
    // This turns +x to +y, +y to +z and +z to +x.
    for (link, other) in arm.links.iter().zip(&default.links) {
        assert_eq!(link.axis, Vector3::z());
        assert_eq!(link.tip_m, Vector3::new(other.tip_m.z, 0.0, 0.0));
        assert_eq!(link.center_of_mass_m.x, other.center_of_mass_m.z);
        let moments = other.inertia_kg_m2.diagonal();
        let turned = Vector3::new(moments.z, moments.x, moments.y);
        assert_eq!(link.inertia_kg_m2, Matrix3::from_diagonal(&turned));
    }
    assert_eq!(
        (arm.arm_base_m, arm.bus_inertia_kg_m2),
        (default.arm_base_m, default.bus_inertia_kg_m2)
    );
    let far = "[servicer]\narm_base_rotation = [0.5, 0.5, 0.5, 0.6]";
    let error = MissionFile::parse(far).and_then(|file| file.mission()).unwrap_err();
    assert_eq!(error.field, "servicer.arm_base_rotation");
    assert!(error.reason.starts_with("not a unit quaternion: its norm is 1.05"));
    assert!(MissionFile::parse("[servicer]\narm_base_rotation = [0, 0, 1]").is_err());
}

#[test]
fn servicers_that_cannot_be_are_named_by_the_files_keys() {
    let field = |line: &str| {
        let text = format!("[servicer]\n{line}");
        MissionFile::parse(&text).and_then(|file| file.mission()).unwrap_err().field
    };
    assert_eq!(field("bus_inertia_kg_m2 = [1, 2]"), "servicer.bus_inertia_kg_m2");
    assert_eq!(field("bus_inertia_kg_m2 = [80, 80, 80, nan, 0, 0]"), "servicer.bus_inertia_kg_m2");
    assert_eq!(field("bus_inertia_kg_m2 = [80, 80, 80, 0, 90, 0]"), "servicer.bus_inertia_kg_m2");
    assert_eq!(field("bus_inertia_kg_m2 = 80"), "servicer.bus_inertia_kg_m2");
    let stops = "servicer.joint_angle_limit_rad";
    assert_eq!(field("joint_angle_limit_rad = [3, 2]"), stops);
    assert_eq!(field("joint_angle_limit_rad = [3, 2, [-1, 1], 3]"), stops);
    assert_eq!(field("joint_angle_limit_rad = [3, 2, [1, 1]]"), format!("{stops}[2]"));
    assert_eq!(field("joint_angle_limit_rad = [nan, 2, 1]"), format!("{stops}[0]"));
    assert_eq!(field("joint_angle_limit_rad = [[-3, inf], 2, 1]"), format!("{stops}[0]"));
    assert_eq!(field("joint_angle_limit_rad = [3, 2, [-1, 0, 1]]"), format!("{stops}[2]"));
    assert_eq!(
        field("joint_angle_limit_rad = [[-3, -0.4], 2, 1]"),
        "servicer.initial_joint_angle_rad[0]"
    );
    assert_eq!(
        field("joint_angle_limit_rad = [3, 2, [-0.5, 1]]"),
        "servicer.capture_joint_angle_rad[2]"
    );
    assert_eq!(field("joint_rate_limit_rad_s = [1, 1]"), "servicer.joint_rate_limit_rad_s");
    assert_eq!(field("joint_rate_limit_rad_s = []"), "servicer.joint_rate_limit_rad_s");
    assert_eq!(field("force_limit_n = [1, 0, 1]"), "servicer.force_limit_n");
    assert_eq!(field("force_limit_n = \"strong\""), "servicer.force_limit_n");
    assert_eq!(field("bus_torque_limit_n_m = [1, 1, nan]"), "servicer.bus_torque_limit_n_m");
    assert_eq!(field("joint_torque_limit_n_m = [1, 1, -1]"), "servicer.joint_torque_limit_n_m");
    let link = |from: &str, to: &str| {
        let at = DEFAULT.rfind(from).unwrap();
        let text = format!("{}{to}{}", &DEFAULT[..at], &DEFAULT[at + from.len()..]);
        MissionFile::parse(&text).and_then(|file| file.mission()).unwrap_err().field
    };
    let mass = "mass_kg = 10.0";
    let negative = format!("{mass}\narmature_kg_m2 = -0.1");
    assert_eq!(link(mass, &negative), "servicer.links[2].armature_kg_m2");
    let armature = format!("{mass}\narmature_kg_m2 = nan");
    assert_eq!(link(mass, &armature), "servicer.links[2].armature_kg_m2");
    let inertia = "inertia_kg_m2 = [";
    assert_eq!(link(inertia, "inertia_kg_m2 = [1.0, "), "servicer.links[2].inertia_kg_m2");
}

/// Whatever degrees a file gives, they are found again.
#[test]
fn degrees_come_back() {
    for i in 1..20_000 {
        let angle = radians(f64::from(i) * 0.009_1);
        assert_eq!(radians(degrees(angle)).to_bits(), angle.to_bits(), "{i}");
    }
}

#[test]
fn the_default_file_spells_everything_out() {
    fn keys(value: &toml::Value, at: &str, out: &mut Vec<String>) {
        match value {
            toml::Value::Table(table) => {
                table.iter().for_each(|(k, v)| keys(v, &format!("{at}.{k}"), out));
            }
            toml::Value::Array(array) if array.iter().all(toml::Value::is_table) => {
                (0..array.len()).for_each(|i| keys(&array[i], &format!("{at}[{i}]"), out));
            }
            _ => out.push(at.to_string()),
        }
    }
    let (mut written, mut known) = (Vec::new(), Vec::new());
    keys(&toml::Value::Table(toml::from_str(DEFAULT).unwrap()), "", &mut written);
    // Phases that are not given follow from the horizon; keep-out distances from the servicer.
    let mut file = MissionFile::of(&Mission::default());
    file.approach.keep_out_far_m = Radius::Auto;
    keys(&toml::Value::try_from(file).unwrap(), "", &mut known);
    written.sort();
    known.sort();
    assert_eq!(written, known);
    let mut page = Vec::new();
    keys(&toml::Value::Table(toml::from_str(on_page().nth(1).unwrap()).unwrap()), "", &mut page);
    known.retain(|key| !page.contains(key) && key != ".format" && !key.contains(".links"));
    assert_eq!(known, [""; 0]);
}

#[test]
fn typical_magnitudes_are_given_all_or_none() {
    let all = "[typical]\nlength_m = 1\nvelocity_m_s = 1\nforce_n = 1\nangle_rad = 0.1\n\
               rate_rad_s = 1\njoint_rate_rad_s = 1\nbus_torque_n_m = 1\njoint_torque_n_m = 1";
    let mission = MissionFile::parse(all).unwrap().mission().unwrap();
    assert_eq!(mission.typical_magnitudes.unwrap().rate_rad_s, 1.0);
    // A typical magnitude never exceeds its limit, whatever the file gives.
    assert_eq!(mission.typical().bus_torque_n_m, 5e-3);
    assert!(MissionFile::parse("[typical]\nlength_m = 1").is_err());
    let wrong = all.replace("force_n = 1", "force_n = -1");
    let error = MissionFile::parse(&wrong).unwrap().mission().unwrap_err();
    assert_eq!(error.field, "typical.force_n");
}

#[test]
fn a_file_may_change_one_number() {
    let file = MissionFile::parse("[servicer]\nbus_mass_kg = 400\n").unwrap();
    let mut expected = Mission::default();
    expected.servicer.bus_mass_kg = 400.0;
    // The keep-out distances follow from the bus mass.
    expected.approach.keep_out_far_m = expected.servicer.extension();
    expected.approach.keep_out_near_m = expected.servicer.capture_geometry().reach;
    assert_eq!(file.mission().unwrap(), expected);
    let file = MissionFile::parse("[servicer]\nforce_limit_n = 2\n").unwrap();
    let mut expected = Mission::default();
    expected.servicer.force_limit_n.fill(2.0);
    assert_eq!(file.mission().unwrap(), expected);
}

#[test]
fn phases_follow_from_the_horizon_where_they_are_not_given() {
    let approach = |text: &str| {
        let file = MissionFile::parse(&format!("[horizon]\nduration_s = 600\n{text}")).unwrap();
        file.mission().unwrap().approach
    };
    let given = approach("[approach]\nkeep_out_near_s = 150\npreset_s = 70\nrecovery_s = 30");
    assert_eq!((given.keep_out_near_s, given.preset_s, given.recovery_s), (150.0, 70.0, 30.0));
    let usual = approach("");
    assert_eq!((usual.keep_out_near_s, usual.preset_s), (180.0, 40.0));
    let long = MissionFile::parse("[horizon]\nduration_s = 3600").unwrap().mission().unwrap();
    assert_eq!((long.approach.keep_out_near_s, long.approach.recovery_s), (360.0, 80.0));
}

#[test]
fn nonsense_is_named_by_the_files_keys() {
    let field = |text: &str| {
        let error = MissionFile::parse(text).and_then(|file| file.mission()).unwrap_err();
        error.field
    };
    assert_eq!(field("[servicer]\nbus_mass_kg = -1.0"), "servicer.bus_mass_kg");
    assert_eq!(field("[target]\nmass_kg = nan"), "target.mass_kg");
    assert_eq!(field("[tolerances]\nkeep_out_m = 0.0"), "tolerances.keep_out_m");
    assert_eq!(field("[horizon]\nduration_s = inf"), "horizon.duration_s");
    assert_eq!(field("[horizon]\nnodes = 61"), "horizon.nodes");
    assert_eq!(field("[horizon]\nnodes = 3"), "horizon.nodes");
    assert_eq!(field("[horizon]\nduration_s = 1e5"), "horizon.duration_s");
    assert_eq!(field("[approach]\npreset_s = 0"), "approach.preset_s");
    assert_eq!(field("[approach]\nkeep_out_near_s = -1"), "approach.keep_out_near_s");
    assert_eq!(field("[approach]\nrecovery_s = nan"), "approach.recovery_s");
    assert_eq!(field("[orbit]\nspeed = 1"), "orbit.speed");
    assert_eq!(field("[orbit]\neccentricity = \"low\""), "orbit.eccentricity");
    assert_eq!(field("format = \"remora-mission/9\"\nnew = 1"), "format");
    assert_eq!(field("[servicer]\nlinks = []"), "servicer.links");
    let third = DEFAULT.rfind("mass_kg = 10.0").unwrap();
    let light = format!("{}mass_kg = -10.0{}", &DEFAULT[..third], &DEFAULT[third + 14..]);
    assert_eq!(field(&light), "servicer.links[2].mass_kg");
}

#[test]
fn syntax_errors_name_the_line() {
    let error = MissionFile::parse("[orbit]\n\neccentricity = = 3\n").unwrap_err();
    assert!(error.reason.ends_with("at line 3"), "{}", error.reason);
}

const POSE: &str = "[servicer]\ncapture = \"pose\"\n";

#[test]
fn joint_angles_at_capture_are_found_where_the_file_says_so() {
    let mission = MissionFile::parse(POSE).and_then(|file| file.mission()).unwrap();
    let servicer = &mission.servicer;
    let search = capture_search(&mission, Vector3::z());
    let violation = servicer.capture_violation(&search, &servicer.capture_joint_angle_rad);
    assert!(violation.worst(1e-9).is_none(), "{violation:?}");
    assert!(mission.approach.keep_out_near_m != 1.46);
    // Written, they are given.
    let written = MissionFile::of(&mission);
    assert_eq!(written.servicer.capture, MissionCapture::Joints);
    assert_eq!(bits(&written.mission().unwrap()), bits(&mission));
    // A file that says how to find them is written as it stands, and another arm finds its own.
    let file = MissionFile::parse(POSE).unwrap();
    assert_eq!(
        MissionFile::parse(&crate::formats::toml_text::to_text(&file).unwrap()).unwrap(),
        file
    );
    let light = MissionFile::parse(&format!("{POSE}bus_mass_kg = 60")).unwrap().mission().unwrap();
    assert_ne!(light.servicer.capture_joint_angle_rad, servicer.capture_joint_angle_rad);
}

#[test]
fn the_end_effectors_axis_turns_with_the_arms_base() {
    let turned = format!("{POSE}arm_base_rotation = [0.5, 0.5, 0.5, 0.5]\n");
    let axis = |text: &str| MissionFile::parse(text).unwrap().servicer.capture_axis().unwrap();
    assert_eq!(axis(POSE), Some(Vector3::z()));
    assert_eq!(axis(&turned), Some(Vector3::x()));
    assert_eq!(axis(&format!("{turned}end_effector_axis = [0, 1, 0]")), Some(Vector3::z()));
    assert_eq!(axis(""), None);
}

#[test]
fn captures_that_cannot_be_are_named() {
    let refused = |text: &str| {
        let error = MissionFile::parse(text).and_then(|file| file.mission()).unwrap_err();
        (error.field, error.reason)
    };
    let (field, reason) = refused(&format!("{POSE}end_effector_axis = [1, 0, 0]"));
    assert_eq!(field, "servicer.capture");
    assert!(reason.starts_with("no joint angles were found: the best miss "), "{reason}");
    let field = |text: &str| refused(text).0;
    let given = format!("{POSE}capture_joint_angle_rad = [0, 0, 0]");
    assert_eq!(field(&given), "servicer.capture_joint_angle_rad");
    assert_eq!(field("[servicer]\nend_effector_axis = [0, 0, 1]"), "servicer.end_effector_axis");
    for axis in ["[0, 0, 1.1]", "[nan, 0, 1]", "[0, 1]"] {
        let text = format!("{POSE}end_effector_axis = {axis}");
        assert_eq!(field(&text), "servicer.end_effector_axis");
    }
    assert_eq!(field("[servicer]\ncapture = \"port\""), "servicer.capture");
    let stops = "joint_angle_limit_rad = [3, 2, [0.1, 1]]";
    assert_eq!(field(&format!("{POSE}{stops}")), "servicer.initial_joint_angle_rad[2]");
}

#[test]
fn a_link_without_mass_needs_an_armature() {
    let third = |mass: &str| {
        let at = DEFAULT.rfind("mass_kg = 10.0").unwrap();
        let text = format!("{}{mass}{}", &DEFAULT[..at], &DEFAULT[at + 14..]);
        let (links, rest) = text.split_at(text.rfind("inertia_kg_m2").unwrap());
        let after = rest.split_once('\n').map_or("", |(_, after)| after);
        MissionFile::parse(&format!("{links}inertia_kg_m2 = [0, 0, 0]\n{after}"))
    };
    let mission = third("mass_kg = 0\narmature_kg_m2 = 0.1").unwrap().mission().unwrap();
    assert_eq!(mission.servicer.total_mass(), 520.0);
    assert_eq!(bits(&MissionFile::of(&mission).mission().unwrap()), bits(&mission));
    let error = third("mass_kg = 0").unwrap().mission().unwrap_err();
    assert_eq!(error.field, "servicer.links[2].armature_kg_m2");
}

#[test]
fn a_roll_is_read_written_and_looked_at() {
    let text = "[roll]\nend_effector = [1, 0, 0]\nport = [0.6, 0.8, 0]\n";
    let mission = MissionFile::parse(text).unwrap().mission().unwrap();
    assert_eq!(mission.roll.unwrap().port, Vector3::new(0.6, 0.8, 0.0));
    assert_eq!(bits(&MissionFile::of(&mission).mission().unwrap()), bits(&mission));
    assert_ne!(mission.checksum(), Mission::default().checksum());
    // In the axes that the links are given in.
    let turned = format!("{text}[servicer]\narm_base_rotation = [0.5, 0.5, 0.5, 0.5]");
    let roll = MissionFile::parse(&turned).unwrap().mission().map(|mission| mission.roll);
    assert!(roll.is_ok_and(|roll| roll.is_some_and(|roll| roll.end_effector == Vector3::y())));
    // The joint angles that are found decide what is across the approach.
    let found = format!("{text}{POSE}");
    assert!(MissionFile::parse(&found).unwrap().mission().is_ok());
    let field =
        |text: &str| MissionFile::parse(text).and_then(|file| file.mission()).unwrap_err().field;
    assert_eq!(field("[roll]\nend_effector = [1, 0, 0]\nport = [0, 0, 1]"), "roll.port");
    assert_eq!(field("[roll]\nend_effector = [0, 0, 1]\nport = [1, 0, 0]"), "roll.end_effector");
    assert_eq!(field("[roll]\nend_effector = [1, 0, nan]\nport = [1, 0, 0]"), "roll.end_effector");
    assert_eq!(field("[roll]\nport = [1, 0, 0]"), "roll");
    assert_eq!(field("[roll]\nend_effector = [1, 0]\nport = [1, 0, 0]"), "roll.end_effector");
}
