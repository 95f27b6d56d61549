//! The host as a board. Its counter stands still: what costs on a desktop is measured elsewhere.

use crate::models::MODELS;
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

    fn paint_stack(&self) {}

    fn stack(&self) -> Option<Stack> {
        None
    }
}

/// Stack of the planning thread [bytes]: placeholders of large types pass through it here.
const STACK_BYTES: usize = 32 << 20;

/// How to call it.
const USAGE: &str = "usage: remora-firmware euler|rk4 heuristic|model MASK";

/// Usage: `remora-firmware euler|rk4 heuristic|model MASK`; MASK, a number, has a bit for each
/// scenario of the corpus.
pub fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(request) = request(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let work = move || run(&Host, request, &MODELS, &mut Box::new(Memory::new()));
    let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn(work);
    match thread.map(std::thread::JoinHandle::join) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

fn request(arguments: &[String]) -> Option<Request> {
    let [integrator, start, scenarios] = arguments else { return None };
    let rk4 = match integrator.as_str() {
        "euler" => false,
        "rk4" => true,
        _ => return None,
    };
    let model = match start.as_str() {
        "heuristic" => false,
        "model" => true,
        _ => return None,
    };
    Some(Request::new(scenarios.parse().ok()?, rk4, model))
}
