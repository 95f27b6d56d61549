//! Memory in which bits flip: what is struck, when, and what becomes of it.

use super::*;

const SHAPE: Shape = Shape { layers: 2, heads: 2, width: 12, nodes: 5, chunk: 1, action: 6 };
type Quantised = Memory<2, 12, 5>;

/// The actions of a rollout with a strike, those that came; how often the memory was used, and
/// whether it was struck.
fn injected(bytes: &[u8], bit_flip: Option<BitFlip>) -> (Vec<Vec<u32>>, u32, bool) {
    let model = Model::open(bytes).unwrap();
    let mut memory = heap::<Quantised>();
    let mut faulty = FaultyMemory::new(&mut *memory, bit_flip);
    let mut network = Network::new(&model, &mut faulty).unwrap();
    let mut actions = Vec::new();
    for features in features(model.header(), 4) {
        let mut out = [0.0; ACTION];
        if network.act(&features, &mut out).is_ok() {
            assert!(out.iter().all(|x| x.is_finite()));
            actions.push(out.map(f32::to_bits).to_vec());
        }
    }
    (actions, faulty.calls(), faulty.is_injected())
}

fn model() -> Vec<u8> {
    file(&header(Precision::Int8, Layout::Fused, Decoder::Flow { steps: 2 }, SHAPE), 2)
}

#[test]
fn without_a_strike_nothing_changes() {
    let bytes = model();
    let (actions, calls, is_injected) = injected(&bytes, None);
    assert_eq!((calls, is_injected), (5 * (2 * 4 + 3), false));
    let model = Model::open(&bytes).unwrap();
    let mut memory = heap::<Quantised>();
    let mut network = Network::new(&model, &mut *memory).unwrap();
    let plain = rollout(&mut network, &features(model.header(), 4), 0);
    let bits = |action: &Vec<f32>| action.iter().map(|x| x.to_bits()).collect();
    assert_eq!(actions, plain.iter().map(bits).collect::<Vec<Vec<u32>>>());
}

/// At the second block of node 3, of which the cache holds what nodes 0 to 2 left.
#[test]
fn what_lives_across_blocks_matters_and_what_does_not_is_gone() {
    let bytes = model();
    let sound = injected(&bytes, None).0;
    let call = 3 * 11 + 5;
    let matters = [Part::Keys, Part::Values, Part::KeyScales, Part::ValueScales, Part::Residual];
    let gone = [Part::Normal, Part::Intermediate, Part::Quantised, Part::I16Operand, Part::Scores];
    for part in matters.into_iter().chain(gone) {
        let (actions, calls, is_injected) =
            injected(&bytes, Some(BitFlip { call, part, element: 1, bit: 30 }));
        assert_eq!((calls, is_injected), (55, true), "{part:?}");
        assert_eq!(actions[..3], sound[..3], "{part:?}");
        assert_eq!(actions == sound, gone.contains(&part), "{part:?}");
    }
    // The hidden state, between the final norm and the decoder.
    let hidden_state = BitFlip { call: 3 * 11 + 10, part: Part::Normal, element: 5, bit: 31 };
    assert_ne!(injected(&bytes, Some(hidden_state)).0, sound);
}

/// Between the steps of the second block of node 3: queries, what attention found, the wide layer.
#[test]
fn what_lives_within_a_block_matters() {
    let bytes = model();
    let sound = injected(&bytes, None).0;
    for (step, lives) in [(1, Part::Intermediate), (2, Part::Normal), (3, Part::Intermediate)] {
        for part in [Part::Intermediate, Part::Normal, Part::Residual] {
            let call = 3 * 11 + 5 + step;
            let (actions, _, is_injected) =
                injected(&bytes, Some(BitFlip { call, part, element: 1, bit: 30 }));
            assert!(is_injected);
            assert_eq!(actions[..3], sound[..3], "{step} {part:?}");
            if part == lives || part == Part::Residual {
                assert_ne!(actions, sound, "{step} {part:?}");
            }
        }
    }
}

#[test]
fn a_strike_elsewhere_or_later_does_nothing() {
    let bytes = model();
    let sound = injected(&bytes, None).0;
    let bit_flip = BitFlip { call: 55, part: Part::Residual, element: 0, bit: 30 };
    assert_eq!(injected(&bytes, Some(bit_flip)), (sound.clone(), 55, false));
    let bit_flip = BitFlip { call: 7, part: Part::Keys, element: usize::MAX, bit: 30 };
    assert_eq!(injected(&bytes, Some(bit_flip)), (sound, 55, false));
}

#[test]
fn every_bit_of_a_number_can_flip() {
    for bit in 0..8 {
        assert_eq!(0u8.flipped(bit), 1 << bit);
        assert_eq!(0u8.flipped(bit + 8), 1 << bit);
    }
    assert_eq!(1.0f32.flipped(31), -1.0);
    assert_eq!(1.0f32.flipped(30), f32::INFINITY);
    assert_eq!(0.0f32.flipped(0), f32::from_bits(1));
}
