//! Inputs of a plan in its file: scenario, mission, time grid and program. The file stands
//! alone with them.

use super::{
    MISSION_FORMAT, Mission, MissionFile, NamedScenario, Scenario, ServicerStart, TargetStart, json,
};
use crate::error::FieldError;
use crate::method::Integrator;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Scenario and mission of a plan, whole, with the checksums by which others are compared to them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with scenario and mission")]
pub struct PlanInputs {
    /// The scenario.
    pub scenario: PlanScenario,
    /// Checksum of the scenario: 16 hexadecimal digits.
    pub scenario_checksum: String,
    /// The mission, every number given.
    pub mission: MissionFile,
    /// Checksum of the mission, but for the ranges that scenarios are drawn from.
    pub mission_checksum: String,
    /// Settings that the mission leaves to the integrator, with the values used.
    pub in_force: InForce,
}

/// A scenario by keys that name frames and units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a scenario")]
pub struct PlanScenario {
    /// The target's attitude at t = 0, `[x, y, z, w]`.
    pub target_attitude_body_to_rtn: [f64; 4],
    /// Its angular velocity relative to RTN at t = 0, in its body axes [rad/s].
    pub target_rate_body_rad_s: [f64; 3],
    /// The system's centre of mass at t = 0 [m].
    pub servicer_position_rtn_m: [f64; 3],
    /// Its velocity relative to RTN [m/s].
    pub servicer_velocity_rtn_m_s: [f64; 3],
    /// The bus's attitude at t = 0, where it was given, `[x, y, z, w]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bus_attitude_body_to_rtn: Option<[f64; 4]>,
    /// Its angular velocity relative to RTN, where it was given [rad/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bus_rate_rtn_rad_s: Option<[f64; 3]>,
    /// The joint angles at t = 0, where they were given [rad].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_angle_rad: Option<Vec<f64>>,
    /// The joint rates at t = 0, where they were given [rad/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_rate_rad_s: Option<Vec<f64>>,
    /// The time to capture, where it was given [s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// The number of nodes, where it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
}

/// Parts of the problem beyond the paper's that the plan was made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with what is in force")]
pub struct InForce {
    /// The gravity gradient turns the target.
    pub gravity_gradient: bool,
    /// Bodies stay clear of each other.
    pub clearance: bool,
    /// Limits hold between the nodes.
    pub between_nodes: bool,
}

/// The times that rows belong to: row `k` is at `k dt_s`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the time grid")]
pub struct PlanGrid {
    /// Number of nodes, which is that of the rows of states.
    pub nodes: usize,
    /// Time from node to node [s].
    pub dt_s: f64,
    /// The node, from 0, from which the arm has its capture configuration.
    pub preset_node: usize,
}

/// Mission and scenario of a plan, read from its file and validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MadeFor {
    /// The mission; valid.
    pub mission: Mission,
    /// The scenario.
    pub scenario: Scenario,
}

/// The program that made a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with version and commit")]
pub struct Program {
    /// Its version.
    pub version: String,
    /// Commit of its sources; `unknown` where the build was not told.
    pub commit: String,
}

/// Version of this program and the commit that it was built of, for people.
pub const VERSION: &str = env!("REMORA_VERSION");

impl Program {
    /// This one.
    pub fn this() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").into(), commit: env!("REMORA_COMMIT").into() }
    }
}

/// The frames that keys name.
const FRAMES: [(&str, &str); 4] = [
    (
        "rtn",
        "axes radially outward, along track, along the orbit normal, at the target's centre of mass; rotating with the orbit",
    ),
    ("body", "axes fixed in the body that the key is of: bus or target"),
    (
        "body_to_rtn",
        "attitude quaternion [x, y, z, w] that turns body components into RTN components",
    ),
    (
        "rate",
        "angular velocity relative to RTN; joint angles and rates are of each joint about its axis, from the bus outwards",
    ),
];

/// The frames that a plan's keys name, in words.
pub fn frames() -> BTreeMap<String, String> {
    FRAMES.map(|(name, words)| (name.to_string(), words.to_string())).into()
}

impl PlanGrid {
    /// The grid of a scenario's plan.
    pub fn of(mission: &Mission, scenario: &Scenario) -> Self {
        let grid = mission.grid(scenario);
        Self { nodes: grid.nodes, dt_s: grid.interval(), preset_node: grid.preset_node() }
    }

    /// Refuses a grid that is not that of mission and scenario.
    pub(super) fn check(&self, mission: &Mission, scenario: &Scenario) -> Result<(), FieldError> {
        let is = Self::of(mission, scenario);
        let differs = |field: &str, said: String, is: String| {
            let reason = format!("is {said}, that of its inputs is {is}");
            Err(FieldError::new(format!("grid.{field}"), reason))
        };
        if self.nodes != is.nodes {
            return differs("nodes", self.nodes.to_string(), is.nodes.to_string());
        }
        if self.preset_node != is.preset_node {
            return differs(
                "preset_node",
                self.preset_node.to_string(),
                is.preset_node.to_string(),
            );
        }
        // Another program may have divided otherwise.
        if !((self.dt_s - is.dt_s).abs() <= 1e-12 * is.dt_s) {
            return differs("dt_s", self.dt_s.to_string(), is.dt_s.to_string());
        }
        Ok(())
    }
}

