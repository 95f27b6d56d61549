//! The host as a board. Its counter stands still: what costs on a desktop is measured elsewhere.

use remora_firmware::{Board, Memory, Request, Stack, run};
use std::io::Write as _;
use std::process::ExitCode;

struct Host;

impl Board for Host {
    const NAME: &'static str = "host";
    const RESOLUTION: u64 = 1;

    fn write(&self, byte: u8) {
        // A report nobody can read is noticed by whoever compares it.
        let _ = std::io::stdout().write_all(&[byte]);
    }

    fn instructions(&self) -> u64 {
        0
    }

    fn known_loop(&self, _turns: u32) -> u64 {
        0
    }

    fn stack(&self) -> Option<Stack> {
        None
    }
}

/// Stack of the planning thread [bytes]: placeholders of large types pass through it here.
const STACK_BYTES: usize = 32 << 20;

/// Usage: `remora-firmware [SCENARIOS [euler|rk4]]`.
pub fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let scenarios = arguments.next().map_or(Ok(1), |text| text.parse());
    let integrator = arguments.next();
    let request = match (scenarios, integrator.as_deref()) {
        (Ok(scenarios), None | Some("euler")) => Request::new(scenarios, false),
        (Ok(scenarios), Some("rk4")) => Request::new(scenarios, true),
        _ => {
            eprintln!("usage: remora-firmware [SCENARIOS [euler|rk4]]");
            return ExitCode::from(2);
        }
    };
    let work = move || run(&Host, request, &mut Box::new(Memory::new()));
    let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn(work);
    match thread.map(std::thread::JoinHandle::join) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}
