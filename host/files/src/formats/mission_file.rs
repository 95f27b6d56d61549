//! Missions: `*.mission.toml`, all numbers with their units in the keys.
//!
//! Sections and keys that a file leaves out keep the problem definition's values, so that a file
//! may change a single number. `fixtures/missions/default.mission.toml` spells all of them out.

use super::mission_capture::{self, Roll};
use super::mission_keys::key_of;
use super::mission_sections::{
    Approach, Corridor, Horizon, Margins, Orbit, Scenarios, Target, Tolerances, Typical, Weights,
};
use super::mission_servicer::Servicer;
use super::{Kind, Limit, PLANNED_JOINTS, as_text, toml_text};
use crate::error::{Error, FieldError};
use crate::with_joints;
use remora_core::advanced::model::{InvalidField, MIN_NODES, Mission, Orbit as TargetOrbit};
use remora_core::advanced::stages::{LINKS, NODES};
use serde::{Deserialize, Serialize};
use std::any::Any;
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
    /// The end effector's roll about the approach at capture; free where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll: Option<Roll>,
    /// The servicer.
    pub servicer: Servicer,
}

/// A mission file with its values not judged yet, or the built-in one without a file.
///
/// # Errors
/// As [`MissionFile::parse`], with the file.
pub fn read_mission_file(file: Option<&Path>) -> Result<MissionFile, Error> {
    let Some(file) = file else { return Ok(MissionFile::default()) };
    Kind::Mission.read(file, Limit::TEXT, |bytes| MissionFile::parse(as_text(bytes)?))
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
        toml_text::parse(text, Some(FORMAT))
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
        let wrong = || self.wrong_joints(&format!("here the arm has {NL} joints"));
        self.judged()?.downcast().map(|mission| *mission).map_err(|_| wrong())
    }

    /// The mission of as many joints as the file has. The code that judges missions is large, and there
    /// for each number of joints: whoever reads one shares this, compiled with this crate.
    fn judged(&self) -> Result<Box<dyn Any>, FieldError> {
        with_joints!(self.joints(), NL => {
            Ok(Box::new(self.judge::<NL>()?))
        } else {
            Err(self.wrong_joints(PLANNED_JOINTS))
        })
    }

    fn judge<const NL: usize>(&self) -> Result<Mission<NL>, FieldError> {
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
            mission.servicer.capture_joint_angle = mission_capture::found(&mission, axis)?;
        }
        mission.roll = self.roll.as_ref().map(|roll| self.servicer.roll(roll)).transpose()?;
        let a = &self.approach;
        mission.approach.keep_out_far = a.keep_out_far_m.far(&mission.servicer);
        mission.approach.keep_out_near = a.keep_out_near_m.near(&mission.servicer);
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

    fn convert<const NL: usize>(&self) -> Result<Mission<NL>, FieldError> {
        Ok(Mission {
            orbit: self.orbit.convert()?,
            target: self.target.convert()?,
            servicer: self.servicer.convert()?,
            approach: self.approach.convert(&self.horizon),
            weights: self.weights.convert(),
            tolerances: self.tolerances.convert(),
            margins: self.margins.convert(),
            corridor: self.corridor.convert(),
            scenarios: self.scenarios.convert(),
            typical_magnitudes: self.typical.as_ref().map(Typical::convert),
            // Looked at where the joint angles at capture are known.
            roll: None,
        })
    }
}

/// Refuses the first field, by its key in the file, whose value makes no sense.
fn validate<const NL: usize>(mission: &Mission<NL>) -> Result<(), FieldError> {
    let named = |error: InvalidField| FieldError::new(key_of(error.field, mission), error.reason);
    mission.validate().map_err(named)
}
