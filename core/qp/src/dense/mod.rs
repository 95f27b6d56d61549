//! Small dense kernels and factorisations, the same bits on every target.
//!
//! Everything is written so that it rounds the same everywhere: IEEE add, subtract, multiply, divide
//! and square root in a fixed order, and [`libm`] for the transcendental functions. Nothing here calls
//! a `std` or nalgebra float function, whose implementation depends on features that other crates may
//! switch on.

mod cholesky;
mod eigen;
pub mod matrix;

pub use cholesky::{NotPositiveDefinite, cholesky_in_place, cholesky_solve_in_place};
pub use eigen::{MAX_SWEEPS, project_positive};

use nalgebra::{ArrayStorage, SMatrix};

/// A zero matrix in constants.
pub const fn zeros<const R: usize, const C: usize>() -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(ArrayStorage([[0.0; R]; C]))
}

/// `value` projected onto `[least, most]`; NaN stays NaN.
///
/// `f64::clamp` panics where the limits contradict; this returns one of them.
#[inline]
pub fn clamp(value: f64, least: f64, most: f64) -> f64 {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}
