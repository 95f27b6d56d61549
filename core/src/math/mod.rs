//! Small fixed-size mathematics that nalgebra lacks or must not provide here.
//!
//! Everything is written so that it rounds the same on every target: IEEE add, subtract, multiply,
//! divide and square root in a fixed order, and [`libm`] for the transcendental functions. Nothing
//! here calls a `std` or nalgebra float function, whose implementation depends on features that
//! other crates may switch on.

mod lanes;
pub mod quaternion;
mod scalar;
mod spatial;
mod unit;

pub use lanes::Lanes;
pub use scalar::Scalar;
pub use spatial::{Mat3, Vec3};
pub use unit::{NEARLY_UNIT, nearly_unit};
