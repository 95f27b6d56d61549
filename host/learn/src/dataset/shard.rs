//! Shards: the trajectories of a run of scenarios, in one file with a checksum.
//!
//! Magic bytes, version, head and records in postcard, CRC-32. The head says what dataset the records
//! are of, so that a shard without its manifest is not taken for one of another.

use super::Trajectory;
use remora_host::error::{Error, io_reason};
use remora_host::formats::{Limit, open_regular, read_bytes, write_atomically};
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::Path;

pub(super) const MAGIC: &[u8; 8] = b"REMORA\0D";
const VERSION: u32 = 2;
/// Where the head begins, and size of the CRC at the end [bytes].
const HEAD_AT: usize = 12;
pub(super) const CRC_BYTES: usize = 4;
/// More than a head has [bytes].
const HEAD_ROOM: u64 = 128;

/// A shard's place in its dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place<'a> {
    /// Fingerprint of the dataset: [`Manifest::dataset`](super::Manifest::dataset).
    pub dataset: &'a str,
    /// Joints of its arm.
    pub joints: usize,
    /// Index of the first scenario that is tried.
    pub first: u64,
    /// Number of scenarios that are tried.
    pub tried: u32,
}

/// Head, which stands before the records.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Head<'a> {
    dataset: &'a str,
    first: u64,
    tried: u32,
    kept: u32,
    /// Size of the records together.
    bytes: u64,
}

/// A shard's head, and where its records begin.
struct Outline<'a> {
    head: Head<'a>,
    begin: usize,
}

impl<'a> Outline<'a> {
    /// Reads the beginning of a shard.
    fn read(bytes: &'a [u8], dataset: &str) -> Result<Self, String> {
        let rest = bytes.strip_prefix(MAGIC).ok_or("is not a shard of a dataset")?;
        let (version, rest) = rest.split_first_chunk().ok_or("is truncated")?;
        let version = u32::from_le_bytes(*version);
        if version != VERSION {
            return Err(format!("is of version {version}; this reader understands {VERSION}"));
        }
        let (head, records) =
            postcard::take_from_bytes::<Head<'_>>(rest).map_err(|_| "is truncated")?;
        if head.dataset != dataset {
            return Err("is of another dataset: of another seed, mission, integrator or \
                        model than its manifest says"
                .into());
        }
        Ok(Self { head, begin: HEAD_AT + rest.len() - records.len() })
    }

    /// Refuses a shard that stands in the place of another, and one that is not whole.
    fn check(self, place: Place<'_>, size: u64) -> Result<Self, String> {
        let Head { first, tried, kept, bytes, .. } = self.head;
        if (first, tried) != (place.first, place.tried) || kept > place.tried {
            return Err(format!(
                "holds {kept} of {tried} scenarios from {first} on; expected {} from {} on",
                place.tried, place.first
            ));
        }
        let expected = bytes.saturating_add((self.begin + CRC_BYTES) as u64);
        if size != expected {
            return Err(format!("has {size} bytes instead of {expected}"));
        }
        // Memory is set aside for as many as are said to be there.
        match u64::from(kept).saturating_mul(Trajectory::least_bytes(place.joints)) <= bytes {
            true => Ok(self),
            false => Err(format!("has {bytes} bytes of records, too few for {kept}")),
        }
    }
}

/// Writes a shard whole or not at all: the trajectories, in order of their scenarios.
pub(super) fn write(
    file: &Path,
    place: Place<'_>,
    trajectories: &[Trajectory],
) -> Result<(), Error> {
    let failed =
        |error: postcard::Error| Error::Output { file: file.into(), reason: error.to_string() };
    write_atomically(file, &encode(place, trajectories).map_err(failed)?)
}

pub(super) fn encode(
    place: Place<'_>,
    trajectories: &[Trajectory],
) -> Result<Vec<u8>, postcard::Error> {
    let Place { dataset, joints, first, tried } = place;
    let room = Vec::with_capacity(trajectories.len() * Trajectory::bytes(joints));
    let records = trajectories.iter().try_fold(room, |out, t| t.encode(out))?;
    let kept = trajectories.len() as u32;
    let head = Head { dataset, first, tried, kept, bytes: records.len() as u64 };
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    let mut bytes = postcard::to_extend(&head, bytes)?;
    bytes.extend(records);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    Ok(bytes)
}

