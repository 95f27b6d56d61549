//! The audit: evidence of memory, time, robustness and requirements for a review board.

pub mod budgets;
pub mod loops;
pub mod requirements;
