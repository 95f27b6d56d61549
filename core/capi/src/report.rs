//! Results as C has them: copied out, with no pointer into the planner.
#![allow(unsafe_code, reason = "says what a structure begins with")]

use crate::abi::REMORA_JOINTS;
use crate::codes::{
    RemoraFallbackCode, RemoraRefusalCode, RemoraSolveStatus, RemoraSolveStatusCode,
    RemoraStartCode, RemoraVerdict, RemoraVerdictCode,
};
use crate::pointers::Sized32;
use core::ffi::c_char;
use remora_core::advanced::planner::{Report, StageSolveRecord, VERSION};
use remora_core::advanced::stages::{Closest, Verification};
use remora_core::prelude::{Refusal, SolveRecord};

/// Report on a plan.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraReport {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// Whether the verifier found every constraint satisfied: the plan can be flown.
    pub is_verified: u32,
    /// Verdict on the plan.
    pub verdict: RemoraVerdictCode,
    /// End of planning.
    pub status: RemoraSolveStatusCode,
    /// Initial guess of Stage 2.
    pub start: RemoraStartCode,
    /// Constraint for which the scenario was refused.
    pub refusal: RemoraRefusalCode,
    /// Name of the constraint it was refused for; empty if it was not.
    pub refusal_name: [c_char; 16],
    /// Nodes of the plan.
    pub nodes: u32,
    /// Iterations of Stage 1.
    pub iterations_1: u32,
    /// Iterations of Stage 2.
    pub iterations_2: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Time from the first node to the last [s].
    pub duration_s: f64,
    /// When a plan of remora_replan begins, on the clock of the estimates [s]; 0 for others.
    pub begins_s: f64,
    /// Cost of the path of the centre of mass.
    pub cost_1: f64,
    /// Cost of attitude and arm.
    pub cost_2: f64,
    /// Time that planning took by the caller's clock [s]; 0 without one.
    pub planning_time_s: f64,
    /// Checksum of the plan's exact bits: the same for the same input behind every door of Remora.
    pub checksum: u64,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraReport {}

impl RemoraReport {
    /// Of no plan.
    pub(crate) const NOTHING: Self = Self {
        size: size_of::<Self>() as u32,
        is_verified: 0,
        verdict: RemoraVerdict::NotFlyable as u32,
        status: RemoraSolveStatus::Infeasible as u32,
        start: 0,
        refusal: 0,
        refusal_name: [0; 16],
        nodes: 0,
        iterations_1: 0,
        iterations_2: 0,
        reserved: 0,
        duration_s: 0.0,
        begins_s: 0.0,
        cost_1: 0.0,
        cost_2: 0.0,
        planning_time_s: 0.0,
        checksum: 0,
    };

    /// Converts a report for C; the caller adds the plan's nodes and their time.
    pub(crate) fn of(report: &Report) -> Self {
        Self {
            is_verified: u32::from(report.is_verified()),
            verdict: report.verdict().code(),
            status: report.status.code(),
            start: report.record.start.code(),
            iterations_1: report.translation.outcome.iterations as u32,
            iterations_2: report.reorientation.outcome.iterations as u32,
            cost_1: report.translation.cost,
            cost_2: report.reorientation.cost,
            checksum: report.record.output,
            ..Self::NOTHING
        }
    }

    /// Converts the refusal of a scenario for C.
    pub(crate) fn refused(refusal: &Refusal) -> Self {
        Self { refusal: refusal.code(), refusal_name: text(refusal.name()), ..Self::NOTHING }
    }
}

/// The beginning of a text of ASCII letters, ended by zero.
fn text(letters: &str) -> [c_char; 16] {
    let mut text = [0; 16];
    // One place stays zero: the text's end.
    let places = text.iter_mut().take(15).zip(letters.bytes());
    places.for_each(|(place, letter)| *place = letter as c_char);
    text
}

/// A plan at one of its nodes. Controls hold from there to the next node; at the last they are zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraNode {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// The node, from 0.
    pub index: u32,
    /// Time since the first node [s].
    pub time_s: f64,
    /// Centre of mass of bus and arm from the target's, RTN [m].
    pub com_position_rtn_m: [f64; 3],
    /// Its velocity relative to RTN, in RTN [m/s].
    pub com_velocity_rtn_m_s: [f64; 3],
    /// Attitude of the bus.
    pub bus_attitude_body_to_rtn: [f64; 4],
    /// Its angular velocity relative to RTN, in RTN [rad/s].
    pub bus_rate_rtn_rad_s: [f64; 3],
    /// Joint angles [rad].
    pub joint_angle_rad: [f64; REMORA_JOINTS],
    /// Joint rates [rad/s].
    pub joint_rate_rad_s: [f64; REMORA_JOINTS],
    /// Force on the bus at its centre of mass, RTN [N].
    pub bus_force_rtn_n: [f64; 3],
    /// Torque on the bus, bus axes [N m].
    pub bus_torque_body_n_m: [f64; 3],
    /// Joint torques [N m].
    pub joint_torque_n_m: [f64; REMORA_JOINTS],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraNode {}

