//! The solve record: inputs, settings and output of a plan by checksum, and statuses.
//!
//! Everything in it follows from inputs and settings: the same plan has the same record, whatever
//! the machine. Times are not in it.

use super::{GuessRecord, PlanSettings, StageReport};
use crate::dynamics::Integrator;
use crate::model::{
    Approach, Corridor, Grid, Link, Margins, Mission, Orbit, Roll, Scenario, Servicer, Start,
    Target, Tolerances, Typical, Weights,
};
use crate::scp::{Log, Settings, Status};
use crate::stages::{Mode, NODES, ReorientationTrajectory, TranslationTrajectory};
use nalgebra::{Matrix3, SVector};
use remora_qp::Checksum;
use remora_qp::{QpOutcome, QpStatus};

/// What was left in the place of the iterate at which a stage's loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum Fallback {
    /// Nothing: the last iterate stands.
    #[default]
    None = 0,
    /// The best feasible iterate, not the last one.
    EarlierIterate = 1,
    /// The initial guess: no step was accepted.
    Start = 2,
}

impl Fallback {
    /// Code for records; it never changes its meaning.
    pub fn code(self) -> u32 {
        self as u32
    }
}

/// Solve record of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "serde", serde(expecting = "an object with the record of a stage"))]
pub struct StageSolveRecord {
    /// Status of the SCP solver.
    pub status: Status,
    /// Iterations; those of Stage 1 include its initial guess.
    pub iterations: u32,
    /// Second-order corrections.
    pub corrections: u32,
    /// Interior-point iterations of all QPs together.
    pub qp_iterations: u32,
    /// Number of QPs not solved to full accuracy.
    pub qp_unsolved: u32,
    /// What replaces the last iterate.
    pub fallback: Fallback,
}

impl StageSolveRecord {
    pub(super) fn new(report: &StageReport, log: &Log) -> Self {
        let outcome = &report.outcome;
        let moved = log.iter().any(|record| record.accepted);
        Self {
            status: outcome.status,
            iterations: outcome.iterations as u32,
            corrections: outcome.corrections as u32,
            qp_iterations: log.iter().map(|record| record.qp_iterations).sum(),
            qp_unsolved: log.iter().map(|record| record.qp_unsolved).sum(),
            fallback: match outcome.status {
                Status::Solved => Fallback::None,
                _ if outcome.is_earlier => Fallback::EarlierIterate,
                _ if !moved => Fallback::Start,
                _ => Fallback::None,
            },
        }
    }

    /// This record of a later try with the counts of the first added.
    pub(super) fn after(mut self, first: &Self) -> Self {
        self.iterations += first.iterations;
        self.corrections += first.corrections;
        self.qp_iterations += first.qp_iterations;
        self.qp_unsolved += first.qp_unsolved;
        self
    }

    /// Adds a QP outside the SCP solver to the counts.
    pub(super) fn count(&mut self, qp: QpOutcome) {
        self.qp_iterations += qp.iterations;
        self.qp_unsolved += u32::from(qp.status != QpStatus::Solved);
    }
}

/// Solve record of a plan. Checksums are 64-bit FNV-1a over exact bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolveRecord {
    /// Version of this crate.
    pub version: &'static str,
    /// Checksum of mission and scenario.
    pub input: u64,
    /// Checksum of options, horizon and solvers with their settings.
    pub settings: u64,
    /// Checksum of the plan: see [`output_checksum`].
    pub output: u64,
    /// Status of the plan.
    pub status: Status,
    /// Whether the verifier found every residual within its tolerance.
    pub is_verified: bool,
    /// Limits that the given start violates and the plan leads back into, a bit each, in the order of
    /// [`RECOVERY_NAMES`](crate::model::RECOVERY_NAMES).
    pub recovery: u32,
    /// Initial guess of Stage 2.
    pub start: GuessRecord,
    /// Stage 1.
    pub translation: StageSolveRecord,
    /// Stage 2.
    pub reorientation: StageSolveRecord,
}

