//! From a scenario to a plan file.

mod outcome;
mod planner;

pub use outcome::{PlanOutcome, check_writable};
pub use planner::{Planner, Subproblem, WallClock};
