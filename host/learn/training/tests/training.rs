//! Training: gradients against differences, resuming, and the model file against the core.

use remora_core::advanced::nn::{Model, Network as Inference, ReferenceMemory};
use remora_host::formats::{Mission, ModelFile, Values, read_mission};
use remora_host::method::{Integrator, Method};
use remora_host::request::PlanRequest;
use remora_learn::dataset::{MISSION, Recipe, SHARD};
use remora_learn::quantise::quantise;
use remora_training::checkpoint::LossRow;
use remora_training::config::{Action, Encoding};
use remora_training::config::{Decoder, Layout};
use remora_training::model::{self, Origin};
use remora_training::network::{Losses, Network};
use remora_training::output::Outcome;
use remora_training::params::Table;
use remora_training::random::Random;
use remora_training::recorded::Recorded;
use remora_training::shape::Shape;
use remora_training::source::{
    Batch, Batches, Example, ExampleSource, Split, Statistics, Synthetic,
};
use remora_training::{Config, Cpu, Observer, Run};
use std::num::NonZeroUsize;
use std::path::Path;

const CONFIG: &str = r#"
[data]
path = "synthetic"
[model]
layout = "fused"
encoding = "paper"
action = "torque"
decoder = "linear"
chunk = 1
layers = 2
heads = 2
width = 16
[training]
batch = 4
accumulation = 2
learning_rate = 3e-3
warmup_steps = 3
weight_decay = 0.1
clip_norm = 0.5
steps = 12
seed = 3
validate_every = 5
validation_count = 6
state_loss = 0.3
"#;

fn config(layout: Layout, decoder: Decoder, chunk: usize) -> Config {
    let mut config = Config::parse(CONFIG).unwrap();
    config.model.layout = layout;
    config.model.decoder = decoder;
    config.model.chunk = chunk;
    config
}

/// With the numbers of an action: six are those of three joints.
const VARIANTS: [(Layout, Decoder, usize, usize); 8] = [
    (Layout::Fused, Decoder::Linear, 1, 6),
    (Layout::Fused, Decoder::Flow, 5, 6),
    (Layout::Separate, Decoder::Linear, 5, 6),
    (Layout::Separate, Decoder::Flow, 1, 6),
    (Layout::Separate, Decoder::Flow, 1, 5),
    (Layout::Fused, Decoder::Linear, 5, 10),
    (Layout::Chunked, Decoder::Linear, 4, 6),
    (Layout::Chunked, Decoder::Flow, 2, 6),
];

fn source() -> Synthetic {
    source_of(6, 1)
}

fn source_of(action: usize, stride: usize) -> Synthetic {
    Synthetic::new(Shape { nodes: 7, groups: vec![action, 1, 3, 2, 4], states: 4, stride }, 40)
}

struct Fixture {
    table: Table,
    statistics: Statistics,
    parameters: Vec<f32>,
    batch: Batch,
}

fn fixture(config: &Config, action: usize) -> Fixture {
    let source = source_of(action, config.model.stride());
    let table = Table::new(config, source.shape());
    let statistics = Statistics::of(&source, 1).unwrap();
    let batches = Batches { source: &source, statistics: &statistics, table: &table, seed: 5 };
    let batch = batches.training(0, 3, &mut (0, Vec::new())).unwrap();
    // Biases and the like away from their start at zero.
    let mut random = Random::new(7, 0, 0);
    let start = table.start(3).into_iter();
    let parameters = start.map(|x| x + 0.1 * random.normal() as f32).collect();
    Fixture { table, statistics, parameters, batch }
}

