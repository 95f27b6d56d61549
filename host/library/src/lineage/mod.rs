//! Lineage of a model: the trainings that its numbers went through, and the scenarios that each
//! learnt from.
//!
//! A model's header names its own training, the scenarios learnt from and the model that it started
//! from. `NAME.lineage.toml` beside `NAME.model` names every training, the first ancestor's first:
//! training writes it, quantisation carries it over. An evaluation asks here which scenarios it
//! must leave out.

mod source;

pub use source::Source;

use crate::error::Error;
use crate::formats::{Limit, read_text, toml_text};
use crate::formats::{NamedScenario, write_atomically};
use remora_core::advanced::nn::Provenance;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The `format` of a lineage file.
const FORMAT: &str = "remora-lineage/1";

/// One training that a model went through.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Name of the model that came out.
    pub name: String,
    /// Integrator of the plans.
    pub integrator: String,
    /// Scenarios that this training itself learnt from, such as `s1000:90000`.
    pub learnt_from: String,
    /// Optimiser steps.
    pub steps: u64,
    /// Trajectories of a step; absent where nobody wrote it down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub batch: Option<u64>,
}

/// All trainings of a model, the first ancestor's first and its own last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lineage {
    /// The trainings.
    pub trainings: Vec<Training>,
    /// Origin of the first of them, where no more is known of it: checksum or digest, name.
    pub before: Option<String>,
    /// Everything learnt from, with what the header alone names.
    pub sources: Vec<Source>,
}

/// The file as it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LineageFile {
    format: String,
    model: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    before: Option<String>,
    training: Vec<Training>,
}

/// Text of a training that learnt from no scenarios.
const SYNTHETIC: &str = "synthetic";

/// Trajectories in fifty that a training learns from: the rest is for validation.
const LEARNT_IN_FIFTY: f64 = 49.0;

impl Training {
    /// How often it met each trajectory; none where the batch or the datasets are not known.
    pub fn epochs(&self) -> Option<f64> {
        let sources = Source::parse_all(&self.learnt_from).ok()?;
        let count = sources.iter().fold(0u64, |all, source| all.saturating_add(source.count));
        let trajectories = count as f64 * LEARNT_IN_FIFTY / 50.0;
        let seen = self.steps.saturating_mul(self.batch?);
        (count > 0).then_some(seen as f64 / trajectories)
    }
}

/// Where the lineage of a model file stands.
pub fn path_of(model: &Path) -> PathBuf {
    model.with_extension("lineage.toml")
}

impl Lineage {
    /// Lineage from a header alone: its own training, and the model it started from. A header that
    /// names no drawn scenarios, such as `synthetic`, has no sources.
    pub fn of_header(name: &str, provenance: &Provenance) -> Self {
        let learnt_from = provenance.dataset.as_str();
        let sources = Source::parse_all(learnt_from).unwrap_or_default();
        let own = Training {
            name: name.into(),
            integrator: provenance.integrator.as_str().into(),
            learnt_from: learnt_from.into(),
            steps: provenance.steps,
            batch: None,
        };
        let parent = provenance.config.split_once(" from ").map(|(_, parent)| parent.into());
        Self { trainings: vec![own], before: parent, sources }
    }

    /// Lineage of a model file with this checksum and header: from the file beside it, or the header.
    ///
    /// # Errors
    /// A lineage that cannot be read, is another model's, or names no dataset.
    pub fn beside(model: &Path, checksum: u32, provenance: &Provenance) -> Result<Self, Error> {
        let name = model.file_stem().unwrap_or(model.as_os_str()).to_string_lossy();
        let own = Self::of_header(&name, provenance);
        let file = path_of(model);
        if !file.exists() {
            return Ok(own);
        }
        let found = LineageFile::read(&file)?;
        let checksum = format!("{checksum:08x}");
        if found.model != checksum {
            let reason = format!("is {}, the model beside it {checksum}", found.model);
            return Err(Error::input(&file, "model", reason));
        }
        let steps = found.training.last().map(|last| last.steps);
        if steps != Some(provenance.steps) {
            let reason = format!("the last has not the {} steps of the header", provenance.steps);
            return Err(Error::input(&file, "training", reason));
        }
        let mut sources = own.sources;
        let drawn = |training: &&Training| training.learnt_from != SYNTHETIC;
        for Training { name, learnt_from, .. } in found.training.iter().filter(drawn) {
            let more = Source::parse_all(learnt_from).map_err(|reason| {
                Error::input(&file, format!("training {name}: learnt_from"), reason)
            })?;
            sources.extend(more);
        }
        Ok(Self { trainings: found.training, before: found.before, sources: widest(&sources) })
    }

    /// Writes it beside a model file of this checksum.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_beside(&self, model: &Path, checksum: u32) -> Result<PathBuf, Error> {
        let path = path_of(model);
        let file = LineageFile {
            format: FORMAT.into(),
            model: format!("{checksum:08x}"),
            before: self.before.clone(),
            training: self.trainings.clone(),
        };
        let text = toml_text::to_text(&file)
            .map_err(|error| Error::output(&path, &std::io::Error::other(error)))?;
        write_atomically(&path, text.as_bytes()).map(|()| path)
    }

    /// The first of the scenarios that it has learnt from, itself or an ancestor.
    pub fn learnt<'a>(&self, scenarios: &'a [NamedScenario]) -> Option<&'a str> {
        let met = |id: &str| {
            drawn(id).is_some_and(|(seed, index)| {
                self.sources.iter().any(|source| source.seed == seed && index < source.count)
            })
        };
        scenarios.iter().map(|scenario| scenario.id.as_str()).find(|id| met(id))
    }

    /// Scenarios learnt from; those of one seed count once, however often they were met.
    pub fn size(&self) -> u64 {
        let all = widest(&self.sources);
        all.iter().fold(0, |size, source| size.saturating_add(source.count))
    }
}

impl LineageFile {
    fn read(file: &Path) -> Result<Self, Error> {
        toml_text::parse(&read_text(file, Limit::TEXT)?, Some(FORMAT))
            .map_err(|error| error.at(file))
    }
}

/// One source a seed, the largest.
fn widest(sources: &[Source]) -> Vec<Source> {
    let mut counts = BTreeMap::new();
    for Source { seed, count } in sources {
        let most = counts.entry(*seed).or_insert(*count);
        *most = (*most).max(*count);
    }
    counts.into_iter().map(|(seed, count)| Source { seed, count }).collect()
}

/// Seed and index of a drawn scenario, of which its id is made.
fn drawn(id: &str) -> Option<(u64, u64)> {
    let (seed, index) = id.strip_prefix('s')?.split_once('-')?;
    Some((seed.parse().ok()?, index.parse().ok()?))
}

#[cfg(test)]
mod tests;
