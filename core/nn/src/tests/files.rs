//! Files that are not what they should be: refused, and nothing worse.

use super::*;
use proptest::prelude::*;
use std::string::ToString;

fn tiny(precision: Precision) -> Vec<u8> {
    file(&header(precision, Layout::Separate, Decoder::Flow { steps: 1 }, TINY), 1)
}

fn refusal(bytes: &[u8]) -> Option<ModelError> {
    Model::open(bytes).err()
}

#[test]
fn a_sound_file_is_opened_wherever_it_lies() {
    for precision in [Precision::Int8, Precision::F32] {
        let bytes = tiny(precision);
        for shift in 0..4 {
            let mut moved = vec![0; shift];
            moved.extend(&bytes);
            let model = Model::open(&moved[shift..]).unwrap();
            assert_eq!(model.header().precision, precision);
            assert_eq!(model.dimensions().tokens, 14);
        }
    }
}

// Verifies REM-LRN-002.
#[test]
fn a_file_cut_anywhere_is_refused() {
    for precision in [Precision::Int8, Precision::F32] {
        let bytes = tiny(precision);
        for length in 0..bytes.len() {
            assert!(refusal(&bytes[..length]).is_some(), "{length}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert_eq!(refusal(&longer), Some(ModelError::Trailing));
        assert_eq!(refusal(&bytes[..bytes.len() - 1]), Some(ModelError::Missing));
    }
}

// Verifies REM-LRN-001.
#[test]
fn a_flipped_bit_is_refused_wherever_it_is() {
    let mut bytes = tiny(Precision::Int8);
    for at in 0..bytes.len() {
        for bit in 0..8 {
            bytes[at] ^= 1 << bit;
            assert!(refusal(&bytes).is_some(), "byte {at} bit {bit}");
            bytes[at] ^= 1 << bit;
        }
    }
    assert_eq!(refusal(&bytes), None);
}

#[test]
fn each_refusal_has_its_reason() {
    let good = tiny(Precision::Int8);
    let with = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        refusal(&bytes)
    };
    assert_eq!(with(0, b'x'), Some(ModelError::Magic));
    assert_eq!(with(4, 3), Some(ModelError::Version));
    assert_eq!(with(5, 9), Some(ModelError::Header));
    assert_eq!(with(good.len() - 1, !good[good.len() - 1]), Some(ModelError::Crc));
    assert_eq!(with(good.len() - 5, !good[good.len() - 5]), Some(ModelError::Crc));
    assert_eq!(refusal(b""), Some(ModelError::Magic));
    assert_eq!(refusal(b"RMRN"), Some(ModelError::Version));
    assert_eq!(ModelError::Crc.code(), 7);
    assert_eq!(NetworkError::Output.code(), 106);
    assert_eq!(ModelError::Crc.to_string(), "has a wrong checksum");
}

#[test]
fn shapes_beyond_the_limits_are_refused() {
    let sound = header(Precision::Int8, Layout::Separate, Decoder::Flow { steps: 1 }, TINY);
    let changed = |change: &dyn Fn(&mut Header)| {
        let mut header = sound.clone();
        change(&mut header);
        let mut bytes = vec![0; 4096];
        let length = write_header(&header, &mut bytes).unwrap();
        assert_eq!(synthetic_model(&header, 0, &mut bytes), None);
        refusal(&bytes[..length + 4])
    };
    assert_eq!(changed(&|_| {}), Some(ModelError::Missing));
    let wrong: [&dyn Fn(&mut Header); 18] = [
        &|h| h.width = 0,
        &|h| h.width = 1032,
        &|h| h.heads = 0,
        &|h| h.heads = 12,
        &|h| h.heads = 5,
        &|h| h.layers = 0,
        &|h| h.layers = 17,
        &|h| h.nodes = 0,
        &|h| h.nodes = 1025,
        &|h| h.chunk = 0,
        &|h| h.chunk = 9,
        &|h| (h.version, h.action) = (2, 0),
        &|h| (h.version, h.action) = (2, 51),
        &|h| (h.version, h.action, h.chunk) = (2, 10, 6),
        &|h| (h.version, h.action, h.chunk) = (2, 7, 8),
        &|h| h.decoder = Decoder::Flow { steps: 0 },
        &|h| h.layout = Layout::Fused,
        &|h| h.token_types[2] = 129,
    ];
    for change in wrong {
        assert_eq!(changed(change), Some(ModelError::Shape));
    }
}

/// What three joints need is written as it always was; another number stands behind the header.
#[test]
fn the_second_version_says_how_many_numbers_an_action_has() {
    for (action, version) in [(4, 2), (5, 2), (6, 1), (10, 2)] {
        let shape = Shape { action, ..TINY };
        let header = header(Precision::Int8, Layout::Fused, Decoder::Linear, shape);
        assert_eq!(header.version, version);
        let bytes = file(&header, 1);
        let model = Model::open(&bytes).unwrap();
        assert_eq!(model.header(), &header);
        assert_eq!(model.dimensions().action, usize::from(action));
    }
    // Six numbers may be said to be six.
    let header =
        Header { version: 2, ..header(Precision::F32, Layout::Fused, Decoder::Linear, TINY) };
    assert_eq!(Model::open(&file(&header, 1)).unwrap().header(), &header);
    // The first version has no room for another number.
    let odd = Header { version: 1, action: 5, ..header };
    assert_eq!(odd.dimensions(), Err(ModelError::Shape));
    assert_eq!(synthetic_model(&odd, 1, &mut vec![0; 1 << 16]), None);
}

proptest! {
    // Verifies REM-LRN-002.
    #[test]
    fn any_bytes_are_opened_or_refused(mut bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = refusal(&bytes);
        let good = tiny(Precision::Int8);
        for (byte, good) in bytes.iter_mut().zip(&good).take(6) {
            *byte = *good;
        }
        let _ = refusal(&bytes);
    }

    /// A file whose checksum is right may still hold anything: whatever it is, it is acted upon
    /// without a panic, and what comes out is finite or an error.
    #[test]
    fn any_weights_are_acted_upon(
        seed: u64, changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..200),
    ) {
        for precision in [Precision::Int8, Precision::F32] {
            let header = header(precision, Layout::Separate, Decoder::Flow { steps: 1 }, TINY);
            let mut bytes = file(&header, seed);
            let mut all = 0;
            tensors(&header, |tensor| all += tensor.bytes()).unwrap();
            let end = bytes.len() - 4;
            for (at, byte) in &changes {
                bytes[end - all + at.index(all)] = *byte;
            }
            let crc = Crc32::of(&bytes[..end]);
            bytes[end..].copy_from_slice(&crc.to_le_bytes());
            let model = Model::open(&bytes).unwrap();
            let features = features(&header, seed);
            let (mut int8, mut float) = (Memory::<2, 12, 14>::new(), ReferenceMemory::<2, 12, 14>::new());
            fn run<M: Storage>(mut network: Network<'_, '_, M>, features: &[Vec<f32>]) {
                let mut out = [0.0; 6];
                for features in features {
                    let sound = network.act(features, &mut out).is_ok();
                    assert_eq!(sound, out.iter().all(|x| x.is_finite()));
                }
            }
            match precision {
                Precision::Int8 => run(Network::new(&model, &mut int8).unwrap(), &features),
                Precision::F32 => run(Network::new(&model, &mut float).unwrap(), &features),
            }
        }
    }
}
