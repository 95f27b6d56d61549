//! The network written down plainly in double precision: tensors by their names, all tokens at
//! once, attention over the whole sequence without any cache.

use super::*;
use std::collections::HashMap;
use std::string::{String, ToString};
use std::{format, println};

struct Tensors(HashMap<String, (usize, Vec<f64>)>);

impl Tensors {
    /// The tensors of a file, from its end backwards; bytes as they are.
    fn new(header: &Header, bytes: &[u8]) -> Self {
        let mut all = Vec::new();
        tensors(header, |tensor| all.push(tensor)).unwrap();
        let length: usize = all.iter().map(Tensor::bytes).sum();
        let mut at = bytes.len() - 4 - length;
        let mut map = HashMap::new();
        for tensor in all {
            let bytes = &bytes[at..at + tensor.bytes()];
            at += tensor.bytes();
            let numbers = match tensor.element {
                TensorElement::Int8 => bytes.iter().map(|b| f64::from(*b as i8)).collect(),
                TensorElement::F32 => {
                    let chunks = bytes.as_chunks::<4>().0.iter();
                    chunks.map(|b| f64::from(f32::from_le_bytes(*b))).collect()
                }
            };
            map.insert(tensor.name.to_string(), (tensor.columns, numbers));
        }
        Self(map)
    }

    fn get(&self, name: &str) -> &[f64] {
        &self.0[name].1
    }

    fn linear(&self, name: &str, x: &[f64]) -> Vec<f64> {
        let (columns, weights) = &self.0[&format!("{name}.weight")];
        let scales = self.0.get(&format!("{name}.scale"));
        let row = |(r, (w, b)): (usize, (&[f64], &f64))| {
            let scale = scales.map_or(1.0, |(_, scales)| scales[r]);
            scale * w.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() + b
        };
        assert_eq!(x.len(), *columns);
        let bias = self.get(&format!("{name}.bias"));
        weights.chunks(*columns).zip(bias).enumerate().map(row).collect()
    }

    fn norm(&self, name: &str, x: &[f64]) -> Vec<f64> {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let (gain, bias) = (self.get(&format!("{name}.gain")), self.get(&format!("{name}.bias")));
        let one = |((x, g), b): ((&f64, &f64), &f64)| (x - mean) / (variance + 1e-5).sqrt() * g + b;
        x.iter().zip(gain).zip(bias).map(one).collect()
    }
}

/// The actions at every node.
fn actions(header: &Header, bytes: &[u8], features: &[Vec<f32>], seed: u64) -> Vec<Vec<f64>> {
    let t = Tensors::new(header, bytes);
    let (mut tokens, mut states) = (Vec::new(), Vec::new());
    let stride = header.dimensions().unwrap().stride;
    for (seen, features) in features.iter().enumerate() {
        let node = seen * stride;
        let mut at = 0;
        for (token_type, inputs) in
            header.token_types.iter().map(|inputs| usize::from(*inputs)).enumerate()
        {
            let range = at..at + inputs;
            at += inputs;
            let previous = header.layout == Layout::Separate && token_type == 0;
            if previous && node == 0 {
                continue;
            }
            let mut x = t.get(&format!("embed.{token_type}.bias")).to_vec();
            let width = x.len();
            let place = if previous { node - 1 } else { node };
            for (i, x) in x.iter_mut().enumerate() {
                for (j, f) in range.clone().enumerate() {
                    let (mean, std) = (t.get("input.mean")[f], t.get("input.std")[f]);
                    let weight = t.get(&format!("embed.{token_type}.weight"))[j * width + i];
                    *x += weight * (f64::from(features[f]) - mean) / std;
                }
                *x += t.get("node.embedding")[place * width + i];
            }
            tokens.push(t.norm("embed.norm", &x));
        }
        states.push(tokens.len() - 1);
    }
    for layer in 0..usize::from(header.layers) {
        block(&t, &format!("block.{layer}"), usize::from(header.heads), &mut tokens);
    }
    let action = usize::from(header.action);
    let decode = |(seen, state): (usize, &usize)| {
        let hidden_state = t.norm("norm", &tokens[*state]);
        let z = match header.decoder {
            Decoder::Linear => t.linear("head", &hidden_state),
            Decoder::Flow { steps } => {
                flow(&t, &hidden_state, usize::from(steps), noise(action, seen * stride, seed))
            }
        };
        let raw = |(i, z): (usize, &f64)| {
            t.get("action.mean")[i % action] + t.get("action.std")[i % action] * z
        };
        z.iter().enumerate().map(raw).collect()
    };
    states.iter().enumerate().map(decode).collect()
}

