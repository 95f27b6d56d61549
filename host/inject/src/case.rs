//! Fault injection: sites, faults, and how they are drawn.

use super::bit_flip::{PROGRAM_FIELDS, SOLUTION_FIELDS, START_FIELDS};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use remora_core::advanced::nn::{BitFlip, Dimensions, Model, ModelError, Part, tensors};
use remora_core::advanced::stages::NODES;
use remora_host::choice::Choice;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Where faults are injected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// The model file before it is opened
    WeightsBeforeCheck,
    /// The model file between its check and its use
    WeightsAfterCheck,
    /// The network's activations between two blocks
    Activations,
    /// Keys and values that the network remembers
    KvCache,
    /// The start of Stage 2 before it is tested
    StartBeforeCheck,
    /// The start of Stage 2 once it has been accepted
    StartAfterCheck,
    /// A subproblem on its way to the solver
    QpData,
    /// Its solution on the way back
    QpSolution,
}

impl Choice for Site {
    // Case `n` of any seed hits the one at `n` modulo their number.
    const ALL: &'static [Self] = &[
        Self::WeightsBeforeCheck,
        Self::WeightsAfterCheck,
        Self::Activations,
        Self::KvCache,
        Self::StartBeforeCheck,
        Self::StartAfterCheck,
        Self::QpData,
        Self::QpSolution,
    ];

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::WeightsBeforeCheck => "The model file before it is opened",
            Self::WeightsAfterCheck => "The model file between its check and its use",
            Self::Activations => "The network's activations between two blocks",
            Self::KvCache => "Keys and values that the network remembers",
            Self::StartBeforeCheck => "The start of Stage 2 before it is tested",
            Self::StartAfterCheck => "The start of Stage 2 once it has been accepted",
            Self::QpData => "A subproblem on its way to the solver",
            Self::QpSolution => "Its solution on the way back",
        }
    }
}

impl Site {
    /// The site of a case.
    pub fn of(number: u64) -> Self {
        Self::ALL[(number % Self::ALL.len() as u64) as usize]
    }

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::WeightsBeforeCheck => "weights_before_check",
            Self::WeightsAfterCheck => "weights_after_check",
            Self::Activations => "activations",
            Self::KvCache => "kv_cache",
            Self::StartBeforeCheck => "start_before_check",
            Self::StartAfterCheck => "start_after_check",
            Self::QpData => "qp_data",
            Self::QpSolution => "qp_solution",
        }
    }
}

/// One flipped bit: what it belongs to, and when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Of the model file.
    File {
        /// Whether the file had been checked before.
        checked: bool,
        /// The tensor, `header` or `checksum`.
        part: String,
        /// Which number (byte of the header) of it.
        element: usize,
        /// Which byte of the file.
        byte: usize,
        /// Which bit of the number.
        bit: u32,
    },
    /// Of the network's memory.
    Memory {
        /// Whether of the cache.
        cached: bool,
        /// The node at which.
        node: usize,
        /// When, and what.
        bit_flip: BitFlip,
    },
    /// Of the start of Stage 2.
    Start {
        /// Whether it had been accepted before.
        accepted: bool,
        /// Which of [`START_FIELDS`].
        field: usize,
        /// The node.
        node: usize,
        /// Which number of it.
        element: usize,
        /// Which bit of the number.
        bit: u32,
    },
    /// Of a subproblem or its solution.
    Program {
        /// Whether of the solution.
        solution: bool,
        /// Which of a plan's programs, from zero, in the order they are solved.
        call: u32,
        /// Which of [`PROGRAM_FIELDS`] or [`SOLUTION_FIELDS`].
        field: usize,
        /// The node.
        node: usize,
        /// Which number of it.
        element: usize,
        /// Which bit of the number.
        bit: u32,
    },
}

