//! Solvers of the convex subproblem on the host: Clarabel, and any solver with someone watching.
//! The core's own is used as it is.

mod clarabel;
mod recorder;
mod sparse_program;

pub use self::clarabel::ClarabelQp;
pub use self::recorder::{Recorder, Solve};
