//! The convex subproblem: a quadratic program with the stage structure of optimal control.
//!
//! Over nodes `k = 0 .. N-1` with states `x_k` and controls `u_k` (none at the last node):
//!
//! ```text
//! min  sum_k 1/2 [x_k; u_k]^T H_k [x_k; u_k] + g_k^T [x_k; u_k]
//!        + defect_weight * sum_k |xi_k|_1 + row_weight * sum_k 1^T zeta_k
//! s.t. x_{k+1} = A_k x_k + B_k u_k + c_k + xi_k
//!      lower_k <= [x_k; u_k] <= upper_k
//!      C_k x_k + d_k <= zeta_k,  zeta_k >= 0
//! ```
//!
//! Where a lower bound equals its upper bound the variable is *pinned*; which ones are must not
//! change between the subproblems of one plan. With a finite `defect_weight` the program is
//! feasible whenever the boxes are not empty; an infinite one makes the dynamics hard (`xi = 0`).

mod convexify;
mod data;
mod embedded;
mod solver;

pub use convexify::Sweep;
pub(crate) use data::zeros;
pub use data::{Qp, Solution, Stage};
pub use embedded::{ATTEMPTS, EmbeddedQp, InteriorPointSettings, MAX_SOLVER_ITERATIONS, STARTS};
pub use solver::{QpOutcome, QpSolver, QpStatus};