/// Reads how many of its scenarios a shard has kept, and compares the file's size with that. `None` where
/// there is no such file.
pub(super) fn look(file: &Path, place: Place<'_>) -> Result<Option<u32>, Error> {
    if !file.exists() {
        return Ok(None);
    }
    let failed = |cause: std::io::Error| Error::input(file, "", io_reason(&cause));
    let mut handle = open_regular(file)?;
    let mut bytes = Vec::new();
    handle.by_ref().take(HEAD_ROOM).read_to_end(&mut bytes).map_err(failed)?;
    let size = handle.metadata().map_err(failed)?.len();
    let outline = Outline::read(&bytes, place.dataset);
    let outline = outline.and_then(|outline| outline.check(place, size));
    outline.map(|outline| Some(outline.head.kept)).map_err(|reason| Error::input(file, "", reason))
}

/// Looks at a shard like [`look`], and reads every byte.
pub(super) fn verify(file: &Path, place: Place<'_>) -> Result<Option<u32>, Error> {
    let found = look(file, place)?;
    if found.is_some() {
        read(file, place, place.first, &mut Vec::new())?;
    }
    Ok(found)
}

/// Adds the trajectories of a whole shard to `out`; those of scenarios from `end` on are left out.
pub(super) fn read(
    file: &Path,
    place: Place<'_>,
    end: u64,
    out: &mut Vec<Trajectory>,
) -> Result<(), Error> {
    let record = Trajectory::bytes(place.joints) as u64;
    let most = HEAD_ROOM + u64::from(place.tried) * (record + HEAD_ROOM);
    let bytes = read_bytes(file, Limit::of(most))?;
    decode(&bytes, place, end, out).map_err(|reason| Error::input(file, "", reason))
}

