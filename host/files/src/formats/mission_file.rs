//! Missions: `*.mission.toml`, all numbers with their units in the keys.
//!
//! Sections and keys that a file leaves out keep the problem definition's values, so that a file
//! may change a single number. `fixtures/missions/default.mission.toml` spells all of them out.

use super::json;
use super::mission_keys::key_of;
use super::quantities::{Inertia, Limits, Stops, rotation};
use super::radius::Radius;
use crate::error::{Error, FieldError};
use nalgebra::{Matrix3, SVector, Vector3};
use remora_core::advanced::model::{self, MIN_NODES, Mission, Switch};
use remora_core::advanced::stages::{LINKS, NODES};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::path::Path;

/// The `format` of the missions this version reads. A file may leave it out.
pub const FORMAT: &str = "remora-mission/1";

/// Longest time from node to node, over the orbit's mean motion [rad].
const MAX_NODE_INTERVAL: f64 = 2.0 * PI / 10.0;

/// A mission, as in its file. [`MissionFile::default`] is the problem definition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MissionFile {
    /// [`FORMAT`].
    pub format: String,
    /// The horizon.
    pub horizon: Horizon,
    /// The target's orbit.
    pub orbit: Orbit,
    /// The target.
    pub target: Target,
    /// The approach.
    pub approach: Approach,
    /// Cost weights.
    pub weights: Weights,
    /// What counts as solved.
    pub tolerances: Tolerances,
    /// How far planning stays from its limits.
    pub margins: Margins,
    /// The end effector's way to the port.
    pub corridor: Corridor,
    /// Where scenarios are drawn from.
    pub scenarios: Scenarios,
    /// What steps are divided by; left out, it follows from the rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub typical: Option<Typical>,
    /// The servicer.
    pub servicer: Servicer,
}

/// `[margins]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Margins {
    /// From the joint stops [rad].
    pub joint_angle_rad: f64,
    /// Share of the joint rate limit left unused.
    pub joint_rate: f64,
    /// From the keep-out distances [m].
    pub keep_out_m: f64,
    /// From the edge of the field of view [deg].
    pub field_of_view_deg: f64,
    /// Between bodies [m].
    pub clearance_m: f64,
}

/// `[corridor]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Corridor {
    /// Half angle of the cone about the port's normal [deg].
    pub half_angle_deg: f64,
    /// Radius of the cone at the port [m].
    pub mouth_radius_m: f64,
    /// Length of the last link's end that only the corridor concerns [m].
    pub end_effector_length_m: f64,
}

/// `[typical]`: all keys or none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Typical {
    /// Position [m].
    pub length_m: f64,
    /// Velocity [m/s].
    pub velocity_m_s: f64,
    /// Force [N].
    pub force_n: f64,
    /// Attitude and joint angles [rad].
    pub angle_rad: f64,
    /// Bus rate [rad/s].
    pub rate_rad_s: f64,
    /// Joint rates [rad/s].
    pub joint_rate_rad_s: f64,
    /// Bus torque [N m].
    pub bus_torque_n_m: f64,
    /// Joint torques [N m].
    pub joint_torque_n_m: f64,
}

impl Typical {
    fn convert(&self) -> model::Typical {
        model::Typical {
            length: self.length_m,
            velocity: self.velocity_m_s,
            force: self.force_n,
            angle: self.angle_rad,
            rate: self.rate_rad_s,
            joint_rate: self.joint_rate_rad_s,
            bus_torque: self.bus_torque_n_m,
            joint_torque: self.joint_torque_n_m,
        }
    }
}

/// `[scenarios]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenarios {
    /// Distance in front of the port about which starts are drawn [m].
    pub standoff_m: f64,
    /// Half widths of the offset from there, RTN axes [m].
    pub offset_m: [f64; 3],
    /// Half width of each component of the target's rate [rad/s].
    pub rate_rad_s: f64,
    /// Norm of the target's rate, its direction then uniform [deg/s]; left out, the components are
    /// drawn one by one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_norm_deg_s: Option<f64>,
    /// Half width of each component of the servicer's velocity [m/s].
    pub velocity_m_s: f64,
}

/// `[horizon]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Horizon {
    /// Number of nodes, from [`MIN_NODES`] to the compiled [`NODES`].
    pub nodes: usize,
    /// Time from the first node to the last [s].
    pub duration_s: f64,
}

/// `[orbit]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orbit {
    /// Earth's gravitational parameter [m^3/s^2].
    pub gravitational_parameter_m3_s2: f64,
    /// Semi-major axis [m].
    pub semi_major_axis_m: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination [deg].
    pub inclination_deg: f64,
}

