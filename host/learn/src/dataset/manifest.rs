//! The manifest: what a dataset was asked to be.

use super::shard::{self, Place};
use super::trajectory::state_size;
use super::{Recipe, Trajectory};
use remora_core::advanced::stages::{NODES, size};
use remora_host::draw::MAX_COUNT;
use remora_host::error::{Error, FieldError};
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{
    Limit, MAX_JOINTS, PLANNED_JOINTS, json, read_text, write_atomically, write_first,
};
use remora_host::learned::Learned;
use remora_host::method::Integrator;
use remora_host::request::PlanRequest;
use remora_host::settings::settings_text;
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;
use std::path::Path;

/// The `format` of datasets.
pub const FORMAT: &str = "remora-dataset/2";

/// Name of the manifest in a dataset's directory.
pub const MANIFEST: &str = "dataset.json";

/// Scenarios a shard, where nothing else is asked for: some seconds of work, 4 MB.
pub const SHARD: NonZeroU32 = NonZeroU32::new(500).unwrap();

/// Most scenarios of a shard: 1 GB with seven joints.
const MOST_A_SHARD: u32 = 1 << 16;

/// All that the contents of a dataset depend on, and their sizes: `dataset.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "the manifest of a dataset")]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// Version of the program.
    pub version: String,
    /// Seed of the draw.
    pub seed: u64,
    /// Scenarios `0..count` are tried.
    pub count: u64,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Checksum of the model whose rollouts Stage 2 started from; none is the heuristic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Fingerprint of the mission.
    pub mission: String,
    /// Fingerprint of the planner's settings.
    pub settings: String,
    /// Scenarios a shard; the last has what is left.
    pub shard: u32,
    /// Nodes of a trajectory.
    pub nodes: usize,
    /// Joints of the arm.
    pub links: usize,
    /// Numbers of a state.
    pub state: usize,
    /// Numbers of a control.
    pub control: usize,
}

impl Manifest {
    /// The manifest of what a recipe makes.
    pub fn new(recipe: &Recipe) -> Self {
        let PlanRequest { mission, method, guess, .. } = &recipe.request;
        let links = mission.joints();
        Self {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            seed: recipe.seed,
            count: recipe.count,
            integrator: method.integrator,
            model: guess.model().map(Self::name_of),
            mission: fingerprint(mission),
            settings: fingerprint(&settings_text(method)),
            shard: recipe.shard.get(),
            nodes: NODES,
            links,
            state: state_size(links),
            control: size::controls(links),
        }
    }

    /// Names a model by its checksum.
    pub(super) fn name_of(model: &Learned) -> String {
        format!("{:08x}", model.checksum())
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// The file with the first field found wrong, or with the reason why it cannot be read.
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(&read_text(file, Limit::TEXT)?).map_err(|error| error.at(file))
    }

