//! Clarabel, and the embedded solver against it: on random, degenerate, broken and the mission's own
//! programs. What needs no other solver is tested in `core/qp/tests`, which has the programs too.

#[path = "../../../../core/qp/tests/common/mod.rs"]
mod common;

mod clarabel;
mod edge;
mod mission;
mod polish;
mod random;
