//! A learned initial guess: a model file where it lies, a network that works in memory of yours.

use remora_core::prelude::*;
use std::error::Error;

/// On a board: bytes in flash.
static FILE: &[u8] = include_bytes!("../../fixtures/models/rk4.model");

fn main() -> Result<(), Box<dyn Error>> {
    let mission = Mission::default().validated()?;
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    }
    .validated()?;
    // Checks the file to its last byte: 421 kB.
    let model = Model::open(FILE)?;
    // Three blocks of width 96, room for sixty tokens: 64 kB for cache and scratch.
    let mut memory = Box::new(NetworkMemory::new());
    let policy = NetworkPolicy::new(Network::new(&model, &mut *memory)?)?;

    let mut planner = Box::new(Planner::new());
    let guesses = [InitialGuess::Heuristic, InitialGuess::Learned { policy: &policy, seed: 0 }];
    for guess in guesses {
        let options = Options::builder().initial_guess(guess).build()?;
        let plan = planner.plan(&mission, &scenario, &options)?;
        println!(
            "from {:?}: {} iterations, {}",
            plan.record().start,
            plan.report().reorientation.outcome.iterations,
            plan.verdict().name(),
        );
    }
    Ok(())
}
