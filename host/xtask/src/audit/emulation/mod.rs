//! Instructions under emulation: what the images of the corpus measured, by target and phase.
//!
//! The largest number of a phase is the *observed maximum, emulated*: the most that any scenario of
//! the corpus took. No scenario outside it is bounded by that, and an instruction is not a cycle.

mod file;
mod tables;

pub use file::{
    Counter, FORMAT, GuidanceRecord, Instructions, IntegratorName, Part, PlanRecord, ReportFile,
    RunRecord, StageCounts, StartName, Steps, TargetRecord,
};

use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, json, read_text};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A part of a plan whose instructions are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Stage 1.
    Translation,
    /// The target's tumble and the heuristic start of Stage 2.
    Start,
    /// The learned start of Stage 2, its comparison with the heuristic included.
    Inference,
    /// Stage 2: linearisation, curvature and bounds.
    Linearise,
    /// Stage 2: the solver of the subproblems.
    Qp,
    /// Stage 2: retractions and residuals of steps.
    Step,
    /// The independent verifier.
    Verify,
    /// Checksums, and what the loop does between the phases.
    Rest,
    /// The whole plan.
    Total,
}

impl Phase {
    /// All of them, in the order of a plan.
    pub const ALL: [Self; 9] = [
        Self::Translation,
        Self::Start,
        Self::Inference,
        Self::Linearise,
        Self::Qp,
        Self::Step,
        Self::Verify,
        Self::Rest,
        Self::Total,
    ];

    /// Name in tables.
    pub fn label(self) -> &'static str {
        match self {
            Self::Translation => "Stage 1",
            Self::Start => "tumble, heuristic",
            Self::Inference => "warm start",
            Self::Linearise => "linearisation",
            Self::Qp => "QP",
            Self::Step => "steps",
            Self::Verify => "verification",
            Self::Rest => "rest",
            Self::Total => "whole plan",
        }
    }
}

/// Measurements under emulation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Emulation {
    /// One image each.
    pub targets: Vec<Target>,
}

/// One target's image and its runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Target {
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
    /// Largest high-water mark of the stack by entry point, over all runs.
    pub stack_bytes: BTreeMap<String, u64>,
    /// Whether no panic can be reached in the image.
    pub panic_free: bool,
    /// The parts of a plan one by one, in the test image.
    pub parts: Vec<Part>,
    /// One an integrator and start.
    pub runs: Vec<Run>,
}

/// Plans with one integrator from one start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Discretisation of Stage 2.
    pub integrator: IntegratorName,
    /// Requested initial guess of Stage 2.
    pub start: StartName,
    /// How many scenarios.
    pub scenarios: usize,
    /// How many of them were solved, as the verifier agrees.
    pub solved: usize,
    /// How many asked the model and used the heuristic.
    pub fell_back: usize,
    /// Whether results are the host's, bit for bit.
    pub same_bits_as_host: bool,
    /// Whether a second run printed the same; none where there was no second.
    pub repeatable: Option<bool>,
    /// The instruction counter against a loop of known length.
    pub counter: Counter,
    /// Instructions of opening the model; none from the heuristic.
    pub open_model_instructions: Option<u64>,
    /// High-water mark of the stack by entry point.
    pub stack_bytes: BTreeMap<String, u64>,
    /// Guidance along the last plan; none in reports of before it flew.
    pub guidance: Option<GuidanceRecord>,
    /// Instructions of each phase over the scenarios.
    pub phases: Vec<Observed>,
    /// The plans one by one.
    pub plans: Vec<PlanRecord>,
}

/// Instructions of one phase over the scenarios.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Observed {
    /// The phase.
    pub phase: Phase,
    /// Fewest.
    pub min_instructions: u64,
    /// Median; the mean of the middle two, rounded down, of an even number.
    pub median_instructions: u64,
    /// Most: the observed maximum, emulated.
    pub max_instructions: u64,
    /// The first scenario that took so many.
    pub max_scenario: String,
}

impl Observed {
    /// Observations of some plans; none without a plan.
    fn of(phase: Phase, plans: &[PlanRecord]) -> Option<Self> {
        let count = |plan: &PlanRecord| plan.instructions.of(phase);
        let mut counts: Vec<u64> = plans.iter().map(count).collect();
        counts.sort_unstable();
        let (min, max) = (*counts.first()?, *counts.last()?);
        let below = counts[(counts.len() - 1) / 2];
        let above = counts[counts.len() / 2];
        let hardest = plans.iter().find(|plan| count(plan) == max)?;
        Some(Self {
            phase,
            min_instructions: min,
            median_instructions: below + (above - below) / 2,
            max_instructions: max,
            max_scenario: hardest.scenario.clone(),
        })
    }
}

