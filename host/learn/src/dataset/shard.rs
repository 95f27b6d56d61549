//! Shards: the trajectories of a run of scenarios, in one file with a checksum.

use super::Trajectory;
use remora_host::error::{Error, io_reason};
use remora_host::formats::write_atomically;
use std::fs::File;
use std::io::Read;
use std::path::Path;

const MAGIC: &[u8; 8] = b"REMORA\0D";
const VERSION: u32 = 1;
/// Size of [`Head`] in the file, and of the CRC at the end [bytes].
const HEAD_BYTES: usize = 32;
const CRC_BYTES: usize = 4;

/// The first bytes of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    /// Index of the first scenario that was tried.
    pub first: u64,
    /// How many were tried.
    pub tried: u32,
    /// How many of them were kept: the number of records.
    pub kept: u32,
}

impl Head {
    fn encode<const NL: usize>(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend(VERSION.to_le_bytes());
        out.extend((Trajectory::<NL>::BYTES as u32).to_le_bytes());
        out.extend(self.first.to_le_bytes());
        out.extend(self.tried.to_le_bytes());
        out.extend(self.kept.to_le_bytes());
        out
    }

    /// The head of a shard, where it is one of this format, of an arm of so many joints; otherwise the
    /// reason.
    fn decode<const NL: usize>(bytes: &[u8]) -> Result<Self, String> {
        let mut words = bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut word = || words.next().ok_or("is truncated");
        if !bytes.starts_with(MAGIC) {
            return Err("is not a shard of a dataset".into());
        }
        let (_, _, version, record) = (word()?, word()?, word()?, word()?);
        if version != VERSION {
            return Err(format!("is of version {version}; this reader understands {VERSION}"));
        }
        if record as usize != Trajectory::<NL>::BYTES {
            let expected = Trajectory::<NL>::BYTES;
            return Err(format!("has records of {record} bytes; a trajectory has {expected}"));
        }
        let (low, high) = (u64::from(word()?), u64::from(word()?));
        Ok(Self { first: high << 32 | low, tried: word()?, kept: word()? })
    }

    /// Size of the file that it heads [bytes].
    fn file_bytes<const NL: usize>(&self) -> u64 {
        (HEAD_BYTES + CRC_BYTES) as u64 + u64::from(self.kept) * Trajectory::<NL>::BYTES as u64
    }

    /// Refuses a shard that stands in the place of another.
    fn check(&self, first: u64, tried: u32) -> Result<(), String> {
        if (self.first, self.tried) != (first, tried) || self.kept > tried {
            return Err(format!(
                "holds {} of {} scenarios from {} on; expected {tried} from {first} on",
                self.kept, self.tried, self.first
            ));
        }
        Ok(())
    }
}

/// Writes a shard whole or not at all: the trajectories, in order of their scenarios, of
/// `tried` scenarios from `first` on.
pub(super) fn write<const NL: usize>(
    file: &Path,
    first: u64,
    tried: u32,
    trajectories: &[Trajectory<NL>],
) -> Result<(), Error> {
    let mut bytes = Head { first, tried, kept: trajectories.len() as u32 }.encode::<NL>();
    bytes.reserve(trajectories.len() * Trajectory::<NL>::BYTES + CRC_BYTES);
    trajectories.iter().for_each(|trajectory| trajectory.encode(&mut bytes));
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    write_atomically(file, &bytes)
}

/// Reads the head of the shard of `tried` scenarios from `first` on, and compares the file's size
/// with it. `None` where there is no such file.
pub(super) fn look<const NL: usize>(
    file: &Path,
    first: u64,
    tried: u32,
) -> Result<Option<Head>, Error> {
    let failed = |cause: std::io::Error| Error::input(file, "", io_reason(&cause));
    let mut handle = match File::open(file) {
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        opened => opened.map_err(failed)?,
    };
    let mut bytes = Vec::new();
    handle.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut bytes).map_err(failed)?;
    let size = handle.metadata().map_err(failed)?.len();
    let head = checked_head::<NL>(&bytes, size, first, tried);
    head.map(Some).map_err(|reason| Error::input(file, "", reason))
}

fn checked_head<const NL: usize>(
    bytes: &[u8],
    size: u64,
    first: u64,
    tried: u32,
) -> Result<Head, String> {
    let head = Head::decode::<NL>(bytes)?;
    head.check(first, tried)?;
    let expected = head.file_bytes::<NL>();
    if size != expected {
        return Err(format!("has {size} bytes instead of {expected}"));
    }
    Ok(head)
}