/// What stands where in a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// What was hit, such as `block.0.qkv.scale`.
    pub part: String,
    /// The kind of it by which cases are counted, such as `scale`.
    pub kind: String,
    /// Which use of the memory or which of a plan's programs; zero where there is but one moment.
    pub moment: u32,
    /// The node; zero where the data belong to none.
    pub node: usize,
    /// Which number.
    pub element: usize,
    /// Which bit of it.
    pub bit: u32,
}

impl Fault {
    /// Where it is.
    pub fn site(&self) -> Site {
        match self {
            Self::File { checked: false, .. } => Site::WeightsBeforeCheck,
            Self::File { checked: true, .. } => Site::WeightsAfterCheck,
            Self::Memory { cached: false, .. } => Site::Activations,
            Self::Memory { cached: true, .. } => Site::KvCache,
            Self::Start { accepted: false, .. } => Site::StartBeforeCheck,
            Self::Start { accepted: true, .. } => Site::StartAfterCheck,
            Self::Program { solution: false, .. } => Site::QpData,
            Self::Program { solution: true, .. } => Site::QpSolution,
        }
    }

    /// Names and numbers of it.
    pub fn place(&self) -> Place {
        match self {
            Self::File { part, element, bit, .. } => {
                let kind = part.rsplit('.').next().unwrap_or(part).to_string();
                let (part, element, bit) = (part.clone(), *element, *bit);
                Place { part, kind, moment: 0, node: 0, element, bit }
            }
            Self::Memory { node, bit_flip, .. } => {
                let BitFlip { call, part, element, bit } = *bit_flip;
                let name = part_name(part).to_string();
                Place { part: name.clone(), kind: name, moment: call, node: *node, element, bit }
            }
            Self::Start { field, node, element, bit, .. } => {
                let name = START_FIELDS[*field].0.to_string();
                let (node, element, bit) = (*node, *element, *bit);
                Place { part: name.clone(), kind: name, moment: 0, node, element, bit }
            }
            Self::Program { solution, call, field, node, element, bit } => {
                let fields: &[_] = if *solution { &SOLUTION_FIELDS } else { &PROGRAM_FIELDS };
                let name = fields[*field].0.to_string();
                let (moment, node, element, bit) = (*call, *node, *element, *bit);
                Place { part: name.clone(), kind: name, moment, node, element, bit }
            }
        }
    }
}

fn part_name(part: Part) -> &'static str {
    match part {
        Part::Keys => "keys",
        Part::Values => "values",
        Part::KeyScales => "key_scales",
        Part::ValueScales => "value_scales",
        Part::Residual => "residual",
        Part::Normal => "normal",
        Part::Intermediate => "hidden",
        Part::Quantised => "quantised",
        Part::I16Operand => "wide",
        Part::Scores => "scores",
    }
}

/// One case: a fault in the plan of a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// Its number.
    pub number: u64,
    /// Which scenario.
    pub scenario: usize,
    /// The fault.
    pub fault: Fault,
}

/// A tensor of a model file, or what stands before and after them all.
#[derive(Clone, Debug)]
struct Span {
    name: String,
    bytes: Range<usize>,
    /// Bytes of a number.
    size: usize,
}

/// Where things lie in a model file and in the memory of its network.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Header, tensors, checksum.
    spans: Vec<Span>,
    size: Dimensions,
    /// Width and tokens of the network's memory.
    memory: (usize, usize),
}

impl Layout {
    pub fn new(
        model: &Model<'_>,
        length: usize,
        memory: (usize, usize),
    ) -> Result<Self, ModelError> {
        let mut sizes = Vec::new();
        tensors(model.header(), |t| {
            sizes.push((t.name.to_string(), t.bytes(), t.element.bytes()));
        })?;
        let all: usize = sizes.iter().map(|(_, bytes, _)| bytes).sum();
        let mut at = length.saturating_sub(all + 4);
        let mut spans = vec![Span { name: "header".into(), bytes: 0..at, size: 1 }];
        for (name, bytes, size) in sizes {
            spans.push(Span { name, bytes: at..at + bytes, size });
            at += bytes;
        }
        spans.push(Span { name: "checksum".into(), bytes: at..length, size: 1 });
        Ok(Self { spans, size: *model.dimensions(), memory })
    }
}

