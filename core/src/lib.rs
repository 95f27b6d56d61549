//! Remora's flight core: plans how a servicer with a robot arm catches a tumbling object.
//!
//! `no_std`, no allocation, no unsafe. Data goes down this list, imports go up it:
//!
//! - [`math`]: quaternions, dual numbers, small factorisations, the same bits on every target;
//! - [`model`]: the world as data, with the target's tumble and the orbit's transition;
//! - [`dynamics`]: bus and arm, their discrete steps and exact derivatives;
//!
//! Conventions (frames, quaternions, units, index ranges) are in `docs/conventions.md`.
#![no_std]

pub mod dynamics;
pub mod math;
pub mod model;
pub mod planner;
pub mod qp;
pub mod scp;
pub mod stages;
