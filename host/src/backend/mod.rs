//! Solvers of the convex subproblem that live on the host.

mod clarabel;

pub use self::clarabel::ClarabelQp;
