//! Program of every image, whatever its board: scenarios of the audit through the planner, with the
//! result, its checksum and the retired instructions of each phase printed as lines of
//! `key=value`.
//!
//! Hosts run this code too. Lines that start with `stage`, `plan`, `residual`, `verified`,
//! `guidance` or `kernel` must be equal on all machines; the others say what it cost.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod board;
mod guidance;
#[cfg(feature = "kernels")]
mod kernels;
#[cfg(feature = "kernels")]
mod network;
mod output;
#[cfg(feature = "with-panic")]
mod panicking;
mod plans;
#[cfg(feature = "replay")]
mod replay;
mod request;
mod run;
mod scenarios;
mod start;

pub use board::{Board, Stack};
#[cfg(feature = "replay")]
pub use replay::{NUMBERS, replay};
pub use request::{Request, StartKind};
pub use run::{Memory, Models, NetworkMemory, run};
