//! Plans an approach and looks at what came out.

use remora_core::prelude::*;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mission = Mission::default().validated()?;
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    }
    .validated()?;
    let options = Options::builder().mode(Mode::Optimal).integrator(Integrator::RK4).build()?;
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options)?;

    let report = plan.report();
    println!("{}: {}", plan.verdict().name(), if plan.is_verified() { "fly it" } else { "do not" });
    println!("iterations: {}", report.reorientation.outcome.iterations);
    println!("cost of attitude and arm: {:.4}", report.reorientation.cost);
    let torque = plan.controls().iter().map(|control| control.bus_torque.amax());
    println!("largest bus torque: {:.2e} N m", torque.fold(0.0, f64::max));
    let last = plan.states().last().ok_or("a plan has states")?;
    println!("joints at capture: {:.3}", last.joint_angle.transpose());
    Ok(())
}
