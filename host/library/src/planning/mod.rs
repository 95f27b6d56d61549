//! From a scenario to a plan file.

mod job;
mod planner;

pub use job::{PlanJob, refusal};
pub use planner::{PlanOutcome, Planner, Subproblem, WallClock};
