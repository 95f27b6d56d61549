//! State that a training needs to go on as if it had never stopped.
//!
//! `REMORACK`, a version, the length of a JSON head, the head, then parameters and the optimiser's
//! two moments as little-endian f32, and the CRC-32 of all before it.

use crate::model::Origin;
use crate::optimiser::AdamW;
use crate::rollout::RolloutError;
use crate::source::Statistics;
use remora_host::error::Error;
use remora_host::formats::{Limit, json, read_bytes, write_atomically};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"REMORACK";
const VERSION: u32 = 1;

/// A row of `loss.csv`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LossRow {
    /// Steps done.
    pub step: u64,
    /// Mean training loss of the action since the last row.
    pub train: f64,
    /// The next state's.
    pub train_state: f64,
    /// Validation loss of the action.
    pub validation: f64,
    /// The next state's.
    pub validation_state: f64,
    /// Rollouts of validation scenarios, where they were measured.
    pub rollout: Option<RolloutError>,
    /// Mean norm of the gradient before clipping.
    pub gradient_norm: f64,
    /// Learning rate.
    pub learning_rate: f64,
    /// Nodes a second.
    pub nodes_per_s: f64,
    /// Training time so far [s].
    pub elapsed_s: f64,
}

/// Everything of a training but its data.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Digest of the configuration.
    pub digest: String,
    /// Shape of the network: one line a tensor.
    pub shape: String,
    /// Where the parameters came from.
    pub origin: Origin,
    /// Normalisation.
    pub statistics: Statistics,
    /// Training time so far [s].
    pub elapsed_s: f64,
    /// Rows of `loss.csv` so far.
    pub rows: Vec<LossRow>,
    /// Sums of training loss, state loss and gradient norm since the last row, and their number.
    pub sums: [f64; 4],
    /// Parameters.
    pub parameters: Vec<f32>,
    /// Optimiser, with the step.
    pub optimiser: AdamW,
}

/// The JSON head. Statistics are f32, which JSON keeps exactly.
#[derive(Serialize, Deserialize)]
struct Head {
    digest: String,
    shape: String,
    origin: Origin,
    features: Vec<[f32; 2]>,
    actions: Vec<[f32; 2]>,
    states: Vec<[f32; 2]>,
    elapsed_s: f64,
    rows: Vec<LossRow>,
    sums: [f64; 4],
    step: u64,
}

impl Checkpoint {
    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// The file with the reason.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        write_atomically(file, &self.encode())
    }

    fn encode(&self) -> Vec<u8> {
        let statistics = self.statistics.clone();
        let head = Head {
            digest: self.digest.clone(),
            shape: self.shape.clone(),
            origin: self.origin.clone(),
            features: statistics.features,
            actions: statistics.actions,
            states: statistics.states,
            elapsed_s: self.elapsed_s,
            rows: self.rows.clone(),
            sums: self.sums,
            step: self.optimiser.step,
        };
        let head = serde_json::to_vec(&head).unwrap_or_default();
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((head.len() as u32).to_le_bytes());
        bytes.extend(head);
        for values in [&self.parameters, &self.optimiser.first, &self.optimiser.second] {
            bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        }
        let crc = crc32fast::hash(&bytes);
        bytes.extend(crc.to_le_bytes());
        bytes
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The file with the reason.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let bytes = read_bytes(file, Limit::BINARY)?;
        let reason = match bytes.starts_with(MAGIC) {
            true => "is not a whole checkpoint",
            false => "is neither a checkpoint nor a model",
        };
        Self::decode(&bytes).ok_or_else(|| Error::input(file, "", reason))
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (body, crc) = bytes.split_last_chunk::<4>()?;
        if crc32fast::hash(body) != u32::from_le_bytes(*crc) {
            return None;
        }
        let body = body.strip_prefix(MAGIC)?.strip_prefix(&VERSION.to_le_bytes())?;
        let (length, body) = body.split_first_chunk::<4>()?;
        let (head, numbers) = body.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        let head: Head = json::parse_value(head).ok()?;
        let (numbers, []) = numbers.as_chunks::<4>() else { return None };
        let numbers: Vec<f32> = numbers.iter().map(|x| f32::from_le_bytes(*x)).collect();
        let count = numbers.len() / 3;
        if numbers.len() != 3 * count {
            return None;
        }
        Some(Self {
            digest: head.digest,
            shape: head.shape,
            origin: head.origin,
            statistics: Statistics {
                features: head.features,
                actions: head.actions,
                states: head.states,
            },
            elapsed_s: head.elapsed_s,
            rows: head.rows,
            sums: head.sums,
            optimiser: AdamW {
                first: numbers[count..2 * count].to_vec(),
                second: numbers[2 * count..].to_vec(),
                step: head.step,
            },
            parameters: numbers[..count].to_vec(),
        })
    }
}

/// The checkpoint that a path means: itself, or the one in a training's directory.
pub fn locate(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(FILE) } else { path.to_path_buf() }
}

/// Name of the checkpoint in a training's directory.
pub const FILE: &str = "checkpoint.bin";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkpoint_comes_back_and_damage_is_seen() {
        let checkpoint = Checkpoint {
            digest: "a".into(),
            shape: "b".into(),
            origin: Origin { parent: "c".into(), ..Origin::default() },
            statistics: Statistics { features: vec![[0.1, 3.3e-7]], ..Statistics::default() },
            elapsed_s: 0.1,
            rows: vec![LossRow { train: 1.0 / 3.0, ..LossRow::default() }],
            sums: [0.1, 0.2, 0.3, 4.0],
            parameters: vec![1.0, 2.0],
            optimiser: AdamW { first: vec![3.0, 4.0], second: vec![5.0, 6.0], step: 7 },
        };
        let mut bytes = checkpoint.encode();
        assert_eq!(Checkpoint::decode(&bytes), Some(checkpoint));
        bytes[40] ^= 1;
        assert_eq!(Checkpoint::decode(&bytes), None);
        assert_eq!(Checkpoint::decode(&bytes[..20]), None);
    }
}
