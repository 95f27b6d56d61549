//! `remora learn quantise`

use super::bench::Bench;
use remora_core::advanced::nn::{
    Decoder, Header, Layout, Memory, Model, Network, Precision, Provenance, ReferenceMemory,
    VERSION, synthetic_model,
};
use remora_core::advanced::warmstart::{Action, Encoding};
use remora_host::formats::{ModelBuilder, ModelFile, Values};
use std::fs;

fn header() -> Header {
    Header {
        version: VERSION,
        precision: Precision::F32,
        layout: Layout::Fused,
        inputs: Encoding::Body.tag(),
        outputs: Action::Rate.tag(),
        decoder: Decoder::Flow { steps: 2 },
        chunk: 1,
        nodes: 8,
        layers: 2,
        heads: 2,
        width: 32,
        token_types: [36].into_iter().collect(),
        provenance: Provenance { dataset: "drawn".try_into().unwrap(), ..Default::default() },
        action: 6,
    }
}

/// A bench with `in.model`, in single precision with weights at random.
pub fn bench() -> Bench {
    let bench = Bench::new();
    let mut bytes = vec![0; 1 << 20];
    let length = synthetic_model(&header(), 1, &mut bytes).unwrap();
    fs::write(bench.path("in.model"), &bytes[..length]).unwrap();
    bench
}

#[test]
fn a_quantised_model_acts_like_the_one_it_was() {
    let bench = bench();
    let run = bench.solves("learn quantise in.model out.model");
    assert!(run.out.contains("block.0.qkv.weight"), "{}", run.out);
    assert!(run.out.ends_with("written: out.model\n"), "{}", run.out);

    let files = ["in.model", "out.model"].map(|name| fs::read(bench.path(name)).unwrap());
    let models = [0, 1].map(|i| Model::open(&files[i]).unwrap());
    assert_eq!(models[1].header(), &Header { precision: Precision::Int8, ..header() });
    let (mut float, mut int8) = (ReferenceMemory::<2, 32, 8>::new(), Memory::<2, 32, 8>::new());
    let mut float = Network::new(&models[0], &mut float).unwrap();
    let mut int8 = Network::new(&models[1], &mut int8).unwrap();
    let (mut squares, mut errors) = (0.0, 0.0);
    for node in 0..8 {
        let features: Vec<f32> = (0..36).map(|i| (i as f32 + 0.3 * node as f32).sin()).collect();
        let (mut exact, mut rounded) = ([0.0f32; 6], [0.0f32; 6]);
        float.act(&features, &mut exact).unwrap();
        int8.act(&features, &mut rounded).unwrap();
        for (exact, rounded) in exact.iter().zip(rounded) {
            squares += exact * exact;
            errors += (exact - rounded) * (exact - rounded);
        }
    }
    let error = (errors / squares).sqrt();
    assert!(error > 0.0 && error < 0.03, "{error}");
}

#[test]
fn a_file_taken_apart_and_put_together_is_the_same() {
    let bench = bench();
    let run = bench.solves("learn quantise in.model out.model --json");
    let tensors: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert!(tensors[0]["name"].is_string() && tensors[0]["bytes"][1].is_u64(), "{tensors}");
    for name in ["in.model", "out.model"] {
        let bytes = fs::read(bench.path(name)).unwrap();
        let file = ModelFile::read(&bench.path(name)).unwrap();
        let mut builder = ModelBuilder::new(file.header().clone()).unwrap();
        for tensor in file.tensors() {
            builder.set(&tensor.name, tensor.values.clone()).unwrap();
        }
        assert_eq!(builder.finish().unwrap().bytes(), bytes);
        assert_eq!(file.tensor("action.std").unwrap().columns, 6);
        assert_eq!(file.tensor("nothing"), None);
    }
}

#[test]
fn a_builder_wants_every_tensor_once_in_its_shape_and_finite() {
    let mut builder = ModelBuilder::new(header()).unwrap();
    let refusal = |builder: &mut ModelBuilder, name: &str, values: &[f32]| {
        let error = builder.set_f32(name, values).unwrap_err();
        format!("{}: {}", error.field, error.reason)
    };
    let mut refused = |name: &str, values: &[f32]| refusal(&mut builder, name, values);
    assert_eq!(refused("head.bias", &[]), "head.bias: no such tensor");
    assert_eq!(refused("action.std", &[1.0]), "action.std: has 1 numbers, not 1 x 6");
    assert_eq!(refused("action.std", &[f32::NAN; 6]), "action.std: holds NaN");
    builder.set_f32("action.std", &[1.0; 6]).unwrap();
    let bytes = Values::Int8(vec![0; 6]);
    assert_eq!(builder.set("action.mean", bytes).unwrap_err().reason, "must be F32");
    assert_eq!(builder.finish().unwrap_err().field, "input.mean");
    assert!(ModelBuilder::new(Header { heads: 3, ..header() }).is_err());
}

#[test]
fn bad_models_are_refused() {
    let bench = bench();
    bench.solves("learn quantise in.model int8.model");
    let good = fs::read(bench.path("in.model")).unwrap();
    fs::write(bench.path("cut.model"), &good[..good.len() / 2]).unwrap();
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 4;
    fs::write(bench.path("flipped.model"), flipped).unwrap();
    for (file, reason) in [
        ("none.model", "no such file or directory"),
        ("set.scenarios.json", "this is a scenario set; learn quantise takes a model"),
        ("cut.model", "is shorter than its header says"),
        ("flipped.model", "has a wrong checksum"),
        ("int8.model", "precision: is quantised already"),
    ] {
        bench.refuses(&format!("learn quantise {file} out.model"), &format!("{file}: {reason}"));
    }
    bench.refuses(
        "learn quantise in.model none/out.model",
        "none/out.model: no such file or directory",
    );
}