/// Along the gradient of each tensor alone, the loss changes as the gradient says.
#[test]
fn gradients_are_not_zero_and_those_of_differences() {
    for (layout, decoder, chunk, action) in VARIANTS {
        let config = config(layout, decoder, chunk);
        let Fixture { table, parameters, batch, .. } = fixture(&config, action);
        let network = Network::<Cpu>::new(&table, Default::default(), 0.0, 0.3);
        let mut gradient = vec![0.0; table.len()];
        network.gradient(&parameters, &batch, 1.0, &mut gradient);
        let loss = |parameters: &[f32]| {
            let Losses { action, state } = network.losses(parameters, &batch);
            action + 0.3 * state
        };
        for entry in &table.entries {
            let part = &gradient[entry.range()];
            let norm = part.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
            // Rows of the embedding of nodes that are not seen are the only idle parameters, but for biases
            // of keys, which attention does not see.
            let idle = part.iter().filter(|g| **g == 0.0).count();
            let unseen = (table.nodes - table.seen()) * table.width;
            let most = if entry.name == "nodes" { unseen } else { entry.len() / 2 };
            assert!(norm > 1e-4 && idle <= most, "{} {norm} {idle}", entry.name);
            let step = (3e-3 / norm).min(0.02 / norm.max(1.0)).min(1e-2);
            let moved = |factor: f64| {
                let mut moved = parameters.clone();
                for (x, g) in moved[entry.range()].iter_mut().zip(part) {
                    *x += (factor * step * f64::from(*g) / norm) as f32;
                }
                loss(&moved)
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            assert!(
                (slope - norm).abs() < 0.02 * norm + 2e-4,
                "{layout:?} {decoder:?} {}: {slope} {norm}",
                entry.name
            );
        }
    }
}

/// The file that training writes, run by the core node by node, says what the network said in
/// training all at once.
#[test]
fn the_core_says_what_training_says() {
    for (layout, decoder, chunk, action) in VARIANTS {
        let config = config(layout, decoder, chunk);
        let Fixture { table, statistics, parameters, mut batch } = fixture(&config, action);
        let infer = |parameters: &[f32]| -> Vec<f32> {
            let header = model::header(&config, &table, &Origin::default(), 1);
            let bytes = model::model_bytes(header, &table, &statistics, parameters).unwrap();
            let model = Model::open(&bytes).unwrap();
            let mut memory = Box::new(ReferenceMemory::<2, 16, 35>::new());
            let mut network = Inference::new(&model, &mut *memory).unwrap();
            let source = source_of(action, table.stride);
            let (mut example, mut out) = (Example::zeros(source.shape()), Vec::new());
            let order = Random::new(5, Random::ORDER, 0).order(source.len(Split::Training));
            for trajectory in &order[..batch.size] {
                let index = *trajectory as usize;
                let mut random = Random::new(0, 0, 0);
                source.sample(Split::Training, index, &mut random, &mut example).unwrap();
                network.begin(11);
                for features in example.features.chunks_exact(source.shape().features()) {
                    let mut actions = vec![0.0; table.outputs];
                    network.act(features, &mut actions).unwrap();
                    let normal = |(i, x): (usize, &f32)| {
                        let [mean, deviation] = statistics.actions[i % table.action];
                        (x - mean) / deviation
                    };
                    out.extend(actions.iter().enumerate().map(normal));
                }
            }
            out
        };
        let mut found = infer(&parameters);
        if decoder == Decoder::Flow {
            // Without the last layer the flow stays where it starts: that is what it was asked.
            let mut still = parameters.clone();
            for entry in table.entries.iter().filter(|e| e.name.starts_with("flow3")) {
                still[entry.range()].fill(0.0);
            }
            let start = infer(&still);
            let questions = batch.question.chunks_exact_mut(table.outputs + 1);
            for (question, start) in questions.zip(start.chunks_exact(table.outputs)) {
                question[..table.outputs].copy_from_slice(start);
                question[table.outputs] = 0.0;
            }
            found.iter_mut().zip(&start).for_each(|(x, start)| *x -= start);
        }
        let network = Network::<Cpu>::new(&table, Default::default(), 0.0, 0.0);
        let expected = network.answers(&parameters, &batch);
        assert_eq!(found.len(), expected.len());
        assert!(expected.iter().any(|x| x.abs() > 0.3));
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() < 2e-4 * (1.0 + b.abs()), "{layout:?} {decoder:?}: {a} {b}");
        }
    }
}

struct Silent;

