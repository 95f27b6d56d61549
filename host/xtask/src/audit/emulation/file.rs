//! The report of firmware images, `remora-firmware/2`, as it is written.

use super::Phase;
use remora_host::error::FieldError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The `format` that is understood.
pub const FORMAT: &str = "remora-firmware/2";

/// The whole report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a report of firmware images")]
pub struct ReportFile {
    /// [`FORMAT`].
    pub format: String,
    /// The images.
    pub targets: Vec<TargetRecord>,
}

/// One target's image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a target's image")]
pub struct TargetRecord {
    /// The compiler's name of it.
    pub target: String,
    /// The emulated board.
    pub board: String,
    /// Processor that the compiler made it for.
    pub cpu: String,
    /// The compiler.
    pub toolchain: String,
    /// Clock rate of the estimate of milliseconds [Hz].
    pub clock_hz: Option<u64>,
    /// Code, constants and initial data, without models.
    pub image_bytes: u64,
    /// Models in the image.
    pub model_bytes: u64,
    /// Static memory in all, without the stack.
    pub static_bytes: u64,
    /// Room for the stack.
    pub stack_size_bytes: u64,
    /// The planner's memory.
    pub workspace_bytes: u64,
    /// The memory of the subproblems' solver.
    pub solver_bytes: u64,
    /// The memory of the learned start's network.
    pub network_bytes: u64,
    /// The state of guidance; none in reports of before it flew.
    pub guidance_bytes: Option<u64>,
    /// A plan as it is flown.
    pub flight_plan_bytes: Option<u64>,
    /// Whether no panic can be reached in the image.
    pub panic_free: bool,
    /// The parts of a plan one by one, in the test image.
    pub parts: Vec<Part>,
    /// Runs of the image.
    pub runs: Vec<RunRecord>,
}

/// A part of a plan on its own.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a part of a plan")]
pub struct Part {
    /// Its name.
    pub name: String,
    /// How often it was called.
    pub calls: u64,
    /// Instructions retired in all of these.
    pub instructions: u64,
}

/// Plans with one integrator from one start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a run of an image")]
pub struct RunRecord {
    /// Discretisation of Stage 2.
    pub integrator: IntegratorName,
    /// Requested initial guess of Stage 2.
    pub start: StartName,
    /// Whether results are the host's, bit for bit.
    pub same_bits_as_host: bool,
    /// Whether a second run printed the same; none where there was no second.
    pub repeatable: Option<bool>,
    /// The instruction counter against a loop of known length.
    pub counter: Counter,
    /// Instructions of opening the model: a look at every byte; none from the heuristic.
    pub open_model_instructions: Option<u64>,
    /// High-water mark of the stack by entry point, over all plans.
    pub stack_bytes: BTreeMap<String, u64>,
    /// Guidance along the last plan; none in reports of before it flew.
    pub guidance: Option<GuidanceRecord>,
    /// The plans in order.
    pub plans: Vec<PlanRecord>,
}

/// Steps of guidance along a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with steps of guidance")]
pub struct GuidanceRecord {
    /// Steps that follow another by 0.1 s.
    pub next: Steps,
    /// Steps that begin at another place of the plan.
    pub first: Steps,
    /// Stack of one, without what called it.
    pub stack_bytes: Option<u64>,
}

/// How many steps of guidance, and what one takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a number of steps")]
pub struct Steps {
    /// How many.
    pub steps: u64,
    /// The most instructions of one.
    pub instructions: u64,
}

/// Discretisation of Stage 2 in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IntegratorName {
    /// Euler.
    Euler,
    /// RK4 with four substeps.
    Rk4,
}

impl IntegratorName {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Rk4 => "rk4",
        }
    }

    /// Name for readers.
    pub fn label(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Rk4 => "RK4 (4)",
        }
    }
}

/// Requested initial guess of Stage 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartName {
    /// The heuristic.
    Heuristic,
    /// The image's model for the integrator.
    Model,
}

impl StartName {
    /// Name in files and for readers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Heuristic => "heuristic",
            Self::Model => "model",
        }
    }
}

/// The instruction counter against a loop of known length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the counter's calibration")]
pub struct Counter {
    /// Instructions of the loop.
    pub expected: u64,
    /// Instructions that were counted.
    pub counted: u64,
    /// Smallest difference that the counter knows [instructions].
    pub resolution: u64,
}

/// One plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a plan")]
pub struct PlanRecord {
    /// Id of the scenario.
    pub scenario: String,
    /// Code of its status: 0 is solved.
    pub status: u32,
    /// Whether the verifier found every residual within its tolerance.
    pub verified: bool,
    /// Code of what Stage 2 started from: 0 heuristic, 1 model, otherwise why it fell back.
    pub start: u32,
    /// Checksum of the plan's trajectories: 16 hexadecimal digits.
    pub output: String,
    /// Stage 1.
    pub translation: StageCounts,
    /// Stage 2.
    pub reorientation: StageCounts,
    /// Retired instructions of each phase.
    pub instructions: Instructions,
    /// The most of them between two pauses; none in reports of before it was counted.
    pub longest_slice: Option<u64>,
}

/// Code of a start from the model: `StartRecord::Learned` of the core.
const FROM_MODEL: u32 = 1;

impl PlanRecord {
    /// Whether it ended solved and the verifier agreed.
    pub fn is_solved(&self) -> bool {
        self.status == 0 && self.verified
    }

    /// Whether a model was asked for and the heuristic used.
    pub fn fell_back(&self, asked: StartName) -> bool {
        asked == StartName::Model && self.start != FROM_MODEL
    }

    /// Iterations of the subproblems' solver in both stages.
    pub fn qp_iterations(&self) -> u64 {
        self.translation.qp_iterations + self.reorientation.qp_iterations
    }
}

/// Counts of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the counts of a stage")]
pub struct StageCounts {
    /// Code of its status: 0 is solved.
    pub status: u32,
    /// Iterations.
    pub iterations: u64,
    /// Second-order corrections.
    pub corrections: u64,
    /// Iterations of the subproblems' solver.
    pub qp_iterations: u64,
}

/// Retired instructions of a plan by phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with instructions by phase")]
pub struct Instructions {
    translation: u64,
    start: u64,
    inference: u64,
    linearise: u64,
    qp: u64,
    step: u64,
    verify: u64,
    rest: u64,
    total: u64,
}

impl Instructions {
    /// Those of each phase, by its name in an image's log.
    ///
    /// # Errors
    /// The first phase that there is nothing of.
    pub fn by(count: impl Fn(&str) -> Option<u64>) -> Result<Self, FieldError> {
        let of = |name: &str| count(name).ok_or_else(|| FieldError::new(name, "missing"));
        Ok(Self {
            translation: of("translation")?,
            start: of("start")?,
            inference: of("inference")?,
            linearise: of("linearise")?,
            qp: of("qp")?,
            step: of("step")?,
            verify: of("verify")?,
            rest: of("rest")?,
            total: of("total")?,
        })
    }

    /// Those of one phase.
    pub fn of(&self, phase: Phase) -> u64 {
        match phase {
            Phase::Translation => self.translation,
            Phase::Start => self.start,
            Phase::Inference => self.inference,
            Phase::Linearise => self.linearise,
            Phase::Qp => self.qp,
            Phase::Step => self.step,
            Phase::Verify => self.verify,
            Phase::Rest => self.rest,
            Phase::Total => self.total,
        }
    }
}