impl SolveRecord {
    /// A record of inputs and settings, before planning.
    pub(super) fn new(input: u64, settings: u64) -> Self {
        Self {
            version: VERSION,
            input,
            settings,
            output: 0,
            status: Status::default(),
            is_verified: false,
            recovery: 0,
            start: GuessRecord::default(),
            translation: StageSolveRecord::default(),
            reorientation: StageSolveRecord::default(),
        }
    }
}

/// Version of this crate.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Checksum of a plan of so many `nodes`: positions, velocities and forces, then attitudes, joint angles,
/// rates, joint rates and torques, in the order and number of a plan file's rows. Cost: 13 kB of FNV-1a.
pub fn output_checksum<const N: usize, const NL: usize>(
    nodes: usize,
    translation: &TranslationTrajectory<N>,
    reorientation: &ReorientationTrajectory<N, NL>,
) -> u64 {
    let mut sum = Checksum::new();
    // The last controls are not part of the plan.
    let intervals = nodes.saturating_sub(1);
    let states = || reorientation.states.iter().take(nodes);
    let controls = || reorientation.controls.iter().take(intervals);
    translation.position.iter().take(nodes).for_each(|r| sum.numbers(r));
    translation.velocity.iter().take(nodes).for_each(|v| sum.numbers(v));
    translation.force.iter().take(intervals).for_each(|f| sum.numbers(f));
    states().for_each(|x| sum.numbers(&x.attitude));
    states().for_each(|x| sum.numbers(&x.joint_angle));
    states().for_each(|x| sum.numbers(&x.rate));
    states().for_each(|x| sum.numbers(&x.joint_rate));
    controls().for_each(|u| sum.numbers(&u.bus_torque));
    controls().for_each(|u| sum.numbers(&u.joint_torque));
    sum.value()
}

/// Checksum of mission and scenario together, the inputs of a plan.
pub fn input_checksum<const NL: usize>(mission: &Mission<NL>, scenario: &Scenario<NL>) -> u64 {
    let mut sum = Checksum::new();
    add_mission(&mut sum, mission);
    add_scenario(&mut sum, scenario);
    sum.value()
}

/// Checksum of a mission without its scenario ranges, which no plan depends on.
pub fn mission_checksum<const NL: usize>(mission: &Mission<NL>) -> u64 {
    let mut sum = Checksum::new();
    add_mission(&mut sum, mission);
    sum.value()
}

/// Checksum of a scenario.
pub fn scenario_checksum<const NL: usize>(scenario: &Scenario<NL>) -> u64 {
    let mut sum = Checksum::new();
    add_scenario(&mut sum, scenario);
    sum.value()
}

/// Adds a mission. Fields are destructured here and below, so that a new one cannot be forgotten.
fn add_mission<const NL: usize>(sum: &mut Checksum, mission: &Mission<NL>) {
    let Mission {
        orbit,
        target,
        servicer,
        approach,
        weights,
        tolerances,
        margins,
        corridor,
        // Scenarios are sampled from these; a plan has one.
        scenarios: _,
        typical_magnitudes,
        roll,
    } = mission;
    add_orbit(sum, orbit);
    add_target(sum, target);
    add_servicer(sum, servicer);
    add_approach(sum, approach, &mission.own_grid());
    add_weights(sum, weights);
    add_tolerances(sum, tolerances);
    let Margins { joint_angle, joint_rate, keep_out, field_of_view, clearance } = margins;
    sum.numbers([joint_angle, joint_rate, keep_out, field_of_view, clearance]);
    let Corridor { half_angle, mouth_radius, end_effector_length } = corridor;
    sum.numbers([half_angle, mouth_radius, end_effector_length]);
    if let Some(typical) = typical_magnitudes {
        let Typical { length, velocity, force, angle, rate, joint_rate, bus_torque, joint_torque } =
            typical;
        sum.numbers([length, velocity, force, angle, rate, joint_rate, bus_torque, joint_torque]);
    }
    if let Some(Roll { end_effector, port }) = roll {
        sum.numbers(end_effector);
        sum.numbers(port);
    }
}

