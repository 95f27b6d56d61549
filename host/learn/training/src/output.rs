//! Files that a training leaves in its directory.

use crate::checkpoint::{Checkpoint, LossRow};
use crate::config::Config;
use crate::model::revision;
use crate::params::Table;
use remora_host::error::Error;
use remora_host::formats::{check_writable, remove_partials, write_atomically};
use remora_host::lineage::Training;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Where a training ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The last checkpoint.
    pub checkpoint: Checkpoint,
    /// Sizes.
    pub table: Table,
    /// Whether the schedule ran to its end.
    pub complete: bool,
}

/// Makes the directory and copies the configuration into it.
pub(super) fn prepare(out: &Path, config: &Config) -> Result<(), Error> {
    std::fs::create_dir_all(out).map_err(|cause| Error::output(out, &cause))?;
    remove_partials(out);
    check_writable(&out.join("loss.csv"))?;
    write_atomically(&out.join("config.toml"), config.text().as_bytes())
}

/// Name of the model in a training's directory.
pub const MODEL: &str = "model.f32.model";

/// Writes the losses.
pub(super) fn report(out: &Path, rows: &[LossRow]) -> Result<(), Error> {
    write_atomically(&out.join("loss.csv"), csv(rows).as_bytes())?;
    match crate::curve::svg(rows) {
        Some(text) => write_atomically(&out.join("loss.svg"), text.as_bytes()),
        None => Ok(()),
    }
}

fn csv(rows: &[LossRow]) -> String {
    let mut text = String::from(
        "step,train,train_state,validation,validation_state,rollout_mean_m,rollout_p95_m,\
         rollout_torque_n_m,gradient_norm,learning_rate,nodes_per_s,elapsed_s\n",
    );
    for r in rows {
        let rollout = r.rollout.map_or(",,".into(), |rollout| {
            format!("{:.5},{:.5},{:.4e}", rollout.mean_m, rollout.p95_m, rollout.torque_n_m)
        });
        let _ = writeln!(
            text,
            "{},{:.6e},{:.6e},{:.6e},{:.6e},{rollout},{:.4e},{:.4e},{:.0},{:.1}",
            r.step,
            r.train,
            r.train_state,
            r.validation,
            r.validation_state,
            r.gradient_norm,
            r.learning_rate,
            r.nodes_per_s,
            r.elapsed_s,
        );
    }
    text
}

/// How a training ended: `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary<'a> {
    format: &'static str,
    complete: bool,
    data: String,
    count: Option<u64>,
    learnt_from: &'a str,
    parent: &'a str,
    ancestors: &'a [Training],
    seed: u64,
    steps: u64,
    examples: u64,
    parameters: usize,
    parameters_of_model: usize,
    config_digest: &'a str,
    revision: Option<String>,
    training_s: f64,
    last: Option<&'a LossRow>,
}

impl<'a> Summary<'a> {
    /// Of a training's configuration and end.
    pub fn of(config: &'a Config, outcome: &'a Outcome) -> Self {
        let state = &outcome.checkpoint;
        let steps = state.optimiser.step;
        Self {
            format: "remora-training/1",
            complete: outcome.complete,
            data: config.data.path.display().to_string(),
            count: config.data.count,
            learnt_from: &state.origin.dataset,
            parent: &state.origin.parent,
            ancestors: &state.origin.ancestors,
            seed: config.training.seed,
            steps,
            examples: steps * (config.training.batch * config.training.accumulation) as u64,
            parameters: outcome.table.len(),
            parameters_of_model: outcome.table.inference_len(),
            config_digest: &state.digest,
            revision: revision(),
            training_s: state.elapsed_s,
            last: state.rows.last(),
        }
    }

    /// Writes `summary.json` to the directory of a training.
    ///
    /// # Errors
    /// The file with the reason.
    pub fn write(&self, out: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        write_atomically(&out.join("summary.json"), text.as_bytes())
    }
}
