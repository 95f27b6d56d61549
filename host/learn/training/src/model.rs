//! The model file of a training's parameters, and the parameters of a model file.

use crate::config::{self, Action, Config, Encoding};
use crate::params::{Entry, Table};
use crate::source::Statistics;
use remora_core::advanced::nn::{Decoder, Header, Layout, Precision, Provenance};
use remora_host::error::FieldError;
use remora_host::formats::{ModelBuilder, ModelFile, Values};
use remora_host::lineage::{Lineage, Source, Training};
use serde::{Deserialize, Serialize};

/// Where parameters came from, as the model file says it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Discretisation of the trajectories.
    pub integrator: String,
    /// Datasets, those that the parent learnt from among them.
    pub dataset: String,
    /// Parent that the training started from, checksum or digest and name; empty where from nothing.
    pub parent: String,
    /// Datasets of this training alone; empty where these are all.
    pub own: String,
    /// Trajectories of a step.
    pub batch: Option<u64>,
    /// The trainings before this one, the first ancestor's first.
    pub ancestors: Vec<Training>,
    /// Model that the first of them started from, where no more is known of it.
    pub before: Option<String>,
}

/// Bytes of the header's text of datasets.
const DATASET_BYTES: usize = 64;

impl Origin {
    /// This training's, which starts from the parameters of a parent.
    ///
    /// # Errors
    /// More datasets than a header has room for: cut off, they would no longer be kept from
    /// evaluations.
    pub fn from(&self, parent: String, learnt: &[&str]) -> Result<Self, FieldError> {
        let known = learnt.iter().filter(|text| !text.is_empty());
        let dataset = known.fold(self.dataset.clone(), |all, text| Source::union(&all, text));
        if dataset.len() > DATASET_BYTES {
            let reason = format!("{dataset}: more datasets than a model's header has room for");
            return Err(FieldError::new("provenance.dataset", reason));
        }
        Ok(Self { dataset, parent, own: self.dataset.clone(), ..self.clone() })
    }

    /// This training and all before it; its own model has a name and took so many steps.
    pub fn lineage(&self, name: String, steps: u64) -> Lineage {
        let own = if self.own.is_empty() { &self.dataset } else { &self.own };
        let last = Training {
            name,
            integrator: self.integrator.clone(),
            learnt_from: own.clone(),
            steps,
            batch: self.batch,
        };
        let trainings = self.ancestors.iter().cloned().chain([last]).collect();
        let before = self.before.clone();
        Lineage { trainings, before, sources: Source::parse_all(&self.dataset).unwrap_or_default() }
    }

    /// Puts this training after those of another model.
    pub fn after(self, parent: Lineage) -> Self {
        Self { ancestors: parent.trainings, before: parent.before, ..self }
    }
}

/// Cuts a text to the length of a header's string.
fn short<S: for<'a> TryFrom<&'a str> + Default>(text: &str, most: usize) -> S {
    let end = (0..=most.min(text.len())).rev().find(|i| text.is_char_boundary(*i));
    S::try_from(&text[..end.unwrap_or(0)]).unwrap_or_default()
}

/// The header of a model.
pub fn header(config: &Config, table: &Table, origin: &Origin, steps: u64) -> Header {
    let model = &config.model;
    let mut digest = config.digest();
    if !origin.parent.is_empty() {
        digest += &format!(" from {}", origin.parent);
    }
    let action = table.action as u16;
    Header {
        version: Header::version_of(action),
        precision: Precision::F32,
        layout: match model.layout {
            config::Layout::Fused => Layout::Fused,
            config::Layout::Separate => Layout::Separate,
            config::Layout::Chunked => Layout::Chunked,
        },
        inputs: model.encoding.tag(),
        outputs: model.action.tag(),
        decoder: match model.decoder {
            config::Decoder::Linear => Decoder::Linear,
            config::Decoder::Flow => Decoder::Flow { steps: 1 },
        },
        chunk: model.chunk as u16,
        nodes: table.nodes as u16,
        layers: table.layers as u16,
        heads: table.heads as u16,
        width: table.width as u16,
        token_types: table.token_types.iter().map(|inputs| *inputs as u16).collect(),
        provenance: Provenance {
            integrator: short(&origin.integrator, 16),
            dataset: short(&origin.dataset, DATASET_BYTES),
            config: short(&digest, 64),
            revision: short(&revision().unwrap_or_default(), 48),
            seed: config.training.seed,
            steps,
        },
        action,
    }
}

