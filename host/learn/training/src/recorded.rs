//! Examples from datasets.

use crate::config::Config;
use crate::examples::{self, Disturbance, Recipe};
use crate::model::Origin;
use crate::random::Random;
use crate::rollout::{self, RolloutError};
use crate::shape::Shape;
use crate::source::{Example, ExampleSource, Split, spread};
use remora_core::advanced::stages::NODES;
use remora_host::error::{Error, io_reason};
use remora_host::formats::Mission;
use remora_host::lineage::Source;
use remora_host::method::Integrator;
use remora_learn::dataset::{self, Dataset, MANIFEST, Trajectory};
use std::io;
use std::path::{Path, PathBuf};

/// The trajectories of one or several datasets, as a configuration wants to see them.
pub struct Recorded {
    /// Of each dataset.
    missions: Vec<Mission>,
    recipe: Recipe,
    shape: Shape,
    training: Vec<Recording>,
    validation: Vec<Recording>,
    integrator: Integrator,
    sources: Vec<Source>,
}

/// A trajectory and which dataset it is of.
type Recording = (usize, Trajectory);

impl Recorded {
    /// Reads the datasets of a configuration: the first `count` scenarios of the first, all of the
    /// others, in whose place a directory of datasets may stand. Each has its own mission, or was made for this
    /// one; all with the same integrator.
    ///
    /// # Errors
    /// A dataset that cannot be read or does not fit the first.
    pub fn read(config: &Config, mission: &Mission) -> Result<Self, Error> {
        let joints = mission.joints();
        let shape = Shape::of(&config.model, NODES, joints);
        let (encoding, action, stride) = (config.model.encoding, config.model.action, shape.stride);
        let data = &config.data;
        let first = Dataset::open(&data.path, joints)?;
        let integrator = first.manifest.integrator;
        let mut found = Self {
            missions: Vec::new(),
            recipe: Recipe { encoding, action, integrator, disturbance: data.disturbance, stride },
            shape,
            training: Vec::new(),
            validation: Vec::new(),
            integrator,
            sources: Vec::new(),
        };
        found.missions.push(first.mission(mission)?);
        found.add(&data.path, &first, data.count.map(|count| count as usize))?;
        for path in datasets_in(&data.extra)? {
            let more = Dataset::open(&path, joints)?;
            if more.manifest.integrator != integrator {
                let reason = format!("is not {integrator} as the first dataset is");
                return Err(Error::input(&path, "integrator", reason));
            }
            found.missions.push(more.mission(mission)?);
            found.add(&path, &more, None)?;
        }
        Ok(found)
    }

    fn add(&mut self, path: &Path, dataset: &Dataset, count: Option<usize>) -> Result<(), Error> {
        let number = self.missions.len() - 1;
        let tried = dataset.tried();
        if count.is_some_and(|count| count as u64 > tried) {
            let reason = format!("has {tried} scenarios so far, fewer than data.count");
            return Err(Error::input(path, "", reason));
        }
        let count = count.unwrap_or(tried as usize);
        for trajectory in dataset.read(Some(count))? {
            match dataset.split(&trajectory) {
                dataset::Split::Train => self.training.push((number, trajectory)),
                dataset::Split::Validation => self.validation.push((number, trajectory)),
            }
        }
        self.sources.push(dataset.source(Some(count)));
        Ok(())
    }

    /// Integrator and datasets, for the model file.
    pub fn origin(&self) -> Origin {
        // Many servicers may share a seed.
        let named = self.sources.iter().map(|source| Source::join(&[*source]));
        let dataset = named.reduce(|all, next| Source::union(&all, &next)).unwrap_or_default();
        Origin { integrator: self.integrator.to_string(), dataset, ..Origin::default() }
    }

    /// Rolls a model out on `count` validation scenarios, from all over the datasets.
    pub fn rollout(&self, model: &[u8], count: usize) -> Option<RolloutError> {
        let all = spread(self.validation.len(), count).map(|index| &self.validation[index]);
        let all: Vec<_> = all.map(|(of, trajectory)| (&self.missions[*of], trajectory)).collect();
        rollout::measure(model, self.integrator, &all)
    }
}

/// The datasets of these paths; a directory of datasets stands for all in it, by name.
fn datasets_in(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut all = Vec::new();
    for path in paths {
        if path.join(MANIFEST).exists() {
            all.push(path.clone());
            continue;
        }
        let unreadable = |cause: io::Error| Error::input(path, "", io_reason(&cause));
        let entries = std::fs::read_dir(path).map_err(unreadable)?;
        let mut within: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
        within.retain(|path| path.join(MANIFEST).exists());
        within.sort();
        if within.is_empty() {
            return Err(Error::input(path, "", "is no dataset and holds none"));
        }
        all.extend(within);
    }
    Ok(all)
}

impl ExampleSource for Recorded {
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
        let ((of, trajectory), disturbance) = match split {
            Split::Training => (&self.training[index], self.recipe.disturbance),
            Split::Validation => (&self.validation[index], Disturbance::default()),
        };
        let recipe = Recipe { disturbance, ..self.recipe };
        let found = examples::example(&self.missions[*of], trajectory, &recipe, random.stream());
        *example = Example { features: found.features, actions: found.actions, states: found.next };
        Ok(())
    }
}
