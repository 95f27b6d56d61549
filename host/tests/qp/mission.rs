//! All subproblems of the public scenarios, recorded while the embedded solver plans them, and
//! solved by Clarabel as well.

use remora_core::model::Mission;
use remora_core::qp::{Qp, QpOutcome, QpSolver, QpStatus, Solution};
use remora_core::stages::LINKS;
use remora_core::time::Deadline;
use remora_host::backend::{ClarabelQp, Solve};
use remora_host::formats::{PlanStatus, ScenarioSet};
use remora_host::kkt::{Kkt, distance, objective};
use remora_host::method::{Integrator, Method, Qp as Choice};
use remora_host::planning::{Planner, ReorientationSolve, STACK_BYTES, TranslationSolve};

/// How one subproblem went with both.
struct Pair {
    name: String,
    ours: (QpOutcome, Kkt),
    theirs: (QpOutcome, Kkt),
    /// Our objective beyond theirs, over one plus its size.
    excess: f64,
    distance: f64,
}

/// Solves what was recorded with Clarabel, from nothing.
fn pair<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    name: String,
    reference: &mut ClarabelQp,
    solve: &Solve<'_, N, NX, NU, NR>,
) -> Pair {
    let qp: &Qp<N, NX, NU, NR> = solve.qp;
    let mut point = Box::new(Solution::ZERO);
    let outcome = reference.solve(qp, &mut point, &Deadline::never());
    let (a, b) = (objective(qp, solve.solution), objective(qp, &point));
    Pair {
        name,
        ours: (solve.outcome, Kkt::of(qp, solve.solution)),
        theirs: (outcome, Kkt::of(qp, &point)),
        excess: (a - b) / (1.0 + b.abs()),
        distance: distance(solve.solution, &point),
    }
}

/// Every `step`th public scenario from `first`.
fn pairs(first: usize, step: usize) -> Vec<Pair> {
    let set = ScenarioSet::built_in().unwrap();
    let mission = Mission::<LINKS>::default();
    let method =
        Method { integrator: Integrator::EULER, qp: Choice::Embedded, ..Method::default() };
    let mut planner = Planner::new();
    let mut pairs = Vec::new();
    for scenario in set.scenarios.iter().skip(first).step_by(step) {
        // Tighter than in plans: the reference should be the better of the two.
        let tight = || ClarabelQp::with_tolerance(1e-11);
        let (mut one, mut two, mut ones, mut twos) = (tight(), tight(), Vec::new(), Vec::new());
        let mut watch_one = |solve: TranslationSolve<'_>| {
            ones.push(pair(format!("{} 1-{}", scenario.id, ones.len()), &mut one, &solve));
        };
        let mut watch_two = |solve: ReorientationSolve<'_>| {
            twos.push(pair(format!("{} 2-{}", scenario.id, twos.len()), &mut two, &solve));
        };
        let watchers = (&mut watch_one as _, &mut watch_two as _);
        let planned = planner.plan_watched(&mission, scenario, &method, watchers);
        assert_eq!(planned.file.status, PlanStatus::Solved, "{}", scenario.id);
        pairs.append(&mut ones);
        pairs.append(&mut twos);
    }
    pairs
}

/// On two threads, as there are that many cores nearly everywhere.
fn all_pairs() -> Vec<Pair> {
    std::thread::scope(|scope| {
        let start = |first: usize| {
            let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
            thread.spawn_scoped(scope, move || pairs(first, 2)).unwrap()
        };
        let threads = [start(0), start(1)];
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    })
}

/// Median, 99th percentile and largest.
fn spread(values: impl Iterator<Item = f64>) -> String {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    format!("median {:.1e}, p99 {:.1e}, max {:.1e}", at(0.5), at(0.99), at(1.0))
}

#[test]
fn embedded_and_clarabel_agree_on_every_subproblem_of_the_public_scenarios() {
    let pairs = all_pairs();
    let kkt = |pick: fn(&Kkt) -> f64| {
        let ours = spread(pairs.iter().map(|pair| pick(&pair.ours.1)));
        let theirs = spread(pairs.iter().map(|pair| pick(&pair.theirs.1)));
        format!("{ours}; Clarabel {theirs}")
    };
    println!("{} subproblems", pairs.len());
    println!("KKT: {}", kkt(Kkt::worst));
    println!("activity: {}", kkt(|kkt| kkt.activity));
    println!("distance: {}", spread(pairs.iter().map(|pair| pair.distance)));
    println!("objective: {}", spread(pairs.iter().map(|pair| pair.excess.abs())));
    println!("iterations: {}", spread(pairs.iter().map(|pair| pair.ours.0.iterations.into())));

    let line = |pair: &Pair| {
        let Pair { name, ours, theirs, excess, distance } = pair;
        format!("{name}: {distance:.1e} {excess:.1e}\n  {ours:?}\n  {theirs:?}")
    };
    let bad = |is_bad: &dyn Fn(&Pair) -> bool, what: &str| {
        let lines: Vec<String> = pairs.iter().filter(|pair| is_bad(pair)).map(line).collect();
        assert!(lines.is_empty(), "{what}: {}\n{}", lines.len(), lines.join("\n"));
    };
    bad(&|pair| pair.ours.0.status != QpStatus::Solved, "not solved");
    bad(&|pair| !(pair.ours.1.worst() <= 1e-8), "KKT residuals");
    bad(&|pair| !(pair.excess.abs() <= 1e-8), "objective");
    bad(&|pair| !(pair.distance <= 1e-6), "solution");
}
