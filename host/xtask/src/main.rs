//! The tools of the checkout: `cargo xtask COMMAND`.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    remora_cli::cli::outgrow_limits_as_errors();
    ExitCode::from(xtask::run(std::env::args_os()))
}