/// A case of which the scenario is drawn already.
pub(super) struct Drawn {
    draw: Draw,
    number: u64,
    pub scenario: usize,
}

impl Drawn {
    /// Case `number` of a seed, in one of so many scenarios.
    pub fn new(seed: u64, number: u64, scenarios: usize) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut stream = ChaCha8Rng::from_seed(key);
        stream.set_stream(number);
        let mut draw = Draw(stream);
        let scenario = draw.below(scenarios);
        Self { draw, number, scenario }
    }

    /// The whole case: a function of seed, number, model, and of how many `programs` the plan of
    /// its scenario has without a fault.
    pub fn case(mut self, programs: u32, layout: &Layout) -> Case {
        let Self { draw, number, scenario } = &mut self;
        let fault = match Site::of(*number) {
            Site::WeightsBeforeCheck => draw.file(layout, false),
            Site::WeightsAfterCheck => draw.file(layout, true),
            Site::Activations => draw.activation(layout),
            Site::KvCache => draw.cached(layout),
            Site::StartBeforeCheck => draw.start(false),
            Site::StartAfterCheck => draw.start(true),
            Site::QpData => draw.program(programs, false),
            Site::QpSolution => draw.program(programs, true),
        };
        Case { number: *number, scenario: *scenario, fault }
    }
}

struct Draw(ChaCha8Rng);

impl Draw {
    /// Below `count`, of which there is at least one. That 2^64 is no multiple of it shifts
    /// shares by less than 1e-12.
    fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count.max(1) as u64) as usize
    }

    /// Tensors have equal shares, whatever their size, so that the many weights do not hide scales
    /// and gains; header and checksum a tenth each.
    fn file(&mut self, layout: &Layout, checked: bool) -> Fault {
        let last = layout.spans.len() - 1;
        let at = match self.below(10) {
            0 => 0,
            // Once checked, nobody looks at the checksum any more.
            1 if !checked => last,
            _ => 1 + self.below(last - 1),
        };
        let Span { name, bytes, size } = &layout.spans[at];
        let element = self.below(bytes.len() / size);
        let bit = self.below(8 * size) as u32;
        let byte = bytes.start + element * size + bit as usize / 8;
        Fault::File { checked, part: name.clone(), element, byte, bit }
    }

    /// What is alive most often: the residual stream half the time, the latent a quarter.
    fn activation(&mut self, layout: &Layout) -> Fault {
        let (layers, (width, tokens)) = (layout.size.layers, layout.memory);
        let node = self.below(NODES - 1);
        let (part, at, row) = match self.below(8) {
            0..4 => (Part::Residual, 1 + self.below(layers + 1), layout.size.width),
            4..6 => (Part::Normal, layers + 2, layout.size.width),
            6 => (Part::Intermediate, self.below(layers + 3), 4 * layout.size.width),
            _ => match self.below(3) {
                0 => (Part::Quantised, self.below(layers + 3), 4 * width),
                1 => (Part::I16Operand, self.below(layers + 3), 4 * width),
                _ => (Part::Scores, self.below(layers + 3), tokens),
            },
        };
        let (call, element) = (moment(node, at, layers), self.below(row));
        let bit_flip = BitFlip { call, part, element, bit: self.below(32) as u32 };
        Fault::Memory { cached: false, node, bit_flip }
    }

    /// Of a node before the one at work, so that it will be read.
    fn cached(&mut self, layout: &Layout) -> Fault {
        let (layers, (width, tokens)) = (layout.size.layers, layout.memory);
        let node = 1 + self.below(NODES - 2);
        let before = self.below(node);
        let part = match self.below(8) {
            0..3 => Part::Keys,
            3..6 => Part::Values,
            6 => Part::KeyScales,
            _ => Part::ValueScales,
        };
        let element = match part {
            Part::Keys | Part::Values => before * width + self.below(layout.size.width),
            _ => self.below(layout.size.heads) * tokens + before,
        };
        let call = moment(node, 1 + self.below(layers), layers);
        let bit_flip = BitFlip { call, part, element, bit: self.below(32) as u32 };
        Fault::Memory { cached: true, node, bit_flip }
    }

    fn start(&mut self, accepted: bool) -> Fault {
        let field = self.below(START_FIELDS.len());
        let (name, count) = START_FIELDS[field];
        // The last controls are not part of it.
        let nodes = if name.ends_with("torque") { NODES - 1 } else { NODES };
        let (node, element) = (self.below(nodes), self.below(count));
        Fault::Start { accepted, field, node, element, bit: self.below(64) as u32 }
    }

    fn program(&mut self, programs: u32, solution: bool) -> Fault {
        let call = self.below(programs as usize) as u32;
        let fields: &[_] = if solution { &SOLUTION_FIELDS } else { &PROGRAM_FIELDS };
        let field = self.below(fields.len());
        let (node, element) = (self.below(NODES), self.below(fields[field].1));
        Fault::Program { solution, call, field, node, element, bit: self.below(64) as u32 }
    }
}

