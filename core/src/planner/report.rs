//! What a plan reports beside its trajectories.

use super::Evidence;
use crate::model::Refusal;
use crate::scp::{Log, Outcome, Status};
use crate::stages::{Clearances, Residuals};

/// Report of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StageReport {
    /// How the loop ended.
    pub outcome: Outcome,
    /// Cost as the problem defines it.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
}

impl StageReport {
    /// This report of a second try, with the iterations and the time of the first added.
    pub(super) fn after(mut self, first: &Self) -> Self {
        self.time_s += first.time_s;
        self.outcome.iterations += first.outcome.iterations;
        self.outcome.corrections += first.outcome.corrections;
        self
    }
}

/// Where the time of a plan went, summed over iterations [s].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PhaseTimes {
    /// The target's tumble and Stage 2's start.
    pub start_s: f64,
    /// The part of it that a start other than the heuristic took: a learned one's roll-out, and the
    /// test of what came out or was handed in.
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
    /// Adds the start and the iterations of Stage 2.
    pub(super) fn add(&mut self, other: &Self) {
        self.start_s += other.start_s;
        self.inference_s += other.inference_s;
        self.linearise_s += other.linearise_s;
        self.qp_s += other.qp_s;
        self.step_s += other.step_s;
    }

    /// Adds up the iterations of Stage 2.
    pub(super) fn add_iterations(&mut self, log: &Log) {
        for record in log {
            self.linearise_s += record.linearise_time_s;
            self.qp_s += record.qp_time_s;
            self.step_s += record.time_s - record.linearise_time_s - record.qp_time_s;
        }
    }
}

/// What a plan is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord)]
#[repr(u32)]
pub enum Verdict {
    /// Verified, and what was asked for was reached: the cost has converged, or in feasibility
    /// mode the plan is feasible.
    Optimal = 0,
    /// Verified, but not converged: it can be flown, though it may cost more than it would have to.
    Verified = 1,
    /// Not to be flown: the verifier found a constraint violated.
    #[default]
    NotFlyable = 2,
}

impl Verdict {
    /// Stable code for records.
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
    /// How near bodies come to each other, by the verifier.
    pub clearances: Clearances,
    /// Where the time went.
    pub times: PhaseTimes,
    /// What the plan was made from, by what, and what came out.
    pub evidence: Evidence,
}

impl Report {
    /// What the plan is good for.
    pub fn verdict(&self) -> Verdict {
        match (self.is_verified(), self.status) {
            (true, Status::Solved) => Verdict::Optimal,
            (true, _) => Verdict::Verified,
            (false, _) => Verdict::NotFlyable,
        }
    }

    /// Whether the verifier found every residual of the plan within its tolerance: such a plan can
    /// be flown whatever the status, though it may cost more than it would have to.
    pub fn is_verified(&self) -> bool {
        self.evidence.is_verified
    }
}
