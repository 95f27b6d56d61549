//! The solve record: inputs, settings and output of a plan by checksum, and statuses.
//!
//! Everything in it follows from inputs and settings: the same plan has the same record, whatever
//! the machine. Times are not in it.

use super::{GuessRecord, PlanSettings, StageReport};
use crate::dynamics::Integrator;
use crate::model::{Field, FieldVisitor, Mission, Scenario, Start};
use crate::scp::{Log, Settings, Status};
use crate::stages::{Mode, NODES, ReorientationTrajectory, TranslationTrajectory};
use nalgebra::SVector;
use remora_qp::Checksum;
use remora_qp::{QpOutcome, QpStatus};

/// Replacement for the last iterate of a stage's SCP solver.
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
    /// Replacement for the last iterate.
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
    let mut mission = *mission;
    mission.visit(&mut sum);
    add_scenario(&mut sum, scenario);
    sum.value()
}

/// Checksum of a mission without its scenario ranges, which no plan depends on.
pub fn mission_checksum<const NL: usize>(mission: &Mission<NL>) -> u64 {
    let mut sum = Checksum::new();
    let mut mission = *mission;
    mission.visit(&mut sum);
    sum.value()
}

/// Checksum of a scenario.
pub fn scenario_checksum<const NL: usize>(scenario: &Scenario<NL>) -> u64 {
    let mut sum = Checksum::new();
    add_scenario(&mut sum, scenario);
    sum.value()
}

impl FieldVisitor for Checksum {
    fn numbers(&mut self, _: Field, values: &mut [f64]) {
        Self::numbers(self, &*values);
    }

    fn word(&mut self, _: Field, value: &mut u32) {
        self.integer(u64::from(*value));
    }
}

fn add_scenario<const NL: usize>(sum: &mut Checksum, scenario: &Scenario<NL>) {
    let Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes } =
        scenario;
    sum.numbers(target_attitude);
    sum.numbers(target_rate);
    sum.numbers(position);
    sum.numbers(velocity);
    // Fields not given add nothing: records of scenarios without them keep their checksums.
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
