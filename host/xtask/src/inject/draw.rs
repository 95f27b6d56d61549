//! Sampling of cases: from a seed and their number alone.

use super::case::{Case, Course, Fault, LoopFault};
use super::fields::{GUIDANCE_FIELDS, PROGRAM_FIELDS, SOLUTION_FIELDS, START_FIELDS};
use super::site::Site;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use remora_core::advanced::guidance::GuidancePart;
use remora_core::advanced::nn::{self, BitFlip, Dimensions, Model, ModelError, Part, tensors};
use remora_core::advanced::qp::kept::Part as Kept;
use remora_core::advanced::stages::NODES;
use std::ops::Range;

/// Tensor of a model file, or the bytes before or after all tensors.
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

    /// Tokens of a roll-out.
    fn tokens(&self) -> usize {
        nn::seen(NODES, self.size.stride)
    }

    /// The node that a token is of.
    fn node(&self, token: usize) -> usize {
        token * self.size.stride
    }
}

/// Work of a plan without a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Work {
    /// Subproblems that are solved.
    pub programs: u32,
    /// Iterations of either stage's loop.
    pub iterations: [u32; 2],
    /// Range of guidance's steps in which a flight on each course can be hit.
    pub steps: [[u32; 2]; Course::ALL.len()],
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

    /// The whole case: a function of seed, number, model, and of what the plan of its scenario takes
    /// without a fault.
    pub fn case(mut self, work: Work, layout: &Layout) -> Case {
        let Self { draw, number, scenario } = &mut self;
        let fault = match Site::of(*number) {
            Site::WeightsBeforeCheck => draw.file(layout, false),
            Site::WeightsAfterCheck => draw.file(layout, true),
            Site::Activations => draw.activation(layout),
            Site::Block => draw.within(layout),
            Site::KvCache => draw.cached(layout),
            Site::StartBeforeCheck => draw.start(false),
            Site::StartAfterCheck => draw.start(true),
            Site::QpData => draw.program(work.programs, false),
            Site::QpSolution => draw.program(work.programs, true),
            Site::LoopIterate => match draw.below(8) {
                0 => draw.kept(Kept::Best, work),
                _ => draw.kept(Kept::Iterate, work),
            },
            Site::LoopResiduals => draw.kept(Kept::Residuals, work),
            Site::LoopMultipliers => draw.kept(Kept::Multipliers, work),
            Site::LoopScalars => draw.kept(Kept::Scalars, work),
            Site::Path => draw.kept(Kept::Path, work),
            Site::Guidance => draw.guidance(work.steps),
        };
        Case { number: *number, scenario: *scenario, fault }
    }
}

struct Draw(ChaCha8Rng);

impl Draw {
    /// Number below `count`, which counts as one where it is zero. The remainder of 2^64 shifts shares
    /// by less than 1e-12.
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

    /// Samples data by how long they live: half the time the residual stream, a quarter the final hidden state.
    fn activation(&mut self, layout: &Layout) -> Fault {
        let (layers, (width, tokens)) = (layout.size.layers, layout.memory);
        let token = self.below(layout.tokens());
        let (part, at, row) = match self.below(8) {
            0..4 => (Part::Residual, 1 + self.below(layers + 1) * USES, layout.size.width),
            4..6 => (Part::Normal, uses(layers) - 1, layout.size.width),
            6 => (Part::Intermediate, self.below(uses(layers)), 4 * layout.size.width),
            _ => match self.below(3) {
                0 => (Part::Quantised, self.below(uses(layers)), 4 * width),
                1 => (Part::I16Operand, self.below(uses(layers)), 4 * width),
                _ => (Part::Scores, self.below(uses(layers)), tokens),
            },
        };
        let (call, element) = (moment(token, at, layers), self.below(row));
        let bit_flip = BitFlip { call, part, element, bit: self.below(32) as u32 };
        Fault::Memory { cached: false, within: false, node: layout.node(token), bit_flip }
    }

    /// Samples data that live between two steps of a block: queries, attention's result, the wide layer, and
    /// the residual stream beside them.
    fn within(&mut self, layout: &Layout) -> Fault {
        let (layers, width) = (layout.size.layers, layout.size.width);
        let token = self.below(layout.tokens());
        let (layer, step) = (self.below(layers), 1 + self.below(USES - 1));
        let (part, row) = match (self.below(4), step) {
            (0, _) => (Part::Residual, width),
            (_, 1) => (Part::Intermediate, width),
            (_, 2) => (Part::Normal, width),
            _ => (Part::Intermediate, 4 * width),
        };
        let call = moment(token, 1 + layer * USES + step, layers);
        let bit_flip = BitFlip { call, part, element: self.below(row), bit: self.below(32) as u32 };
        Fault::Memory { cached: false, within: true, node: layout.node(token), bit_flip }
    }