impl Observer for Silent {
    fn begin(&mut self, _: u64, _: u64, _: usize) {}
    fn step(&mut self, _: u64, _: Losses, _: f64) {}
    fn validated(&mut self, _: &LossRow) {}
}

fn train(config: &Config, out: &Path, resume: bool, stop_after: Option<u64>) -> Outcome {
    let source = source();
    let run = Run {
        config: config.clone(),
        source: &source,
        origin: Origin::default(),
        out: out.to_path_buf(),
        resume,
        stop_after,
        rollout: &|_| None,
    };
    run.train::<Cpu>(Default::default(), &mut Silent).unwrap()
}

/// What does not depend on the clock.
fn timeless(outcome: &Outcome) -> (Vec<f32>, Vec<f32>, Vec<f32>, Vec<[f64; 6]>) {
    let state = &outcome.checkpoint;
    let row = |r: &LossRow| {
        [r.step as f64, r.train, r.train_state, r.validation, r.validation_state, r.gradient_norm]
    };
    (
        state.parameters.clone(),
        state.optimiser.first.clone(),
        state.optimiser.second.clone(),
        state.rows.iter().map(row).collect(),
    )
}

#[test]
fn an_interrupted_training_ends_with_the_same_bits() {
    for (layout, decoder, chunk, _) in [VARIANTS[1], VARIANTS[2]] {
        let mut config = config(layout, decoder, chunk);
        config.model.dropout = 0.1;
        let dir = tempfile::tempdir().unwrap();
        let whole = train(&config, &dir.path().join("whole"), false, None);
        assert!(whole.complete);
        let parts = dir.path().join("parts");
        assert!(!train(&config, &parts, true, Some(4)).complete);
        assert!(!train(&config, &parts, true, Some(3)).complete);
        let resumed = train(&config, &parts, true, None);
        assert_eq!(timeless(&resumed), timeless(&whole));
        let model = |name: &str| std::fs::read(dir.path().join(name).join("model.f32.model"));
        assert_eq!(model("parts").unwrap(), model("whole").unwrap());
    }
}

/// By the clock this one would end before its first step.
#[test]
fn the_clock_leaves_the_least_steps() {
    let mut config = config(Layout::Fused, Decoder::Linear, 1);
    config.training.steps = 1000;
    config.training.minutes = Some(1e-9);
    let dir = tempfile::tempdir().unwrap();
    let steps = |config: &Config, name: &str| {
        let outcome = train(config, &dir.path().join(name), false, None);
        assert!(outcome.complete);
        outcome.checkpoint.optimiser.step
    };
    assert_eq!(steps(&config, "clock"), 0);
    config.training.least_steps = Some(7);
    assert_eq!(steps(&config, "least"), 7);
}

#[test]
fn a_network_learns() {
    let mut config = config(Layout::Fused, Decoder::Linear, 1);
    config.training.steps = 150;
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let outcome = train(&config, &out, false, None);
    let rows = &outcome.checkpoint.rows;
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert!(last.validation < 0.3 * first.validation, "{} {}", first.validation, last.validation);
    for name in ["config.toml", "loss.csv", "checkpoint.bin", "model.f32.model"] {
        assert!(out.join(name).exists(), "{name}");
    }
    // Another starts where this one ended.
    let mut next = config.clone();
    next.training.init_from = Some(out);
    next.training.steps = 5;
    let tuned = train(&next, &dir.path().join("next"), false, None);
    assert!(tuned.checkpoint.rows[0].validation < 1.5 * last.validation);
    assert!(tuned.checkpoint.origin.parent.ends_with(" run"));
}