impl PlanScenario {
    /// The scenario as a set names it.
    pub fn named(&self, id: &str) -> NamedScenario {
        NamedScenario {
            id: id.into(),
            target: TargetStart {
                attitude: self.target_attitude_body_to_rtn,
                rate: self.target_rate_body_rad_s,
            },
            servicer: ServicerStart {
                position: self.servicer_position_rtn_m,
                velocity: self.servicer_velocity_rtn_m_s,
                bus_attitude_body_to_rtn: self.bus_attitude_body_to_rtn,
                bus_rate_rtn_rad_s: self.bus_rate_rtn_rad_s,
                joint_angle_rad: self.joint_angle_rad.clone(),
                joint_rate_rad_s: self.joint_rate_rad_s.clone(),
            },
            duration_s: self.duration_s,
            nodes: self.nodes,
        }
    }
}

impl From<&NamedScenario> for PlanScenario {
    fn from(scenario: &NamedScenario) -> Self {
        Self {
            target_attitude_body_to_rtn: scenario.target.attitude,
            target_rate_body_rad_s: scenario.target.rate,
            servicer_position_rtn_m: scenario.servicer.position,
            servicer_velocity_rtn_m_s: scenario.servicer.velocity,
            bus_attitude_body_to_rtn: scenario.servicer.bus_attitude_body_to_rtn,
            bus_rate_rtn_rad_s: scenario.servicer.bus_rate_rtn_rad_s,
            joint_angle_rad: scenario.servicer.joint_angle_rad.clone(),
            joint_rate_rad_s: scenario.servicer.joint_rate_rad_s.clone(),
            duration_s: scenario.duration_s,
            nodes: scenario.nodes,
        }
    }
}

impl PlanInputs {
    /// The inputs of a plan that is made with this integrator.
    pub fn new(mission: &Mission, scenario: &NamedScenario, integrator: Integrator) -> Self {
        let file = MissionFile::of(mission);
        // Readers compute the checksum from the numbers in the file, so it is computed from those.
        let written = file.mission().unwrap_or(*mission);
        Self {
            scenario: scenario.into(),
            scenario_checksum: checksum_of_scenario(mission, &scenario.scenario()),
            mission: file,
            mission_checksum: checksum_of_mission(&written),
            in_force: InForce {
                gravity_gradient: mission.target.gravity_gradient.is_on(integrator),
                clearance: mission.approach.clearance.is_on(integrator),
                between_nodes: mission.approach.between_nodes.is_on(integrator),
            },
        }
    }

    /// Mission and scenario, looked at.
    ///
    /// # Errors
    /// The first field found wrong; checksums that are not those of what they stand beside.
    pub fn read(&self, id: &str) -> Result<MadeFor, FieldError> {
        let within = |part: &str, error: FieldError| {
            FieldError::new(format!("inputs.{part}.{}", error.field), error.reason)
        };
        json::check_format(Some(&self.mission.format), MISSION_FORMAT)
            .map_err(|error| within("mission", error))?;
        let mission = self.mission.mission().map_err(|error| within("mission", error))?;
        let named = self.scenario.named(id);
        named.validate().map_err(|error| {
            FieldError::new(format!("inputs.scenario.{}", key_of(&error.field)), error.reason)
        })?;
        named.check_joints(mission.joints()).map_err(|error| {
            FieldError::new(format!("inputs.scenario.{}", key_of(&error.field)), error.reason)
        })?;
        let scenario = named.scenario();
        let agrees = |part: &str, said: &str, is: String| {
            let reason = format!("says {said}, the {part} beside it has {is}");
            let field = format!("inputs.{part}_checksum");
            if said == is { Ok(()) } else { Err(FieldError::new(field, reason)) }
        };
        agrees("scenario", &self.scenario_checksum, checksum_of_scenario(&mission, &scenario))?;
        agrees("mission", &self.mission_checksum, checksum_of_mission(&mission))?;
        Ok(MadeFor { mission, scenario })
    }
}

/// A plan's key for a field of a scenario set.
fn key_of(field: &str) -> &str {
    match field {
        "target.attitude" => "target_attitude_body_to_rtn",
        "target.rate" => "target_rate_body_rad_s",
        "servicer.position" => "servicer_position_rtn_m",
        "servicer.velocity" => "servicer_velocity_rtn_m_s",
        _ => field.strip_prefix("servicer.").unwrap_or(field),
    }
}

/// Checksum of a mission as files hold it.
pub fn checksum_of_mission(mission: &Mission) -> String {
    format!("{:016x}", mission.checksum())
}

/// Checksum of a scenario of a mission as files hold it.
pub fn checksum_of_scenario(mission: &Mission, scenario: &Scenario) -> String {
    format!("{:016x}", mission.scenario_checksum(scenario))
}