/// `[target]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Target {
    /// Half edge lengths of its box [m].
    pub half_extents_m: [f64; 3],
    /// Principal moments of inertia [kg m^2].
    pub inertia_kg_m2: [f64; 3],
    /// Mass [kg].
    pub mass_kg: f64,
    /// Docking port, target body axes [m].
    pub port_position_m: [f64; 3],
    /// Outward unit normal of the port.
    pub port_normal: [f64; 3],
    /// Whether the gravity gradient turns it.
    pub gravity_gradient: Switch,
}

/// `[servicer]` and `[[servicer.links]]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Servicer {
    /// Bus mass [kg].
    pub bus_mass_kg: f64,
    /// Bus inertia about its centre of mass, bus axes [kg m^2].
    pub bus_inertia_kg_m2: Inertia,
    /// Half edge lengths of the box that holds the bus [m].
    pub bus_half_extents_m: [f64; 3],
    /// Unit boresight, bus axes.
    pub boresight: [f64; 3],
    /// First joint from the bus centre of mass, bus axes [m].
    pub arm_base_m: [f64; 3],
    /// The rotation from the axes that the links are given in, at zero joint angles, to bus axes, where
    /// they are not the bus axes themselves: a unit quaternion `[x, y, z, w]`. Written missions have their
    /// links in bus axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm_base_rotation: Option<[f64; 4]>,
    /// Joint stops, plus and minus or lower and upper [rad].
    pub joint_angle_limit_rad: Vec<Stops>,
    /// Joint rate limits [rad/s].
    pub joint_rate_limit_rad_s: Limits,
    /// Joint angles at the start [rad].
    pub initial_joint_angle_rad: Vec<f64>,
    /// Joint angles at capture [rad].
    pub capture_joint_angle_rad: Vec<f64>,
    /// Force limits, RTN components [N].
    pub force_limit_n: Limits,
    /// Bus torque limits, body components [N m].
    pub bus_torque_limit_n_m: Limits,
    /// Joint torque limits [N m].
    pub joint_torque_limit_n_m: Limits,
    /// The links, from the bus outwards, one to seven; all of them where any is given.
    pub links: Vec<Link>,
}

/// One of `[[servicer.links]]`; no key but armature and radius may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// From this joint to the next one or the end effector, link axes [m].
    pub tip_m: [f64; 3],
    /// Centre of mass from the joint, link axes [m].
    pub center_of_mass_m: [f64; 3],
    /// Mass [kg].
    pub mass_kg: f64,
    /// Inertia about the centre of mass, link axes [kg m^2].
    pub inertia_kg_m2: Inertia,
    /// Unit joint axis, link axes.
    pub axis: [f64; 3],
    /// Inertia of the joint's rotor about the joint axis, times the gear ratio squared [kg m^2].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub armature_kg_m2: f64,
    /// Radius of the capsule that holds the link [m].
    #[serde(default = "Link::default_radius")]
    pub radius_m: f64,
}

/// `[approach]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Approach {
    /// Keep-out distance while far [m].
    pub keep_out_far_m: Radius,
    /// Keep-out distance afterwards [m].
    pub keep_out_near_m: Radius,
    /// Time before the end from which the near distance holds [s]; where it is not given 360, less on a
    /// horizon below 1200 s in proportion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_out_near_s: Option<f64>,
    /// The same in older missions: the fraction of the duration up to which the far distance holds.
    #[serde(skip_serializing)]
    pub keep_out_far_until: Option<f64>,
    /// Half angle of the field of view [deg].
    pub field_of_view_half_angle_deg: f64,
    /// Time before the end from which the arm is in its capture configuration [s]; where it is not given
    /// 80, likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset_s: Option<f64>,
    /// The same in older missions: intervals before the end.
    #[serde(skip_serializing)]
    pub preset_lead_intervals: Option<usize>,
    /// Time within which a start beyond a limit is led back into it [s]; 80 where it is not given,
    /// likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery_s: Option<f64>,
    /// Whether bus and arm must stay clear of the target, and the arm of its own bus.
    pub clearance: Switch,
    /// Whether limits hold between the nodes too.
    pub between_nodes: Switch,
}

/// `[weights]`, on controls divided by their limits
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Weights {
    /// `W1`: force.
    pub force: f64,
    /// `W2`: change of force from node to node.
    pub force_change: f64,
    /// `W3`, first block: bus torque.
    pub bus_torque: f64,
    /// `W3`, second block: joint torque.
    pub joint_torque: f64,
}

