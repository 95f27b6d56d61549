//! Sequential convex programming (SCP): an exact-penalty trust-region method.
//!
//! It minimises `cost + penalty_parameter * (|defects|_1 + |path violations|_1)` for any [`Problem`],
//! one convex subproblem an iteration; `docs/concepts/scp-and-qp.md` describes the method.

mod kept;
mod memory;
mod outcome;
mod problem;
mod record;
mod settings;
mod solve;
mod trial;

pub use memory::{Iterates, Scratch};
pub use outcome::{Outcome, Status};
pub use problem::{Problem, Residuals};
pub use record::{IterationRecord, Log, MAX_ITERATIONS};
pub use settings::{MAX_CORRECTIONS, Settings};
pub use solve::solve;
pub use trial::MAX_SEARCHES;
