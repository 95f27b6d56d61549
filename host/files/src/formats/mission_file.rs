//! Missions: `*.mission.toml`, all numbers with their units in the keys.
//!
//! Sections and keys that a file leaves out keep the problem definition's values, so that a file
//! may change a single number. `fixtures/missions/default.mission.toml` spells all of them out.

use super::mission_capture;
use super::mission_sections::{Approach, Horizon, Orbit};
use super::mission_servicer::Servicer;
use super::{Kind, Limit, MAX_JOINTS, Mission, PLANNED_JOINTS, as_text, toml_text, unit};
use crate::error::{Error, FieldError};
use remora_core::advanced::model::{
    self, Corridor, InvalidField, MIN_NODES, Margins, Orbit as TargetOrbit, Roll, ScenarioRanges,
    Target, Tolerances, Typical, Weights,
};
use remora_core::advanced::stages::NODES;
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
    /// Tolerances of a solved plan.
    pub tolerances: Tolerances,
    /// How far planning stays from its limits.
    pub margins: Margins,
    /// The end effector's way to the port.
    pub corridor: Corridor,
    /// Where scenarios are drawn from.
    pub scenarios: ScenarioRanges,
    /// Typical magnitudes by which steps are divided; left out, they follow from the rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub typical: Option<Typical>,
    /// The end effector's roll about the approach at capture; free where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll: Option<Roll>,
    /// The servicer.
    pub servicer: Servicer,
}

/// A mission file with its values not validated yet, or the built-in one without a file.
///
/// # Errors
/// The file with the error of [`MissionFile::parse`].
pub fn read_mission_file(file: Option<&Path>) -> Result<MissionFile, Error> {
    let Some(file) = file else { return Ok(MissionFile::default()) };
    Kind::Mission.read(file, Limit::TEXT, |bytes| MissionFile::parse(as_text(bytes)?))
}

/// The mission of a file, or the built-in one without a file.
///
/// # Errors
/// The file with the first field found wrong and the reason.
pub fn read_mission(file: Option<&Path>) -> Result<Mission, Error> {
    let read = read_mission_file(file)?;
    read.mission().map_err(|error| error.at(file.unwrap_or(Path::new("built-in mission"))))
}

impl MissionFile {
    /// Parses a file; its values are not validated yet.
    ///
    /// # Errors
    /// A syntax error with its line, an unknown format or key, a value of the wrong type.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        toml_text::parse(text, Some(FORMAT))
    }

    /// The number of the arm's joints, which may be none that can be planned for.
    pub fn joints(&self) -> usize {
        self.servicer.links.len()
    }

    /// The mission, validated.
    ///
    /// # Errors
    /// The first field, by its key in the file, whose value makes no sense.
    pub fn mission(&self) -> Result<Mission, FieldError> {
        if !(1..=MAX_JOINTS).contains(&self.joints()) {
            let reason = format!("has {} entries; {PLANNED_JOINTS}", self.joints());
            return Err(FieldError::new("servicer.links", reason));
        }
        let nodes = self.horizon.nodes;
        if !(MIN_NODES..=NODES).contains(&nodes) {
            let reason =
                format!("must lie in [{MIN_NODES}, {NODES}], what this program is built for");
            return Err(FieldError::new("horizon.nodes", reason));
        }
        let axis = self.servicer.capture_axis()?;
        let mut mission = self.convert()?;
        validate(&mission)?;
        Orbit::check_perigee(&mission.orbit)?;
        // Joint angles at capture and radii follow from a servicer that has been found sound.
        if let Some(axis) = axis {
            mission.servicer.capture_joint_angle_rad = mission_capture::found(&mission, axis)?;
        }
        mission.roll = self.roll.as_ref().map(|roll| self.servicer.roll(roll)).transpose()?;
        let a = &self.approach;
        mission.approach.keep_out_far_m = a.keep_out_far_m.far(&mission);
        mission.approach.keep_out_near_m = a.keep_out_near_m.near(&mission);
        validate(&mission)?;
        let step = mission.mean_motion() * self.horizon.duration_s / (nodes - 1) as f64;
        if step > MAX_NODE_INTERVAL {
            let reason = "too long: from node to node it is more than a tenth of an orbit";
            return Err(FieldError::new("horizon.duration_s", reason));
        }
        Ok(mission)
    }

    /// The target's orbit.
    ///
    /// # Errors
    /// The key that is wrong.
    pub fn target_orbit(&self) -> Result<TargetOrbit, FieldError> {
        self.orbit.convert()
    }

    fn convert(&self) -> Result<Mission, FieldError> {
        let port_normal = self.target.port_normal.into();
        let port_normal = unit::direction(&port_normal, || "target.port_normal".into())?.into();
        let mission = model::Mission {
            orbit: self.orbit.convert()?,
            target: Target { port_normal, ..self.target },
            servicer: self.servicer.convert()?,
            approach: self.approach.convert(&self.horizon),
            weights: self.weights,
            tolerances: self.tolerances,
            margins: self.margins,
            corridor: self.corridor,
            scenarios: self.scenarios,
            typical_magnitudes: self.typical,
            // Looked at where the joint angles at capture are known.
            roll: None,
        };
        Ok(Mission::new(mission, self.joints()))
    }

    /// The file of a mission with every number given: nothing is left to be derived but whether a
    /// part that is `auto` is in force.
    pub fn of(mission: &Mission) -> Self {
        Self {
            format: FORMAT.into(),
            horizon: Horizon {
                nodes: mission.approach.nodes,
                duration_s: mission.approach.duration_s,
            },
            orbit: Orbit::from(&mission.orbit),
            target: mission.target,
            approach: Approach::from(&mission.approach),
            weights: mission.weights,
            tolerances: mission.tolerances,
            margins: mission.margins,
            corridor: mission.corridor,
            scenarios: mission.scenarios,
            typical: mission.typical_magnitudes,
            roll: mission.roll,
            servicer: Servicer::of(&mission.servicer, mission.joints()),
        }
    }
}

impl Default for MissionFile {
    fn default() -> Self {
        let mut file = Self::of(&Mission::default());
        // Its keep-out distances follow from the servicer.
        file.approach = Approach::default();
        file.servicer = Servicer::default();
        file
    }
}

/// Refuses the first field, by its key in the file, whose value makes no sense.
fn validate(mission: &Mission) -> Result<(), FieldError> {
    mission.validate().map_err(|error| FieldError::new(key_of(&error), error.reason))
}

/// Angles and rates that files give in degrees.
const IN_DEGREES: [&str; 5] = [
    "orbit.inclination_rad",
    "approach.field_of_view_half_angle_rad",
    "margins.field_of_view_rad",
    "corridor.half_angle_rad",
    "scenarios.rate_norm_rad_s",
];

/// The file's key for a field of the core.
fn key_of(error: &InvalidField) -> String {
    let key = match error.field {
        "approach.duration_s" => "horizon.duration_s".into(),
        "approach.nodes" => "horizon.nodes".into(),
        "servicer.min_joint_angle_rad" | "servicer.max_joint_angle_rad" => {
            "servicer.joint_angle_limit_rad".into()
        }
        field if IN_DEGREES.contains(&field) => field.replace("_rad", "_deg"),
        field => field.to_string(),
    };
    match (error.index, key.strip_prefix("servicer.links.")) {
        (None, _) => key,
        (Some(i), Some(of_link)) => format!("servicer.links[{i}].{of_link}"),
        (Some(i), None) => format!("{key}[{i}]"),
    }
}
