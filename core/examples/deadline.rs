//! A plan that must be there in time: what is left when time is up, and whether it can be flown.

use remora_core::prelude::*;
use std::error::Error;
use std::time::Instant;

/// The clock of a desktop; on a board, a timer's register.
struct WallClock(Instant);

impl Clock for WallClock {
    fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mission = Mission::default().validated()?;
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    }
    .validated()?;
    let clock = WallClock(Instant::now());
    let mut planner = Box::new(Planner::new());
    for milliseconds in [5.0, 50.0, 500.0, 5000.0] {
        // For the whole plan, its verification included.
        let options = Options::builder().clock(&clock, 1e-3 * milliseconds).build()?;
        let plan = planner.plan(&mission, &scenario, &options)?;
        let took = 1e3 * plan.report().times.total_s;
        println!("{milliseconds} ms asked, {took:.1} ms taken: {}", plan.verdict().name());
    }
    Ok(())
}