    /// Samples the cache of a token before the one at work, so that it will be read.
    fn cached(&mut self, layout: &Layout) -> Fault {
        let (layers, (width, tokens)) = (layout.size.layers, layout.memory);
        let token = 1 + self.below(layout.tokens() - 1);
        let before = self.below(token);
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
        let call = moment(token, 1 + self.below(layers) * USES, layers);
        let bit_flip = BitFlip { call, part, element, bit: self.below(32) as u32 };
        Fault::Memory { cached: true, within: false, node: layout.node(token), bit_flip }
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

    fn kept(&mut self, part: Kept, work: Work) -> Fault {
        let [first, second] = work.iterations;
        let moment = self.below((first + second) as usize) as u32;
        let stage = usize::from(moment >= first);
        let fields = LoopFault::fields(part, stage);
        let field = self.below(fields.len());
        let (node, element) = (self.below(NODES), self.below(fields[field].1));
        let (node, moment) = match part {
            Kept::Scalars => (0, moment),
            Kept::Path => (node, first),
            _ => (node, moment),
        };
        let bit = self.below(64) as u32;
        Fault::Loop(LoopFault { part, stage, moment, field, node, element, bit })
    }

    /// Samples guidance's state. Parts of one course are hit on that course, others half the time on the approach.
    fn guidance(&mut self, steps: [[u32; 2]; Course::ALL.len()]) -> Fault {
        let field = self.below(GUIDANCE_FIELDS.len());
        let course = match GuidancePart::ALL[field] {
            GuidancePart::Leaving => Course::Escape,
            GuidancePart::Jump => Course::Handover,
            _ => [Course::Approach, Course::Approach, Course::Escape, Course::Handover]
                [self.below(4)],
        };
        // Faults on a course that the plan does not fly move to the approach.
        let there = |course: &Course| steps[*course as usize][1] > steps[*course as usize][0];
        let course = Some(course).filter(there).unwrap_or(Course::Approach);
        let [from, to] = steps[course as usize];
        let step = from + self.below((to - from) as usize) as u32;
        let element = self.below(GUIDANCE_FIELDS[field].1);
        Fault::Guidance { course, step, field, element, bit: self.below(64) as u32 }
    }
}

/// Uses of the memory by a block.
const USES: usize = BitFlip::USES;

/// Uses of the memory by a token.
fn uses(layers: usize) -> usize {
    layers * USES + 3
}

/// Number of a use of the memory: use `at` of a token.
fn moment(token: usize, at: usize, layers: usize) -> u32 {
    (token * uses(layers) + at) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::learned::Learned;
    use remora_host::method::Integrator;
    use std::collections::HashSet;

    const WORK: Work =
        Work { programs: 14, iterations: [5, 7], steps: [[0, 2400], [900, 2100], [1210, 1250]] };

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
        for number in 0..1000 * Site::COUNT {
            let case = Drawn::new(1, number, 60).case(WORK, &layout);
            assert_eq!(case.fault.site(), Site::of(number));
            assert!(case.scenario < 60);
            let place = case.fault.place();
            assert!(place.node < NODES, "{case:?}");
            kinds.insert((Site::of(number), place.kind));
            match case.fault {
                Fault::File { checked, byte, part, .. } => {
                    assert!(byte < length && !(checked && part == "checksum"), "{byte} {part}");
                }
                Fault::Memory { bit_flip, .. } => {
                    assert!(bit_flip.call < 15 * layout.tokens() as u32, "{bit_flip:?}");
                }
                Fault::Start { field, element, bit, .. } => {
                    assert!(element < START_FIELDS[field].1 && bit < 64);
                }
                Fault::Program { solution, call, field, element, bit, .. } => {
                    let fields: &[_] = if solution { &SOLUTION_FIELDS } else { &PROGRAM_FIELDS };
                    assert!(element < fields[field].1 && bit < 64 && call < 14);
                }
                Fault::Loop(fault) => {
                    let fields = LoopFault::fields(fault.part, fault.stage);
                    assert!(fault.element < fields[fault.field].1 && fault.moment < 12);
                    assert!(fault.part == Kept::Path || (fault.moment >= 5) == (fault.stage == 1));
                }
                Fault::Guidance { course, step, field, element, .. } => {
                    let [from, to] = WORK.steps[course as usize];
                    assert!(element < GUIDANCE_FIELDS[field].1 && (from..to).contains(&step));
                }
            }
        }
        // Fields of tensors with header and checksum, then without the latter; parts of the memory between
        // blocks, within one, of the cache; fields of a start, before and after; of programs and solutions; of
        // iterates, last and best, of both stages; of residuals, multipliers, scalars, path, guidance.
        let network = 6 + 3 + 4;
        let loops = 2 * (3 + 6) + 2 + 4 + 6;
        assert_eq!(kinds.len(), 9 + 8 + network + 2 * 6 + 18 + 6 + loops + 3 + 9, "{kinds:?}");
    }

    /// One case for ever, so that no change of a library can pass unseen. A number more in what is struck moves it:
    /// a subproblem's complementarity did.
    #[test]
    fn the_draw_never_changes() {
        let case = Drawn::new(1, 112, 60).case(WORK, &layout().0);
        assert_eq!((case.scenario, case.fault.site()), (31, Site::QpData));
        let place = case.fault.place();
        assert_eq!((place.part.as_str(), place.moment, place.node), ("complementarity", 4, 39));
        assert_eq!((place.element, place.bit), (0, 59));
    }
}
