//! The operator's program as a library: its commands, and the [command line](cli) that the checkout's other
//! programs share with it.

#![forbid(unsafe_code)]

pub mod cli;
mod commands;
mod report;

pub use commands::{command, run};

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;

/// Counts how often memory is asked for, so that reports can say that planning does not; a few
/// additions a request.
#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;
