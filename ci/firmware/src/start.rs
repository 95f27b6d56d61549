//! Initial guess of Stage 2.

use crate::board::Board;
use crate::output::{Line, print_stack};
use crate::{NetworkMemory, StartKind};
use remora_core::advanced::nn::{Model, Network};
use remora_core::advanced::planner::InitialGuess;
use remora_core::advanced::warmstart::NetworkPolicy;

/// Opens the model of the file where one is asked for, and makes one plan with the start.
///
/// An opened model lasts for that plan: damage to it ends with the plan.
pub fn with_start<B: Board, T>(
    board: &B,
    kind: StartKind,
    file: &[u8],
    memory: &mut NetworkMemory,
    plan: impl FnOnce(&InitialGuess<'_>) -> T,
) -> T {
    let model = if kind == StartKind::Model { open(board, file) } else { None };
    let network = model.as_ref().and_then(|model| Network::new(model, memory).ok());
    let policy = network.and_then(|network| NetworkPolicy::new(network).ok());
    plan(&match (&policy, kind) {
        (_, StartKind::Heuristic) => InitialGuess::Heuristic,
        (Some(policy), _) => InitialGuess::Learned { policy, seed: 0 },
        (None, _) => InitialGuess::Refused,
    })
}

/// Opens the model; prints what that took.
fn open<'a, B: Board>(board: &B, file: &'a [u8]) -> Option<Model<'a>> {
    board.paint_stack();
    let before = board.instructions();
    let model = Model::open(file).ok();
    let instructions = board.instructions().wrapping_sub(before);
    let line = Line::new(board, "most").text("name", "open_model");
    line.number("calls", 1).number("instructions", instructions).end();
    print_stack(board, "open_model");
    model
}
