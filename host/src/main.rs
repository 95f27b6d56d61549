//! The program `remora`: parses, calls the libraries, prints.

#![forbid(unsafe_code)]

mod commands;
mod report;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use std::process::ExitCode;

/// Counts how often memory is asked for, so that reports can say that planning does not; a few
/// additions a request.
#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn main() -> ExitCode {
    ExitCode::from(commands::run(std::env::args_os()))
}
