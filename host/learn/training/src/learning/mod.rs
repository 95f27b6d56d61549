//! A model for a mission: dataset, training, quantisation and a paired test, one after the other.
//!
//! ```text
//! WORK/learn.jsonl   what was begun, time spent, what is decided
//! WORK/dataset/      trajectories
//! WORK/training/     the training
//! WORK/test/runs/    plans of the paired test
//! ```
//!
//! Each part goes on where it was interrupted. How many scenarios are planned follows from the time
//! that the first shard took, how long the training lasts from what is left then; both are decided
//! once and kept.

mod journal;
mod recipe;

pub use recipe::{LEAST_SCENARIOS, LEAST_STEPS, PASSES, SHARD, SHARES, TESTS};

use crate::model::network;
use crate::output::{MODEL, Summary};
use crate::recorded::Recorded;
use crate::{Config, Outcome, Run, fitted};
use journal::{Begun, Clock, Mark, State};
use recipe::Sizes;
use remora_core::advanced::stages::LINKS;
use remora_host::error::Error;
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{Mission, ModelFile, NamedScenario, check_writable, make_directory};
use remora_host::learned::Learned;
use remora_host::method::{Integrator, Method};
use remora_host::progress::Progress;
use remora_host::request::PlanRequest;
use remora_learn::dataset::{self, Dataset, Made, Manifest};
use remora_learn::quantise::quantise_file;
use remora_learn::reproduce::{Bench, Card, Paired};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Task of learning: the input of `remora-train mission`.
#[derive(Clone, Debug)]
pub struct Learning {
    /// The mission; valid, its plans of all nodes of this build.
    pub mission: Mission,
    /// Hours of work in all, over all interruptions.
    pub hours: f64,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Seed of the dataset's draw and of the training.
    pub seed: u64,
    /// Whether the network starts from random numbers, not from the built-in model.
    pub anew: bool,
    /// Number of worker threads that plan.
    pub jobs: NonZeroUsize,
    /// The model to write.
    pub out: PathBuf,
    /// Directory of all else.
    pub work: PathBuf,
}

/// Callbacks that tell, watch and train.
pub struct Hands<'a> {
    /// Tells in a line what comes next.
    pub tell: &'a dyn Fn(&str),
    /// Watches the dataset being planned.
    pub dataset: &'a mut dyn Progress,
    /// Trains.
    pub train: &'a mut dyn FnMut(&Run<'_>) -> Result<Outcome, Error>,
    /// Watches the paired test.
    pub test: &'a mut dyn Progress,
}

/// Result of learning.
#[derive(Clone, Debug, Serialize)]
pub struct Learnt {
    format: &'static str,
    /// The model.
    pub model: PathBuf,
    /// Its checksum.
    pub checksum: String,
    /// Scenarios of the dataset.
    pub scenarios: u64,
    /// Those that were solved, to learn from.
    pub trajectories: usize,
    /// Time that planning them took, in all runs [s].
    pub planning_s: f64,
    /// Steps of training.
    pub steps: u64,
    /// Seed of the scenarios that the model was tested on.
    pub test_seed: u64,
    /// The model against the heuristic on scenarios that it has not learnt from.
    pub test: Paired,
}

impl Learning {
    /// Does what is not done yet, to the end.
    ///
    /// # Errors
    /// Work begun with something else; files that cannot be read or written; a mission that allows
    /// no start, that fixes the roll at capture, or of which nothing can be learnt.
    pub fn run(&self, hands: &mut Hands<'_>) -> Result<Learnt, Error> {
        if self.mission.roll.is_some() {
            let reason = "fixes the end effector's roll at capture ([roll]), of which a network sees nothing";
            return Err(Error::argument("MISSION", reason));
        }
        check_writable(&self.out)?;
        make_directory(&self.work)?;
        let mut state = State::open(&self.work, &self.begun())?;
        let sizes = self.plan_all(&mut state, hands)?;
        let dataset = Dataset::open(&self.dataset(), self.mission.joints())?;
        self.train(&mut state, sizes, hands)?;
        quantise_file(&self.trained().join(MODEL), &self.out)?;
        let card = Card::read(&self.out)?;
        let (test_seed, test) = self.test(&card, sizes, hands)?;
        Ok(Learnt {
            format: "remora-learnt/1",
            model: self.out.clone(),
            checksum: card.checksum,
            scenarios: sizes.count,
            trajectories: dataset.len(),
            planning_s: state.planned_s,
            steps: ModelFile::read(&self.out)?.header().provenance.steps,
            test_seed,
            test,
        })
    }

    /// Whether this work was begun before; refuses other work, without changing anything.
    ///
    /// # Errors
    /// Work begun with something else, with the first field that differs.
    pub fn is_begun(&self) -> Result<bool, Error> {
        State::look(&self.work, &self.begun())?;
        Ok(self.work.join(journal::FILE).exists())
    }

    fn begun(&self) -> Begun {
        let out = self.out.file_name().unwrap_or_default().to_string_lossy();
        let Self { mission, hours, integrator, seed, anew, .. } = self;
        Begun::new(fingerprint(mission), *hours, *integrator, *seed, *anew, out.into())
    }

    fn dataset(&self) -> PathBuf {
        self.work.join("dataset")
    }