    /// Parses and validates a file's text.
    ///
    /// # Errors
    /// The first field found wrong.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let manifest: Self = json::parse(text, FORMAT)?;
        manifest.validate().map(|()| manifest)
    }

    /// The trajectories in the bytes of a shard of this dataset, by its number from zero.
    ///
    /// # Errors
    /// The reason why they are none.
    pub fn shard(&self, number: usize, bytes: &[u8]) -> Result<Vec<Trajectory>, String> {
        let shard = self.shards().nth(number).ok_or("is none of this dataset's")?;
        let mut out = Vec::new();
        shard::decode(bytes, self.place(&self.dataset(), shard), self.count, &mut out)?;
        Ok(out)
    }

    /// The bytes of a shard of this dataset with these trajectories, in order of their scenarios.
    ///
    /// # Errors
    /// The reason why there are none.
    pub fn shard_of(&self, number: usize, trajectories: &[Trajectory]) -> Result<Vec<u8>, String> {
        let shard = self.shards().nth(number).ok_or("is none of this dataset's")?;
        let dataset = self.dataset();
        shard::encode(self.place(&dataset, shard), trajectories).map_err(|error| error.to_string())
    }

    /// The place of a shard, by its first scenario and how many it tries, in this `dataset`.
    pub(super) fn place<'a>(&self, dataset: &'a str, (first, tried): (u64, u32)) -> Place<'a> {
        Place { dataset, joints: self.links, first, tried }
    }

    /// Writes the file whole or not at all.
    pub(super) fn write(&self, file: &Path) -> Result<(), Error> {
        write_atomically(file, self.text(file)?.as_bytes())
    }

    /// Writes the file where there is none yet; whether it did. Of several programs that do so at once
    /// one does.
    pub(super) fn begin(&self, file: &Path) -> Result<bool, Error> {
        self.validate().map_err(|error| error.at(file))?;
        Ok(!file.exists() && write_first(file, self.text(file)?.as_bytes())?)
    }

    fn text(&self, file: &Path) -> Result<String, Error> {
        json::to_text(self).map_err(|error| Error::output(file, &error.into()))
    }

    /// Fingerprint of the dataset, whatever its number of scenarios and of shards: each shard holds it.
    pub(super) fn dataset(&self) -> String {
        let Self { version, seed, integrator, model, mission, settings, nodes, links, .. } = self;
        fingerprint(&(version, seed, integrator, model, mission, settings, nodes, links))
    }

    /// Asks for more scenarios than the dataset in a directory was begun with; its shards must all be whole
    /// ones.
    ///
    /// # Errors
    /// Fewer scenarios than there are, a last shard that is not whole, a manifest that cannot be
    /// written.
    pub fn grow(directory: &Path, count: u64) -> Result<(), Error> {
        let file = directory.join(MANIFEST);
        let manifest = Self::read(&file)?;
        manifest.of_more(count).map_err(|error| error.at(&file))?.write(&file)
    }

    /// First scenario and number of scenarios of each shard.
    pub(super) fn shards(&self) -> impl Iterator<Item = (u64, u32)> + use<> {
        let (count, shard) = (self.count, u64::from(self.shard));
        (0..count.div_ceil(shard)).map(move |i| (i * shard, (count - i * shard).min(shard) as u32))
    }

    /// Enlarges the manifest to more scenarios: whole shards stay as they are.
    fn of_more(&self, count: u64) -> Result<Self, FieldError> {
        if count < self.count || !self.count.is_multiple_of(self.shard.into()) {
            let reason = format!("is {}, which cannot grow to {count}", self.count);
            return Err(FieldError::new("count", reason));
        }
        Ok(Self { count, ..self.clone() })
    }

    /// Refuses trajectories of another arm.
    pub(super) fn of_joints(self, joints: usize) -> Result<Self, FieldError> {
        if self.links == joints {
            return Ok(self);
        }
        let reason = format!("is {}; the mission's arm has {joints}", self.links);
        Err(FieldError::new("links", reason))
    }

    /// Refuses sizes that this program was not built for.
    fn validate(&self) -> Result<(), FieldError> {
        let joints = self.links;
        if !(1..=MAX_JOINTS).contains(&joints) {
            return Err(FieldError::new("links", format!("is {joints}; {PLANNED_JOINTS}")));
        }
        for (field, found, expected) in [
            ("nodes", self.nodes, NODES),
            ("state", self.state, state_size(joints)),
            ("control", self.control, size::controls(joints)),
        ] {
            if found != expected {
                let reason = format!("is {found}; this program was built for {expected}");
                return Err(FieldError::new(field, reason));
            }
        }
        // More are not drawn, and their shards would be looked for one by one.
        if !(1..=MAX_COUNT).contains(&self.count) {
            return Err(FieldError::new("count", format!("must be from 1 to {MAX_COUNT}")));
        }
        // A shard is read in one piece.
        if !(1..=MOST_A_SHARD).contains(&self.shard) {
            return Err(FieldError::new("shard", format!("must be from 1 to {MOST_A_SHARD}")));
        }
        Ok(())
    }

    /// The first difference from `begun`, as an error of its field.
    pub(super) fn agree(&self, begun: &Self) -> Result<(), FieldError> {
        let named = |now: &dyn std::fmt::Display, then: &dyn std::fmt::Display| {
            format!("begun with {then}, not {now}")
        };
        let checks = [
            ("version", self.version != begun.version, named(&self.version, &begun.version)),
            ("seed", self.seed != begun.seed, named(&self.seed, &begun.seed)),
            ("count", self.count != begun.count, named(&self.count, &begun.count)),
            (
                "integrator",
                self.integrator != begun.integrator,
                named(&self.integrator, &begun.integrator),
            ),
            ("mission", self.mission != begun.mission, "begun with another mission".into()),
            ("settings", self.settings != begun.settings, "begun with other settings".into()),
            ("model", self.model != begun.model, "begun with another model".into()),
            ("shard", self.shard != begun.shard, named(&self.shard, &begun.shard)),
        ];
        match checks.into_iter().find(|(_, differs, _)| *differs) {
            Some((field, _, reason)) => {
                let advice = "choose another --out to start anew";
                Err(FieldError::new(field, format!("this dataset was {reason}; {advice}")))
            }
            None => Ok(()),
        }
    }
}