/// The network that a header describes, as a configuration says it; `None` where its inputs or outputs have no
/// meaning here.
pub fn network(header: &Header) -> Option<config::Model> {
    Some(config::Model {
        layout: match header.layout {
            Layout::Fused => config::Layout::Fused,
            Layout::Separate => config::Layout::Separate,
            Layout::Chunked => config::Layout::Chunked,
        },
        encoding: Encoding::of_tag(header.inputs)?,
        action: Action::of_tag(header.outputs)?,
        decoder: match header.decoder {
            Decoder::Linear => config::Decoder::Linear,
            Decoder::Flow { .. } => config::Decoder::Flow,
        },
        chunk: header.chunk.into(),
        layers: header.layers.into(),
        heads: header.heads.into(),
        width: header.width.into(),
        dropout: 0.0,
    })
}

/// Where a tensor of the parameters is in a model file.
enum Place {
    /// Not there: of use in training only.
    Nowhere,
    /// Under this name.
    AsIs(String),
    /// Under this name, a row an input.
    Transposed(String),
    /// In two: the columns that change with the flow's time, a row an input, and the rest.
    Split { rest: &'static str, first: &'static str },
}

impl Place {
    fn of(entry: &Entry) -> Result<Self, FieldError> {
        let (group, field) = entry.name.split_once('.').unwrap_or((&entry.name, ""));
        Ok(match (group, field) {
            ("state", _) => Self::Nowhere,
            ("nodes", _) => Self::AsIs("node.embedding".into()),
            ("norm", _) => Self::AsIs(format!("embed.norm.{field}")),
            ("last", _) => Self::AsIs(format!("norm.{field}")),
            ("flow1", "weight") => {
                Self::Split { rest: "flow.latent.weight", first: "flow.action.weight" }
            }
            ("flow1", _) => Self::AsIs("flow.latent.bias".into()),
            ("flow2", _) => Self::AsIs(format!("flow.hidden.{field}")),
            ("flow3", _) => Self::AsIs(format!("flow.out.{field}")),
            ("head", _) => Self::AsIs(entry.name.clone()),
            _ => match (group.strip_prefix("kind"), group.strip_prefix("block")) {
                (Some(kind), _) => Self::Transposed(format!("embed.{kind}.{field}")),
                (_, Some(block)) => Self::AsIs(format!("block.{block}.{field}")),
                _ => return Err(FieldError::new(&entry.name, "has no place in a model file")),
            },
        })
    }
}

/// The file's bytes.
///
/// # Errors
/// A network that the format has no room for, or a number that is not finite.
pub fn model_bytes(
    header: Header,
    table: &Table,
    statistics: &Statistics,
    parameters: &[f32],
) -> Result<Vec<u8>, FieldError> {
    let mut file = ModelBuilder::new(header)?;
    let column = |pairs: &[[f32; 2]], i: usize| pairs.iter().map(|pair| pair[i]).collect();
    for (name, pairs) in [("input", &statistics.features), ("action", &statistics.actions)] {
        let (mean, deviation): (Vec<f32>, Vec<f32>) = (column(pairs, 0), column(pairs, 1));
        file.set_f32(&format!("{name}.mean"), &mean)?;
        file.set_f32(&format!("{name}.std"), &deviation)?;
    }
    for entry in &table.entries {
        let values = &parameters[entry.range()];
        match Place::of(entry)? {
            Place::Nowhere => {}
            Place::AsIs(name) => file.set_f32(&name, values)?,
            Place::Transposed(name) => file.set_f32(&name, &transposed(values, entry.columns))?,
            Place::Split { rest, first } => {
                let asked = table.outputs + 1;
                let rows = values.chunks_exact(entry.columns);
                let latent: Vec<f32> = rows.flat_map(|row| &row[asked..]).copied().collect();
                file.set_f32(rest, &latent)?;
                let action = transposed(values, entry.columns);
                file.set_f32(first, &action[..asked * entry.rows])?;
            }
        }
    }
    Ok(file.finish()?.bytes())
}

/// Row `i` of the result is column `i`; a vector, which is one row, stays as it is.
fn transposed(values: &[f32], columns: usize) -> Vec<f32> {
    if values.len() == columns {
        return values.to_vec();
    }
    (0..columns).flat_map(|i| values.iter().skip(i).step_by(columns)).copied().collect()
}

