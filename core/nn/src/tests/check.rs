//! A file checked in slices: the verdict of one pass, whatever the slices.

use super::*;
use proptest::prelude::*;

fn tiny() -> Vec<u8> {
    file(&header(Precision::Int8, Layout::Fused, Decoder::Linear, TINY), 1)
}

/// Steps to the end by slices of the given lengths, over and over.
fn checked<'a>(bytes: &'a [u8], slices: &[usize]) -> Check<'a> {
    let mut check = Check::new(bytes);
    let mut lengths = slices.iter().cycle();
    while check.verdict().is_none() {
        let (before, most) = (check.left(), *lengths.next().unwrap());
        let verdict = check.step(most);
        assert_eq!(check.left(), before - most.min(before));
        assert_eq!(verdict, check.verdict());
        assert_eq!(verdict.is_some(), check.left() == 0);
    }
    check
}

// Verifies REM-LRN-006.
#[test]
fn what_was_not_checked_to_its_end_is_not_opened() {
    let bytes = tiny();
    let mut check = Check::new(&bytes);
    for most in [0, 1, 0, bytes.len() - 6] {
        assert_eq!(check.step(most), None);
        assert_eq!(check.open().err(), Some(ModelError::Unchecked));
    }
    assert_eq!(check.left(), 1);
    assert_eq!(check.step(0), None);
    assert_eq!(check.step(usize::MAX), Some(Ok(())));
    assert_eq!(check.step(usize::MAX), Some(Ok(())));
    let model = check.open().unwrap();
    assert_eq!(model.checksum(), Model::open(&bytes).unwrap().checksum());
    check.restart();
    assert_eq!((check.left(), check.verdict()), (bytes.len() - 4, None));
    assert_eq!(ModelError::Unchecked.code(), 8);
}

#[test]
fn a_file_without_room_for_a_checksum_is_refused_at_once() {
    for length in 0..4 {
        let mut check = Check::new(&b"RMRN"[..length]);
        assert_eq!(check.verdict(), Some(Err(ModelError::Missing)));
        assert_eq!(check.step(1), Some(Err(ModelError::Missing)));
        assert_eq!(check.open().err(), Model::open(&b"RMRN"[..length]).err());
    }
}

#[test]
fn a_flipped_bit_is_found_wherever_it_is() {
    let mut bytes = tiny();
    for at in 0..bytes.len() {
        for bit in 0..8 {
            bytes[at] ^= 1 << bit;
            let check = checked(&bytes, &[1 + at % 300, 0]);
            assert_eq!(check.verdict(), Some(Err(ModelError::Crc)), "byte {at} bit {bit}");
            assert!(check.open().is_err());
            bytes[at] ^= 1 << bit;
        }
    }
    assert_eq!(checked(&bytes, &[7]).verdict(), Some(Ok(())));
}

/// What has been looked at already may change behind the check's back: the next one finds it.
#[test]
fn a_check_begun_anew_finds_what_has_changed_since() {
    let sound = tiny();
    let mut bytes = sound.clone();
    assert_eq!(checked(&bytes, &[64]).verdict(), Some(Ok(())));
    bytes[sound.len() / 2] ^= 4;
    assert_eq!(checked(&bytes, &[64]).verdict(), Some(Err(ModelError::Crc)));
}

proptest! {
    // Verifies REM-LRN-006.
    #[test]
    fn slices_come_to_the_verdict_of_one_pass(
        slices in proptest::collection::vec(0..700usize, 1..20),
        cut in 0..40usize,
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3),
    ) {
        let mut bytes = tiny();
        bytes.truncate(bytes.len() - cut.saturating_sub(20));
        for (at, byte) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *byte;
        }
        let mut slices = slices;
        slices.push(1);
        let check = checked(&bytes, &slices);
        let (whole, sliced) = (Model::open(&bytes), check.open());
        prop_assert_eq!(whole.as_ref().err(), sliced.as_ref().err());
        // The header is looked at first: a file may be refused for it with a sound checksum.
        prop_assert!(check.verdict() == Some(Ok(())) || whole.is_err());
    }
}
