//! A second core: both pieces of each linearisation at the same time, the same bits.

use remora_core::prelude::*;
use std::error::Error;

/// A thread for the second piece. A board has its second core awake and waiting instead: pieces take
/// 0.02 to 1 ms, about as long as it takes to start a thread.
struct Threads;

impl ForkJoin for Threads {
    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        std::thread::scope(|scope| {
            let second = scope.spawn(b);
            let first = a();
            match second.join() {
                Ok(second) => (first, second),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
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
    let mut planner = Box::new(Planner::new());
    let alone = planner.plan(&mission, &scenario, &Options::builder().build()?)?.record().output;
    let options = Options::builder().second_core(&Threads).build()?;
    let together = planner.plan(&mission, &scenario, &options)?.record().output;
    println!("one core {alone:016x}, two {together:016x}");
    assert_eq!(alone, together);
    Ok(())
}
