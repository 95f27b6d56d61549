//! A servicer of your own: other masses and limits, looked at before anything is planned.

use remora_core::prelude::*;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    }
    .validated()?;
    let mut planner = Box::new(Planner::new());
    let options = Options::builder().build()?;

    let mut mission = Mission::default();
    mission.servicer.bus_mass_kg = 350.0;
    mission.servicer.bus_inertia_kg_m2 *= 0.7;
    mission.servicer.bus_torque_limit_n_m.fill(0.02);
    let lighter = mission.validated()?;
    let plan = planner.plan(&lighter, &scenario, &options)?;
    println!("a lighter bus: {}", plan.verdict().name());

    // A number that no vehicle has is refused where the mission is validated ...
    mission.servicer.bus_mass_kg = -1.0;
    println!("refused: {}", mission.validated().err().ok_or("a mass is positive")?);

    // ... and what no plan can end well where it is to be planned.
    mission.servicer.bus_mass_kg = 350.0;
    mission.servicer.joint_rate_limit_rad_s.fill(1e-5);
    match planner.plan(&mission.validated()?, &scenario, &options) {
        Err(refusal) => println!("refused: {refusal}"),
        Ok(plan) => println!("{}", plan.verdict().name()),
    }
    Ok(())
}
