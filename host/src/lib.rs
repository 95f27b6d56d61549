//! The bench around `remora-core`.

pub mod backend;
