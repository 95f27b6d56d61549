//! Once it has been set up, the planner never asks for memory. A program of its own, without the
//! test harness: allocations are counted over the whole process, and the harness makes some.

use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::model::Mission;
use remora_core::advanced::nn::{
    self, Decoder, Kernel, Layout, Model, Network, Precision, synthetic_model,
};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::stages::{LINKS, Mode};
use remora_core::advanced::warmstart::{Action, Encoding};
use remora_host::formats::ScenarioSet;
use remora_host::planning::WallClock;
use remora_host::threads::Threads;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// What a flight computer has: static memory of constant size.
struct Flight {
    workspace: Workspace,
    solver: EmbeddedSolver,
}

impl Flight {
    const fn new() -> Self {
        Self { workspace: Workspace::new(), solver: EmbeddedSolver::new() }
    }

    fn plan(&mut self, set: &ScenarioSet, options: &PlanSettings, threads: Threads) -> Report {
        plan(
            &Mission::<LINKS>::default(),
            &set.scenarios[0].scenario().resized(),
            &Options::from_parts(
                *options,
                InitialGuess::Heuristic,
                Platform { clock: &WallClock::start(), executor: &threads },
            ),
            &mut self.solver,
            &mut self.workspace,
        )
    }
}

// Verifies REM-MEM-001.
fn main() {
    network_in_place();
    static FLIGHT: std::sync::Mutex<Flight> = std::sync::Mutex::new(Flight::new());
    let mut flight = FLIGHT.lock().unwrap();
    let set = ScenarioSet::built_in().unwrap();
    for threads in [Threads::One, Threads::Two] {
        let options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
        // Starts the second thread.
        flight.plan(&set, &options, threads);
        for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
            for deadline_s in [f64::INFINITY, 1e-3] {
                let options =
                    PlanSettings { deadline_s, ..PlanSettings::new(Mode::Optimal, integrator) };
                let region = Region::new(COUNTED);
                for _ in 0..5 {
                    flight.plan(&set, &options, threads);
                }
                let change = region.change();
                let touched = (change.allocations, change.reallocations, change.deallocations);
                assert_eq!(touched, (0, 0, 0), "{threads:?}, {integrator:?}, {deadline_s}");
            }
        }
    }
}

/// A network opens its file, and rolls out, where both lie.
fn network_in_place() {
    static MEMORY: std::sync::Mutex<nn::Memory<2, 64, 60>> =
        std::sync::Mutex::new(nn::Memory::new());
    let mut memory = MEMORY.lock().unwrap();
    let header = nn::Header {
        version: nn::VERSION,
        precision: Precision::Int8,
        layout: Layout::Fused,
        inputs: Encoding::Paper.tag(),
        outputs: Action::Torque.tag(),
        decoder: Decoder::Flow { steps: 2 },
        chunk: 1,
        nodes: 60,
        layers: 2,
        heads: 4,
        width: 64,
        token_types: [36].into_iter().collect(),
        provenance: nn::Provenance::default(),
        action: nn::ACTION as u16,
    };
    let mut file = vec![0; 1 << 20];
    let length = synthetic_model(&header, 1, &mut file).unwrap();

    let region = Region::new(COUNTED);
    let model = Model::open(&file[..length]).unwrap();
    for kernel in Kernel::available() {
        let mut network = Network::new(&model, &mut *memory).unwrap();
        network.use_kernel(kernel);
        network.begin(1);
        let mut action = [0.0; nn::ACTION];
        for _ in 0..60 {
            network.act(&[0.3; 36], &mut action).unwrap();
        }
    }
    let change = region.change();
    let touched = (change.allocations, change.reallocations, change.deallocations);
    assert_eq!(touched, (0, 0, 0), "the network");
}