/// As [`look`], and reads every byte.
pub(super) fn verify<const NL: usize>(
    file: &Path,
    first: u64,
    tried: u32,
) -> Result<Option<Head>, Error> {
    let head = look::<NL>(file, first, tried)?;
    if head.is_some() {
        read::<NL>(file, first, tried, first, &mut Vec::new())?;
    }
    Ok(head)
}

/// Adds the trajectories of a whole shard to `out`; those of scenarios from `end` on are left out.
pub(super) fn read<const NL: usize>(
    file: &Path,
    first: u64,
    tried: u32,
    end: u64,
    out: &mut Vec<Trajectory<NL>>,
) -> Result<(), Error> {
    let bytes = std::fs::read(file).map_err(|cause| Error::input(file, "", io_reason(&cause)))?;
    decode(&bytes, first, tried, end, out).map_err(|reason| Error::input(file, "", reason))
}

fn decode<const NL: usize>(
    bytes: &[u8],
    first: u64,
    tried: u32,
    end: u64,
    out: &mut Vec<Trajectory<NL>>,
) -> Result<(), String> {
    checked_head::<NL>(bytes, bytes.len() as u64, first, tried)?;
    let (body, crc) = bytes.split_last_chunk().ok_or("is truncated")?;
    if crc32fast::hash(body) != u32::from_le_bytes(*crc) {
        return Err("is damaged: its CRC-32 does not match".into());
    }
    let records = body.get(HEAD_BYTES..).unwrap_or_default().chunks_exact(Trajectory::<NL>::BYTES);
    let mut next = first;
    for trajectory in records.filter_map(Trajectory::decode) {
        let scenario = trajectory.scenario;
        if scenario < next || scenario >= first + u64::from(tried) {
            return Err(format!("scenario {scenario} is out of order"));
        }
        next = scenario + 1;
        if scenario < end {
            out.push(trajectory);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::trajectory::tests::counting;
    use super::*;
    use proptest::prelude::*;
    use remora_core::advanced::stages::LINKS;

    fn bytes_of(indices: &[u64]) -> Vec<u8> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("shard");
        let trajectories: Vec<_> = indices.iter().map(|i| counting::<LINKS>(*i)).collect();
        write(&file, 500, 10, &trajectories).unwrap();
        assert_eq!(look::<LINKS>(&file, 500, 10).unwrap().map(|head| head.kept), Some(2));
        std::fs::read(file).unwrap()
    }

    fn read_bytes(bytes: &[u8], end: u64) -> Result<Vec<u64>, String> {
        let mut out = Vec::<Trajectory>::new();
        decode(bytes, 500, 10, end, &mut out)?;
        Ok(out.iter().map(|t| t.scenario).collect())
    }

    #[test]
    fn a_shard_survives_a_round_trip_and_is_cut_at_the_limit() {
        let bytes = bytes_of(&[501, 507]);
        assert_eq!(bytes.len(), 36 + 2 * 8420);
        assert_eq!(read_bytes(&bytes, 1000).unwrap(), [501, 507]);
        assert_eq!(read_bytes(&bytes, 507).unwrap(), [501]);
    }

    #[test]
    fn another_shard_or_another_order_is_refused() {
        let bytes = bytes_of(&[501, 507]);
        let mut out = Vec::<Trajectory>::new();
        let reason = decode(&bytes, 1000, 10, 2000, &mut out).unwrap_err();
        assert_eq!(reason, "holds 2 of 10 scenarios from 500 on; expected 10 from 1000 on");
        for wrong in [[507, 501], [501, 501], [499, 501], [501, 510]] {
            let reason = read_bytes(&bytes_of(&wrong), 1000).unwrap_err();
            assert!(reason.ends_with("is out of order"), "{reason}");
        }
    }

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
        assert_eq!(reason(&|b| b.truncate(9000)), "has 9000 bytes instead of 16876");
        assert_eq!(reason(&|b| b[8] = 2), "is of version 2; this reader understands 1");
        assert_eq!(reason(&|b| b[12] = 0), "has records of 8192 bytes; a trajectory has 8420");
        assert_eq!(reason(&|b| b[999] ^= 1), "is damaged: its CRC-32 does not match");
        let mut out = Vec::<Trajectory<2>>::new();
        let reason = decode(&whole, 500, 10, 1000, &mut out).unwrap_err();
        assert_eq!(reason, "has records of 8420 bytes; a trajectory has 7700");
    }

    proptest! {
        /// One wrong byte anywhere is found.
        #[test]
        fn damage_is_found(at in 0usize..36 + 2 * 8420, bit in 0u32..8) {
            let mut bytes = bytes_of(&[501, 507]);
            bytes[at] ^= 1 << bit;
            prop_assert!(read_bytes(&bytes, 1000).is_err());
        }
    }
}
