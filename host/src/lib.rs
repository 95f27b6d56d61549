//! The bench around `remora-core`.