pub(super) fn decode(
    bytes: &[u8],
    place: Place<'_>,
    end: u64,
    out: &mut Vec<Trajectory>,
) -> Result<(), String> {
    let outline = Outline::read(bytes, place.dataset)?;
    let outline = outline.check(place, bytes.len() as u64)?;
    let (body, crc) = bytes.split_last_chunk().ok_or("is truncated")?;
    if crc32fast::hash(body) != u32::from_le_bytes(*crc) {
        return Err("is damaged: its CRC-32 does not match".into());
    }
    let mut rest = body.get(outline.begin..).ok_or("is truncated")?;
    let mut next = place.first;
    for _ in 0..outline.head.kept {
        let trajectory;
        (trajectory, rest) = Trajectory::decode(rest, place.joints)?;
        let scenario = trajectory.scenario;
        if scenario < next || scenario >= place.first + u64::from(place.tried) {
            return Err(format!("scenario {scenario} is out of order"));
        }
        next = scenario + 1;
        if scenario < end {
            out.push(trajectory);
        }
    }
    match rest.is_empty() {
        true => Ok(()),
        false => Err(format!("has {} bytes behind its records", rest.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::trajectory::tests::counting;
    use super::*;
    use proptest::prelude::*;

    const PLACE: Place<'_> =
        Place { dataset: "0123456789abcdef", joints: 3, first: 500, tried: 10 };
    /// Size of a shard of two records: its head, the records, the CRC.
    const BYTES: usize = 12 + 17 + 2 + 1 + 1 + 3 + 2 * 8413 + 4;

    fn bytes_of(indices: &[u64]) -> Vec<u8> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("shard");
        let trajectories: Vec<_> = indices.iter().map(|i| counting(*i, 3)).collect();
        write(&file, PLACE, &trajectories).unwrap();
        let found = look(&file, PLACE).unwrap();
        assert_eq!(found, Some(indices.len() as u32));
        std::fs::read(file).unwrap()
    }

    fn read_bytes(bytes: &[u8], end: u64) -> Result<Vec<u64>, String> {
        let mut out = Vec::new();
        decode(bytes, PLACE, end, &mut out)?;
        assert!(out.iter().all(|t| *t == counting(t.scenario, 3)));
        Ok(out.iter().map(|t| t.scenario).collect())
    }

    #[test]
    fn a_shard_survives_a_round_trip_and_is_cut_at_the_limit() {
        let bytes = bytes_of(&[501, 507]);
        assert_eq!(bytes.len(), BYTES);
        assert_eq!(read_bytes(&bytes, 1000).unwrap(), [501, 507]);
        assert_eq!(read_bytes(&bytes, 507).unwrap(), [501]);
    }

    #[test]
    fn another_shard_or_another_order_is_refused() {
        let bytes = bytes_of(&[501, 507]);
        let refused = |place: Place<'_>| decode(&bytes, place, 2000, &mut Vec::new()).unwrap_err();
        let reason = refused(Place { first: 1000, ..PLACE });
        assert_eq!(reason, "holds 2 of 10 scenarios from 500 on; expected 10 from 1000 on");
        let reason = refused(Place { dataset: "0123456789abcde0", ..PLACE });
        assert!(reason.starts_with("is of another dataset"), "{reason}");
        for wrong in [[507, 501], [501, 501], [499, 501], [501, 510]] {
            let reason = read_bytes(&bytes_of(&wrong), 1000).unwrap_err();
            assert!(reason.ends_with("is out of order"), "{reason}");
        }
    }

    // Verifies REM-IO-005.
    #[test]
    fn each_kind_of_damage_is_named() {
        let whole = bytes_of(&[501, 507]);
        let reason = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = whole.clone();
            change(&mut bytes);
            read_bytes(&bytes, 1000).unwrap_err()
        };
        assert_eq!(reason(&|b| b.clear()), "is not a shard of a dataset");
        assert_eq!(reason(&|b| b.truncate(20)), "is truncated");
        assert_eq!(reason(&|b| b.truncate(9000)), format!("has 9000 bytes instead of {BYTES}"));
        for version in [1, 3] {
            let told = format!("is of version {version}; this reader understands 2");
            assert_eq!(reason(&|b| b[8] = version), told);
        }
        assert_eq!(reason(&|b| b[999] ^= 1), "is damaged: its CRC-32 does not match");
        let forged = |change: &dyn Fn(&mut Vec<u8>)| {
            reason(&|bytes| {
                bytes.truncate(BYTES - 4);
                change(bytes);
                bytes.extend(crc32fast::hash(bytes).to_le_bytes());
            })
        };
        let nan = |bytes: &mut Vec<u8>| bytes[9002..9006].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(forged(&nan), "scenario 507 holds what is no number");
        // A number of numbers that there cannot be.
        let many = |bytes: &mut Vec<u8>| bytes[47..49].copy_from_slice(&[0xff, 0x7f]);
        assert!(forged(&many).starts_with("holds a record that is none"), "{}", forged(&many));
    }

    /// A head that says that there are more records than bytes: nobody sets aside memory for them.
    #[test]
    fn more_records_than_bytes_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("shard");
        let tried = 1 << 16;
        let head = Head { dataset: PLACE.dataset, first: 500, tried, kept: tried, bytes: 8400 };
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        let mut bytes = postcard::to_extend(&head, bytes).unwrap();
        bytes.extend([0; 8404]);
        std::fs::write(&file, bytes).unwrap();
        let error = look(&file, Place { tried, ..PLACE }).unwrap_err().to_string();
        let reason = "shard: has 8400 bytes of records, too few for 65536";
        assert!(error.ends_with(reason), "{error}");
    }

    proptest! {
        /// One wrong byte anywhere is found.
        #[test]
        fn damage_is_found(at in 0usize..BYTES, bit in 0u32..8) {
            let mut bytes = bytes_of(&[501, 507]);
            bytes[at] ^= 1 << bit;
            prop_assert!(read_bytes(&bytes, 1000).is_err());
        }

        /// Forged records between a right head and a right CRC give an answer, and no panic.
        #[test]
        fn forged_records_are_answered(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let head = Head {
                dataset: PLACE.dataset, first: 500, tried: 10, kept: 2, bytes: bytes.len() as u64,
            };
            let mut forged = MAGIC.to_vec();
            forged.extend(VERSION.to_le_bytes());
            let mut forged = postcard::to_extend(&head, forged).unwrap();
            forged.extend(bytes);
            forged.extend(crc32fast::hash(&forged).to_le_bytes());
            prop_assert!(read_bytes(&forged, 1000).is_err());
        }
    }
}