    /// The directory of the training: its name is the model's in lineages.
    fn trained(&self) -> PathBuf {
        self.work.join("training").join(self.out.file_stem().unwrap_or_default())
    }

    /// Plans the dataset: its first shard, and then as many as there is time for.
    fn plan_all(&self, state: &mut State, hands: &mut Hands<'_>) -> Result<Sizes, Error> {
        let sizes = match state.sizes {
            Some(sizes) => sizes,
            None => {
                let first = u64::from(SHARD.get());
                (hands.tell)(&format!("planning {first} scenarios, to see how long one takes"));
                self.plan(first, state, hands)?;
                let sizes = Sizes::of(self.hours, self.seed, state.planned_s);
                state.mark(Mark::Sized(sizes))?;
                let Sizes { count, tests } = sizes;
                let minutes = (count - first) as f64 * state.planned_s / (60 * first) as f64;
                (hands.tell)(&format!(
                    "took {:.1} s: {count} to learn from, about {minutes:.1} min; {tests} to test on",
                    state.planned_s
                ));
                sizes
            }
        };
        Manifest::grow(&self.dataset(), sizes.count)?;
        self.plan(sizes.count, state, hands)?;
        Ok(sizes)
    }

    fn plan(&self, count: u64, state: &mut State, hands: &mut Hands<'_>) -> Result<Made, Error> {
        let method = Method { integrator: self.integrator, ..Method::default() };
        let recipe = dataset::Recipe {
            count,
            seed: self.seed,
            request: PlanRequest { mission: self.mission, method, ..Default::default() },
            mission_file: None,
            shard: SHARD,
            part: None,
            jobs: self.jobs,
            out: self.dataset(),
        };
        let mut clock = Clock::new(state, hands.dataset);
        let made = recipe.make(&mut clock)?;
        clock.keep().map(|()| made)
    }

    /// Trains in the time that is left.
    fn train(&self, state: &mut State, sizes: Sizes, hands: &mut Hands<'_>) -> Result<(), Error> {
        if state.is_trained && self.trained().join(MODEL).exists() {
            return Ok(());
        }
        let minutes = match state.minutes {
            Some(minutes) => minutes,
            None => {
                let minutes = recipe::minutes(self.hours, state.planned_s);
                state.mark(Mark::Minutes(minutes))?;
                (hands.tell)(&format!("training for {minutes:.1} min, or {LEAST_STEPS} steps"));
                minutes
            }
        };
        let config = self.config(sizes, minutes)?;
        let data = Recorded::read(&config, &self.mission)?;
        let count = config.training.rollout_count.unwrap_or_default();
        let run = Run {
            config,
            source: &data,
            origin: data.origin(),
            out: self.trained(),
            resume: true,
            stop_after: None,
            rollout: &|model| data.rollout(model, count),
        };
        let outcome = (hands.train)(&run)?;
        Summary::of(&run.config, &outcome).write(&run.out)?;
        state.mark(Mark::Trained)
    }

    /// The training of the built-in model's network.
    fn config(&self, sizes: Sizes, minutes: f64) -> Result<Config, Error> {
        let built_in = Learned::built_in(self.integrator);
        let network = built_in.model().and_then(|model| network(model.header()));
        let network = network.unwrap_or_else(|| unreachable!("this program trained it"));
        let from = self.start()?;
        Ok(recipe::config(self.dataset(), network, from.as_deref(), sizes, self.seed, minutes))
    }

    /// The file of the model that the training starts from: the built-in one, made fit for the arm.
    fn start(&self) -> Result<Option<PathBuf>, Error> {
        if self.anew {
            return Ok(None);
        }
        let built_in = Learned::write_built_in(self.integrator, &self.work)?;
        match self.mission.joints() {
            LINKS => Ok(Some(built_in)),
            joints => fitted::write(&built_in, joints).map(Some),
        }
    }

    /// The paired test, and the seed of its scenarios.
    fn test(
        &self,
        model: &Card,
        sizes: Sizes,
        hands: &mut Hands<'_>,
    ) -> Result<(u64, Paired), Error> {
        let (seed, scenarios) = self.held_out(model, sizes.tests)?;
        (hands.tell)(&format!("testing on {} other scenarios, seed {seed}", scenarios.len()));
        let mut bench = Bench {
            scenarios,
            mission: self.mission,
            integrator: self.integrator,
            jobs: self.jobs,
            out: &self.work.join("test"),
            progress: hands.test,
        };
        // Made fit for another arm it is a start of trainings, not yet one of plans.
        let before = self.start()?.filter(|_| self.mission.joints() == LINKS);
        let before = before.map(|file| Card::read(&file)).transpose()?;
        Ok((seed, Paired::test(model, before.as_ref(), &mut bench)?))
    }

    /// Scenarios of the first seed after the dataset's that neither the model nor an ancestor has
    /// learnt from.
    fn held_out(&self, model: &Card, count: u64) -> Result<(u64, Vec<NamedScenario>), Error> {
        let known = &model.lineage.sources;
        let mut seed = self.seed.wrapping_add(1);
        while known.iter().any(|source| source.seed == seed) {
            seed = seed.wrapping_add(1);
        }
        let set = remora_host::draw::draw(count, seed, &self.mission)
            .ok_or_else(|| Error::argument("MISSION", "its geometry lets no start pass"))?;
        Ok((seed, set.scenarios))
    }
}
