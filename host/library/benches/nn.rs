//! Whole roll-outs of 60 nodes by networks with weights at random, on one core: the published size
//! and the small ones, each with every kernel the processor has.
//!
//! Then the check of a model file, a slice at a time.
//!
//! Lines before the measurements say what each costs (megabytes of weights, billions of
//! multiplications), and the shortest of a few runs, which a busy machine disturbs least.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use remora_core::advanced::nn::{
    ACTION, Check, Decoder, Dimensions, Header, Kernel, Layout, Memory, Model, Network, Precision,
    Provenance, Storage, VERSION, synthetic_model,
};
use remora_core::advanced::warmstart::{Action, Encoding};
use std::hint::black_box;
use std::time::{Duration, Instant};

const NODES: usize = 60;

struct Case {
    name: &'static str,
    layout: Layout,
    decoder: Decoder,
    layers: u16,
    heads: u16,
    width: u16,
}

const PAPER: Case = Case {
    name: "paper 6x384 flow",
    layout: Layout::Separate,
    decoder: Decoder::Flow { steps: 1 },
    layers: 6,
    heads: 6,
    width: 384,
};

const fn fused(name: &'static str, layers: u16, width: u16) -> Case {
    let decoder = Decoder::Flow { steps: 1 };
    Case { name, layout: Layout::Fused, decoder, layers, heads: width / 32, width }
}

impl Case {
    fn header(&self) -> Header {
        let token_types: &[u16] = match self.layout {
            Layout::Separate => &[6, 1, 7, 9, 13],
            Layout::Fused | Layout::Chunked => &[36],
        };
        Header {
            version: VERSION,
            precision: Precision::Int8,
            layout: self.layout,
            inputs: Encoding::Paper.tag(),
            outputs: Action::Torque.tag(),
            decoder: self.decoder,
            chunk: 1,
            nodes: NODES as u16,
            layers: self.layers,
            heads: self.heads,
            width: self.width,
            token_types: token_types.iter().copied().collect(),
            provenance: Provenance::default(),
            action: ACTION as u16,
        }
    }
}

/// Multiplications of a roll-out: blocks, attention, decoder.
fn multiplications(case: &Case, size: &Dimensions) -> f64 {
    let [tokens, nodes, w] = [size.tokens, size.nodes, size.width].map(|x| x as f64);
    let layers = f64::from(case.layers);
    let blocks = w * w * (12.0 * tokens * (layers - 1.0) + 2.0 * tokens + 10.0 * nodes);
    let attention = w * tokens * (tokens * (layers - 1.0) + nodes);
    blocks + attention + nodes * 6.0 * w * w
}

fn rollout<M: Storage>(network: &mut Network<'_, '_, M>, features: &[f32]) -> f32 {
    let mut action = [0.0; ACTION];
    network.begin(1);
    for _ in 0..NODES {
        network.act(black_box(features), &mut action).expect("weights and features are sound");
    }
    action[0]
}

fn run<M: Storage + Default>(c: &mut Criterion, case: &Case) {
    let mut bytes = vec![0; 16 << 20];
    let length = synthetic_model(&case.header(), 1, &mut bytes).expect("there is room");
    bytes.truncate(length);
    let model = Model::open(&bytes).expect("the file is sound");
    let mut memory = Box::<M>::default();
    let mut network = Network::new(&model, &mut *memory).expect("the memory is large enough");
    let features: Vec<f32> = (0..36).map(|i| (i as f32 * 0.7).sin()).collect();

    let mut group = c.benchmark_group(case.name);
    group.sample_size(20).warm_up_time(Duration::from_millis(300));
    group.measurement_time(Duration::from_secs(2));
    let work = multiplications(case, model.dimensions());
    println!("{}: {:.2} MB, {:.3} G multiplications", case.name, length as f64 * 1e-6, work * 1e-9);
    for kernel in Kernel::available() {
        network.use_kernel(kernel);
        let seconds = best(|| rollout(&mut network, &features));
        println!(
            "{:<10} {:>8.3} ms, {:>5.1} G multiplications a second",
            kernel.name(),
            seconds * 1e3,
            work / seconds * 1e-9
        );
        group.bench_function(kernel.name(), |b| {
            b.iter(|| rollout(&mut network, &features));
        });
    }
    group.finish();
}

/// The shortest of a few runs [s].
fn best(mut work: impl FnMut() -> f32) -> f64 {
    let once = || {
        let started = Instant::now();
        black_box(work());
        started.elapsed().as_secs_f64()
    };
    std::iter::repeat_with(once).take(25).fold(f64::INFINITY, f64::min)
}

fn nn(c: &mut Criterion) {
    run::<Memory<6, 384, 299>>(c, &PAPER);
    run::<Memory<6, 384, 299>>(
        c,
        &Case { name: "paper 6x384 linear", decoder: Decoder::Linear, ..PAPER },
    );
    run::<Memory<3, 96, 60>>(c, &fused("fused 3x96", 3, 96));
    run::<Memory<3, 128, 60>>(c, &fused("fused 3x128", 3, 128));
    run::<Memory<4, 128, 60>>(c, &fused("fused 4x128", 4, 128));
}

/// A slice of the check of a file, and all of it.
fn check(c: &mut Criterion) {
    const SLICE: usize = 4096;
    let mut bytes = vec![0; 1 << 20];
    let header = fused("fused 3x96", 3, 96).header();
    let length = synthetic_model(&header, 1, &mut bytes).expect("there is room");
    bytes.truncate(length);
    let mut group = c.benchmark_group("check");
    group.throughput(Throughput::Bytes(SLICE as u64));
    let mut check = Check::new(&bytes);
    group.bench_function("4 KiB slice", |b| {
        b.iter(|| {
            if check.left() < SLICE {
                check.restart();
            }
            black_box(check.step(SLICE))
        });
    });
    group.throughput(Throughput::Bytes(length as u64));
    group.bench_function("whole file", |b| {
        b.iter(|| Check::new(black_box(&bytes)).step(usize::MAX));
    });
    group.throughput(Throughput::Elements(1));
    check.step(usize::MAX);
    group.bench_function("open what was checked", |b| {
        b.iter(|| black_box(check.open()).is_ok());
    });
    group.finish();
}

criterion_group!(benches, nn, check);
criterion_main!(benches);
