//! Batches, kernels, refusals of a network.

use super::*;

const SHAPE: Shape = Shape { layers: 2, heads: 3, width: 48, nodes: 6, chunk: 5, action: 6 };
type Room = Memory<2, 48, 29>;

fn with_network<R>(
    header: &Header,
    seed: u64,
    run: impl FnOnce(&mut Network<'_, '_, Room>, &[Vec<f32>]) -> R,
) -> R {
    let bytes = file(header, seed);
    let model = Model::open(&bytes).unwrap();
    let mut memory = heap::<Room>();
    run(&mut Network::new(&model, &mut *memory).unwrap(), &features(header, seed))
}

// Verifies REM-LRN-004.
#[test]
fn every_kernel_has_the_same_bits() {
    for (layout, decoder) in variants() {
        let header = header(Precision::Int8, layout, decoder, SHAPE);
        with_network(&header, 2, |network, features| {
            let best = rollout(network, features, 1);
            for kernel in Kernel::available() {
                network.use_kernel(kernel);
                assert_eq!(rollout(network, features, 1), best, "{}", kernel.name());
            }
        });
    }
}

#[test]
fn a_token_alone_has_the_bits_of_a_batch() {
    for decoder in [Decoder::Linear, Decoder::Flow { steps: 1 }] {
        let header = header(Precision::Int8, Layout::Separate, decoder, SHAPE);
        with_network(&header, 3, |network, features| {
            let batched = rollout(network, features, 4);
            network.begin(4);
            for (features, batched) in features.iter().zip(batched) {
                let mut alone = vec![0.0; batched.len()];
                network.act_one_by_one(features, &mut alone).unwrap();
                assert_eq!(alone, batched);
            }
        });
    }
}

// Verifies REM-LRN-005.
#[test]
fn a_roll_out_depends_on_nothing_before_it() {
    let header = header(Precision::Int8, Layout::Separate, Decoder::Flow { steps: 2 }, SHAPE);
    with_network(&header, 4, |network, features| {
        let first = rollout(network, features, 1);
        assert_ne!(rollout(network, features, 2), first);
        network.begin(7);
        network.observe(&features[0]).unwrap();
        assert_eq!(rollout(network, features, 1), first);
        network.set_flow_steps(Some(5));
        assert_ne!(rollout(network, features, 1), first);
        network.set_flow_steps(None);
        assert_eq!(rollout(network, features, 1), first);
    });
}

#[test]
fn a_node_observed_is_a_node_known() {
    let header = header(Precision::Int8, Layout::Separate, Decoder::Linear, SHAPE);
    with_network(&header, 4, |network, features| {
        let all = rollout(network, features, 0);
        network.begin(0);
        for features in &features[..5] {
            network.observe(features).unwrap();
        }
        let mut last = vec![0.0; 30];
        network.act(&features[5], &mut last).unwrap();
        assert_eq!(last, all[5]);
    });
}

#[test]
fn the_first_previous_action_is_not_looked_at() {
    let header = header(Precision::Int8, Layout::Separate, Decoder::Linear, SHAPE);
    with_network(&header, 5, |network, features| {
        let usual = rollout(network, features, 0);
        let mut others = features.to_vec();
        others[0][..6].fill(f32::NAN);
        assert_eq!(rollout(network, &others, 0), usual);
    });
}

#[test]
fn what_is_not_a_number_is_an_error() {
    let header = header(Precision::Int8, Layout::Separate, Decoder::Linear, SHAPE);
    with_network(&header, 5, |network, features| {
        let mut out = vec![0.0; 30];
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut features = features[0].clone();
            features[20] = odd;
            network.begin(0);
            assert_eq!(network.act(&features, &mut out), Err(NetworkError::Input));
        }
        // Finite, but beyond what single precision can square.
        let mut huge = features[0].clone();
        huge[20] = 1e30;
        network.begin(0);
        assert_eq!(network.act(&huge, &mut out), Err(NetworkError::Output));
    });
}

#[test]
fn wrong_lengths_too_many_nodes_and_little_memory_are_refused() {
    let header = header(Precision::Int8, Layout::Fused, Decoder::Linear, SHAPE);
    with_network(&header, 6, |network, features| {
        let mut out = vec![0.0; 30];
        assert_eq!(network.act(&features[0][1..], &mut out), Err(NetworkError::Length));
        assert_eq!(network.act(&features[0], &mut out[1..]), Err(NetworkError::Length));
        rollout(network, features, 0);
        assert_eq!(network.node(), 6);
        assert_eq!(network.act(&features[0], &mut out), Err(NetworkError::Nodes));
    });
    let bytes = file(&header, 6);
    let model = Model::open(&bytes).unwrap();
    fn refusal<M: Storage + Default>(model: &Model) -> Option<NetworkError> {
        Network::new(model, &mut *heap::<M>()).err()
    }
    assert_eq!(refusal::<Memory<2, 48, 6>>(&model), None);
    assert_eq!(refusal::<Memory<3, 64, 7>>(&model), None);
    assert_eq!(refusal::<Memory<1, 48, 6>>(&model), Some(NetworkError::Memory));
    assert_eq!(refusal::<Memory<2, 47, 6>>(&model), Some(NetworkError::Memory));
    assert_eq!(refusal::<Memory<2, 48, 5>>(&model), Some(NetworkError::Memory));
    assert_eq!(refusal::<ReferenceMemory<2, 48, 6>>(&model), Some(NetworkError::Precision));
}

/// Six nodes in chunks of five are seen twice, and take the memory of two tokens.
#[test]
fn a_chunk_is_one_token() {
    let header = header(Precision::Int8, Layout::Chunked, Decoder::Linear, SHAPE);
    let bytes = file(&header, 6);
    let model = Model::open(&bytes).unwrap();
    let features = features(&header, 6);
    assert_eq!((features.len(), model.dimensions().tokens), (2, 2));
    let mut memory = heap::<Memory<2, 48, 2>>();
    let mut network = Network::new(&model, &mut *memory).unwrap();
    let actions = rollout(&mut network, &features, 0);
    assert_eq!((network.node(), actions[0].len()), (10, 5 * 6));
    let mut out = vec![0.0; 30];
    assert_eq!(network.act(&features[0], &mut out), Err(NetworkError::Nodes));
}

/// Room to spare changes nothing.
#[test]
fn memory_may_be_larger_than_the_model() {
    let header = header(Precision::Int8, Layout::Separate, Decoder::Linear, SHAPE);
    let bytes = file(&header, 7);
    let model = Model::open(&bytes).unwrap();
    let features = features(&header, 7);
    let (mut exact, mut large) = (heap::<Room>(), heap::<Memory<4, 96, 299>>());
    let exact = rollout(&mut Network::new(&model, &mut *exact).unwrap(), &features, 0);
    assert_eq!(rollout(&mut Network::new(&model, &mut *large).unwrap(), &features, 0), exact);
}

/// The bars of a small flight computer: the default's memory, and room for weights.
#[test]
fn the_small_model_fits_a_small_computer() {
    const { assert!(Memory::<4, 128, 60>::BYTES <= 128 << 10) };
    let shape = Shape { layers: 4, heads: 4, width: 128, nodes: 60, chunk: 1, action: 6 };
    for decoder in [Decoder::Linear, Decoder::Flow { steps: 1 }] {
        let header = header(Precision::Int8, Layout::Fused, decoder, shape);
        assert!(file(&header, 0).len() <= 1 << 20);
    }
}