fn add_scenario<const NL: usize>(sum: &mut Checksum, scenario: &Scenario<NL>) {
    let Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes } =
        scenario;
    sum.numbers(target_attitude);
    sum.numbers(target_rate);
    sum.numbers(position);
    sum.numbers(velocity);
    // What is not given adds nothing: records of scenarios without it keep their checksums.
    let Start { bus_attitude, bus_rate, joint_angle, joint_rate } = start;
    if start.is_given() {
        sum.integer(u64::from(bus_attitude.is_some()) + 2 * u64::from(joint_angle.is_some()));
        sum.numbers(&bus_attitude.unwrap_or_default());
        sum.numbers(bus_rate);
        sum.numbers(&joint_angle.unwrap_or_else(SVector::zeros));
        sum.numbers(joint_rate);
    }
    if let Some(duration) = duration {
        sum.numbers([duration]);
    }
    if let Some(nodes) = nodes {
        sum.integer(*nodes as u64);
    }
}

/// Adds a plan's settings to a checksum.
pub(super) fn add_options(sum: &mut Checksum, options: &PlanSettings) {
    let PlanSettings { mode, integrator, deadline_s, translation, reorientation, learned } =
        options;
    sum.integer(NODES as u64);
    sum.integer(match mode {
        Mode::Optimal => 0,
        Mode::Feasible => 1,
    });
    sum.integer(match integrator {
        Integrator::Euler => 0,
        Integrator::Rk4 { substeps } => *substeps as u64,
    });
    sum.numbers([deadline_s]);
    add_settings(sum, translation);
    add_settings(sum, reorientation);
    add_settings(sum, learned);
}

fn add_settings(sum: &mut Checksum, settings: &Settings) {
    let Settings {
        max_iterations,
        stop_when_feasible,
        cost_tolerance,
        absolute_cost_tolerance,
        radius,
        min_radius,
        max_radius,
        eta_0,
        eta_1,
        eta_2,
        shrink,
        grow,
        penalty_parameter,
        max_penalty_parameter,
        penalty_growth,
        curvature_below,
        correct_below,
        max_corrections,
    } = settings;
    sum.integer(*max_iterations as u64);
    sum.integer(u64::from(*stop_when_feasible));
    sum.integer(u64::from(*max_corrections));
    sum.numbers([cost_tolerance, absolute_cost_tolerance]);
    sum.numbers([radius, min_radius, max_radius, eta_0, eta_1, eta_2]);
    sum.numbers([
        shrink,
        grow,
        penalty_parameter,
        max_penalty_parameter,
        penalty_growth,
        curvature_below,
        correct_below,
    ]);
}

fn add_orbit(sum: &mut Checksum, orbit: &Orbit) {
    // No plan depends on the body's name and radius.
    let Orbit { gravitational_parameter, semi_major_axis, eccentricity, inclination, body: _ } =
        orbit;
    sum.numbers([gravitational_parameter, semi_major_axis, eccentricity, inclination]);
}

fn add_target(sum: &mut Checksum, target: &Target) {
    let Target { half_extents, inertia, mass, port_position, port_normal, gravity_gradient } =
        target;
    sum.integer(*gravity_gradient as u64);
    sum.numbers(half_extents);
    sum.numbers(inertia);
    sum.numbers([mass]);
    sum.numbers(port_position);
    sum.numbers(port_normal);
}

