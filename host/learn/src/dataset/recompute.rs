//! Planning a sample of a dataset again: a machine that computes wrongly is found by its trajectories.

use super::manifest::{MANIFEST, Manifest};
use super::shard;
use super::{Dataset, Recipe, Trajectory, shard_path};
use remora_host::draw::id;
use remora_host::error::{Error, FieldError};
use remora_host::formats::Mission;
use remora_host::learned::Learned;
use remora_host::method::Method;
use remora_host::part::Part;
use remora_host::parts::{Difference, Sample, Then, again};
use remora_host::planning::Planner;
use remora_host::progress::Progress;
use remora_host::request::PlanRequest;
use std::collections::BTreeMap;
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::Path;

/// Plans `sample` of the scenarios again, spread evenly, and compares what was kept, bit by bit; what differs is
/// named with its file, one of as many as there should be. Those of files that are missing are left out.
/// `model` is that whose rollouts Stage 2 started from, where it was not the built-in one.
///
/// # Errors
/// A dataset of another model, mission or settings than this program has; a shard that is damaged; a thread that
/// cannot be started.
pub fn recompute(
    directory: &Path,
    model: Option<Learned>,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let file = directory.join(MANIFEST);
    let manifest = Manifest::read(&file)?;
    let model = manifest.model_of(model)?;
    let mission = Dataset::open(directory, manifest.links)?.own_mission()?;
    let recipe = manifest.recipe(mission, model, jobs, directory);
    recipe.map_err(|error| error.at(&file))?.again(&manifest, sample, progress)
}

impl Manifest {
    /// The model that Stage 2 started from: the one given, or the built-in one.
    fn model_of(&self, given: Option<Learned>) -> Result<Option<Learned>, Error> {
        let refused = |reason| Err(Error::argument("--model", reason));
        match (&self.model, given) {
            (None, None) => Ok(None),
            (None, Some(_)) => refused("the dataset was made from the heuristic start".to_string()),
            (Some(made), given) => {
                let is_given = given.is_some();
                let model = given.unwrap_or_else(|| Learned::built_in(self.integrator));
                match (Self::name_of(&model) == *made, is_given) {
                    (true, _) => Ok(Some(model)),
                    (false, true) => refused(format!(
                        "is {}; the dataset was made with {made}",
                        Self::name_of(&model)
                    )),
                    (false, false) => {
                        refused(format!("the dataset was made with {made}, which is not built in"))
                    }
                }
            }
        }
    }

    /// Recipe that the manifest was made by.
    fn recipe(
        &self,
        mission: Mission,
        model: Option<Learned>,
        jobs: NonZeroUsize,
        out: &Path,
    ) -> Result<Recipe, FieldError> {
        let shard = NonZeroU32::new(self.shard).ok_or_else(|| FieldError::new("shard", "is 0"))?;
        let method = Method { integrator: self.integrator, ..Method::default() };
        let plain = Recipe {
            count: self.count,
            seed: self.seed,
            request: PlanRequest { mission, method, guess: model.into(), ..Default::default() },
            mission_file: None,
            shard,
            jobs,
            part: None,
            out: out.into(),
        };
        let mut sharp = plain.clone();
        sharp.request.method.sharp = true;
        let is_ours = |recipe: &Recipe| Self::new(recipe).settings == self.settings;
        [plain, sharp].into_iter().find(is_ours).ok_or_else(|| {
            FieldError::new("settings", "are of another version of the planner than this one")
        })
    }
}

impl Recipe {
    fn again(
        &self,
        manifest: &Manifest,
        sample: u64,
        progress: &mut dyn Progress,
    ) -> Result<Vec<Difference>, Error> {
        let kept = self.sampled(manifest, sample)?;
        let plan = |planner: &mut Planner, index| self.plan(planner, index);
        let differs = |then: &Option<Trajectory>, again: &Option<Box<Trajectory>>| {
            differs(then.as_ref(), again.as_deref()).map(String::from)
        };
        again(&kept, self.jobs, plan, differs, progress)
    }

    /// Reads the kept results of a sample, with the file that each stands in.
    fn sampled(
        &self,
        manifest: &Manifest,
        sample: u64,
    ) -> Result<BTreeMap<u64, Then<Option<Trajectory>>>, Error> {
        let mut kept = BTreeMap::new();
        let mut picked = Sample::of(sample, self.count);
        let (files, dataset) = (manifest.shards().count() as u64, manifest.dataset());
        for ((number, (first, tried)), part) in (0..).zip(manifest.shards()).zip(Part::all(files)) {
            let here = picked.within(&(first..first + u64::from(tried)));
            let file = shard_path(&self.out, number);
            if here.is_empty() || !file.exists() {
                continue;
            }
            let (mut all, place) = (Vec::new(), manifest.place(&dataset, (first, tried)));
            shard::read(&file, place, self.count, &mut all)?;
            let mut all: BTreeMap<_, _> = all.into_iter().map(|t| (t.scenario, t)).collect();
            kept.extend(here.into_iter().map(|index| {
                let (scenario, value) = (id(self.seed, index), all.remove(&index));
                (index, Then { part, scenario, value })
            }));
        }
        Ok(kept)
    }
}

/// The first quantity in which what was kept differs; `kept` where one was and the other was not.
fn differs(one: Option<&Trajectory>, other: Option<&Trajectory>) -> Option<&'static str> {
    match (one, other) {
        (Some(one), Some(other)) => one.differs(other),
        (None, None) => None,
        _ => Some("kept"),
    }
}