impl Emulation {
    /// Reads the report that images left, `firmware/report.json` in the target folder.
    ///
    /// # Errors
    /// The file and the first field or line that cannot be understood; a run without plans.
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(&read_text(file, Limit::DOCUMENT)?).map_err(|error| error.at(file))
    }

    /// Parses the text of a report.
    ///
    /// # Errors
    /// As [`Emulation::read`].
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        Self::new(json::parse(text, FORMAT)?)
    }

    /// Converts and checks a report.
    ///
    /// # Errors
    /// As [`Emulation::read`].
    pub fn new(report: ReportFile) -> Result<Self, FieldError> {
        if report.targets.is_empty() {
            return Err(FieldError::new("targets", "empty: nothing was run"));
        }
        let targets = report.targets.into_iter().enumerate();
        let targets = targets.map(|(i, target)| Target::new(target, &format!("targets[{i}]")));
        Ok(Self { targets: targets.collect::<Result<_, _>>()? })
    }

    /// Whether all plans were solved with the host's bits, no second run differed, no panic can be
    /// reached, and every counter agrees with the loop of known length.
    pub fn is_sound(&self) -> bool {
        self.targets.iter().all(|target| target.panic_free && target.runs.iter().all(Run::is_sound))
    }
}

impl Target {
    fn new(record: TargetRecord, at: &str) -> Result<Self, FieldError> {
        if record.runs.is_empty() {
            return Err(FieldError::new(format!("{at}.runs"), "empty: nothing was run"));
        }
        let runs = record.runs.into_iter().enumerate();
        let runs = runs.map(|(i, run)| Run::new(run, &format!("{at}.runs[{i}]")));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        let mut stack_bytes = BTreeMap::new();
        for (entry, used) in runs.iter().flat_map(|run| &run.stack_bytes) {
            let most: &mut u64 = stack_bytes.entry(entry.clone()).or_default();
            *most = (*most).max(*used);
        }
        Ok(Self {
            target: record.target,
            board: record.board,
            cpu: record.cpu,
            toolchain: record.toolchain,
            clock_hz: record.clock_hz,
            image_bytes: record.image_bytes,
            model_bytes: record.model_bytes,
            static_bytes: record.static_bytes,
            workspace_bytes: record.workspace_bytes,
            solver_bytes: record.solver_bytes,
            network_bytes: record.network_bytes,
            guidance_bytes: record.guidance_bytes,
            flight_plan_bytes: record.flight_plan_bytes,
            stack_bytes,
            panic_free: record.panic_free,
            parts: record.parts,
            runs,
        })
    }

    /// Largest instruction counts and stack of guidance's steps over all runs.
    pub fn guidance(&self) -> Option<GuidanceRecord> {
        let most = |one: Steps, other: Steps| Steps {
            steps: one.steps + other.steps,
            instructions: one.instructions.max(other.instructions),
        };
        let flown = self.runs.iter().filter_map(|run| run.guidance);
        flown.reduce(|one, other| GuidanceRecord {
            next: most(one.next, other.next),
            first: most(one.first, other.first),
            stack_bytes: one.stack_bytes.max(other.stack_bytes),
        })
    }

    /// The longest slice of planning over all runs.
    pub fn longest_slice(&self) -> Option<u64> {
        self.runs.iter().filter_map(Run::longest_slice).map(|(instructions, _)| instructions).max()
    }

    /// The run with this integrator and start.
    pub fn run(&self, integrator: IntegratorName, start: StartName) -> Option<&Run> {
        self.runs.iter().find(|run| run.integrator == integrator && run.start == start)
    }
}

impl Run {
    fn new(record: RunRecord, at: &str) -> Result<Self, FieldError> {
        let plans = record.plans;
        let observed = Phase::ALL.into_iter().map(|phase| Observed::of(phase, &plans));
        let phases = observed.collect::<Option<_>>();
        let phases = phases.ok_or_else(|| FieldError::new(format!("{at}.plans"), "empty"))?;
        Ok(Self {
            integrator: record.integrator,
            start: record.start,
            scenarios: plans.len(),
            solved: plans.iter().filter(|plan| plan.is_solved()).count(),
            fell_back: plans.iter().filter(|plan| plan.fell_back(record.start)).count(),
            same_bits_as_host: record.same_bits_as_host,
            repeatable: record.repeatable,
            counter: record.counter,
            open_model_instructions: record.open_model_instructions,
            stack_bytes: record.stack_bytes,
            guidance: record.guidance,
            phases,
            plans,
        })
    }

    /// The longest slice of its plans, and the first scenario with so long a one.
    pub fn longest_slice(&self) -> Option<(u64, &str)> {
        let slices = self.plans.iter().filter_map(|plan| Some((plan.longest_slice?, plan)));
        let longest = slices.reduce(|most, other| if other.0 > most.0 { other } else { most });
        longest.map(|(instructions, plan)| (instructions, plan.scenario.as_str()))
    }

    /// Observations of a phase.
    pub fn observed(&self, phase: Phase) -> Option<&Observed> {
        self.phases.iter().find(|observed| observed.phase == phase)
    }

    fn is_sound(&self) -> bool {
        self.solved == self.scenarios
            && self.same_bits_as_host
            && self.repeatable != Some(false)
            && self.counter.is_right()
    }
}

/// Instructions around the loop of known length that may be counted with it.
const CALLING: u64 = 8;

impl Counter {
    /// Whether the counter agrees with the loop, to its resolution and what calls the loop.
    pub fn is_right(&self) -> bool {
        let (low, high) = (self.resolution, self.resolution + CALLING);
        (self.expected.saturating_sub(low)..=self.expected + high).contains(&self.counted)
    }
}

#[cfg(test)]
mod tests;
