//! Remora's flight core: plans how a servicer with a robot arm catches a tumbling object.
//!
//! `no_std`, no allocation, no unsafe but in the kernels of `nn`. Data goes down this list, imports go up it:
//!
//! - [`math`]: quaternions, small dense kernels and factorisations, the same bits on every target;
//! - [`model`]: the world as data, with the target's tumble and the orbit's transition;
//! - [`dynamics`]: bus and arm, their discrete steps, exact first and second derivatives;
//! - [`time`], [`pair`]: clock, deadline and second core, given by the caller;
//! - [`qp`]: the stage-structured convex program, its convexification, the embedded solver;
//! - [`scp`]: the loop over convex programs, its settings and log, the problem trait;
//! - [`stages`]: translation and reorientation as problems, the heuristic start, the independent
//!   verifier;
//! - [`nn`]: the learned warm start's network: model file, kernels, inference;
//! - [`planner`]: scenario in, plan out;
//! - [`bounds`]: how often each loop may turn whose length depends on data.
//!
//! Conventions (frames, quaternions, units, index ranges) are in `docs/conventions.md`.
#![no_std]

pub mod bounds;
pub mod dynamics;
pub mod math;
pub mod model;
pub mod nn;
pub mod pair;
pub mod planner;
pub mod qp;
pub mod scp;
pub mod stages;
pub mod time;
pub mod warmstart;
