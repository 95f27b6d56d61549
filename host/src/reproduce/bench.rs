//! The laboratory that plans: a campaign a run, kept in a folder.

use super::laboratory::{Laboratory, Run, Start};
use crate::campaign::{Campaign, run_together};
use crate::error::Error;
use crate::fingerprint::{self, fingerprint};
use crate::formats::{NamedScenario, Row};
use crate::method::{Integrator, Method};
use crate::progress::Progress;
use remora_core::model::Mission;
use remora_core::stages::LINKS;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Plans the same scenarios in as many ways as it is asked to.
pub struct Bench<'a> {
    /// The scenarios.
    pub scenarios: Vec<NamedScenario>,
    /// The mission; valid.
    pub mission: Mission<LINKS>,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Number of worker threads. Times are those of flight with one.
    pub jobs: NonZeroUsize,
    /// Where the campaigns are kept.
    pub out: &'a Path,
    /// Who watches.
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
        let Start::Heuristic = &run.start else {
            return Err(Error::argument("--models", "this build plans from the heuristic only"));
        };
        Ok(Campaign {
            scenarios: self.scenarios.clone(),
            mission: self.mission.clone(),
            method: Method { mode: run.mode, integrator: self.integrator, ..Method::default() },
            jobs: self.jobs,
            save_plans: false,
            csv: false,
            out: self.folder(run),
        })
    }
}

impl Laboratory for Bench<'_> {
    fn plan(&mut self, runs: &[Run]) -> Result<Vec<Vec<Row>>, Error> {
        let campaigns: Vec<Campaign> =
            runs.iter().map(|run| self.campaign(run)).collect::<Result<_, _>>()?;
        let results = run_together(&campaigns, self.jobs, self.progress)?;
        Ok(results.into_iter().map(|results| results.rows).collect())
    }

    fn misses(&mut self, _: &[Run]) -> Result<Vec<Vec<f64>>, Error> {
        Err(Error::argument("--models", "this build rolls no model out"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Mode;

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
        let scenarios = crate::draw::draw(3, 7, &mission).unwrap().scenarios;
        let plan = |runs: &[Run]| {
            let mut counter = Counter::default();
            let rows = Bench {
                scenarios: scenarios.clone(),
                mission: mission.clone(),
                integrator: Integrator::EULER,
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
