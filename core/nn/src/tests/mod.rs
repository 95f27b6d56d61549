//! The network as a whole: against a plain reference, against itself in other batches and with
//! other kernels, and against files that are not what they should be.

extern crate std;

mod bit_flip;
mod check;
mod exhaustive;
mod files;
mod fixed;
mod inference;
mod reference;

use super::*;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

/// A header for tests.
#[derive(Clone, Copy)]
struct Shape {
    layers: u16,
    heads: u16,
    width: u16,
    nodes: u16,
    chunk: u16,
    action: u16,
}

const TINY: Shape = Shape { layers: 2, heads: 2, width: 12, nodes: 3, chunk: 1, action: 6 };

fn header(precision: Precision, layout: Layout, decoder: Decoder, shape: Shape) -> Header {
    let token_types: &[u16] = match layout {
        Layout::Separate => &[shape.action, 1, 7, 9, 13],
        Layout::Fused | Layout::Chunked => &[30 + shape.action],
    };
    Header {
        version: Header::version_of(shape.action),
        precision,
        layout,
        inputs: 0,
        outputs: 0,
        decoder,
        chunk: shape.chunk,
        nodes: shape.nodes,
        layers: shape.layers,
        heads: shape.heads,
        width: shape.width,
        token_types: heapless::Vec::from_slice(token_types).unwrap(),
        provenance: Provenance { seed: 3, ..Provenance::default() },
        action: shape.action,
    }
}

/// Every combination of layout and decoder.
fn variants() -> impl Iterator<Item = (Layout, Decoder)> {
    [Layout::Separate, Layout::Fused, Layout::Chunked]
        .into_iter()
        .flat_map(|l| [(l, Decoder::Linear), (l, Decoder::Flow { steps: 3 })])
}

fn file(header: &Header, seed: u64) -> Vec<u8> {
    let mut bytes = vec![0; 1 << 23];
    let length = synthetic_model(header, seed, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// Features of all nodes that are seen.
fn features(header: &Header, seed: u64) -> Vec<Vec<f32>> {
    let size = header.dimensions().unwrap();
    let numbers = |node: usize| {
        let pairs = (0..size.features).map(|i| noise::normal_pair(seed, (100 * node + i) as u64));
        pairs.map(|[x, _]| x).collect()
    };
    (0..size.nodes).step_by(size.stride).map(numbers).collect()
}

/// Memory on the heap, with its bits as they come from there.
fn heap<M: Default>() -> Box<M> {
    Box::default()
}

/// The actions of a whole rollout.
fn rollout<M: Storage>(
    network: &mut Network<'_, '_, M>,
    features: &[Vec<f32>],
    seed: u64,
) -> Vec<Vec<f32>> {
    network.begin(seed);
    let actions = network.model().dimensions().actions;
    let act = |features: &Vec<f32>| {
        let mut out = vec![0.0; actions];
        network.act(features, &mut out).unwrap();
        out
    };
    features.iter().map(act).collect()
}
