//! The model file of a training's parameters.

use super::config::{self, Config};
use super::params::Table;
use super::source::Statistics;
use crate::error::FieldError;
use crate::formats::ModelBuilder;
use remora_core::nn::{Action, Decoder, Encoding, Header, Layout, Precision, Provenance, VERSION};

/// Where the examples came from, as the model file says it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Discretisation of the trajectories.
    pub integrator: String,
    /// Datasets.
    pub dataset: String,
}

/// As much of a text as a header's string holds.
fn short<S: for<'a> TryFrom<&'a str> + Default>(text: &str, most: usize) -> S {
    let end = (0..=most.min(text.len())).rev().find(|i| text.is_char_boundary(*i));
    S::try_from(&text[..end.unwrap_or(0)]).unwrap_or_default()
}

/// The header of a model.
pub fn header(config: &Config, table: &Table, origin: &Origin, steps: u64) -> Header {
    let model = &config.model;
    Header {
        version: VERSION,
        precision: Precision::F32,
        layout: match model.layout {
            config::Layout::Fused => Layout::Fused,
            config::Layout::Separate => Layout::Separate,
        },
        encoding: match model.encoding {
            config::Encoding::Paper => Encoding::Paper,
            config::Encoding::Body => Encoding::Body,
        },
        action: match model.action {
            config::Action::Torque => Action::Torque,
            config::Action::Rate => Action::Rate,
        },
        decoder: match model.decoder {
            config::Decoder::Linear => Decoder::Linear,
            config::Decoder::Flow => Decoder::Flow { steps: 1 },
        },
        chunk: model.chunk as u16,
        nodes: table.nodes as u16,
        layers: table.layers as u16,
        heads: table.heads as u16,
        width: table.width as u16,
        kinds: table.kinds.iter().map(|inputs| *inputs as u16).collect(),
        provenance: Provenance {
            integrator: short(&origin.integrator, 16),
            dataset: short(&origin.dataset, 64),
            config: short(&config.digest(), 64),
            revision: short(&super::output::revision().unwrap_or_default(), 48),
            seed: config.training.seed,
            steps,
        },
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
        let (group, field) = entry.name.split_once('.').unwrap_or((&entry.name, ""));
        match (group, field) {
            ("state", _) => {}
            ("nodes", _) => file.set_f32("node.embedding", values)?,
            ("norm", _) => file.set_f32(&format!("embed.norm.{field}"), values)?,
            ("last", _) => file.set_f32(&format!("norm.{field}"), values)?,
            ("flow1", "weight") => {
                // The first matrix in two: what changes with the flow's time, input by input, and
                // what does not.
                let asked = table.outputs + 1;
                let rows = values.chunks_exact(entry.columns);
                let latent: Vec<f32> = rows.flat_map(|row| &row[asked..]).copied().collect();
                file.set_f32("flow.latent.weight", &latent)?;
                let action = transposed(values, entry.columns);
                file.set_f32("flow.action.weight", &action[..asked * entry.rows])?;
            }
            ("flow1", _) => file.set_f32("flow.latent.bias", values)?,
            ("flow2", _) => file.set_f32(&format!("flow.hidden.{field}"), values)?,
            ("flow3", _) => file.set_f32(&format!("flow.out.{field}"), values)?,
            ("head", _) => file.set_f32(&entry.name, values)?,
            _ => match (group.strip_prefix("kind"), group.strip_prefix("block")) {
                (Some(kind), _) => {
                    let name = format!("embed.{kind}.{field}");
                    file.set_f32(&name, &transposed(values, entry.columns))?;
                }
                (_, Some(block)) => file.set_f32(&format!("block.{block}.{field}"), values)?,
                _ => return Err(FieldError::new(&entry.name, "has no place in a model file")),
            },
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
