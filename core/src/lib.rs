#![doc = include_str!("../README.md")]
//! ## Reading the code
//!
//! Data goes down this list, imports go up it:
//!
//! - `remora-qp`: the stage-structured convex program, its convexification, the embedded solver, the
//!   caller's clock and deadline;
//! - `remora-nn`: the learned guess's network: model file, kernels, inference;
//! - `math`: quaternions and numbers side by side, the same bits on every target;
//! - `model`: the world as data, with the target's motion and the orbit's transition;
//! - `dynamics`: bus and arm, their discrete steps, exact first and second derivatives;
//! - `pair`: the second core, given by the caller;
//! - `scp`: the solver by sequential convex programming, its settings and log, the problem trait;
//! - `stages`: translation and reorientation as problems, the heuristic guess, the independent
//!   verifier;
//! - `warmstart`: features, rollout and actions of the learned guess;
//! - `planner`: scenario in, plan out, with memory and solver of the caller;
//! - `plan`: the front door: a planner with its memory, and the plan it leaves;
//! - `guidance`: flies a plan: feedback, modes, when to plan again;
//! - [`prelude`]: what planning needs; [`advanced`]: all that stands behind it;
//! - `bounds`: how often each loop may turn whose length depends on data.
#![no_std]
#![forbid(unsafe_code)]

pub use nalgebra;

/// The Rust of the project's README and of the book's pages compiles.
#[cfg(doctest)]
mod documents {
    #[doc = include_str!("../../README.md")]
    struct Readme;

    #[doc = include_str!("../../docs/guides/bare-metal.md")]
    struct BareMetal;

    #[doc = include_str!("../../docs/concepts/guidance.md")]
    struct Guidance;

    #[doc = include_str!("../../docs/reference/model-file.md")]
    struct Network;

    #[doc = include_str!("../../docs/concepts/planner.md")]
    struct Planner;

    #[doc = include_str!("../../docs/concepts/scp-and-qp.md")]
    struct ScpAndQp;

    #[doc = include_str!("../../docs/your-spacecraft.md")]
    struct YourSpacecraft;
}

mod bounds;
mod dynamics;
mod executor;
mod guidance;
mod math;
mod model;
mod plan;
mod planner;
mod scp;
mod stages;
mod warmstart;

pub mod advanced;
pub mod prelude;
