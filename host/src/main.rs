//! The program `remora`: parses, calls the libraries, prints.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    remora_cli::cli::outgrow_limits_as_errors();
    ExitCode::from(remora_cli::run(std::env::args_os()))
}
