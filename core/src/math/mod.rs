//! Small fixed-size mathematics that nalgebra lacks or must not provide here.
//!
//! Everything is written so that it rounds the same on every target: IEEE add, subtract, multiply,
//! divide and square root in a fixed order, and [`libm`] for the transcendental functions. Nothing
//! here calls a `std` or nalgebra float function, whose implementation depends on features that
//! other crates may switch on.

mod checksum;
mod cholesky;
mod eigen;
mod lanes;
pub mod matrix;
pub mod quaternion;
mod scalar;
mod spatial;

/// `value` brought into `[least, most]`; what is not a number stays so.
///
/// `f64::clamp` panics where the limits contradict each other; this returns one of them.
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

pub use checksum::Checksum;
pub use cholesky::{NotPositiveDefinite, cholesky_in_place, cholesky_solve_in_place};
pub use eigen::{MAX_SWEEPS, project_positive};
pub use lanes::Lanes;
pub use scalar::Scalar;
pub use spatial::{Mat3, Vec3};
