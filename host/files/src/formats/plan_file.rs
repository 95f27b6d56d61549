//! Plans: `*.plan.json`.

use super::plan_inputs::{PlanGrid, PlanInputs, Program};
use super::{Clearances, Residuals, Status, Verdict};
use crate::method::{Integrator, Mode};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The `format` of plans.
pub const FORMAT: &str = "remora-plan/2";

/// A plan, as in its file. States have a row a node, controls one less.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a plan")]
pub struct PlanFile {
    /// [`FORMAT`].
    pub format: String,
    /// Program that wrote the plan; other planners may leave it out.
    pub program: Option<Program>,
    /// Id of the scenario.
    pub scenario: String,
    /// The worse of the stages'.
    pub status: Status,
    /// Verdict on the plan; other planners may leave it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Initial guess of Stage 2. Any name: a plan may come from another planner.
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
    pub inputs: PlanInputs,
    /// The times of rows.
    pub grid: PlanGrid,
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
    pub residuals: Residuals,
    /// How near bodies come to each other, by the verifier; plans of other planners need not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearances: Option<Clearances>,
}

/// Stage 1: the system centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 1")]
pub struct PlanStage1 {
    /// How it ended.
    pub status: Status,
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
    pub status: Status,
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
    pub joint_angle: Vec<Vec<f64>>,
    /// Bus rate relative to RTN, in RTN [rad/s].
    #[serde(rename = "rate_rtn_rad_s")]
    pub rate: Vec<[f64; 3]>,
    /// Joint rates [rad/s].
    #[serde(rename = "joint_rate_rad_s")]
    pub joint_rate: Vec<Vec<f64>>,
    /// Bus torque, bus body axes [N m].
    #[serde(rename = "bus_torque_body_n_m")]
    pub bus_torque: Vec<[f64; 3]>,
    /// Joint torques [N m].
    #[serde(rename = "joint_torque_n_m")]
    pub joint_torque: Vec<Vec<f64>>,
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
