//! The audit: evidence of memory, time, robustness and requirements for a review board.

pub mod budgets;
pub mod emulation;
pub mod firmware;
pub mod loops;
pub mod requirements;
pub mod section;
//! The audit: what a flight-software review asks of the planner.

pub mod image;
