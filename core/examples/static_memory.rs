//! All memory static, as on a board without a heap. The planner's bits are zero: they take no room in
//! the image and are there when the program starts.

use remora_core::prelude::*;
use static_cell::ConstStaticCell;
use std::error::Error;

static PLANNER: ConstStaticCell<Planner> = ConstStaticCell::new(Planner::new());
static NETWORK: ConstStaticCell<NetworkMemory> = ConstStaticCell::new(NetworkMemory::new());
static FILE: &[u8] = include_bytes!("../../fixtures/models/euler.model");

fn main() -> Result<(), Box<dyn Error>> {
    let (planner, memory) = (PLANNER.take(), NETWORK.take());
    println!("planner: {} bytes, network: {} bytes", Planner::BYTES, size_of_val(memory));

    let mission = Mission::default().validated()?;
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    }
    .validated()?;
    let model = Model::open(FILE)?;
    let policy = NetworkPolicy::new(Network::new(&model, memory)?)?;
    let guess = InitialGuess::Learned { policy: &policy, seed: 0 };
    let builder = Options::builder().integrator(Integrator::Euler).initial_guess(guess);
    let plan = planner.plan(&mission, &scenario, &builder.build()?)?;
    println!("{}, checksum {:016x}", plan.verdict().name(), plan.record().output);
    Ok(())
}