/// `[tolerances]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tolerances {
    /// Dynamics defects, scaled.
    pub dynamics: f64,
    /// Control bounds, relative.
    pub control: f64,
    /// Joint limits [rad].
    pub joint_rad: f64,
    /// Joint rate limit, relative.
    pub joint_rate: f64,
    /// Pointing, in cosine.
    pub pointing: f64,
    /// Arm preset, scaled.
    pub preset: f64,
    /// Terminal bus rate, scaled.
    pub terminal_rate: f64,
    /// Keep-out distance [m].
    pub keep_out_m: f64,
    /// End effector at the port [m].
    pub ee_position_m: f64,
    /// Approach direction [rad].
    pub ee_angle_rad: f64,
    /// Overlap of bodies [m].
    pub clearance_m: f64,
}

/// A mission file with its values not judged yet, or the built-in one without a file.
///
/// # Errors
/// As [`MissionFile::parse`], with the file.
pub fn read_mission_file(file: Option<&Path>) -> Result<MissionFile, Error> {
    let Some(file) = file else { return Ok(MissionFile::default()) };
    MissionFile::parse(&json::read_text(file)?).map_err(|error| error.at(file))
}

/// The mission of a file, or the built-in one without a file, with an arm of `NL` joints.
///
/// # Errors
/// The file with the first field found wrong and the reason; another number of joints.
pub fn read_mission<const NL: usize>(file: Option<&Path>) -> Result<Mission<NL>, Error> {
    let read = read_mission_file(file)?;
    read.mission_of().map_err(|error| error.at(file.unwrap_or(Path::new("built-in mission"))))
}

impl MissionFile {
    /// Parses a file; its values are not judged yet.
    ///
    /// # Errors
    /// A syntax error with its line, an unknown format or key, a value of the wrong type.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let line = |error: &toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start.min(text.len()));
            1 + text.as_bytes()[..start].iter().filter(|byte| **byte == b'\n').count()
        };
        let reason = |error: &toml::de::Error| {
            format!("{} at line {}", error.message().replace('\n', " "), line(error))
        };
        let table: toml::Table =
            toml::from_str(text).map_err(|error| FieldError::new("", reason(&error)))?;
        if let Some(format) = table.get("format").and_then(toml::Value::as_str) {
            json::check_format(Some(format), FORMAT)?;
        }
        let reader =
            toml::Deserializer::parse(text).map_err(|error| FieldError::new("", reason(&error)))?;
        serde_path_to_error::deserialize(reader).map_err(|error| {
            let path = error.path().to_string();
            let path = if path == "." { String::new() } else { path };
            FieldError::new(path, reason(error.inner()))
        })
    }

    /// The number of the arm's joints, which may be none that can be planned for.
    pub fn joints(&self) -> usize {
        self.servicer.links.len()
    }

    /// What refuses a number of joints.
    pub fn wrong_joints(&self, planned: &str) -> FieldError {
        let reason = format!("has {} entries; {planned}", self.joints());
        FieldError::new("servicer.links", reason)
    }

    /// The mission of an arm like the built-in mission's, validated: see [`MissionFile::mission_of`].
    ///
    /// # Errors
    /// As there.
    pub fn mission(&self) -> Result<Mission<LINKS>, FieldError> {
        self.mission_of()
    }

    /// The mission with its arm of `NL` joints, validated.
    ///
    /// # Errors
    /// The first field, by its key in the file, whose value makes no sense; another number of joints.
    pub fn mission_of<const NL: usize>(&self) -> Result<Mission<NL>, FieldError> {
        let nodes = self.horizon.nodes;
        if !(MIN_NODES..=NODES).contains(&nodes) {
            let reason =
                format!("must lie in [{MIN_NODES}, {NODES}], what this program is built for");
            return Err(FieldError::new("horizon.nodes", reason));
        }
        self.approach.validate(nodes)?;
        let mut mission = self.convert()?;
        mission
            .validate()
            .map_err(|error| FieldError::new(key_of(error.field, &mission), error.reason))?;
        // The radii follow from a servicer that has been found sound.
        let a = &self.approach;
        mission.approach.keep_out_far = a.keep_out_far_m.far(&mission.servicer);
        mission.approach.keep_out_near = a.keep_out_near_m.near(&mission.servicer);
        mission
            .validate()
            .map_err(|error| FieldError::new(key_of(error.field, &mission), error.reason))?;
        let step = mission.mean_motion() * self.horizon.duration_s / (nodes - 1) as f64;
        if step > MAX_NODE_INTERVAL {
            let reason = "too long: from node to node it is more than a tenth of an orbit";
            return Err(FieldError::new("horizon.duration_s", reason));
        }
        Ok(mission)
    }

    fn convert<const NL: usize>(&self) -> Result<Mission<NL>, FieldError> {
        if self.joints() != NL {
            return Err(self.wrong_joints(&format!("here the arm has {NL} joints")));
        }
        Ok(Mission {
            orbit: self.orbit.convert(),
            target: self.target.convert(),
            servicer: self.servicer.convert()?,
            approach: self.approach.convert(&self.horizon),
            weights: self.weights.convert(),
            tolerances: self.tolerances.convert(),
            margins: self.margins.convert(),
            corridor: self.corridor.convert(),
            scenarios: self.scenarios.convert(),
            typical_magnitudes: self.typical.as_ref().map(Typical::convert),
            roll: None,
        })
    }
}

