//! How many iterations a good start saves: every scenario of a set is planned from the heuristic,
//! its torques are disturbed smoothly and rolled out, and Stage 2 is planned again from there.
//!
//! ```text
//! cargo run --release --example warm_start -- fixtures/scenarios/public.scenarios.json 0.05
//! ```

use remora_core::dynamics::Integrator;
use remora_core::model::Mission;
use remora_core::pair::Sequential;
use remora_core::planner::{Environment, Options, Start, Workspace, plan, plan_reorientation};
use remora_core::scp::Status;
use remora_core::stages::{LINKS, Mode};
use remora_host::backend::ClarabelQp;
use remora_host::formats::ScenarioSet;
use remora_host::perturbation::disturb;
use remora_host::planning::WallClock;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or("fixtures/scenarios/public.scenarios.json".into());
    let size: f64 = arguments.next().map_or(Ok(0.05), |text| text.parse())?;
    let set = ScenarioSet::read(Path::new(&file))?;
    let mission = Mission::<LINKS>::default();
    let options = Options::new(Mode::Optimal, Integrator::Euler);
    let mut workspace = Box::new(Workspace::new());
    let mut solver = ClarabelQp::default();
    let environment = Environment { clock: &WallClock::start(), pair: &Sequential };
    let mut sums = [0.0; 5];
    let mut solved = 0;
    for (k, named) in set.scenarios.iter().enumerate() {
        let scenario = named.scenario();
        let first = plan(
            &mission,
            &scenario,
            &options,
            &mut Start::Heuristic,
            &mut solver,
            &environment,
            &mut workspace,
        );
        let Workspace { translation, reorientation, .. } = &mut *workspace;
        let (path, motion) = (&translation.trajectory, &mut reorientation.trajectory);
        disturb(&mission, options.integrator, path, motion, size, k as u64);
        let again =
            plan_reorientation(&mission, &options, &mut solver, &environment, &mut workspace);
        solved += usize::from(again.outcome.status == Status::Solved);
        let ratio = again.cost / first.reorientation.cost;
        println!(
            "{}: {} iterations from the heuristic, {} from the disturbed plan, cost x {ratio:.4}",
            named.id, first.reorientation.outcome.iterations, again.outcome.iterations,
        );
        let row = [
            first.reorientation.outcome.iterations as f64,
            again.outcome.iterations as f64,
            again.outcome.corrections as f64,
            again.time_s,
            ratio,
        ];
        sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
    }
    let n = set.scenarios.len() as f64;
    let [heuristic, disturbed, corrections, time, ratio] = sums.map(|sum| sum / n);
    println!("solved {solved} of {n}; mean iterations {heuristic:.2} -> {disturbed:.2}");
    println!("mean corrections {corrections:.2}, time {time:.3} s, cost x {ratio:.4}");
    Ok(())
}
