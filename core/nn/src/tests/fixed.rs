//! Codes, names and bits of answers, which stay from version to version.

use super::*;
use crate::error::{ModelError, NetworkError};
use crate::header::seen;
use crate::rows::{from, from_mut, rows, rows_mut};
use std::format;
use std::string::String;

#[test]
fn reasons_have_a_code_and_words_of_their_own() {
    let models = [
        ModelError::Magic,
        ModelError::Version,
        ModelError::Header,
        ModelError::Shape,
        ModelError::Missing,
        ModelError::Trailing,
        ModelError::Crc,
        ModelError::Unchecked,
    ];
    let networks = [
        NetworkError::Memory,
        NetworkError::Precision,
        NetworkError::Length,
        NetworkError::Nodes,
        NetworkError::Input,
        NetworkError::Output,
    ];
    assert_eq!(models.map(ModelError::code), [1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(networks.map(NetworkError::code), [101, 102, 103, 104, 105, 106]);
    let words = models.map(|error| format!("{error}")).into_iter();
    let words: Vec<String> = words.chain(networks.map(|error| format!("{error}"))).collect();
    let reasons = models.map(ModelError::reason).into_iter();
    let reasons: Vec<&str> = reasons.chain(networks.map(NetworkError::reason)).collect();
    assert_eq!(words, reasons);
    for (i, word) in words.iter().enumerate() {
        assert!(word.len() > 10 && !words[..i].contains(word), "{word}");
    }
}

/// Names and shapes, of which readers in other languages know.
#[test]
fn tensors_have_names_and_shapes() {
    let of = |precision: Precision, decoder: Decoder| {
        let header = header(precision, Layout::Fused, decoder, TINY);
        let (mut lines, mut bytes) = (Vec::new(), 0);
        tensors(&header, |tensor| {
            lines.push(format!("{} {}x{}", tensor.name, tensor.rows, tensor.columns));
            bytes += tensor.bytes();
        })
        .unwrap();
        (lines, bytes)
    };
    let (lines, bytes) = of(Precision::Int8, Decoder::Linear);
    let expected = [
        "input.mean 1x36",
        "input.std 1x36",
        "action.mean 1x6",
        "action.std 1x6",
        "embed.0.weight 36x12",
        "embed.0.bias 1x12",
        "node.embedding 3x12",
        "embed.norm.gain 1x12",
        "embed.norm.bias 1x12",
        "block.0.norm1.gain 1x12",
        "block.0.norm1.bias 1x12",
        "block.0.qkv.weight 36x12",
        "block.0.qkv.scale 1x36",
        "block.0.qkv.bias 1x36",
        "block.0.out.weight 12x12",
    ];
    assert_eq!(lines[..expected.len()], expected);
    let end = ["norm.gain 1x12", "norm.bias 1x12", "head.weight 6x12", "head.bias 1x6"];
    assert_eq!(lines[lines.len() - 4..], end);
    // Of 3 w^2 + w^2 + 4 w^2 + 4 w^2 weights a block one byte each, of everything else four.
    let others =
        2 * 36 + 2 * 6 + 37 * 12 + 3 * 12 + 2 * 12 + 2 * (4 * 12 + 2 * 9 * 12) + 2 * 12 + 13 * 6;
    assert_eq!(bytes, 2 * 12 * 144 + 4 * others);
    let (plain, four) = of(Precision::F32, Decoder::Linear);
    assert_eq!((plain.len(), four), (lines.len() - 8, 4 * (2 * 12 * 144 + others - 2 * 9 * 12)));
    let (flow, _) = of(Precision::F32, Decoder::Flow { steps: 3 });
    let end = [
        "flow.latent.weight 24x12",
        "flow.latent.bias 1x24",
        "flow.action.weight 7x24",
        "flow.hidden.weight 24x24",
        "flow.hidden.bias 1x24",
        "flow.out.weight 6x24",
        "flow.out.bias 1x6",
    ];
    assert_eq!(flow[flow.len() - 7..], end);
}

#[test]
fn dimensions_follow_from_the_header() {
    let shape = Shape { layers: 3, heads: 4, width: 20, nodes: 7, chunk: 3, action: 5 };
    let size =
        |layout| header(Precision::Int8, layout, Decoder::Linear, shape).dimensions().unwrap();
    let chunked = size(Layout::Chunked);
    assert_eq!((chunked.nodes, chunked.layers, chunked.heads, chunked.width), (7, 3, 4, 20));
    assert_eq!((chunked.head_width, chunked.action, chunked.actions), (5, 5, 15));
    assert_eq!((chunked.features, chunked.stride, chunked.tokens), (35, 3, 3));
    let fused = size(Layout::Fused);
    assert_eq!((fused.stride, fused.tokens, fused.features), (1, 7, 35));
    let separate = size(Layout::Separate);
    assert_eq!((separate.stride, separate.tokens, separate.features), (1, 34, 35));
    // Nodes that are seen are those before the last, a token for each stride.
    assert_eq!([0, 1, 2, 4, 5, 7].map(|nodes| seen(nodes, 3)), [0, 0, 1, 1, 2, 2]);
}

#[test]
fn rows_of_a_slice_end_with_it() {
    let mut data = [1, 2, 3, 4, 5, 6, 7];
    let all: Vec<&[i32]> = rows(&data, 3, 2).collect();
    assert_eq!(all, [&[1, 2][..], &[4, 5], &[7]]);
    assert_eq!(rows(&data, 0, 1).count(), 7);
    assert_eq!((from(&data, 5), from(&data, 7), from(&data, 9)), (&[6, 7][..], &[][..], &[][..]));
    rows_mut(&mut data, 3, 2).for_each(|row| row.fill(0));
    assert_eq!(data, [0, 0, 3, 0, 0, 6, 0]);
    from_mut(&mut data, 5).fill(9);
    assert_eq!(data, [0, 0, 3, 0, 0, 9, 9]);
    assert!(from_mut(&mut data, 8).is_empty());
}

fn answers<M: Storage + Default>(model: &Model, features: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut memory: Box<M> = heap();
    rollout(&mut Network::new(model, &mut *memory).unwrap(), features, 3)
}

/// Whoever changes the format or the arithmetic on purpose copies what this prints.
#[test]
fn answers_of_synthetic_models_have_fixed_bits() {
    let mut found = Vec::new();
    for precision in [Precision::Int8, Precision::F32] {
        for (layout, decoder) in variants() {
            let header = header(precision, layout, decoder, TINY);
            let bytes = file(&header, 5);
            let model = Model::open(&bytes).unwrap();
            let features = features(&header, 2);
            let actions = match precision {
                Precision::Int8 => answers::<Memory<2, 12, 14>>(&model, &features),
                Precision::F32 => answers::<ReferenceMemory<2, 12, 14>>(&model, &features),
            };
            let numbers: Vec<u8> = actions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            found.push(Crc32::of(&numbers));
        }
    }
    // A token for each node, in chunks of one or not, is the same network.
    let expected = [
        0x08a5_f868,
        0xfa0f_2c43,
        0xbd31_e92d,
        0xde9f_f074,
        0xbd31_e92d,
        0xde9f_f074,
        0xbcc7_687a,
        0x2740_0f38,
        0xaf4c_a19f,
        0x566b_1496,
        0xaf4c_a19f,
        0x566b_1496,
    ];
    let lines: Vec<String> = found.iter().map(|sum| format!("0x{sum:08x},")).collect();
    assert_eq!(found, expected, "\n{}", lines.join("\n"));
}