impl Orbit {
    fn convert(&self) -> model::Orbit {
        model::Orbit {
            gravitational_parameter: self.gravitational_parameter_m3_s2,
            semi_major_axis: self.semi_major_axis_m,
            eccentricity: self.eccentricity,
            inclination: radians(self.inclination_deg),
        }
    }
}

impl Approach {
    /// Refuses what is said twice, and what older missions could not say.
    fn validate(&self, nodes: usize) -> Result<(), FieldError> {
        let twice = |new: &str, old: &str| {
            Err(FieldError::new(format!("approach.{old}"), format!("{new} says it already")))
        };
        if self.keep_out_near_s.and(self.keep_out_far_until).is_some() {
            return twice("keep_out_near_s", "keep_out_far_until");
        }
        if self.preset_s.is_some() && self.preset_lead_intervals.is_some() {
            return twice("preset_s", "preset_lead_intervals");
        }
        if self.keep_out_far_until.is_some_and(|share| !(0.0..=1.0).contains(&share)) {
            return Err(FieldError::new("approach.keep_out_far_until", "must lie in [0, 1]"));
        }
        let lead = 1..=nodes - 2;
        if self.preset_lead_intervals.is_some_and(|intervals| !lead.contains(&intervals)) {
            let reason = format!("must lie in [1, {}]", lead.end());
            return Err(FieldError::new("approach.preset_lead_intervals", reason));
        }
        Ok(())
    }

    /// The approach without its keep-out distances, which follow from the servicer. On a horizon shorter
    /// than the usual one, phases that are not given are shorter too.
    fn convert(&self, horizon: &Horizon) -> model::Approach {
        let Horizon { nodes, duration_s: duration } = *horizon;
        let usual = model::Approach::default();
        let shorter = (duration / usual.duration).min(1.0);
        let near = self.keep_out_far_until.map(|share| (1.0 - share) * duration);
        let interval = duration / (nodes - 1) as f64;
        let preset = self.preset_lead_intervals.map(|intervals| intervals as f64 * interval);
        let given =
            |new: Option<f64>, old: Option<f64>, usual: f64| new.or(old).unwrap_or(usual * shorter);
        model::Approach {
            duration,
            nodes,
            keep_out_far: 0.0,
            keep_out_near: 0.0,
            keep_out_near_time: given(self.keep_out_near_s, near, usual.keep_out_near_time),
            field_of_view_half_angle: radians(self.field_of_view_half_angle_deg),
            preset_time: given(self.preset_s, preset, usual.preset_time),
            recovery_time: given(self.recovery_s, None, usual.recovery_time),
            clearance: self.clearance,
            between_nodes: self.between_nodes,
        }
    }
}

impl Weights {
    fn convert(&self) -> model::Weights {
        model::Weights {
            force: self.force,
            force_change: self.force_change,
            bus_torque: self.bus_torque,
            joint_torque: self.joint_torque,
        }
    }
}

impl Tolerances {
    fn convert(&self) -> model::Tolerances {
        model::Tolerances {
            dynamics: self.dynamics,
            control: self.control,
            joint: self.joint_rad,
            joint_rate: self.joint_rate,
            pointing: self.pointing,
            preset: self.preset,
            terminal_rate: self.terminal_rate,
            keep_out: self.keep_out_m,
            end_effector_position: self.ee_position_m,
            end_effector_angle: self.ee_angle_rad,
            clearance: self.clearance_m,
        }
    }
}

impl Margins {
    fn convert(&self) -> model::Margins {
        model::Margins {
            joint_angle: self.joint_angle_rad,
            joint_rate: self.joint_rate,
            keep_out: self.keep_out_m,
            field_of_view: radians(self.field_of_view_deg),
            clearance: self.clearance_m,
        }
    }
}

impl Corridor {
    fn convert(&self) -> model::Corridor {
        model::Corridor {
            half_angle: radians(self.half_angle_deg),
            mouth_radius: self.mouth_radius_m,
            end_effector_length: self.end_effector_length_m,
        }
    }
}

