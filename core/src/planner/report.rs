//! Report of a plan.

use super::SolveRecord;
use crate::model::Refusal;
use crate::scp::{Log, Outcome, Status};
use crate::stages::{ArmClearances, Clearances, Residuals};
use core::fmt;

/// Report of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StageReport {
    /// Outcome of the SCP solver.
    pub outcome: Outcome,
    /// Cost by the problem's definition.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
}

impl StageReport {
    /// This report of a later try with iterations and time of the first added.
    pub(super) fn after(mut self, first: &Self) -> Self {
        self.time_s += first.time_s;
        self.outcome.iterations += first.outcome.iterations;
        self.outcome.corrections += first.outcome.corrections;
        self
    }
}

/// Times of a plan by phase, summed over iterations [s].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PhaseTimes {
    /// The target's motion and Stage 2's initial guess.
    pub start_s: f64,
    /// Part of it for a guess other than the heuristic: the learned rollout and its comparison.
    pub inference_s: f64,
    /// Stage 1.
    pub translation_s: f64,
    /// Stage 2: linearisation, curvature and bounds.
    pub linearise_s: f64,
    /// Stage 2: the solver of the subproblems, corrections included.
    pub qp_s: f64,
    /// Stage 2: retractions and residuals of steps, corrections and line search.
    pub step_s: f64,
    /// The independent verifier.
    pub verify_s: f64,
    /// The whole plan, checksums included.
    pub total_s: f64,
}

impl PhaseTimes {
    /// Adds the times of Stage 2's initial guess and iterations.
    pub(super) fn add(&mut self, other: &Self) {
        self.start_s += other.start_s;
        self.inference_s += other.inference_s;
        self.linearise_s += other.linearise_s;
        self.qp_s += other.qp_s;
        self.step_s += other.step_s;
    }

    /// Adds the times of Stage 2's iterations.
    pub(super) fn add_iterations(&mut self, log: &Log) {
        for record in log {
            self.linearise_s += record.linearise_time_s;
            self.qp_s += record.qp_time_s;
            self.step_s += record.time_s - record.linearise_time_s - record.qp_time_s;
        }
    }
}

/// Verdict on a plan: the three outcomes, best first. They read the same in files (by name), on
/// the terminal and in documents (in words, which is how they are displayed).
///
/// ```
/// use remora_core::prelude::*;
///
/// assert_eq!(Verdict::of(true, Status::IterationLimit), Verdict::Verified);
/// assert_eq!(Verdict::Verified.name(), "verified_not_converged");
/// assert_eq!(Verdict::Verified.to_string(), "verified but not converged");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum Verdict {
    /// Verified and converged; in feasibility mode verified and feasible.
    Optimal = 0,
    /// Verified but not converged: flyable, perhaps at a higher cost.
    #[cfg_attr(feature = "serde", serde(rename = "verified_not_converged"))]
    Verified = 1,
    /// Not flyable: the verifier found a violation.
    #[default]
    NotFlyable = 2,
}

impl Verdict {
    /// All of them, best first.
    pub const ALL: [Self; 3] = [Self::Optimal, Self::Verified, Self::NotFlyable];

    /// The verdict on a plan that is verified or not, and ended so.
    pub fn of(is_verified: bool, status: Status) -> Self {
        match (is_verified, status) {
            (true, Status::Solved) => Self::Optimal,
            (true, _) => Self::Verified,
            (false, _) => Self::NotFlyable,
        }
    }

    /// Code for records; it never changes its meaning.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Verified => "verified_not_converged",
            Self::NotFlyable => "not_flyable",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Verified => "verified but not converged",
            Self::NotFlyable => "not flyable",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.words())
    }
}

/// Report of a plan; the trajectories are in the workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The worse of the stages' statuses; solved only where the verifier agrees.
    pub status: Status,
    /// Why nothing was planned, where the scenario was refused.
    pub refusal: Option<Refusal>,
    /// Stage 1.
    pub translation: StageReport,
    /// Stage 2.
    pub reorientation: StageReport,
    /// The verifier's residuals.
    pub residuals: Residuals,
    /// Least distances between bodies, by the verifier.
    pub clearances: Clearances,
    /// Clearances of the arm's parts.
    pub arm: ArmClearances,
    /// Times by phase.
    pub times: PhaseTimes,
    /// The solve record.
    pub record: SolveRecord,
}

impl Report {
    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(self.is_verified(), self.status)
    }

    /// Whether the verifier found every residual within its tolerance: the plan can be flown whatever the
    /// status.
    pub fn is_verified(&self) -> bool {
        self.record.is_verified
    }
}