/// From the plans that are checked in: both our own features and actions, and the paper's.
#[test]
fn a_network_learns_from_real_plans() {
    let dir = tempfile::tempdir().unwrap();
    let sets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fixtures/datasets");
    for (name, encoding, action) in
        [("euler", Encoding::Body, Action::Rate), ("rk4", Encoding::Paper, Action::Torque)]
    {
        let mut config = config(Layout::Fused, Decoder::Linear, 1);
        config.data.path = sets.join(name);
        config.model.encoding = encoding;
        config.model.action = action;
        config.training.steps = 60;
        config.training.validation_count = 2;
        let mission = Mission::default();
        let source = Recorded::read(&config, &mission).unwrap();
        assert!(source.len(Split::Validation) >= 1);
        let origin = source.origin();
        let (seed, count) = if name == "euler" { (5000, 200) } else { (5001, 100) };
        assert_eq!(origin.dataset, format!("s{seed}:{count}"));
        let rollout = |model: &[u8]| source.rollout(model, 1);
        let out = dir.path().join(name);
        let run = Run { config, origin, out, rollout: &rollout, ..quiet(&source) };
        let outcome = run.train::<Cpu>(Default::default(), &mut Silent).unwrap();
        let rows = &outcome.checkpoint.rows;
        let (first, last) = (rows[0].validation, rows[rows.len() - 1].validation);
        assert!(last < 0.5 * first, "{name}: {first} {last}");
    }
}

/// Each dataset in a directory has its own mission, which its manifest must be of.
#[test]
fn datasets_of_many_servicers_are_learnt_from_together() {
    let dir = tempfile::tempdir().unwrap();
    let sets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fixtures");
    let heavier = dir.path().join("heavier.mission.toml");
    std::fs::write(&heavier, "format = \"remora-mission/1\"\n[servicer]\nbus_mass_kg = 650.0\n")
        .unwrap();
    let mission = read_mission(Some(&heavier)).unwrap();
    let servicers = dir.path().join("servicers");
    let method = Method { integrator: Integrator::Euler, ..Method::default() };
    for (name, mission, mission_file) in
        [("heavier", mission, Some(heavier)), ("own", Mission::default(), None)]
    {
        let recipe = Recipe {
            count: 4,
            seed: 9,
            request: PlanRequest { mission, method, ..PlanRequest::default() },
            mission_file,
            shard: SHARD,
            jobs: NonZeroUsize::MIN,
            part: None,
            out: servicers.join(name),
        };
        recipe.make(&mut ()).unwrap();
    }
    let mut config = config(Layout::Fused, Decoder::Linear, 1);
    config.data.path = sets.join("datasets/euler");
    config.data.extra = vec![servicers.clone()];
    config.model.encoding = Encoding::Servicer;
    let source = Recorded::read(&config, &Mission::default()).unwrap();
    assert_eq!(source.origin().dataset, "s5000:200+s9:4");
    assert_eq!(source.len(Split::Training) + source.len(Split::Validation), 208);
    // The first number behind the time is the bus's mass.
    let mut example = Example::zeros(source.shape());
    let mut masses = Vec::new();
    for index in 0..source.len(Split::Training) {
        source.sample(Split::Training, index, &mut Random::new(1, 0, 0), &mut example).unwrap();
        masses.push(example.features[7]);
    }
    let heavy = masses.iter().filter(|mass| **mass == 650.0).count();
    assert!((1..=4).contains(&heavy), "{heavy}");
    assert_eq!(masses.iter().filter(|mass| **mass == 500.0).count(), masses.len() - heavy);

    std::fs::write(servicers.join("heavier").join(MISSION), "format = \"remora-mission/1\"\n")
        .unwrap();
    let refused = Recorded::read(&config, &Mission::default()).err().unwrap();
    assert!(refused.to_string().contains("was made for another mission"), "{refused}");
    config.data.extra = vec![sets.join("scenarios")];
    let refused = Recorded::read(&config, &Mission::default()).err().unwrap();
    assert!(refused.to_string().ends_with("is no dataset and holds none"), "{refused}");
}

