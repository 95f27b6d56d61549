//! The command lines of both programs, and the commands that pages and help texts name.

mod conventions;
mod documented;

use clap::Command;

/// The operator's program and the tools of the checkout.
fn programs() -> [Command; 2] {
    [remora_cli::command(), xtask::command()]
}
