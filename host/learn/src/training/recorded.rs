//! Examples from datasets.

use super::config::Config;
use super::examples::{self, Disturbance, Recipe};
use super::model::Origin;
use super::random::Random;
use super::rollout::{self, RolloutError};
use super::shape::Shape;
use super::source::{Example, ExampleSource, Split};
use crate::dataset::{self, Dataset, Trajectory};
use remora_core::advanced::model::Mission;
use remora_core::advanced::stages::{LINKS, NODES};
use remora_host::error::Error;
use remora_host::fingerprint::fingerprint;
use remora_host::lineage::Source;
use remora_host::method::Integrator;
use std::path::Path;

/// The trajectories of one or several datasets, as a configuration wants to see them.
pub struct Recorded<const NL: usize = LINKS> {
    mission: Mission<NL>,
    recipe: Recipe,
    shape: Shape,
    training: Vec<Trajectory<NL>>,
    validation: Vec<Trajectory<NL>>,
    integrator: Integrator,
    sources: Vec<Source>,
}

impl<const NL: usize> Recorded<NL> {
    /// Reads the datasets of a configuration: the first `count` scenarios of the first, all of the
    /// others. They must have been made for this mission, and with the same integrator.
    ///
    /// # Errors
    /// A dataset that cannot be read or does not fit the first.
    pub fn read(config: &Config, mission: &Mission<NL>) -> Result<Self, Error> {
        let (encoding, action) = (config.model.encoding, config.model.action);
        let data = &config.data;
        let first = Dataset::open(&data.path)?;
        let integrator = first.manifest.integrator;
        let mut found = Self {
            mission: *mission,
            recipe: Recipe { encoding, action, integrator, disturbance: data.disturbance },
            shape: Shape::of(encoding, NODES, NL),
            training: Vec::new(),
            validation: Vec::new(),
            integrator,
            sources: Vec::new(),
        };
        found.add(&data.path, &first, data.count.map(|count| count as usize))?;
        for path in &data.extra {
            let more = Dataset::open(path)?;
            if more.manifest.integrator != integrator {
                let reason = format!("is not {integrator} as the first dataset is");
                return Err(Error::input(path, "integrator", reason));
            }
            found.add(path, &more, None)?;
        }
        Ok(found)
    }

    fn add(
        &mut self,
        path: &Path,
        dataset: &Dataset<NL>,
        count: Option<usize>,
    ) -> Result<(), Error> {
        if dataset.manifest.mission != fingerprint(&self.mission) {
            let file = path.join(dataset::MANIFEST);
            let reason = "was made for another mission; --mission names it";
            return Err(Error::input(&file, "mission", reason));
        }
        let tried = dataset.tried();
        if count.is_some_and(|count| count as u64 > tried) {
            let reason = format!("has {tried} scenarios so far, fewer than data.count");
            return Err(Error::input(path, "", reason));
        }
        let count = count.unwrap_or(tried as usize);
        for trajectory in dataset.read(Some(count))? {
            match dataset.split(&trajectory) {
                dataset::Split::Train => self.training.push(trajectory),
                dataset::Split::Validation => self.validation.push(trajectory),
            }
        }
        self.sources.push(dataset.source(Some(count)));
        Ok(())
    }

    /// Integrator and datasets, for the model file.
    pub fn origin(&self) -> Origin {
        Origin {
            integrator: self.integrator.to_string(),
            dataset: Source::join(&self.sources),
            ..Origin::default()
        }
    }

    /// Rolls a model out on the first `count` validation scenarios.
    pub fn rollout(&self, model: &[u8], count: usize) -> Option<RolloutError> {
        let count = count.min(self.validation.len());
        let trajectories = &self.validation[..count];
        rollout::measure(model, &self.mission, self.integrator, trajectories)
    }
}

impl<const NL: usize> ExampleSource for Recorded<NL> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn len(&self, split: Split) -> usize {
        match split {
            Split::Training => self.training.len(),
            Split::Validation => self.validation.len(),
        }
    }

    fn sample(
        &self,
        split: Split,
        index: usize,
        random: &mut Random,
        example: &mut Example,
    ) -> Result<(), Error> {
        // Validation is of the trajectories as they are.
        let (trajectory, disturbance) = match split {
            Split::Training => (&self.training[index], self.recipe.disturbance),
            Split::Validation => (&self.validation[index], Disturbance::default()),
        };
        let recipe = Recipe { disturbance, ..self.recipe };
        let found = examples::example(&self.mission, trajectory, &recipe, random.stream());
        *example = Example { features: found.features, actions: found.actions, states: found.next };
        Ok(())
    }
}
