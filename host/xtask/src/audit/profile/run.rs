//! The measurements.

use super::counter::Instructions;
use super::journal::Journal;
use super::machine::{Watch, processor, switches};
use super::order::{Case, Configuration, Job, Rounds, order};
use super::pin::pin_pair;
use super::results::{Profile, Run};
use super::sample::{Sample, WARM_UP_PLANS};
use remora_core::advanced::executor::ForkJoin;
use remora_core::advanced::time::Clock;
use remora_host::error::Error;
use remora_host::formats::{Mission, NamedScenario, Status};
use remora_host::learned::Learned;
use remora_host::memory::on_large_stack;
use remora_host::method::WarmStart;
use remora_host::planning::{PlanOutcome, Planner, WallClock};
use remora_host::progress::Progress;
use remora_host::request::PlanRequest;
use remora_host::threads::Threads;
use std::path::Path;
use std::time::Instant;

/// A profile to be made: the input of `cargo xtask profile`.
#[derive(Clone, Debug)]
pub struct Profiler {
    /// The scenarios; at least one.
    pub scenarios: Vec<NamedScenario>,
    /// The mission; valid.
    pub mission: Mission,
    /// Configurations to profile.
    pub configurations: Vec<Configuration>,
    /// How often every scenario is planned.
    pub rounds: Rounds,
    /// The two cores; the first two that the program may use where none are named.
    pub cores: Option<[usize; 2]>,
}

impl Profiler {
    /// Makes the profile, on a thread of its own. Measurements that stand in the file `resumed` are not made
    /// again, and each that is finished is added to it; the machine's load is that of this run.
    ///
    /// # Errors
    /// Cores that the program may not use; a thread that cannot be started; a file of another profile.
    pub fn run(
        &self,
        resumed: Option<&Path>,
        progress: &mut (dyn Progress + Send),
    ) -> Result<Profile, Error> {
        on_large_stack(|| self.run_here(resumed, progress))?
    }

    fn run_here(
        &self,
        resumed: Option<&Path>,
        progress: &mut dyn Progress,
    ) -> Result<Profile, Error> {
        let started = Instant::now();
        let pinning = pin_pair(self.cores)?;
        let counter = Instructions::open();
        let (configurations, scenarios) = (&self.configurations, self.scenarios.len());
        let jobs = order(configurations, scenarios, self.rounds, counter.is_ok());
        let on = (&*processor(), pinning.cores, counter.is_ok());
        let (mut journal, mut samples) = Journal::open(resumed, self, on, &jobs)?;
        let mut bench = Bench::new(self, counter.as_ref().ok());
        bench.warm_up();
        let watch = Watch::begin();
        progress.begin(jobs.len(), samples.len());
        for job in &jobs[samples.len()..] {
            let sample = bench.measure(*job);
            journal.append(&sample)?;
            progress.done(sample.is_solved);
            samples.push(sample);
        }
        progress.end();
        Ok(Profile::of(Run {
            configurations,
            scenarios,
            rounds: self.rounds,
            pinning,
            machine: watch.end(),
            no_counter: counter.err(),
            samples,
            wall_s: started.elapsed().as_secs_f64(),
        }))
    }
}

/// The planners at work.
struct Bench<'a> {
    profiler: &'a Profiler,
    /// A request for each configuration.
    requests: Vec<PlanRequest>,
    counter: Option<&'a Instructions>,
    alone: Planner,
    shared: Planner,
    /// The other core's.
    second: Planner,
}

impl<'a> Bench<'a> {
    fn new(profiler: &'a Profiler, counter: Option<&'a Instructions>) -> Self {
        let request = |configuration: &Configuration| {
            let is_learned = configuration.warm_start == WarmStart::Model;
            PlanRequest {
                mission: profiler.mission,
                method: configuration.method(),
                guess: is_learned.then(|| Learned::built_in(configuration.integrator)).into(),
                ..PlanRequest::default()
            }
        };
        Self {
            profiler,
            requests: profiler.configurations.iter().map(request).collect(),
            counter,
            alone: Planner::new(),
            shared: Planner::new(),
            second: Planner::new(),
        }
    }

    /// Everything once or twice, so that memory is there, threads run and caches are warm.
    fn warm_up(&mut self) {
        let scenarios = self.profiler.scenarios.len().min(WARM_UP_PLANS);
        let is_counted = self.counter.is_some();
        let jobs = order(&self.profiler.configurations, scenarios, Rounds::of(1), is_counted);
        jobs.into_iter().for_each(|job| drop(self.measure(job)));
    }

    fn measure(&mut self, job: Job) -> Sample {
        let Self { profiler, requests, counter, alone, shared, second } = self;
        let scenario = &profiler.scenarios[job.scenario];
        let mut request = requests[job.configuration].clone();
        if job.case == Case::TwoCores {
            request.threads = Threads::Two;
        }
        let plan =
            |planner: &mut Planner, clock: &dyn Clock| planner.plan_by(clock, &request, scenario);
        let timed = |planner: &mut Planner| plan(planner, &WallClock::start());
        let (before, started) = (switches(), Instant::now());
        let planned = match (job.case, counter) {
            (Case::TwoCores, _) => timed(shared),
            (Case::TwoPlans, _) => Threads::Two.join(|| timed(alone), || timed(second)).0,
            (Case::Counted, Some(counter)) => plan(alone, *counter),
            _ => timed(alone),
        };
        let wall_s = started.elapsed().as_secs_f64();
        Sample::new(job, wall_s, switches().saturating_sub(before), &planned)
    }
}

impl Sample {
    fn new(job: Job, wall_s: f64, switches: u64, planned: &PlanOutcome) -> Self {
        let log = &planned.logs[1];
        // After a rejected step the linearisation is the last one still.
        let is_fresh = |i: usize| i == 0 || log[i - 1].accepted;
        let fresh = log.iter().enumerate().filter(|(i, _)| is_fresh(*i));
        Self {
            job,
            wall_s,
            times: planned.times,
            linearise_s: fresh.map(|(_, record)| record.linearise_time_s).collect(),
            qp_s: log.iter().map(|record| record.qp_time_s).collect(),
            iterations: planned.file.stage2.iterations,
            is_solved: planned.file.status == Status::Solved,
            switches,
        }
    }
}
