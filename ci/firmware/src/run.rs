//! The whole run of an image.

use crate::board::Board;
use crate::output::Line;
use crate::plans::Plans;
use crate::{Request, guidance, scenarios};
use core::hint::black_box;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::guidance::{FlightPlan, Guidance};
use remora_core::advanced::planner::{EmbeddedSolver, Workspace};

/// Memory of the network of a learned start, of the size that the default models need.
pub use remora_core::advanced::planner::memory::NetworkMemory;

/// All the memory a planner needs, to be placed in static memory.
pub struct Memory {
    /// The planner's.
    pub workspace: Workspace,
    /// The solver's of the subproblems.
    pub solver: EmbeddedSolver,
    /// The learned start's.
    pub network: NetworkMemory,
    /// The plan that is flown.
    pub flight_plan: FlightPlan,
    /// Another network's, of the test image.
    #[cfg(feature = "kernels")]
    pub synthetic_model: crate::network::SyntheticModel,
}

impl Memory {
    /// Blank: all bits are zero, so that it lies in `.bss` and costs an image nothing.
    pub const fn new() -> Self {
        Self {
            workspace: Workspace::new(),
            solver: EmbeddedSolver::new(),
            network: NetworkMemory::new(),
            flight_plan: FlightPlan::BLANK,
            #[cfg(feature = "kernels")]
            synthetic_model: crate::network::SyntheticModel::new(),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Model files, where they lie.
#[derive(Clone, Copy, Debug)]
pub struct Models<'a> {
    /// For Stage 2 with Euler.
    pub euler: &'a [u8],
    /// For Stage 2 with RK4.
    pub rk4: &'a [u8],
}

/// Turns of the loop that the instruction counter is held against.
const CALIBRATION_TURNS: u32 = 1_000_000;

/// Plans what is asked for and prints everything about it.
pub fn run<B: Board>(board: &B, request: Request, models: &Models<'_>, memory: &mut Memory) {
    Line::new(board, "image").text("board", B::NAME).end();
    Line::new(board, "size")
        .number("workspace", Workspace::BYTES as u64)
        .number("solver", EmbeddedSolver::BYTES as u64)
        .number("network", NetworkMemory::BYTES as u64)
        .number("guidance", <Guidance>::BYTES as u64)
        .number("flight_plan", <FlightPlan>::BYTES as u64)
        .end();
    calibrate(board);

    // Models are data, as missions are.
    let file = black_box(match request.integrator {
        Integrator::Rk4 { .. } => models.rk4,
        _ => models.euler,
    });
    let last = plan_all(board, request, file, memory);
    if let Some((id, scenario)) = last.and_then(|last| scenarios::all().nth(last)) {
        let Memory { workspace, flight_plan, .. } = memory;
        guidance::run(board, id, &scenarios::mission(), &scenario, workspace, flight_plan);
    }
    #[cfg(feature = "kernels")]
    for (id, scenario) in scenarios::all().take(1) {
        let mission = scenarios::mission();
        crate::kernels::run(board, id, &mission, &scenario, request.integrator, memory);
        crate::network::run(board, &mut memory.synthetic_model);
    }
    #[cfg(feature = "with-panic")]
    crate::panicking::run(board);
    Line::new(board, "end").end();
}

/// Plans the scenarios, from the heuristic or from the model in the file; which was the last.
fn plan_all<B: Board>(
    board: &B,
    request: Request,
    file: &[u8],
    memory: &mut Memory,
) -> Option<usize> {
    let mut plans = Plans { board, request, file, memory };
    let mut last = None;
    for index in (0..u16::BITS as usize).filter(|index| request.wants(*index)) {
        last = plans.run(index).map(|()| index).or(last);
    }
    last
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
