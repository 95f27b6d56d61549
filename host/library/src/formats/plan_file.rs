//! Plans: `*.plan.json`.

use super::plan_inputs::{PlanGrid, PlanInputs, Program};
use super::{PlanClearances, PlanVerdict};
use crate::method::{Integrator, Mode};
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::LINKS;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The `format` of the plans this version writes. It reads `remora-plan/1` too.
pub const FORMAT: &str = "remora-plan/2";

/// A plan, as in its file. States have `NODES` rows, controls one less. What is optional is missing
/// in plans of the first format, and required in all others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a plan")]
pub struct PlanFile {
    /// [`FORMAT`].
    pub format: String,
    /// What wrote it.
    pub program: Option<Program>,
    /// Id of the scenario.
    pub scenario: String,
    /// The worse of the stages'.
    pub status: PlanStatus,
    /// What the plan is good for; plans of other planners need not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<PlanVerdict>,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Start of Stage 2. Any name: a plan may come from another planner.
    pub warm_start: String,
    /// Solver of the subproblems. Any name.
    pub qp: String,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time of the whole plan [s].
    pub time_s: Option<f64>,
    /// Processor time of the planning thread [s]; none where the system does not tell.
    pub cpu_time_s: Option<f64>,
    /// Scenario and mission.
    pub inputs: Option<PlanInputs>,
    /// The times of rows.
    pub grid: Option<PlanGrid>,
    /// The frames that keys name, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<BTreeMap<String, String>>,
    /// Path of the system centre of mass.
    pub stage1: PlanStage1,
    /// Bus attitude and arm.
    pub stage2: PlanStage2,
    /// The target at the nodes.
    pub target: PlanTarget,
    /// Residuals by the verifier.
    pub residuals: PlanResiduals,
    /// How near bodies come to each other, by the verifier; plans of other planners need not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearances: Option<PlanClearances>,
}

/// How a stage or a plan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanStatus {
    /// Feasible, and settled where that was asked for.
    Solved,
    /// The iteration limit was reached first.
    IterationLimit,
    /// The convex subproblem has no feasible point.
    Infeasible,
    /// Time ran out first.
    Deadline,
    /// Arithmetic or the subproblem's solver broke down.
    NumericalFailure,
}

/// Stage 1: the system centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 1")]
pub struct PlanStage1 {
    /// How it ended.
    pub status: PlanStatus,
    /// Iterations.
    pub iterations: u64,
    /// Cost.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
    /// Position in RTN [m].
    #[serde(rename = "position_rtn_m")]
    pub position: Vec<[f64; 3]>,
    /// Velocity relative to RTN, in RTN [m/s].
    #[serde(rename = "velocity_rtn_m_s")]
    pub velocity: Vec<[f64; 3]>,
    /// Force in RTN [N].
    #[serde(rename = "force_rtn_n")]
    pub force: Vec<[f64; 3]>,
}

/// Stage 2: bus attitude and arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 2")]
pub struct PlanStage2 {
    /// How it ended.
    pub status: PlanStatus,
    /// Iterations.
    pub iterations: u64,
    /// Cost.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
    /// Part of it spent in a learned warm start [s].
    pub inference_s: f64,
    /// Bus attitude, body to RTN, `[x, y, z, w]`.
    #[serde(rename = "attitude_body_to_rtn")]
    pub attitude: Vec<[f64; 4]>,
    /// Joint angles [rad].
    #[serde(rename = "joint_angle_rad")]
    pub joint_angle: Vec<[f64; LINKS]>,
    /// Bus rate relative to RTN, in RTN [rad/s].
    #[serde(rename = "rate_rtn_rad_s")]
    pub rate: Vec<[f64; 3]>,
    /// Joint rates [rad/s].
    #[serde(rename = "joint_rate_rad_s")]
    pub joint_rate: Vec<[f64; LINKS]>,
    /// Bus torque, bus body axes [N m].
    #[serde(rename = "bus_torque_body_n_m")]
    pub bus_torque: Vec<[f64; 3]>,
    /// Joint torques [N m].
    #[serde(rename = "joint_torque_n_m")]
    pub joint_torque: Vec<[f64; LINKS]>,
}

/// The target's tumble at the nodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the target's attitude and rate")]
pub struct PlanTarget {
    /// Attitude, body to RTN, `[x, y, z, w]`.
    #[serde(rename = "attitude_body_to_rtn")]
    pub attitude: Vec<[f64; 4]>,
    /// Angular velocity relative to RTN, in RTN [rad/s].
    #[serde(rename = "rate_rtn_rad_s")]
    pub rate: Vec<[f64; 3]>,
}

/// Residuals of a plan, each zero or positive, in the units of the problem definition; infinite, and
/// `null` in the file, where the deadline passed before the verifier had finished.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the residuals")]
pub struct PlanResiduals {
    /// Stage 1 dynamics, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub dynamics1: f64,
    /// Keep-out [m].
    #[serde(deserialize_with = "null_is_infinity")]
    pub keep_out: f64,
    /// Stage 2 dynamics, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub dynamics2: f64,
    /// Control bounds, relative.
    #[serde(deserialize_with = "null_is_infinity")]
    pub control: f64,
    /// Joint limits [rad].
    #[serde(deserialize_with = "null_is_infinity")]
    pub joint: f64,
    /// Joint rates, relative.
    #[serde(deserialize_with = "null_is_infinity")]
    pub joint_rate: f64,
    /// Pointing, in cosine.
    #[serde(deserialize_with = "null_is_infinity")]
    pub pointing: f64,
    /// Arm preset, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub preset: f64,
    /// Terminal bus rate, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub terminal_rate: f64,
    /// End effector from the port [m].
    #[serde(deserialize_with = "null_is_infinity")]
    pub ee_position: f64,
    /// Approach direction [rad].
    #[serde(deserialize_with = "null_is_infinity")]
    pub ee_angle: f64,
    /// Overlap of bodies [m]; plans of older versions have none.
    #[serde(default, deserialize_with = "null_is_infinity")]
    pub clearance: f64,
}

/// JSON has no infinity, which is the residual of a verifier that did not finish: it is written as
/// null.
fn null_is_infinity<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl PlanStatus {
    /// All of them, best first.
    pub const ALL: [Self; 5] = [
        Self::Solved,
        Self::IterationLimit,
        Self::Infeasible,
        Self::Deadline,
        Self::NumericalFailure,
    ];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::IterationLimit => "iteration_limit",
            Self::Infeasible => "infeasible",
            Self::Deadline => "deadline",
            Self::NumericalFailure => "numerical_failure",
        }
    }
}

impl fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl From<Status> for PlanStatus {
    fn from(status: Status) -> Self {
        match status {
            Status::Solved => Self::Solved,
            Status::IterationLimit => Self::IterationLimit,
            Status::Infeasible => Self::Infeasible,
            Status::Deadline => Self::Deadline,
            _ => Self::NumericalFailure,
        }
    }
}