/// How near two bodies come to each other.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraClosest {
    /// Distance of their surfaces [m]; negative where they overlap, infinite where nobody has looked.
    pub distance_m: f64,
    /// Time since the first node [s].
    pub time_s: f64,
    /// 0 the bus, then the links, from 1.
    pub body: u32,
    /// Nothing; zero.
    pub reserved: u32,
}

impl RemoraClosest {
    fn of(closest: &Closest) -> Self {
        let Closest { distance, time_s, body } = *closest;
        Self { distance_m: distance, time_s, body, reserved: 0 }
    }
}

/// Findings of the independent verifier: residuals, zero where a constraint is satisfied, and distances.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraVerification {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// Whether every residual is within the mission's tolerance.
    pub is_verified: u32,
    /// Dynamics of Stage 1, over 1 m and 1e-2 m/s.
    pub dynamics1: f64,
    /// Dynamics of Stage 2, over 1, 1 rad and 1e-2 rad/s.
    pub dynamics2: f64,
    /// Controls beyond their limits, over these.
    pub control: f64,
    /// Joints beyond their stops [rad].
    pub joint_rad: f64,
    /// Joint rates beyond their limits, over these.
    pub joint_rate: f64,
    /// Port out of view, in cosine.
    pub pointing: f64,
    /// Arm off its capture angles, over 1 rad and 1e-2 rad/s.
    pub preset: f64,
    /// Rate of the bus relative to the target at capture, over 1e-2 rad/s.
    pub terminal_rate: f64,
    /// Within the keep-out distance [m].
    pub keep_out_m: f64,
    /// End effector off the port [m].
    pub ee_position_m: f64,
    /// End effector off the direction of approach [rad].
    pub ee_angle_rad: f64,
    /// Overlap of bodies [m].
    pub clearance_m: f64,
    /// Arm and target.
    pub arm: RemoraClosest,
    /// Bus and target.
    pub bus: RemoraClosest,
    /// Arm and its own bus.
    pub own: RemoraClosest,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraVerification {}

impl RemoraVerification {
    /// Converts the verifier's findings for C.
    pub(crate) fn of(found: &Verification, is_verified: bool) -> Self {
        let (r, c) = (&found.residuals, &found.clearances);
        Self {
            size: size_of::<Self>() as u32,
            is_verified: u32::from(is_verified),
            dynamics1: r.dynamics1,
            dynamics2: r.dynamics2,
            control: r.control,
            joint_rad: r.joint,
            joint_rate: r.joint_rate,
            pointing: r.pointing,
            preset: r.preset,
            terminal_rate: r.terminal_rate,
            keep_out_m: r.keep_out,
            ee_position_m: r.ee_position,
            ee_angle_rad: r.ee_angle,
            clearance_m: r.clearance,
            arm: RemoraClosest::of(&c.arm),
            bus: RemoraClosest::of(&c.bus),
            own: RemoraClosest::of(&c.own),
        }
    }
}

/// A stage in the record.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraStage {
    /// End of the stage.
    pub status: RemoraSolveStatusCode,
    /// Iterations.
    pub iterations: u32,
    /// Second-order corrections.
    pub corrections: u32,
    /// Iterations of the solver of all its subproblems.
    pub qp_iterations: u32,
    /// Subproblems not solved to full accuracy.
    pub qp_unsolved: u32,
    /// Iterate that was left in place of the last one.
    pub fallback: RemoraFallbackCode,
}

impl RemoraStage {
    fn of(stage: &StageSolveRecord) -> Self {
        let StageSolveRecord { status, iterations, corrections, .. } = *stage;
        let StageSolveRecord { qp_iterations, qp_unsolved, fallback, .. } = *stage;
        let (status, fallback) = (status.code(), fallback.code());
        Self { status, iterations, corrections, qp_iterations, qp_unsolved, fallback }
    }
}

/// The record to file with a plan. The same input leaves the same one on every machine: no time is in it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraRecord {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// End of planning.
    pub status: RemoraSolveStatusCode,
    /// Whether the verifier found every residual within its tolerance.
    pub is_verified: u32,
    /// Initial guess of Stage 2.
    pub start: RemoraStartCode,
    /// Limits that the start violates and the plan leads back into: a sum of RemoraRecovery.
    pub recovery: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Checksum of mission and scenario.
    pub input: u64,
    /// Checksum of options, horizon and solver.
    pub settings: u64,
    /// Checksum of the plan.
    pub output: u64,
    /// Stage 1.
    pub translation: RemoraStage,
    /// Stage 2.
    pub reorientation: RemoraStage,
    /// Version of the planner, ended by zero.
    pub version: [c_char; 16],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraRecord {}

/// The planner's version fits.
const _: () = assert!(VERSION.len() < 16);

impl RemoraRecord {
    /// Converts the solve record for C.
    pub(crate) fn of(record: &SolveRecord) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            status: record.status.code(),
            is_verified: u32::from(record.is_verified),
            start: record.start.code(),
            recovery: record.recovery,
            reserved: 0,
            input: record.input,
            settings: record.settings,
            output: record.output,
            translation: RemoraStage::of(&record.translation),
            reorientation: RemoraStage::of(&record.reorientation),
            version: text(record.version),
        }
    }
}
