//! The solver against the optimality conditions and against answers found in other ways.

#[path = "../common/mod.rs"]
mod common;

mod again;
mod convexify;
mod data;
mod degenerate;
mod dense;
mod exhaustive;
mod fewer;
mod golden;
mod limits;
mod random;
mod reference;
mod solver;
mod unsound;
