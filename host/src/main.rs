//! The program `remora`: parses, calls the libraries, prints.

#![forbid(unsafe_code)]

mod commands;
mod report;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use std::process::ExitCode;
#[cfg(unix)]
use std::sync::{Arc, atomic::AtomicBool};

/// Counts how often memory is asked for, so that reports can say that planning does not; a few
/// additions a request.
#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn main() -> ExitCode {
    outgrow_limits_as_errors();
    ExitCode::from(commands::run(std::env::args_os()))
}

/// A file that outgrows what the system allows (`ulimit -f`) is an error that names it; without somebody
/// who listens to the signal, it ends the program and leaves what is half written.
fn outgrow_limits_as_errors() {
    #[cfg(unix)]
    let _ = {
        let nobody_asks = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, nobody_asks)
    };
}