/// Takes over the parameters and statistics of a model file, bytes as the numbers they stand for.
/// State head and statistics of states stay as they are: a file does not hold them.
///
/// # Errors
/// The first field in which the model differs from the configuration.
pub fn take_over(
    file: &ModelFile,
    config: &Config,
    table: &Table,
    statistics: &mut Statistics,
    parameters: &mut [f32],
) -> Result<(), FieldError> {
    same_network(file.header(), &header(config, table, &Origin::default(), 0))?;
    for (name, pairs) in [("input", &mut statistics.features), ("action", &mut statistics.actions)]
    {
        let mean = numbers(file, &format!("{name}.mean"))?;
        let deviation = numbers(file, &format!("{name}.std"))?;
        *pairs = mean.into_iter().zip(deviation).map(|(mean, std)| [mean, std]).collect();
    }
    for entry in &table.entries {
        let values = match Place::of(entry)? {
            Place::Nowhere => continue,
            Place::AsIs(name) => numbers(file, &name)?,
            Place::Transposed(name) => transposed(&numbers(file, &name)?, entry.rows),
            Place::Split { rest, first } => {
                let action = transposed(&numbers(file, first)?, entry.rows);
                let latent = numbers(file, rest)?;
                let rows = action
                    .chunks_exact(table.outputs + 1)
                    .zip(latent.chunks_exact(entry.columns - table.outputs - 1));
                rows.flat_map(|(first, rest)| first.iter().chain(rest)).copied().collect()
            }
        };
        parameters[entry.range()].copy_from_slice(&values);
    }
    Ok(())
}

/// Refuses a model that is not of the network that is to be trained.
fn same_network(found: &Header, wanted: &Header) -> Result<(), FieldError> {
    let decoder = |header: &Header| match header.decoder {
        Decoder::Linear => "linear",
        Decoder::Flow { .. } => "flow",
    };
    let name = |of: Option<String>| of.unwrap_or_else(|| "unknown".into());
    let encoding =
        |header: &Header| name(Encoding::of_tag(header.inputs).map(|of| format!("{of:?}")));
    let action = |header: &Header| name(Action::of_tag(header.outputs).map(|of| format!("{of:?}")));
    // Three numbers of an action are the bus's.
    let joints = |header: &Header| header.action.saturating_sub(3).to_string();
    for (field, found, wanted) in [
        ("layout", format!("{:?}", found.layout), format!("{:?}", wanted.layout)),
        ("encoding", encoding(found), encoding(wanted)),
        ("action", action(found), action(wanted)),
        ("decoder", decoder(found).into(), decoder(wanted).into()),
        ("joints", joints(found), joints(wanted)),
        ("chunk", found.chunk.to_string(), wanted.chunk.to_string()),
        ("nodes", found.nodes.to_string(), wanted.nodes.to_string()),
        ("layers", found.layers.to_string(), wanted.layers.to_string()),
        ("heads", found.heads.to_string(), wanted.heads.to_string()),
        ("width", found.width.to_string(), wanted.width.to_string()),
        ("token_types", format!("{:?}", found.token_types), format!("{:?}", wanted.token_types)),
    ] {
        if found != wanted {
            let reason = format!("the model has {found}, the configuration {wanted}");
            return Err(FieldError::new(field, reason));
        }
    }
    Ok(())
}

/// The numbers of a tensor, bytes times the scales of their rows.
fn numbers(file: &ModelFile, name: &str) -> Result<Vec<f32>, FieldError> {
    let missing = || FieldError::new(name, "is missing");
    let tensor = file.tensor(name).ok_or_else(missing)?;
    match &tensor.values {
        Values::F32(numbers) => Ok(numbers.clone()),
        Values::Int8(bytes) => {
            let scales = numbers(file, &name.replace("weight", "scale"))?;
            let rows = bytes.chunks(tensor.columns).zip(scales);
            Ok(rows
                .flat_map(|(row, scale)| row.iter().map(move |b| scale * f32::from(*b)))
                .collect())
        }
    }
}

/// The commit of the working directory, if it is one of git's.
pub fn revision() -> Option<String> {
    let output = std::process::Command::new("git")
        .args(["describe", "--always", "--dirty", "--abbrev=12"])
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.trim().is_empty()).then(|| text.trim().to_string())
}
