//! The audit: what the planner needs and how long it takes, with what it was measured on.

pub mod emulation;
