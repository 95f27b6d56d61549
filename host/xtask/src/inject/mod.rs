//! Fault injection: one flipped bit in what the planner works on, and what becomes of the plan.
//!
//! A case is a scenario and a fault: a site, a moment, a number and one of its bits, all drawn from
//! the ChaCha8 stream of the case's number. So the same seed has the same cases whatever the number
//! of threads, and any of them can be run alone. Each is held against the same plan without the
//! fault, and judged by the verifier with a mission and a scenario that nothing has touched.
//! `docs/evidence/verification.md` tells what the sites and classes mean.

mod bit_flip;
mod case;
mod class;
mod draw;
mod ended;
mod fields;
mod flights;
mod journal;
mod reference;
mod report;
mod result;
mod site;
mod watch;
mod worker;

pub use case::{Case, Course, Fault, LoopFault, Place};
pub use class::{Claim, Class, Judge, Plan, Seen};
pub use fields::{
    Field, GUIDANCE_FIELDS, PATH_FIELDS, PROGRAM_FIELDS, RESIDUAL_FIELDS, SCALAR_FIELDS,
    SOLUTION_FIELDS, START_FIELDS,
};
pub use report::{injection_report, replay_report};
pub use result::{Counts, Extra, FORMAT, Injection, Record, Share};
pub use site::Site;

use draw::{Drawn, Layout};
use ended::{Ended, Ran};
use journal::{Header, Journal, Line};
use reference::Reference;
use remora_core::advanced::planner::{GuessRecord, PlanSettings};
use remora_core::advanced::scp::{IterationRecord, Status};
use remora_core::advanced::stages::Mode;
use remora_host::choice::Choice;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Mission, NamedScenario};
use remora_host::learned::Learned;
use remora_host::method::Integrator;
use remora_host::pool;
use remora_host::progress::Progress;
use std::collections::HashSet;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::thread;
use std::time::Duration;
use watch::Watch;
use worker::{MEMORY, Setup, Worker};

/// Most cases.
pub const MAX_COUNT: u64 = 100_000_000;

/// After one case of each site in so many, and after each that is not solved, a plan without a
/// fault is made on the same planner.
const LEAK_EVERY: u64 = 16;

/// A case hangs if it takes longer than this many times the slowest plan without a fault, and
/// longer than the least limit. A busy machine must not look like it: no case that ends by itself
/// is judged by its time.
const PATIENCE: f64 = 400.0;
const LEAST_LIMIT: Duration = Duration::from_secs(60);

/// Faults to be injected: the input of `cargo xtask inject`.
#[derive(Clone, Debug)]
pub struct Injector {
    /// Seed of the cases.
    pub seed: u64,
    /// Sites of the faults; at least one, none twice.
    pub sites: Vec<Site>,
    /// The scenarios to draw from, at least one; ids are unique.
    pub scenarios: Vec<NamedScenario>,
    /// The mission; valid, of the built-in mission's arm.
    pub mission: Mission,
    /// Discretisation of Stage 2; its built-in model is what plans start from.
    pub integrator: Integrator,
}

/// One case run alone.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Its record.
    pub record: Record,
    /// The loops' logs of stages 1 and 2; of a file that was refused, those of the plan from the
    /// heuristic.
    pub logs: [Vec<IterationRecord>; 2],
}

/// Inputs that runs of cases share.
struct Bench<'a> {
    setup: Setup<'a>,
    layout: Layout,
}

