//! The problem definition's values as a mission file, and the file's keys for the core's fields.

use super::mission_file::{
    Approach, Corridor, FORMAT, Horizon, Link, Margins, MissionFile, Orbit, Scenarios, Servicer,
    Switch, Target, Tolerances, Weights,
};
use super::radius::Radius;
use remora_core::advanced::model;
use remora_core::advanced::stages::NODES;
use std::f64::consts::PI;

fn degrees(radians: f64) -> f64 {
    radians * 180.0 / PI
}

impl Default for MissionFile {
    fn default() -> Self {
        Self {
            format: FORMAT.into(),
            horizon: Horizon::default(),
            orbit: Orbit::default(),
            target: Target::default(),
            approach: Approach::default(),
            weights: Weights::default(),
            tolerances: Tolerances::default(),
            margins: Margins::default(),
            corridor: Corridor::default(),
            scenarios: Scenarios::default(),
            typical: None,
            servicer: Servicer::default(),
        }
    }
}

impl Default for Horizon {
    fn default() -> Self {
        Self { nodes: NODES, duration_s: model::Approach::default().duration }
    }
}

impl Default for Orbit {
    fn default() -> Self {
        let o = model::Orbit::default();
        Self {
            gravitational_parameter_m3_s2: o.gravitational_parameter,
            semi_major_axis_m: o.semi_major_axis,
            eccentricity: o.eccentricity,
            inclination_deg: degrees(o.inclination),
        }
    }
}

impl Default for Target {
    fn default() -> Self {
        let t = model::Target::default();
        Self {
            half_extents_m: t.half_extents.into(),
            inertia_kg_m2: t.inertia.into(),
            mass_kg: t.mass,
            port_position_m: t.port_position.into(),
            port_normal: t.port_normal.into(),
            gravity_gradient: Switch::Auto,
        }
    }
}

impl Default for Servicer {
    fn default() -> Self {
        let s = model::Servicer::default();
        Self {
            bus_mass_kg: s.bus_mass,
            bus_inertia_kg_m2: s.bus_inertia.into(),
            bus_half_extents_m: s.bus_half_extents.into(),
            boresight: s.boresight.into(),
            arm_base_m: s.arm_base.into(),
            joint_angle_limit_rad: s.max_joint_angle.into(),
            joint_rate_limit_rad_s: s.max_joint_rate,
            initial_joint_angle_rad: s.initial_joint_angle.into(),
            capture_joint_angle_rad: s.capture_joint_angle.into(),
            force_limit_n: s.max_force,
            bus_torque_limit_n_m: s.max_bus_torque,
            joint_torque_limit_n_m: s.max_joint_torque,
            links: s.links.iter().map(Link::from).collect(),
        }
    }
}

impl From<&model::Link> for Link {
    fn from(link: &model::Link) -> Self {
        Self {
            tip_m: link.tip.into(),
            center_of_mass_m: link.center_of_mass.into(),
            mass_kg: link.mass,
            inertia_kg_m2: link.inertia.into(),
            axis: link.axis.into(),
            radius_m: link.radius,
        }
    }
}

impl Default for Approach {
    fn default() -> Self {
        let a = model::Approach::default();
        Self {
            keep_out_far_m: Radius::Auto,
            keep_out_near_m: Radius::Auto,
            keep_out_far_until: a.keep_out_far_until,
            field_of_view_half_angle_deg: degrees(a.field_of_view_half_angle),
            preset_lead_intervals: a.preset_lead,
            clearance: Switch::Auto,
            between_nodes: Switch::Auto,
        }
    }
}

impl Default for Weights {
    fn default() -> Self {
        let w = model::Weights::default();
        Self {
            force: w.force,
            force_change: w.force_change,
            bus_torque: w.bus_torque,
            joint_torque: w.joint_torque,
        }
    }
}

impl Default for Tolerances {
    fn default() -> Self {
        let t = model::Tolerances::default();
        Self {
            dynamics: t.dynamics,
            control: t.control,
            joint_rad: t.joint,
            joint_rate: t.joint_rate,
            pointing: t.pointing,
            preset: t.preset,
            terminal_rate: t.terminal_rate,
            keep_out_m: t.keep_out,
            ee_position_m: t.end_effector_position,
            ee_angle_rad: t.end_effector_angle,
            clearance_m: t.clearance,
        }
    }
}

