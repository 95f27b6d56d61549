//! The laboratory that plans: a campaign a run, kept in a folder.

use super::laboratory::{Laboratory, Run, Start};
use remora_core::advanced::stages::NODES;
use remora_host::approach::Approach;
use remora_host::campaign::{Campaign, run_together};
use remora_host::engine::SEED;
use remora_host::error::Error;
use remora_host::fingerprint::{self, fingerprint};
use remora_host::formats::{
    Limit, Mission, NamedScenario, PlanFile, Row, Scenario, json, make_directory, read_text,
    write_atomically,
};
use remora_host::learned::{Learned, Memories};
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method, Mode, WarmStart};
use remora_host::progress::Progress;
use remora_host::request::PlanRequest;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Plans the same scenarios in as many ways as it is asked to.
pub struct Bench<'a> {
    /// The scenarios.
    pub scenarios: Vec<NamedScenario>,
    /// The mission; valid.
    pub mission: Mission,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Number of worker threads. Times are those of flight with one.
    pub jobs: NonZeroUsize,
    /// Where the campaigns are kept.
    pub out: &'a Path,
    /// Observer of the planning.
    pub progress: &'a mut dyn Progress,
}

impl Bench<'_> {
    /// Folder of a run. Another build, mission or set of scenarios has another, so that nothing is
    /// mixed and nothing refused.
    fn folder(&self, run: &Run) -> PathBuf {
        let build =
            fingerprint(&(fingerprint::program(), &self.mission, &self.scenarios, self.integrator));
        self.out.join("runs").join(build).join(run.key())
    }

    fn campaign(&self, run: &Run) -> Result<Campaign, Error> {
        let warm_start = match run.start {
            Start::Heuristic => WarmStart::Heuristic,
            Start::Model(..) => WarmStart::Model,
        };
        let (mode, integrator) = (run.mode, self.integrator);
        let method = Method { mode, warm_start, integrator, ..Method::default() };
        let guess = model(&run.start)?.into();
        Ok(Campaign {
            scenarios: self.scenarios.clone(),
            seed: None,
            request: PlanRequest { mission: self.mission, method, guess, ..Default::default() },
            jobs: self.jobs,
            // Rollouts begin from their Stage 1.
            save_plans: *run == Run::heuristic(Mode::Optimal),
            csv: false,
            out: self.folder(run),
        })
    }

    /// The plans from the heuristic, made where they are not there yet.
    fn plans(&self) -> Result<Vec<PlanFile>, Error> {
        let campaign = self.campaign(&Run::heuristic(Mode::Optimal))?;
        // The table has made them before: nobody needs to watch.
        campaign.run(&mut ())?;
        let ids = self.scenarios.iter().map(|scenario| &scenario.id);
        ids.map(|id| PlanFile::read(&campaign.plan_path(id))).collect()
    }

    /// Rolls a model out along the paths of `plans`; none where a rollout is of no use.
    fn rollout(&self, model: &Learned, plans: &[PlanFile]) -> Result<Vec<Option<f64>>, Error> {
        let (mission, integrator) = (self.mission, self.integrator);
        on_large_stack(move || {
            let mut memories = Memories::default();
            let miss =
                |plan: &PlanFile| miss(&approach(mission, integrator, plan), model, &mut memories);
            plans.iter().map(miss).collect()
        })
    }
}

/// An approach along a plan's path.
fn approach(mission: Mission, integrator: Integrator, plan: &PlanFile) -> Approach {
    let (path, target) = (plan.stage1.trajectory(), plan.target.nodes());
    let scenario = Scenario { position: path.position[0], ..Scenario::default() };
    Approach::new(mission, scenario, integrator, path, target)
}

/// How far the end effector is from the port at the end of a rollout [m].
fn miss(approach: &Approach, model: &Learned, memories: &mut Memories) -> Option<f64> {
    let motion = model.at_work(memories, |policy| approach.policy_rollout(policy?, SEED))?;
    Some(approach.miss(&motion.states[NODES - 1]))
}

/// The model of a start.
fn model(start: &Start) -> Result<Option<Learned>, Error> {
    Ok(match start {
        Start::Heuristic => None,
        Start::Model(card, None) => Some(Learned::read(&card.file)?),
        Start::Model(card, Some(steps)) => Some(Learned::read(&card.file)?.with_flow_steps(*steps)),
    })
}

/// Misses of a run's rollouts, as kept in `misses.json`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Misses {
    format: String,
    /// Distance of the end effector from the port [m]; none where a rollout is of no use.
    ee_error_m: Vec<Option<f64>>,
}

const FORMAT: &str = "remora-misses/1";

impl Laboratory for Bench<'_> {
    fn plan(&mut self, runs: &[Run]) -> Result<Vec<Vec<Row>>, Error> {
        let campaigns: Vec<Campaign> =
            runs.iter().map(|run| self.campaign(run)).collect::<Result<_, _>>()?;
        let results = run_together(&campaigns, self.jobs, self.progress)?;
        Ok(results.into_iter().map(|results| results.rows).collect())
    }

    fn misses(&mut self, runs: &[Run]) -> Result<Vec<Vec<f64>>, Error> {
        let plans = self.plans()?;
        let of = |run: &Run| {
            let file = self.folder(run).join("misses.json");
            if file.exists() {
                let kept: Misses = json::parse(&read_text(&file, Limit::DOCUMENT)?, FORMAT)
                    .map_err(|error| error.at(&file))?;
                return Ok(kept.ee_error_m.into_iter().flatten().collect());
            }
            let Some(model) = model(&run.start)? else { return Ok(Vec::new()) };
            let ee_error_m = self.rollout(&model, &plans)?;
            let misses = Misses { format: FORMAT.into(), ee_error_m };
            let text =
                json::to_text(&misses).map_err(|error| Error::output(&file, &error.into()))?;
            make_directory(&self.folder(run))?;
            write_atomically(&file, text.as_bytes())?;
            Ok(misses.ee_error_m.into_iter().flatten().collect())
        };
        runs.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::method::Mode;

    /// Counts what was there and what was planned.
    #[derive(Default)]
    struct Counter {
        before: usize,
        planned: usize,
    }

    impl Progress for Counter {
        fn begin(&mut self, _: usize, done: usize) {
            self.before = done;
        }
        fn done(&mut self, _: bool) {
            self.planned += 1;
        }
        fn end(&mut self) {}
    }

    #[test]
    fn nothing_is_planned_twice() {
        let dir = tempfile::tempdir().unwrap();
        let mission = Mission::default();
        let scenarios = remora_host::draw::draw(3, 7, &mission).unwrap().scenarios;
        let plan = |runs: &[Run]| {
            let mut counter = Counter::default();
            let rows = Bench {
                scenarios: scenarios.clone(),
                mission,
                integrator: Integrator::Euler,
                jobs: NonZeroUsize::MIN,
                out: dir.path(),
                progress: &mut counter,
            }
            .plan(runs)
            .unwrap();
            (rows, counter.before, counter.planned)
        };
        let runs = [Run::heuristic(Mode::Optimal), Run::heuristic(Mode::Feasible)];
        let (first, before, planned) = plan(&runs[..1]);
        assert_eq!((before, planned), (0, 3));
        let (both, before, planned) = plan(&runs);
        assert_eq!((before, planned), (3, 3));
        assert_eq!(both[0], first[0]);
        assert!(both[1].iter().all(|row| row.stage2.iterations > 0));
        assert_eq!(plan(&runs).2, 0);
    }
}
