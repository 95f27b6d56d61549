//! The program `remora`.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(remora_host::cli::run(std::env::args_os()))
}