impl Injector {
    /// Runs the first `count` cases of the sites. Those that stand in the file `resumed` are not run again,
    /// and each that is finished is added to it. `alarm` is told of a case that does not come to
    /// its end, on a thread of its own: nothing else can be done about it than to end the program.
    ///
    /// # Errors
    /// Scenarios that are not solved without a fault; threads that cannot be started; a file of another
    /// injection.
    pub fn run(
        &self,
        count: u64,
        jobs: NonZeroUsize,
        resumed: Option<&Path>,
        progress: &mut dyn Progress,
        alarm: &(dyn Fn(u64) + Sync),
    ) -> Result<Injection, Error> {
        let model = Learned::built_in(self.integrator);
        let bench = self.bench(&model, self.sites.contains(&Site::Guidance))?;
        let (mut journal, mut lines) = self.begun(resumed)?;
        let references = self.references(&bench, jobs)?;
        let limit = limit(&references);
        let mut numbers = self.numbers(count);
        let asked: HashSet<u64> = numbers.iter().copied().collect();
        lines.retain(|line| asked.contains(&line.record.case));
        let finished: HashSet<u64> = lines.iter().map(|line| line.record.case).collect();
        numbers.retain(|number| !finished.contains(number));
        let watch = Watch::new(jobs.get());
        progress.begin(asked.len(), finished.len());
        let outcome = thread::scope(|scope| {
            scope.spawn(|| watch.guard(limit, alarm));
            let make = |number| (number, Worker::new(&bench.setup));
            let run = |(at, worker): &mut (usize, Worker), number| {
                watch.begin(*at, number);
                let (case, attempt) = bench.run(worker, self.seed, number, &references);
                watch.done(*at);
                let record = self.record(&case, &attempt);
                Ok(Line { record, leak_checked: attempt.leaked.is_some() })
            };
            let finish = |_, line: Line| {
                progress.done(line.record.status == Status::Solved);
                journal.iter_mut().try_for_each(|journal| journal.append(&line))?;
                lines.push(line);
                Ok(())
            };
            let outcome = pool::plan_all_with(jobs, &numbers, make, run, finish);
            watch.end();
            outcome
        });
        progress.end();
        outcome?;
        lines.sort_by_key(|line| line.record.case);
        let leak_checks = lines.iter().filter(|line| line.leak_checked).count() as u64;
        let records = lines.into_iter().map(|line| line.record).collect();
        let from = (self.seed, self.integrator.to_string(), self.scenarios.len());
        Ok(Injection::new(from, model.record(), records, leak_checks))
    }

    /// The journal in a file, and the cases that are finished.
    fn begun(&self, file: Option<&Path>) -> Result<(Option<Journal>, Vec<Line>), Error> {
        let Some(file) = file else { return Ok((None, Vec::new())) };
        let is_case =
            |line: &Line| match self.scenarios.iter().any(|s| s.id == line.record.scenario) {
                true => Ok(()),
                false => Err(FieldError::new("record.scenario", "is none of this injection's")),
            };
        let (journal, lines) = Journal::open(file, &Header::new(self), &is_case)?;
        Ok((Some(journal), lines))
    }

    /// Runs one case alone.
    ///
    /// # Errors
    /// As [`Injector::run`].
    pub fn replay(&self, number: u64) -> Result<Replay, Error> {
        let drawn = Drawn::new(self.seed, number, self.scenarios.len());
        let flies = Site::of(number) == Site::Guidance;
        self.alone(drawn.scenario, flies, |reference, layout| drawn.case(reference.work, layout))
    }

    /// Runs a case that was made by hand, of one of the scenarios.
    ///
    /// # Errors
    /// As [`Injector::run`].
    pub fn inject(&self, case: &Case) -> Result<Replay, Error> {
        let flies = case.fault.site() == Site::Guidance;
        self.alone(case.scenario, flies, |_, _| case.clone())
    }

    fn alone(
        &self,
        scenario: usize,
        flies: bool,
        case: impl FnOnce(&Reference, &Layout) -> Case,
    ) -> Result<Replay, Error> {
        let model = Learned::built_in(self.integrator);
        let bench = self.bench(&model, flies)?;
        let mut worker = Worker::new(&bench.setup);
        let reference = worker.reference(&bench.setup, scenario)?;
        let case = case(&reference, &bench.layout);
        let mut attempt = bench.attempt(&mut worker, &case, &reference);
        let (one, two) = worker.logs();
        let logs = [one.to_vec(), two.to_vec()];
        bench.check_leak(&mut worker, &case, &reference, &mut attempt);
        Ok(Replay { record: self.record(&case, &attempt), logs })
    }

    fn bench<'a>(&'a self, model: &'a Learned, flies: bool) -> Result<Bench<'a>, Error> {
        let file = Learned::built_in_file(self.integrator);
        let unusable = || Error::argument("--integrator", "its model cannot be used");
        let model = model.model().ok_or_else(unusable)?;
        let layout = Layout::new(model, file.len(), MEMORY).map_err(|_| unusable())?;
        if self.scenarios.is_empty() {
            return Err(Error::argument("--scenarios", "there is none"));
        }
        let options = PlanSettings::new(Mode::Optimal, self.integrator);
        let (mission, scenarios) = (self.mission.sized(), &self.scenarios[..]);
        Ok(Bench { setup: Setup { mission, scenarios, options, file, model, flies }, layout })
    }

