//! Whether all shards of a dataset are there, whoever made them.

use super::manifest::{MANIFEST, Manifest};
use super::shard::{self, Place};
use super::shard_path;
use remora_host::error::Error;
use remora_host::with_joints;
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
    let file = directory.join(MANIFEST);
    let manifest = Manifest::read(&file)?;
    with_joints!(manifest.links, NL => {
        gather_of::<NL>(directory, &manifest)
    } else {
        Err(Error::input(&file, "links", "arms of 1 to 7 joints are planned for"))
    })
}

fn gather_of<const NL: usize>(directory: &Path, manifest: &Manifest) -> Result<Gathered, Error> {
    let dataset = manifest.dataset();
    let mut gathered = Gathered { shards: 0, missing: Vec::new(), tried: 0, kept: 0 };
    for (number, (first, tried)) in (0..).zip(manifest.shards()) {
        gathered.shards += 1;
        let place = Place { dataset: &dataset, first, tried };
        match shard::verify::<NL>(&shard_path(directory, number), place)? {
            Some(kept) => {
                gathered.tried += u64::from(tried);
                gathered.kept += u64::from(kept);
            }
            None => gathered.missing.push(number),
        }
    }
    Ok(gathered)
}
