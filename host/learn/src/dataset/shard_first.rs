//! Shards of the first version, which are read and no longer written: a head and records of one size,
//! which do not say what dataset they are of.

use super::Trajectory;
use super::shard::{Found, Outline};

pub(super) const VERSION: u32 = 1;
/// Where the records begin [bytes].
const BEGIN: usize = 32;

/// What the head says that stands behind magic bytes and version.
pub(super) fn outline<const NL: usize>(head: &[u8]) -> Result<Outline, String> {
    let words: Vec<u32> =
        head.as_chunks().0.iter().take(5).map(|bytes| u32::from_le_bytes(*bytes)).collect();
    let [record, low, high, tried, kept] = words[..] else { return Err("is truncated".into()) };
    let expected = Trajectory::<NL>::BYTES;
    if record as usize != expected {
        return Err(format!("has records of {record} bytes; a trajectory has {expected}"));
    }
    Ok(Outline {
        first: u64::from(high) << 32 | u64::from(low),
        tried,
        found: Found { kept, is_named: false },
        begin: BEGIN,
        bytes: u64::from(kept) * expected as u64,
    })
}

/// The record that bytes begin with, and what is behind it.
pub(super) fn record<const NL: usize>(bytes: &[u8]) -> Result<(Trajectory<NL>, &[u8]), String> {
    let record = bytes.split_at_checked(Trajectory::<NL>::BYTES).ok_or("is truncated")?;
    Ok((Trajectory::decode_first(record.0)?, record.1))
}