fn add_servicer<const NL: usize>(sum: &mut Checksum, servicer: &Servicer<NL>) {
    let Servicer {
        bus_mass,
        bus_inertia,
        bus_half_extents,
        boresight,
        arm_base,
        links,
        min_joint_angle,
        max_joint_angle,
        max_joint_rate,
        initial_joint_angle,
        capture_joint_angle,
        max_force,
        max_bus_torque,
        max_joint_torque,
    } = servicer;
    sum.numbers([bus_mass]);
    sum.numbers(&bus_inertia.diagonal());
    sum.numbers(bus_half_extents);
    sum.numbers(boresight);
    sum.numbers(arm_base);
    for Link { tip, center_of_mass, mass, inertia, axis, armature: _, radius } in links {
        sum.numbers([radius]);
        sum.numbers(tip);
        sum.numbers(center_of_mass);
        sum.numbers([mass]);
        sum.numbers(&inertia.diagonal());
        sum.numbers(axis);
    }
    sum.numbers(max_joint_angle);
    sum.numbers(initial_joint_angle);
    sum.numbers(capture_joint_angle);
    // As one limit for all joints and axes, as older records have them: the first.
    sum.numbers([&max_joint_rate[0], &max_force[0], &max_bus_torque[0], &max_joint_torque[0]]);
    // What older missions could not say.
    add_new(sum, 1, min_joint_angle.as_slice(), (-max_joint_angle).as_slice());
    let joints = [max_joint_rate.as_slice(), max_joint_torque.as_slice()];
    let axes = [max_force.as_slice(), max_bus_torque.as_slice()];
    let limits = joints.into_iter().chain(axes);
    for (tag, limits) in (2..).zip(limits) {
        add_new(sum, tag, limits, limits.get(..1).unwrap_or_default());
    }
    add_new(sum, 6, &products(bus_inertia), &[0.0]);
    for (tag, link) in (10..).zip(links) {
        add_new_of_link(sum, tag, link);
    }
}

/// Products of inertia.
fn products(inertia: &Matrix3<f64>) -> [f64; 3] {
    [inertia[(0, 1)], inertia[(0, 2)], inertia[(1, 2)]]
}

#[inline(never)]
fn add_new_of_link(sum: &mut Checksum, tag: u64, link: &Link) {
    add_new(sum, tag, &products(&link.inertia), &[0.0]);
    add_new(sum, 100 + tag, &[link.armature], &[0.0]);
}

/// Adds numbers that older missions could not say, after one that tells them apart, where they are not
/// what those meant, one for each or one for all: checksums of older missions stay.
#[inline(never)]
fn add_new(sum: &mut Checksum, tag: u64, numbers: &[f64], meant: &[f64]) {
    if numbers.iter().zip(meant.iter().cycle()).any(|(number, meant)| number != meant) {
        sum.integer(tag);
        sum.numbers(numbers);
    }
}

fn add_approach(sum: &mut Checksum, approach: &Approach, grid: &Grid) {
    let Approach {
        duration,
        nodes,
        keep_out_far,
        keep_out_near,
        keep_out_near_time,
        field_of_view_half_angle,
        preset_time,
        recovery_time,
        clearance,
        between_nodes,
    } = approach;
    sum.integer(*clearance as u64);
    sum.integer(*between_nodes as u64);
    // As fraction and intervals of the mission's own horizon, as older records have them.
    let near = 1.0 - keep_out_near_time / duration;
    let lead = grid.preset_lead();
    sum.numbers([duration, keep_out_far, keep_out_near, &near]);
    sum.numbers([field_of_view_half_angle]);
    sum.integer(lead as u64);
    // What older missions could not say.
    let usual = Approach::default();
    if *preset_time != usual.preset_time && *preset_time != lead as f64 * grid.interval() {
        sum.numbers([preset_time]);
    }
    if *nodes != usual.nodes {
        sum.integer(*nodes as u64);
    }
    if *recovery_time != usual.recovery_time {
        sum.numbers([recovery_time]);
    }
}

fn add_weights(sum: &mut Checksum, weights: &Weights) {
    let Weights { force, force_change, bus_torque, joint_torque } = weights;
    sum.numbers([force, force_change, bus_torque, joint_torque]);
}

fn add_tolerances(sum: &mut Checksum, tolerances: &Tolerances) {
    let Tolerances {
        dynamics,
        control,
        joint,
        joint_rate,
        pointing,
        preset,
        terminal_rate,
        keep_out,
        end_effector_position,
        end_effector_angle,
        clearance,
    } = tolerances;
    sum.numbers([dynamics, control, joint, joint_rate, pointing, preset, terminal_rate]);
    sum.numbers([keep_out, end_effector_position, end_effector_angle, clearance]);
}
