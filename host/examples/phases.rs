//! Where the time of Stage 2 goes: every call that the loop makes of its problem, counted and
//! timed over a set of scenarios. Medians, because a machine has other things to do as well.
//!
//! ```text
//! cargo run --release --example phases -- fixtures/scenarios/public.scenarios.json euler 20
//! ```

use remora_core::model::Mission;
use remora_core::planner::{Options, Workspace, plan};
use remora_core::qp::{Qp, QpOutcome, QpSolver, Solution};
use remora_core::scp::{self, Problem, Residuals};
use remora_core::stages::reorientation_size::{NR, NU, NX};
use remora_core::stages::{LINKS, Mode, NODES, Reorientation, ReorientationTrajectory, heuristic};
use remora_core::time::Deadline;
use remora_host::backend::ClarabelQp;
use remora_host::formats::ScenarioSet;
use remora_host::method::Integrator;
use remora_host::planning::WallClock;
use std::cell::RefCell;
use std::path::Path;
use std::time::Instant;

/// What is told apart.
#[derive(Clone, Copy)]
enum Phase {
    /// Jacobians alone.
    Linearise,
    /// Jacobians, curvature and its convexification.
    LineariseCurved,
    Bound,
    Retract,
    Residuals,
    Solve,
}

const NAMES: [&str; 6] = ["linearise", "and curvature", "bound", "retract", "residuals", "qp"];

/// Durations of all calls, by phase [us].
#[derive(Default)]
struct Times(RefCell<[Vec<f64>; 6]>);

impl Times {
    fn of<R>(&self, phase: Phase, call: impl FnOnce() -> R) -> R {
        let started = Instant::now();
        let result = call();
        self.0.borrow_mut()[phase as usize].push(started.elapsed().as_secs_f64() * 1e6);
        result
    }

    fn print(&self, plans: usize) {
        println!("phase          calls a plan  median [us]  a plan [ms]");
        for (name, times) in NAMES.iter().zip(self.0.borrow_mut().iter_mut()) {
            times.sort_by(f64::total_cmp);
            let median = times.get(times.len() / 2).copied().unwrap_or(0.0);
            let calls = times.len() as f64 / plans as f64;
            println!("{name:13} {calls:13.1} {median:12.1} {:12.2}", calls * median / 1e3);
        }
    }
}

type Stage2<'a> = Reorientation<'a, NODES, LINKS, NX, NU>;
type Motion = ReorientationTrajectory<NODES, LINKS>;
type Program = Qp<NODES, NX, NU, NR>;
type Point = Solution<NODES, NX, NU, NR>;

/// The problem, timed.
struct TimedProblem<'a>(Stage2<'a>, &'a Times);

impl Problem<NODES, NX, NU, NR> for TimedProblem<'_> {
    type Trajectory = Motion;

    fn clip(&self, z: &mut Motion) {
        self.0.clip(z);
    }

    fn linearise(&mut self, z: &Motion, multipliers: Option<&Point>, qp: &mut Program) {
        let phase = if multipliers.is_some() { Phase::LineariseCurved } else { Phase::Linearise };
        self.1.of(phase, || self.0.linearise(z, multipliers, qp));
    }

    fn bound(&self, z: &Motion, radius: f64, qp: &mut Program) {
        self.1.of(Phase::Bound, || self.0.bound(z, radius, qp));
    }

    fn retract(&self, from: &Motion, qp: &Program, step: &Point, to: &mut Motion) {
        self.1.of(Phase::Retract, || self.0.retract(from, qp, step, to));
    }

    fn residuals(&self, z: &Motion, out: &mut Residuals<NODES, NX, NR>) {
        self.1.of(Phase::Residuals, || self.0.residuals(z, out));
    }

    fn violation(&self, residuals: &Residuals<NODES, NX, NR>) -> f64 {
        self.0.violation(residuals)
    }

    fn step_length(&self, step: &Point) -> f64 {
        self.0.step_length(step)
    }
}

/// The solver, timed.
struct TimedSolver<'a>(ClarabelQp, &'a Times);

impl QpSolver<NODES, NX, NU, NR> for TimedSolver<'_> {
    fn reset(&mut self) {
        QpSolver::<NODES, NX, NU, NR>::reset(&mut self.0);
    }

    fn solve(&mut self, qp: &Program, out: &mut Point, deadline: &Deadline) -> QpOutcome {
        self.1.of(Phase::Solve, || self.0.solve(qp, out, deadline))
    }

    fn solve_again(&mut self, qp: &Program, out: &mut Point, deadline: &Deadline) -> QpOutcome {
        self.1.of(Phase::Solve, || self.0.solve_again(qp, out, deadline))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or("fixtures/scenarios/public.scenarios.json".into());
    let integrator: Integrator = arguments.next().unwrap_or("euler".into()).parse()?;
    let most: usize = arguments.next().map_or(Ok(usize::MAX), |text| text.parse())?;
    let set = ScenarioSet::read(Path::new(&file))?;
    let mission = Mission::<LINKS>::default();
    let mut options = Options::new(Mode::Optimal, integrator.core());
    let settings = options.reorientation;
    // Stage 2 of the plan itself is only there to be done again, timed.
    options.reorientation.max_iterations = 1;
    let mut workspace = Box::new(Workspace::new());
    let (mut one, mut two) = (ClarabelQp::default(), ClarabelQp::default());
    let (clock, times) = (WallClock::start(), Times::default());
    let plans = set.scenarios.len().min(most);
    let (mut iterations, mut cost) = (0, 0.0);
    for named in &set.scenarios[..plans] {
        let scenario = named.scenario();
        plan(&mission, &scenario, &options, (&mut one, &mut two), &clock, &mut workspace);
        let Workspace { target, translation, reorientation } = &mut *workspace;
        let path = &translation.trajectory;
        heuristic::warm_start(&mission, path, target, &mut reorientation.trajectory);
        let stage = Stage2::new(&mission, path, target, integrator.core(), Mode::Optimal);
        let mut problem = TimedProblem(stage, &times);
        let mut solver = TimedSolver(ClarabelQp::default(), &times);
        let outcome = scp::solve(&mut problem, &mut solver, &settings, &clock, reorientation);
        iterations += outcome.iterations;
        cost += problem.0.cost(&reorientation.trajectory.controls);
    }
    let mean = |sum: f64| sum / plans as f64;
    println!("{integrator}: {:.2} iterations, cost {:.6}", mean(iterations as f64), mean(cost));
    times.print(plans);
    Ok(())
}
