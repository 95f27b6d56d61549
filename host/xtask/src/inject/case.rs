//! Fault injection: cases, and what is struck in each.

use super::fields::{
    Field, GUIDANCE_FIELDS, PATH_FIELDS, PROGRAM_FIELDS, RESIDUAL_FIELDS, SCALAR_FIELDS,
    SOLUTION_FIELDS, START_FIELDS,
};
use super::site::Site;
use remora_core::advanced::nn::{BitFlip, Part};
use remora_core::advanced::qp::kept::Part as Kept;

/// Flipped bit: the data it belongs to, and the moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Bit of the model file.
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
    /// Bit of the network's memory.
    Memory {
        /// Whether of the cache.
        cached: bool,
        /// Whether within a block.
        within: bool,
        /// The node at which.
        node: usize,
        /// The flip and its moment.
        bit_flip: BitFlip,
    },
    /// Bit of Stage 2's initial guess.
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
    /// Bit of a subproblem or its solution.
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
    /// Bit of the data that a loop keeps between its iterations, or of Stage 1's path.
    Loop(LoopFault),
    /// Bit of guidance's state, in flight.
    Guidance {
        /// How it is flown.
        course: Course,
        /// Step of guidance before which it flips, from zero.
        step: u32,
        /// Which of [`GUIDANCE_FIELDS`].
        field: usize,
        /// Which number of it.
        element: usize,
        /// Which bit of the number.
        bit: u32,
    },
}

/// How a plan is flown that guidance is struck in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Course {
    /// To capture.
    Approach,
    /// A thruster axis is lost on the way, and the target is left.
    Escape,
    /// Planned again on the way: what the command jumps by is faded out.
    Handover,
}

impl Course {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Approach, Self::Escape, Self::Handover];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Escape => "escape",
            Self::Handover => "handover",
        }
    }
}

/// One flipped bit of what a loop keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopFault {
    /// Which part.
    pub part: Kept,
    /// Which stage, from zero.
    pub stage: usize,
    /// Iteration of the plan before which it flips, from zero, those of both stages counted together.
    pub moment: u32,
    /// Which of the part's [`fields`](LoopFault::fields).
    pub field: usize,
    /// The node.
    pub node: usize,
    /// Which number of the field.
    pub element: usize,
    /// Which bit of the number.
    pub bit: u32,
}

impl LoopFault {
    /// Fields of the part at a node in a stage.
    pub fn fields(part: Kept, stage: usize) -> &'static [Field] {
        match (part, stage) {
            (Kept::Iterate | Kept::Best, 0) | (Kept::Path, _) => &PATH_FIELDS,
            (Kept::Iterate | Kept::Best, _) => &START_FIELDS,
            (Kept::Residuals, _) => &RESIDUAL_FIELDS,
            (Kept::Multipliers, _) => &SOLUTION_FIELDS[2..],
            (Kept::Scalars, _) => &SCALAR_FIELDS,
        }
    }

    /// Index among all numbers of the part at a node.
    pub(super) fn flat(&self) -> usize {
        let before = Self::fields(self.part, self.stage).iter().take(self.field);
        before.map(|(_, count)| count).sum::<usize>() + self.element
    }

    fn name(&self) -> String {
        let name = Self::fields(self.part, self.stage)[self.field].0;
        match self.part {
            Kept::Best => format!("best_{name}"),
            _ => name.to_string(),
        }
    }
}

/// Place of a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Name of the data that was hit, such as `block.0.qkv.scale`.
    pub part: String,
    /// Kind of this data, by which cases are counted, such as `scale`.
    pub kind: String,
    /// Which use of the memory, of a plan's programs or iterations, or of guidance's steps; zero where there
    /// is but one moment.
    pub moment: u32,
    /// The node; zero where the data belong to none.
    pub node: usize,
    /// Which number.
    pub element: usize,
    /// Which bit of it.
    pub bit: u32,
}

impl Fault {
    /// Site that it belongs to.
    pub fn site(&self) -> Site {
        match self {
            Self::File { checked: false, .. } => Site::WeightsBeforeCheck,
            Self::File { checked: true, .. } => Site::WeightsAfterCheck,
            Self::Memory { cached: true, .. } => Site::KvCache,
            Self::Memory { within: true, .. } => Site::Block,
            Self::Memory { .. } => Site::Activations,
            Self::Start { accepted: false, .. } => Site::StartBeforeCheck,
            Self::Start { accepted: true, .. } => Site::StartAfterCheck,
            Self::Program { solution: false, .. } => Site::QpData,
            Self::Program { solution: true, .. } => Site::QpSolution,
            Self::Loop(LoopFault { part, .. }) => match part {
                Kept::Iterate | Kept::Best => Site::LoopIterate,
                Kept::Residuals => Site::LoopResiduals,
                Kept::Multipliers => Site::LoopMultipliers,
                Kept::Scalars => Site::LoopScalars,
                Kept::Path => Site::Path,
            },
            Self::Guidance { .. } => Site::Guidance,
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
            Self::Loop(fault) => {
                let LoopFault { moment, node, element, bit, .. } = *fault;
                let name = fault.name();
                Place { part: name.clone(), kind: name, moment, node, element, bit }
            }
            Self::Guidance { course, step, field, element, bit } => {
                let kind = GUIDANCE_FIELDS[*field].0.to_string();
                let part = format!("{}.{kind}", course.name());
                let (moment, element, bit) = (*step, *element, *bit);
                Place { part, kind, moment, node: 0, element, bit }
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
    /// Index of the scenario.
    pub scenario: usize,
    /// The fault.
    pub fault: Fault,
}
