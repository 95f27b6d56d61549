#![doc = include_str!("../README.md")]
//! ## Reading the code
//!
//! Where a lower bound equals its upper bound the variable is *pinned*; which ones are must not
//! change between the subproblems of one plan. With a finite `defect_weight` the program is
//! feasible whenever the boxes are not empty; an infinite one makes the dynamics hard (`xi = 0`).
//!
//! Data goes down this list, imports go up it: [`time`], [`Valid`], [`dense`], [`Checksum`], the program and the
//! solver's trait, its convexification, the embedded solver.
#![no_std]
#![forbid(unsafe_code)]

pub use nalgebra;

mod checksum;
mod convexify;
mod data;
pub mod dense;
mod embedded;
mod solver;
pub mod time;
mod valid;

pub use checksum::Checksum;
pub use convexify::Sweep;
pub use data::{Qp, Solution, Stage};
pub use embedded::{ATTEMPTS, EmbeddedQp, InteriorPointSettings, MAX_SOLVER_ITERATIONS, STARTS};
pub use solver::{QpOutcome, QpSolver, QpStatus};
pub use valid::{InvalidSetting, Valid, Validate};