impl Default for Margins {
    fn default() -> Self {
        let m = model::Margins::default();
        Self {
            joint_angle_rad: m.joint_angle,
            joint_rate: m.joint_rate,
            keep_out_m: m.keep_out,
            field_of_view_deg: degrees(m.field_of_view),
            clearance_m: m.clearance,
        }
    }
}

impl Default for Corridor {
    fn default() -> Self {
        let c = model::Corridor::default();
        Self {
            half_angle_deg: degrees(c.half_angle),
            mouth_radius_m: c.mouth_radius,
            end_effector_length_m: c.end_effector_length,
        }
    }
}

impl Default for Scenarios {
    fn default() -> Self {
        let s = model::ScenarioRanges::default();
        Self {
            standoff_m: s.standoff,
            offset_m: s.offset.into(),
            rate_rad_s: s.rate,
            rate_norm_deg_s: s.rate_norm.map(degrees),
            velocity_m_s: s.velocity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::advanced::model::Mission;
    use remora_core::advanced::stages::LINKS;

    const DEFAULT: &str = include_str!("../../../../fixtures/missions/default.mission.toml");

    /// Every bit of a mission: `Debug` shows the shortest number that reads back the same.
    fn bits(mission: &Mission<LINKS>) -> String {
        format!("{mission:?}")
    }

    #[test]
    fn the_default_is_the_built_in_one() {
        let built_in = Mission::default();
        assert_eq!(bits(&MissionFile::default().mission().unwrap()), bits(&built_in));
        let file = MissionFile::parse(DEFAULT).unwrap();
        assert_eq!(bits(&file.mission().unwrap()), bits(&built_in));
        assert_eq!(bits(&MissionFile::parse("").unwrap().mission().unwrap()), bits(&built_in));
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
        keys(&toml::Value::try_from(MissionFile::default()).unwrap(), "", &mut known);
        written.sort();
        known.sort();
        assert_eq!(written, known);
    }

    #[test]
    fn typical_magnitudes_are_given_all_or_none() {
        let all = "[typical]\nlength_m = 1\nvelocity_m_s = 1\nforce_n = 1\nangle_rad = 0.1\n\
                   rate_rad_s = 1\njoint_rate_rad_s = 1\nbus_torque_n_m = 1\njoint_torque_n_m = 1";
        let mission = MissionFile::parse(all).unwrap().mission().unwrap();
        assert_eq!(mission.typical_magnitudes.unwrap().rate, 1.0);
        // None is above its limit all the same.
        assert_eq!(mission.typical().bus_torque, 5e-3);
        assert!(MissionFile::parse("[typical]\nlength_m = 1").is_err());
        let wrong = all.replace("force_n = 1", "force_n = -1");
        let error = MissionFile::parse(&wrong).unwrap().mission().unwrap_err();
        assert_eq!(error.field, "typical.force_n");
    }

    #[test]
    fn a_file_may_change_one_number() {
        let file = MissionFile::parse("[servicer]\nbus_mass_kg = 400\n").unwrap();
        let mut expected = Mission::default();
        expected.servicer.bus_mass = 400.0;
        // What follows from it changes with it.
        expected.approach.keep_out_far = expected.servicer.extension();
        expected.approach.keep_out_near = expected.servicer.capture_geometry().reach;
        assert_eq!(file.mission().unwrap(), expected);
        let file = MissionFile::parse("[servicer]\nforce_limit_n = 2\n").unwrap();
        let mut expected = Mission::default();
        expected.servicer.max_force = 2.0;
        assert_eq!(file.mission().unwrap(), expected);
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
        assert_eq!(field("[horizon]\nnodes = 50"), "horizon.nodes");
        assert_eq!(field("[horizon]\nduration_s = 1e5"), "horizon.duration_s");
        assert_eq!(
            field("[approach]\npreset_lead_intervals = 59"),
            "approach.preset_lead_intervals"
        );
        assert_eq!(
            field("[approach]\npreset_lead_intervals = 0"),
            "approach.preset_lead_intervals"
        );
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
}
