//! The audit: what a flight-software review asks of the planner.

pub mod image;
