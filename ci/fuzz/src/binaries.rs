//! Readers of bytes.

use crate::{taken, with_checksum};
use remora_core::advanced::nn::{Memory, Model, Network, Precision, ReferenceMemory, Storage};
use remora_core::advanced::warmstart::check_model;
use remora_host::formats::{EvidenceFile, ModelFile, PLAN_FORMAT, PlanFile, json};
use remora_host::memory::on_heap;
use remora_learn::dataset::Manifest;
use std::cell::RefCell;

/// First bytes of every packet and binary file.
const MAGIC: &[u8] = b"REMORA\0";

/// Corrects the checksum of packets; returns text as it is.
fn mended(bytes: &[u8]) -> Vec<u8> {
    match bytes.starts_with(MAGIC) {
        true => with_checksum(bytes),
        false => bytes.to_vec(),
    }
}

pub(crate) fn plan(bytes: &[u8]) {
    let Some(plan) = taken(PlanFile::from_bytes(&mended(bytes))) else { return };
    assert!(plan.stage1.position.as_flattened().iter().all(|x| x.is_finite()));
    if plan.format == PLAN_FORMAT {
        let written = json::to_text(&plan).expect("what was read can be written");
        assert!(taken(PlanFile::parse(&written)) == Some(plan));
    }
}

pub(crate) fn evidence(bytes: &[u8]) {
    let Some(record) = taken(EvidenceFile::from_bytes(&mended(bytes))) else { return };
    assert_eq!(record.output.len(), 16);
    let packet = record.to_packet().expect("what was read can be written");
    assert_eq!(taken(EvidenceFile::from_bytes(&packet)), Some(record));
}

thread_local! {
    /// Memory for small networks; made once.
    static QUANTISED: RefCell<Box<Memory<4, 64, 80>>> = RefCell::new(on_heap(Memory::new));
    static SINGLE: RefCell<Box<ReferenceMemory<4, 64, 80>>> = RefCell::new(on_heap(ReferenceMemory::new));
}

pub(crate) fn model(bytes: &[u8]) {
    let bytes = with_checksum(bytes);
    let Some(file) = taken(ModelFile::parse(&bytes)) else { return };
    let written = file.bytes();
    let again = taken(ModelFile::parse(&written)).expect("what was written can be read");
    // Headers in postcard have more than one spelling, numbers have NaNs.
    assert_eq!(again.bytes(), written);
    let model = Model::open(&bytes).expect("it was taken before");
    let _ = check_model(&model);
    match model.header().precision {
        Precision::Int8 => QUANTISED.with_borrow_mut(|memory| acts(&model, &mut **memory)),
        Precision::F32 => SINGLE.with_borrow_mut(|memory| acts(&model, &mut **memory)),
    }
}

/// Three nodes of a roll-out: what comes out is finite, or refused.
fn acts(model: &Model<'_>, memory: &mut impl Storage) {
    let Ok(mut network) = Network::new(model, memory) else { return };
    let size = model.dimensions();
    let features: Vec<f32> = (0..size.features).map(|i| i as f32 * 0.1 - 1.0).collect();
    let mut actions = vec![0.0; size.actions];
    network.set_flow_steps(Some(2));
    network.begin(1);
    for _ in 0..3 {
        match network.act(&features, &mut actions) {
            Ok(()) => assert!(actions.iter().all(|x| x.is_finite())),
            Err(_) => return,
        }
    }
}

const MANIFEST: &str = include_str!("../../../fixtures/datasets/euler/dataset.json");

/// The first shard of a dataset that is checked in.
pub(crate) fn shard(bytes: &[u8]) {
    let manifest = Manifest::parse(MANIFEST).expect("it is checked in");
    let Ok(kept) = manifest.shard(0, &with_checksum(bytes)) else { return };
    assert!(kept.iter().all(|t| t.position.as_flattened().iter().all(|x| x.is_finite())));
}