/// The model of any network, read back, is the parameters that it was written from.
#[test]
fn parameters_come_back_from_a_model_file() {
    for (layout, decoder, chunk, action) in VARIANTS {
        let config = config(layout, decoder, chunk);
        let Fixture { table, statistics, parameters, .. } = fixture(&config, action);
        let header = model::header(&config, &table, &Origin::default(), 1);
        let bytes = model::model_bytes(header, &table, &statistics, &parameters).unwrap();
        let file = ModelFile::parse(&bytes).unwrap();
        assert!(file.bytes() == bytes);
        assert_eq!(file.header().version, if action == 6 { 1 } else { 2 });
        let read = |file: &ModelFile| {
            let mut found = Statistics { states: statistics.states.clone(), ..Default::default() };
            let mut numbers = parameters.clone();
            numbers[..table.inference_len()].fill(f32::NAN);
            model::take_over(file, &config, &table, &mut found, &mut numbers).unwrap();
            assert_eq!(found, statistics);
            numbers
        };
        assert_eq!(read(&file), parameters, "{layout:?} {decoder:?}");
        // Bytes are as near as their scales are fine, and are the same bytes again.
        let (quantised, _) = quantise(&file).unwrap();
        let near = read(&quantised);
        for entry in &table.entries {
            let [found, wanted] = [&near, &parameters].map(|all| &all[entry.range()]);
            for (a, b) in found.chunks(entry.columns).zip(wanted.chunks(entry.columns)) {
                let most = b.iter().fold(0f32, |most, x| most.max(x.abs()));
                assert!(
                    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most / 250.0),
                    "{}",
                    entry.name
                );
            }
        }
        let header = file.header().clone();
        let again = model::model_bytes(header, &table, &statistics, &near).unwrap();
        let (again, _) = quantise(&ModelFile::parse(&again).unwrap()).unwrap();
        for (a, b) in again.tensors().iter().zip(quantised.tensors()) {
            if let (Values::Int8(a), Values::Int8(b)) = (&a.values, &b.values) {
                assert_eq!(a, b);
            }
        }
    }
}

/// A training of which the rest is to be said.
fn quiet(source: &dyn ExampleSource) -> Run<'_> {
    Run {
        config: config(Layout::Fused, Decoder::Linear, 1),
        source,
        origin: Origin::default(),
        out: Default::default(),
        resume: false,
        stop_after: None,
        rollout: &|_| None,
    }
}

#[test]
fn a_training_starts_from_a_model_and_remembers_it() {
    let (mut config, source) = (config(Layout::Fused, Decoder::Linear, 1), source());
    let dir = tempfile::tempdir().unwrap();
    let run = |config: &Config, name: &str, dataset: &str| {
        let origin = Origin { dataset: dataset.into(), ..Origin::default() };
        let (config, out) = (config.clone(), dir.path().join(name));
        let run = Run { config, origin, out, ..quiet(&source) };
        run.train::<Cpu>(Default::default(), &mut Silent)
    };
    config.training.steps = 100;
    let first = run(&config, "first", "s2:50").unwrap();
    let written = ModelFile::read(&dir.path().join("first/model.f32.model")).unwrap();
    let parent = dir.path().join("parent.model");
    quantise(&written).unwrap().0.write(&parent).unwrap();
    let bytes = std::fs::read(&parent).unwrap();
    let checksum = u32::from_le_bytes(*bytes.last_chunk().unwrap());

    config.training.steps = 5;
    config.training.init_from = Some(parent.clone());
    config.training.parent_learnt_from = Some("s1:9".into());
    let next = run(&config, "next", "s3:40+s2:20").unwrap();
    let validation = |outcome: &Outcome| outcome.checkpoint.rows.last().unwrap().validation;
    assert!(validation(&next) < 1.5 * validation(&first));
    let made = ModelFile::read(&dir.path().join("next/model.f32.model")).unwrap();
    let provenance = &made.header().provenance;
    assert_eq!(provenance.dataset.as_str(), "s3:40+s2:50+s1:9");
    let from = format!("{} from {checksum:08x} parent.model", config.digest());
    assert_eq!(provenance.config.as_str(), from);

    // Parameters of a model, statistics of other data.
    let other = Synthetic::new(source.shape().clone(), 50);
    let mut own = config.clone();
    own.training.own_statistics = true;
    let statistics = |config: Config, name: &str| {
        let run = Run { config, source: &other, out: dir.path().join(name), ..quiet(&source) };
        run.train::<Cpu>(Default::default(), &mut Silent).unwrap().checkpoint.statistics
    };
    let wanted = Statistics::of(&other, own.training.seed).unwrap();
    assert_eq!(statistics(own, "own"), wanted);
    assert_ne!(statistics(config.clone(), "taken-over").features, wanted.features);

    // Its child, from the training's folder, inherits all of it.
    config.training.init_from = Some(dir.path().join("next"));
    config.training.parent_learnt_from = None;
    let child = run(&config, "child", "s4:1").unwrap();
    assert_eq!(child.checkpoint.origin.dataset, "s4:1+s3:40+s2:50+s1:9");
    let reason = |config: &Config, dataset: &str| {
        let out = format!("refused-{}", config.digest());
        run(config, &out, dataset).unwrap_err().to_string()
    };
    let long = (100..110).map(|seed| format!("s{seed}:90000")).collect::<Vec<_>>().join("+");
    assert!(reason(&config, &long).contains("more datasets than"));

    // A model of another arm is none to start from.
    let two = source_of(5, 1);
    config.training.init_from = Some(parent.clone());
    let other = Run { config: config.clone(), out: dir.path().join("two"), ..quiet(&two) };
    let wrong = other.train::<Cpu>(Default::default(), &mut Silent).unwrap_err().to_string();
    assert!(wrong.contains("joints: the model has 3, the configuration 2"), "{wrong}");

    config.model.layers = 1;
    let wrong = reason(&config, "s3:40");
    assert!(wrong.contains("layers: the model has 2, the configuration 1"), "{wrong}");
    config.model.layers = 2;
    std::fs::write(&parent, &bytes[..bytes.len() - 9]).unwrap();
    let cut = reason(&config, "s3:40");
    assert!(cut.contains("parent.model"), "{cut}");
    std::fs::write(&parent, "neither").unwrap();
    let neither = reason(&config, "s3:40");
    assert!(neither.contains("is neither a checkpoint nor a model"), "{neither}");
    config.training.init_from = Some(dir.path().join("none"));
    assert!(reason(&config, "s3:40").contains("no such file"));
}

