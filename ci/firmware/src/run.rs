//! The whole run of an image.

use crate::board::Board;
use crate::network::Specimen;
use crate::output::Line;
use crate::{Request, network, plans, scenarios};
use core::hint::black_box;
use remora_core::model::Mission;
use remora_core::planner::{EmbeddedSolver, Workspace};
use remora_core::stages::LINKS;

/// All the memory a planner needs, to be placed in static memory; and that of a network of its own.
pub struct Memory {
    /// The planner's.
    pub workspace: Workspace,
    /// The solver's of the subproblems.
    pub solver: EmbeddedSolver,
    /// A small network's.
    pub specimen: Specimen,
}

impl Memory {
    /// Blank: all bits are zero, so that it lies in `.bss` and costs an image nothing.
    pub const fn new() -> Self {
        Self {
            workspace: Workspace::new(),
            solver: EmbeddedSolver::new(),
            specimen: Specimen::new(),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Turns of the loop that the instruction counter is held against.
const CALIBRATION_TURNS: u32 = 1_000_000;

/// Plans what is asked for and prints everything about it.
pub fn run<B: Board>(board: &B, request: Request, memory: &mut Memory) {
    Line::new(board, "image").text("board", B::NAME).end();
    Line::new(board, "size")
        .number("workspace", Workspace::BYTES as u64)
        .number("solver", EmbeddedSolver::BYTES as u64)
        .end();
    calibrate(board);

    // Missions are data: were this one a constant, the compiler could prove bounds with it that no
    // other mission has.
    let mission = black_box(Mission::<LINKS>::default());
    for (id, scenario) in scenarios::all().take(request.scenarios) {
        plans::run(board, id, &mission, &scenario, request.integrator, memory);
    }
    network::run(board, &mut memory.specimen);
    // The mark of plans and network: what follows is no part of them.
    if let Some(stack) = board.stack() {
        let line = Line::new(board, "stack");
        line.number("used", stack.used as u64).number("size", stack.size as u64).end();
    }
    #[cfg(feature = "kernels")]
    for (id, scenario) in scenarios::all().take(1) {
        crate::kernels::run(board, id, &mission, &scenario, request.integrator, memory);
    }
    #[cfg(feature = "with-panic")]
    crate::panicking::run(board);
    Line::new(board, "end").end();
}

/// Prints what the counter says about a loop of known length.
fn calibrate<B: Board>(board: &B) {
    let before = board.instructions();
    let expected = board.known_loop(CALIBRATION_TURNS);
    let counted = board.instructions().wrapping_sub(before);
    Line::new(board, "calibration")
        .number("expected", expected)
        .number("counted", counted)
        .number("resolution", B::RESOLUTION)
        .end();
}
