//! Whether all shards of a dataset are there, whoever made them.

use super::manifest::{MANIFEST, Manifest};
use super::shard;
use super::shard_path;
use remora_host::error::Error;
use serde::Serialize;
use std::path::Path;

/// Shards that were gathered.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Gathered {
    /// How many there should be.
    pub shards: u64,
    /// Numbers of those that are missing.
    pub missing: Vec<u64>,
    /// Scenarios that were tried, in the shards that are there.
    pub tried: u64,
    /// Trajectories in them.
    pub kept: u64,
}

/// Reads every shard of a directory.
///
/// # Errors
/// A manifest that cannot be read; a shard that is damaged or of another dataset.
pub fn gather(directory: &Path) -> Result<Gathered, Error> {
    let manifest = Manifest::read(&directory.join(MANIFEST))?;
    let dataset = manifest.dataset();
    let mut gathered = Gathered { shards: 0, missing: Vec::new(), tried: 0, kept: 0 };
    for (number, shard) in (0..).zip(manifest.shards()) {
        gathered.shards += 1;
        let place = manifest.place(&dataset, shard);
        match shard::verify(&shard_path(directory, number), place)? {
            Some(kept) => {
                gathered.tried += u64::from(place.tried);
                gathered.kept += u64::from(kept);
            }
            None => gathered.missing.push(number),
        }
    }
    Ok(gathered)
}
