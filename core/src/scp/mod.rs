//! Sequential convex programming: an exact-penalty trust-region loop over convex subproblems.
//!
//! The loop minimises `cost + weight * (|defects|_1 + |violated rows|_1)` for any [`Problem`],
//! one convex subproblem an iteration; see `docs/scp.md` for the method and why it differs from
//! the paper's.

mod problem;
mod record;
mod settings;
mod solve;

pub use problem::{Problem, Residuals};
pub use record::{IterationRecord, Log, MAX_ITERATIONS};
pub use settings::{InvalidSetting, Settings};
pub use solve::{Outcome, Status, Workspace, solve};

/// A clock for phase timings. It never changes a result.
pub trait Clock {
    /// Seconds since some fixed instant.
    fn seconds(&self) -> f64;
}

/// A clock that stands still, for targets without one.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    fn seconds(&self) -> f64 {
        0.0
    }
}