/// Before which use of the memory: use `at` of a node, of which there are `layers + 3`.
fn moment(node: usize, at: usize, layers: usize) -> u32 {
    (node * (layers + 3) + at) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::learned::Learned;
    use remora_host::method::Integrator;
    use std::collections::HashSet;

    fn layout() -> (Layout, usize) {
        let learned = Learned::built_in(Integrator::Euler);
        let length = Learned::built_in_file(Integrator::Euler).len();
        (Layout::new(learned.model().unwrap(), length, (96, NODES)).unwrap(), length)
    }

    #[test]
    fn spans_cover_the_file() {
        let (layout, length) = layout();
        let mut at = 0;
        for Span { name, bytes, size } in &layout.spans {
            assert_eq!((bytes.start, bytes.len() % size), (at, 0), "{name}");
            at = bytes.end;
        }
        assert_eq!(at, length);
        assert_eq!(layout.spans.last().unwrap().bytes.len(), 4);
    }

    #[test]
    fn every_fault_strikes_something_that_is_there() {
        let (layout, length) = layout();
        let mut kinds = HashSet::new();
        for number in 0..8000 {
            let case = Drawn::new(1, number, 60).case(13, &layout);
            assert_eq!(case.fault.site(), Site::of(number));
            assert!(case.scenario < 60);
            let place = case.fault.place();
            assert!(place.node < NODES, "{case:?}");
            kinds.insert((Site::of(number), place.kind));
            match case.fault {
                Fault::File { checked, byte, part, .. } => {
                    assert!(byte < length && !(checked && part == "checksum"), "{byte} {part}");
                }
                Fault::Memory { bit_flip, .. } => assert!(bit_flip.call < 59 * 6, "{bit_flip:?}"),
                Fault::Start { field, element, bit, .. } => {
                    assert!(element < START_FIELDS[field].1 && bit < 64);
                }
                Fault::Program { solution, call, field, element, bit, .. } => {
                    let fields: &[_] = if solution { &SOLUTION_FIELDS } else { &PROGRAM_FIELDS };
                    assert!(element < fields[field].1 && bit < 64 && call < 13);
                }
            }
        }
        // Fields of tensors with header and checksum, then without the latter; parts of the memory;
        // fields of a start, before and after; of programs and solutions.
        assert_eq!(kinds.len(), 9 + 8 + 6 + 4 + 2 * 6 + 17 + 6, "{kinds:?}");
    }

    /// One case for ever, so that no change of a library can pass unseen.
    #[test]
    fn the_draw_never_changes() {
        let case = Drawn::new(1, 110, 60).case(14, &layout().0);
        assert_eq!((case.scenario, case.fault.site()), (54, Site::QpData));
        let place = case.fault.place();
        assert_eq!((place.part.as_str(), place.moment, place.node), ("lower_u", 13, 43));
        assert_eq!((place.element, place.bit), (5, 56));
    }
}