    fn references(&self, bench: &Bench<'_>, jobs: NonZeroUsize) -> Result<Vec<Reference>, Error> {
        let indices: Vec<usize> = (0..self.scenarios.len()).collect();
        let mut found: Vec<(usize, Reference)> = Vec::with_capacity(indices.len());
        pool::plan_all_with(
            jobs,
            &indices,
            |_| Worker::new(&bench.setup),
            |worker, index| worker.reference(&bench.setup, index),
            |index, reference| {
                found.push((index, reference));
                Ok(())
            },
        )?;
        found.sort_by_key(|(index, _)| *index);
        Ok(found.into_iter().map(|(_, reference)| reference).collect())
    }

    /// Numbers of the first cases of the sites.
    fn numbers(&self, count: u64) -> Vec<u64> {
        let mut sites: Vec<u64> = (0..Site::ALL.len() as u64)
            .filter(|number| self.sites.contains(&Site::of(*number)))
            .collect();
        if sites.is_empty() {
            sites = (0..Site::ALL.len() as u64).collect();
        }
        let share = sites.len() as u64;
        let number = |i: u64| i / share * Site::ALL.len() as u64 + sites[(i % share) as usize];
        (0..count).map(number).collect()
    }

    fn record(&self, case: &Case, attempt: &Attempt) -> Record {
        let Attempt { ran, panicked, leaked } = attempt;
        let seen = Seen {
            is_late: !ran.ended.is_bounded,
            panicked: *panicked,
            is_wrong: ran.ended.is_wrong,
            leaked: *leaked == Some(true),
            is_solved: ran.ended.status == Status::Solved,
            is_refused: ran.is_refused,
            fell_back: ran.ended.start == GuessRecord::Unsolved
                && ran.baseline.start != GuessRecord::Unsolved,
            is_same: ran.ended.is_same(&ran.baseline),
        };
        Record::new(case, &self.scenarios[case.scenario].id, seen.class(), ran)
    }
}

/// Outcome of an attempt to plan.
struct Attempt {
    ran: Ran,
    panicked: bool,
    /// Whether the next plan without a fault was another than before, where one was made.
    leaked: Option<bool>,
}

impl Bench<'_> {
    fn run(
        &self,
        worker: &mut Worker,
        seed: u64,
        number: u64,
        references: &[Reference],
    ) -> (Case, Attempt) {
        let drawn = Drawn::new(seed, number, references.len());
        let reference = &references[drawn.scenario];
        let case = drawn.case(reference.work, &self.layout);
        let mut attempt = self.attempt(worker, &case, reference);
        self.check_leak(worker, &case, reference, &mut attempt);
        (case, attempt)
    }

    /// Plans without a fault where that is due, and compares.
    fn check_leak(
        &self,
        worker: &mut Worker,
        case: &Case,
        reference: &Reference,
        attempt: &mut Attempt,
    ) {
        if case.fault.site() == Site::Guidance {
            return;
        }
        let is_due = (case.number / Site::ALL.len() as u64).is_multiple_of(LEAK_EVERY);
        if is_due || attempt.ran.ended.status != Status::Solved {
            let plan = AssertUnwindSafe(|| worker.sound(&self.setup, case.scenario));
            let leaks = catch_unwind(plan).map_or(true, |ended| ended != reference.learned);
            attempt.leaked = Some(leaks);
        }
    }

    /// Plans a case. After a panic, whose message has gone to standard error, the planner is made
    /// anew.
    fn attempt(&self, worker: &mut Worker, case: &Case, reference: &Reference) -> Attempt {
        let run = AssertUnwindSafe(|| worker.run(&self.setup, case, reference));
        match catch_unwind(run) {
            Ok(ran) => Attempt { ran, panicked: false, leaked: None },
            Err(_) => {
                *worker = Worker::new(&self.setup);
                let baseline = reference.learned;
                let ended = Ended { status: Status::NumericalFailure, output: 0, ..baseline };
                let ran = Ran { ended, baseline, is_refused: false, ending: None };
                Attempt { ran, panicked: true, leaked: None }
            }
        }
    }
}

/// Time after which a case hangs.
fn limit(references: &[Reference]) -> Duration {
    let slowest = references.iter().map(|reference| reference.time_s).fold(0.0, f64::max);
    Duration::try_from_secs_f64(PATIENCE * slowest).unwrap_or(LEAST_LIMIT).max(LEAST_LIMIT)
}