impl Scenarios {
    fn convert(&self) -> model::ScenarioRanges {
        model::ScenarioRanges {
            standoff: self.standoff_m,
            offset: Vector3::from(self.offset_m),
            rate: self.rate_rad_s,
            rate_norm: self.rate_norm_deg_s.map(radians),
            velocity: self.velocity_m_s,
        }
    }
}

impl Target {
    fn convert(&self) -> model::Target {
        model::Target {
            half_extents: Vector3::from(self.half_extents_m),
            inertia: Vector3::from(self.inertia_kg_m2),
            mass: self.mass_kg,
            port_position: Vector3::from(self.port_position_m),
            port_normal: Vector3::from(self.port_normal),
            gravity_gradient: self.gravity_gradient,
        }
    }
}

impl Servicer {
    fn convert<const NL: usize>(&self) -> Result<model::Servicer<NL>, FieldError> {
        let mount = match self.arm_base_rotation {
            Some(q) => Some(rotation(q, "servicer.arm_base_rotation")?),
            None => None,
        };
        let convert = |(i, link): (usize, &Link)| -> Result<model::Link, FieldError> {
            let link = link.convert(&format!("servicer.links[{i}]"))?;
            Ok(mount.map_or(link, |mount| turned(&link, &mount)))
        };
        let links = self.links.iter().enumerate().map(convert);
        let links: Vec<model::Link> = links.collect::<Result<_, _>>()?;
        let links: [model::Link; NL] = links.try_into().map_err(|links: Vec<_>| {
            FieldError::new("servicer.links", format!("has {} entries, not {NL}", links.len()))
        })?;
        let key = "servicer.joint_angle_limit_rad";
        let [min_joint_angle, max_joint_angle] = Stops::all(&self.joint_angle_limit_rad, key)?;
        Ok(model::Servicer {
            bus_mass: self.bus_mass_kg,
            bus_inertia: self.bus_inertia_kg_m2.tensor("servicer.bus_inertia_kg_m2")?,
            bus_half_extents: Vector3::from(self.bus_half_extents_m),
            boresight: Vector3::from(self.boresight),
            arm_base: Vector3::from(self.arm_base_m),
            links,
            min_joint_angle,
            max_joint_angle,
            max_joint_rate: self.joint_rate_limit_rad_s.each("servicer.joint_rate_limit_rad_s")?,
            initial_joint_angle: each(&self.initial_joint_angle_rad, "initial")?,
            capture_joint_angle: each(&self.capture_joint_angle_rad, "capture")?,
            max_force: self.force_limit_n.each("servicer.force_limit_n")?,
            max_bus_torque: self.bus_torque_limit_n_m.each("servicer.bus_torque_limit_n_m")?,
            max_joint_torque: self
                .joint_torque_limit_n_m
                .each("servicer.joint_torque_limit_n_m")?,
        })
    }
}

impl Link {
    fn default_radius() -> f64 {
        0.05
    }

    fn convert(&self, key: &str) -> Result<model::Link, FieldError> {
        Ok(model::Link {
            tip: Vector3::from(self.tip_m),
            center_of_mass: Vector3::from(self.center_of_mass_m),
            mass: self.mass_kg,
            inertia: self.inertia_kg_m2.tensor(&format!("{key}.inertia_kg_m2"))?,
            axis: Vector3::from(self.axis),
            armature: self.armature_kg_m2,
            radius: self.radius_m,
        })
    }
}

/// The joint angles of the start or of capture, one for each joint.
fn each<const NL: usize>(angles: &[f64], when: &str) -> Result<SVector<f64, NL>, FieldError> {
    match angles.len() == NL {
        true => Ok(SVector::from_column_slice(angles)),
        false => {
            let reason = format!("one number for each of {NL} joints, not {}", angles.len());
            Err(FieldError::new(format!("servicer.{when}_joint_angle_rad"), reason))
        }
    }
}

/// A link in axes from which `rotation` leads to those it is given in now.
fn turned(link: &model::Link, rotation: &Matrix3<f64>) -> model::Link {
    let inertia = rotation * link.inertia * rotation.transpose();
    model::Link {
        tip: rotation * link.tip,
        center_of_mass: rotation * link.center_of_mass,
        // Rounding leaves it not quite symmetric.
        inertia: (inertia + inertia.transpose()) * 0.5,
        axis: rotation * link.axis,
        ..*link
    }
}

/// Whether a number may be left out.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Radians of degrees.
pub(super) fn radians(degrees: f64) -> f64 {
    degrees * PI / 180.0
}