fn block(t: &Tensors, name: &str, heads: usize, tokens: &mut [Vec<f64>]) {
    let width = tokens[0].len();
    let part = width / heads;
    let map = |tokens: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let norm = |x: &Vec<f64>| t.norm(&format!("{name}.norm1"), x);
        tokens.iter().map(|x| t.linear(&format!("{name}.qkv"), &norm(x))).collect()
    };
    let qkv = map(tokens);
    for (i, token) in tokens.iter_mut().enumerate() {
        let mut attended = vec![0.0; width];
        for head in 0..heads {
            let at = |what: usize| what * width + head * part..what * width + (head + 1) * part;
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let score = |j: usize| product(&qkv[i][at(0)], &qkv[j][at(1)]) / (part as f64).sqrt();
            let weights: Vec<f64> = (0..=i).map(|j| score(j).exp()).collect();
            let total: f64 = weights.iter().sum();
            for (j, share) in weights.iter().enumerate() {
                for (a, v) in attended[head * part..].iter_mut().zip(&qkv[j][at(2)]) {
                    *a += share / total * v;
                }
            }
        }
        let out = t.linear(&format!("{name}.out"), &attended);
        token.iter_mut().zip(out).for_each(|(x, y)| *x += y);
        let mut up = t.linear(&format!("{name}.up"), &t.norm(&format!("{name}.norm2"), token));
        up.iter_mut().for_each(|x| *x = x.max(0.0));
        let down = t.linear(&format!("{name}.down"), &up);
        token.iter_mut().zip(down).for_each(|(x, y)| *x += y);
    }
}

/// The noise of a node, more of it than any prediction takes.
fn noise(action: usize, node: usize, seed: u64) -> impl Iterator<Item = f64> {
    let from = node * (action * limit::CHUNK / 2);
    (from..).flat_map(move |i| noise::normal_pair(seed, i as u64)).map(f64::from)
}

fn flow(
    t: &Tensors,
    hidden_state: &[f64],
    steps: usize,
    noise: impl Iterator<Item = f64>,
) -> Vec<f64> {
    let count = t.get("flow.out.bias").len();
    let mut z: Vec<f64> = noise.take(count).collect();
    for step in 0..steps {
        let mut x = t.linear("flow.latent", hidden_state);
        let tau = step as f64 / steps as f64;
        for (input, row) in z.iter().chain([&tau]).zip(t.get("flow.action.weight").chunks(x.len()))
        {
            x.iter_mut().zip(row).for_each(|(x, w)| *x += w * input);
        }
        x.iter_mut().for_each(|x| *x = x.max(0.0));
        let mut x = t.linear("flow.hidden", &x);
        x.iter_mut().for_each(|x| *x = x.max(0.0));
        let v = t.linear("flow.out", &x);
        z.iter_mut().zip(v).for_each(|(z, v)| *z += v / steps as f64);
    }
    z
}

/// Root of the mean square, and the largest difference relative to it.
fn difference(ours: &[Vec<f32>], exact: &[Vec<f64>]) -> f64 {
    let all = || ours.iter().flatten().map(|x| f64::from(*x)).zip(exact.iter().flatten());
    let count = exact.iter().flatten().count() as f64;
    let size = (all().map(|(_, y)| y * y).sum::<f64>() / count).sqrt();
    all().map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size
}

const SHAPES: [Shape; 5] = [
    TINY,
    Shape { layers: 3, heads: 4, width: 64, nodes: 12, chunk: 5, action: 6 },
    Shape { layers: 1, heads: 3, width: 57, nodes: 7, chunk: 2, action: 6 },
    Shape { action: 5, ..TINY },
    Shape { chunk: 5, action: 9, ..TINY },
];

#[test]
fn single_precision_is_the_reference_rounded() {
    for shape in SHAPES {
        for (layout, decoder) in variants() {
            let header = header(Precision::F32, layout, decoder, shape);
            let bytes = file(&header, 1);
            let model = Model::open(&bytes).unwrap();
            let mut memory = heap::<ReferenceMemory<3, 64, 59>>();
            let mut network = Network::new(&model, &mut *memory).unwrap();
            let features = features(&header, 5);
            let ours = rollout(&mut network, &features, 9);
            let error = difference(&ours, &actions(&header, &bytes, &features, 9));
            assert!(error < 1e-4, "{layout:?} {decoder:?}: {error:e}");
        }
    }
}

/// Bytes in weights, activations and cache against the same weights without any rounding.
#[test]
fn bytes_are_close_to_the_reference() {
    for shape in SHAPES {
        for (layout, decoder) in variants() {
            let header = header(Precision::Int8, layout, decoder, shape);
            let bytes = file(&header, 1);
            let model = Model::open(&bytes).unwrap();
            let mut memory = heap::<Memory<3, 64, 59>>();
            let mut network = Network::new(&model, &mut *memory).unwrap();
            let features = features(&header, 5);
            let ours = rollout(&mut network, &features, 9);
            let error = difference(&ours, &actions(&header, &bytes, &features, 9));
            println!("{layout:?} {decoder:?} width {}: {:.2} %", shape.width, 100.0 * error);
            assert!(error < 0.1, "{layout:?} {decoder:?}: {error:e}");
        }
    }
}