#[test]
fn configurations_are_refused_with_field_and_reason() {
    let refused = |from: &str, to: &str| {
        assert!(CONFIG.contains(from));
        let error = Config::parse(&CONFIG.replace(from, to)).unwrap_err();
        (error.field, error.reason)
    };
    assert_eq!(refused("chunk = 1", "chunk = 2").0, "model.chunk");
    let chunked = CONFIG.replace("\"fused\"", "\"chunked\"");
    for chunk in [1, 9] {
        let text = chunked.replace("chunk = 1", &format!("chunk = {chunk}"));
        assert_eq!(Config::parse(&text).unwrap_err().field, "model.chunk");
    }
    assert!(Config::parse(&chunked.replace("chunk = 1", "chunk = 8")).is_ok());
    assert_eq!(refused("heads = 2", "heads = 3").0, "model.heads");
    assert_eq!(refused("clip_norm = 0.5", "clip_norm = nan").0, "training.clip_norm");
    assert_eq!(refused("batch = 4", "batch = 0").0, "training.batch");
    let (field, reason) = refused("seed = 3", "seed = 3\nsede = 4");
    assert_eq!(field, "training.sede");
    assert!(reason.contains("unknown field"), "{reason}");
    let learnt = refused("seed = 3", "seed = 3\nparent_learnt_from = \"s1\"");
    assert_eq!(learnt.0, "training.parent_learnt_from");
    assert_eq!(refused("layout = \"fused\"", "layout = \"fusd\"").0, "model.layout");
}

#[test]
fn the_fixtures_can_be_read() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fixtures/models");
    let mut count = 0;
    for entry in std::fs::read_dir(models).unwrap() {
        let file = entry.unwrap().path();
        let name = file.file_name().unwrap().to_str().unwrap();
        // A lineage lies beside each model that the command line ships with.
        if name.ends_with(".toml") && !name.ends_with(".lineage.toml") {
            let config = Config::read(&file).unwrap();
            // The copy that a training keeps is the same configuration.
            assert_eq!(Config::parse(&config.text()), Ok(config));
            count += 1;
        }
    }
    assert!(count >= 2);
}
