//! The tools of the checkout, which `cargo xtask` runs.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`inject`]: fault injection, one flipped bit in what the planner works on;
//! - [`audit`]: evidence for a review board, with profile and firmware images;
//! - [`doors`]: one plan behind every door of a machine;
//! - the commands, which alone print.

#![forbid(unsafe_code)]

pub mod audit;
mod commands;
pub mod doors;
pub mod inject;

pub use commands::{command, run};
