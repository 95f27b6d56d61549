//! The learned warm start's network, with weights at random that every board makes for itself: a
//! roll-out of a few nodes, by the portable kernel and by the processor's own.

use crate::board::Board;
use crate::output::Line;
use core::hint::black_box;
use remora_core::advanced::nn::{
    self, ACTION, Decoder, Header, Kernel, Layout, Model, Network, Precision, Provenance, VERSION,
    synthetic_model,
};
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::warmstart::{Action, Encoding};

const NODES: usize = 4;
const WIDTH: usize = 40;
const TOKENS: usize = 5 * NODES - 1;
const TOKEN_TYPES: [u16; 5] = [6, 1, 7, 9, 13];
const FEATURES: usize = 36;

/// A model file and what its network works in, to be placed in static memory.
pub struct SyntheticModel {
    file: [u8; 96 << 10],
    memory: nn::Memory<2, WIDTH, TOKENS>,
}

impl SyntheticModel {
    /// Blank, all bits zero.
    pub const fn new() -> Self {
        Self { file: [0; 96 << 10], memory: nn::Memory::new() }
    }
}

impl Default for SyntheticModel {
    fn default() -> Self {
        Self::new()
    }
}

/// Five tokens a node, so that batches are as large as they get; a width that is no multiple of a
/// vector register's.
fn header() -> Header {
    Header {
        version: VERSION,
        precision: Precision::Int8,
        layout: Layout::Separate,
        inputs: Encoding::Paper.tag(),
        outputs: Action::Torque.tag(),
        decoder: Decoder::Flow { steps: 2 },
        chunk: 1,
        nodes: NODES as u16,
        layers: 2,
        heads: 2,
        width: WIDTH as u16,
        token_types: TOKEN_TYPES.iter().copied().collect(),
        provenance: Provenance::default(),
        action: ACTION as u16,
    }
}

/// Makes the model, rolls it out and prints checksums and instructions. Where something fails, the
/// line says so, and differs from the host's.
#[inline(never)]
pub fn run<B: Board>(board: &B, place: &mut SyntheticModel) {
    // A header is data: were this one a constant, the compiler could prove bounds with it that no
    // other has.
    let length = synthetic_model(&black_box(header()), 1, &mut place.file).unwrap_or(0);
    let file = place.file.get(..length).unwrap_or_default();
    let Ok(model) = Model::open(file) else {
        Line::new(board, "kernel").text("name", "network").text("checksum", "refused").end();
        return;
    };
    let mut sum = Checksum::new();
    sum.bytes(file);
    Line::new(board, "kernel").text("name", "model").bits("checksum", sum.value()).end();

    for (name, kernel) in [("network_portable", Kernel::portable()), ("network", Kernel::best())] {
        let Ok(mut network) = Network::new(&model, &mut place.memory) else { return };
        network.use_kernel(kernel);
        let before = board.instructions();
        let sum = rollout(&mut network);
        let instructions = board.instructions().wrapping_sub(before);
        let line = Line::new(board, "count").text("name", name).text("kernel", kernel.name());
        line.number("calls", NODES as u64).number("instructions", instructions).end();
        Line::new(board, "kernel").text("name", name).bits("checksum", sum.value()).end();
    }
}

fn rollout<M: nn::Storage>(network: &mut Network<'_, '_, M>) -> Checksum {
    let mut sum = Checksum::new();
    network.begin(7);
    let mut action = [0.0; ACTION];
    for _ in 0..NODES {
        // The last action goes back in, so that every bit of it counts.
        let mut features = [0.25; FEATURES];
        features.iter_mut().zip(action).for_each(|(feature, action)| *feature = action);
        let error = network.act(&features, &mut action).err();
        sum.integer(error.map_or(0, |error| u64::from(error.code())));
        sum.numbers(&action.map(f64::from));
    }
    sum
}
