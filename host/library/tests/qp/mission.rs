//! All subproblems of the public scenarios, recorded while the embedded solver plans them, and
//! solved again by it and by Clarabel, each to its own accuracy. Plans ask for less
//! ([`Qp::complementarity`]): what that costs them is judged too.
//!
//! These programs are flat: in some directions their curvature is 1e-5 and less, held there by
//! constraints with hardly any multiplier. Two points that are both optimal to 1e-9, objectives
//! equal to ten digits, can be 1e-3 apart: Clarabel at 1e-9 is that far from Clarabel at 1e-14. So
//! the yardstick is Clarabel's point made exact ([`polish`]).

use super::common::kkt::distance;
use super::common::programs::{cold, embedded, sharp};
use super::polish::polish;
use remora_core::advanced::planner::PlanSettings;
use remora_core::advanced::qp::{EmbeddedQp, Qp, QpOutcome, QpStatus};
use remora_core::advanced::stages::Mode;
use remora_host::backend::{ClarabelQp, Solve};
use remora_host::formats::{ScenarioSet, Status};
use remora_host::kkt::{Kkt, objective};
use remora_host::memory::STACK_BYTES;
use remora_host::method::{Integrator, Method, Qp as Choice};
use remora_host::planning::{Planner, Subproblem, WallClock};
use remora_host::request::PlanRequest;

/// How one subproblem went with both.
struct Pair {
    name: String,
    /// As the plan has it.
    in_plan: (QpOutcome, Kkt),
    /// Solved again from nothing, to the solver's own accuracy.
    own: (QpOutcome, Kkt),
    /// To the last digit.
    sharp: (QpOutcome, Kkt),
    theirs: (QpOutcome, Kkt),
    /// Objective in the plan beyond Clarabel's.
    given_away: f64,
    /// Our own objective beyond Clarabel's, over one plus its size.
    excess: f64,
    /// Against their point made exact, where that was found.
    exact: Option<Exact>,
}

/// Differences from the exact solution.
#[derive(Clone, Copy, Debug)]
struct Exact {
    /// Of the plan's solution, over the scaled unit one.
    in_plan: f64,
    /// Of that to our own accuracy.
    own: f64,
    /// Of the sharp one.
    sharp: f64,
    /// Of Clarabel's.
    clarabel: f64,
    /// Of our own objective, over one plus its size.
    objective: f64,
}

/// Solvers that solve again what was recorded: ours to its own accuracy and to the last digit, Clarabel.
struct Solvers<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    own: Box<EmbeddedQp<N, NX, NU, NG>>,
    sharp: Box<EmbeddedQp<N, NX, NU, NG>>,
    reference: ClarabelQp,
}

/// Solves what was recorded again, from nothing.
fn pair<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    name: String,
    solvers: &mut Solvers<N, NX, NU, NG>,
    solve: &Solve<'_, N, NX, NU, NG>,
) -> Pair {
    let exacting = Box::new(Qp { complementarity: 0.0, ..solve.qp.clone() });
    let qp: &Qp<N, NX, NU, NG> = &exacting;
    let Solvers { own, sharp, reference } = solvers;
    let (own, sharp) = (cold(&mut **own, qp), cold(&mut **sharp, qp));
    let theirs = cold(reference, qp);
    let (a, b) = (objective(qp, &own.point), objective(qp, &theirs.point));
    let exact = polish(qp, &theirs.point).map(|exact| {
        let least = objective(qp, &exact);
        Exact {
            in_plan: distance(solve.solution, &exact),
            own: distance(&own.point, &exact),
            sharp: distance(&sharp.point, &exact),
            clarabel: distance(&theirs.point, &exact),
            objective: (a - least).abs() / (1.0 + least.abs()),
        }
    });
    Pair {
        name,
        in_plan: (solve.outcome, Kkt::of(qp, solve.solution)),
        own: (own.outcome, Kkt::of(qp, &own.point)),
        sharp: (sharp.outcome, Kkt::of(qp, &sharp.point)),
        theirs: (theirs.outcome, Kkt::of(qp, &theirs.point)),
        given_away: objective(qp, solve.solution) - b,
        excess: (a - b) / (1.0 + b.abs()),
        exact,
    }
}

/// Every `step`th public scenario from `first`.
fn pairs(first: usize, step: usize) -> Vec<Pair> {
    let set = ScenarioSet::built_in().unwrap();
    let method =
        Method { integrator: Integrator::Euler, qp: Choice::Embedded, ..Method::default() };
    let request = PlanRequest { method, ..PlanRequest::default() };
    let mut planner = Planner::new();
    let mut pairs = Vec::new();
    for scenario in set.scenarios.iter().skip(first).step_by(step) {
        let reference = ClarabelQp::with_tolerance(1e-14);
        let mut solvers = Solvers { own: embedded(), sharp: sharp(), reference };
        let mut count = 0;
        let mut watch = |solve: Subproblem<'_>| {
            let name = format!("{} {}-{count}", scenario.id, solve.stage);
            pairs.push(pair(name, &mut solvers, &solve));
            count += 1;
        };
        let planned = planner.plan_watched(&WallClock::start(), &request, scenario, &mut watch);
        assert_eq!(planned.file.status, Status::Solved, "{}", scenario.id);
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

/// What two equal solutions or objectives may differ by.
const SAME: f64 = 1e-6;

/// What a plan may give away of a subproblem's objective.
const GIVEN_AWAY: f64 = 7e-7;

fn statistics(pairs: &[Pair]) {
    let show = |what: &str, pick: fn(&Pair) -> f64| {
        println!("{what}: {}", spread(pairs.iter().map(pick)));
    };
    println!("{} subproblems", pairs.len());
    show("KKT, in plans", |pair| pair.in_plan.1.worst());
    show("KKT, own", |pair| pair.own.1.worst());
    show("KKT, sharp", |pair| pair.sharp.1.worst());
    show("KKT, Clarabel", |pair| pair.theirs.1.worst());
    show("activity, in plans", |pair| pair.in_plan.1.activity);
    show("activity, own", |pair| pair.own.1.activity);
    show("activity, sharp", |pair| pair.sharp.1.activity);
    show("activity, Clarabel", |pair| pair.theirs.1.activity);
    let exact: Vec<Exact> = pairs.iter().filter_map(|pair| pair.exact).collect();
    println!("{} of them with an exact solution; from it", exact.len());
    for (what, pick) in [
        ("in plans", (|exact| exact.in_plan) as fn(&Exact) -> f64),
        ("own", |exact| exact.own),
        ("sharp", |exact| exact.sharp),
        ("Clarabel", |exact| exact.clarabel),
        ("objective, own, relative", |exact| exact.objective),
    ] {
        let within = exact.iter().filter(|exact| pick(exact) <= SAME).count();
        println!("- {what}: {}; {within} within {SAME}", spread(exact.iter().map(pick)));
    }
    show("objective from Clarabel's, own, relative", |pair| pair.excess.abs());
    show("objective from Clarabel's, in plans", |pair| pair.given_away);
    show("iterations, in plans", |pair| pair.in_plan.0.iterations.into());
    show("iterations, own", |pair| pair.own.0.iterations.into());
    show("iterations, sharp", |pair| pair.sharp.0.iterations.into());
}

// Verifies REM-QP-001.
#[test]
fn embedded_and_clarabel_agree_on_every_subproblem_of_the_public_scenarios() {
    let pairs = all_pairs();
    statistics(&pairs);
    let line = |pair: &Pair| {
        let Pair { name, in_plan, own, sharp, theirs, given_away, excess, exact } = pair;
        format!(
            "{name}: {excess:.1e} {given_away:.1e} {exact:?}\n\
            {in_plan:?}\n{own:?}\n{sharp:?}\n{theirs:?}"
        )
    };
    let none = |is_bad: &dyn Fn(&Pair) -> bool, what: &str| {
        let lines: Vec<String> = pairs.iter().filter(|pair| is_bad(pair)).map(line).collect();
        assert!(lines.is_empty(), "{what}: {}\n{}", lines.len(), lines.join("\n"));
    };
    // Of all, those without an exact solution included.
    let share = |is_good: &dyn Fn(Exact) -> bool| {
        let good = pairs.iter().filter(|pair| pair.exact.is_some_and(is_good)).count();
        good as f64 / pairs.len() as f64
    };
    none(&|pair| pair.own.0.status != QpStatus::Solved, "not solved");
    none(&|pair| !(pair.own.1.worst() <= 1e-8), "KKT residuals");
    none(&|pair| !(pair.excess.abs() <= 1e-8), "objective from Clarabel's");
    none(&|pair| pair.exact.is_some_and(|exact| !(exact.objective <= 1e-8)), "objective");
    none(&|pair| pair.exact.is_some_and(|exact| !(exact.sharp <= SAME)), "solution");
    // The yardstick must not shrink unnoticed.
    assert!(share(&|_| true) >= 0.99);
    // The solver's own accuracy is not as sharp, and hardly ever elsewhere.
    assert!(share(&|exact| exact.own <= SAME) >= 0.95);
    // Plans give away less than a hundredth of the least change of the cost that counts.
    none(&|pair| pair.in_plan.0.status != QpStatus::Solved, "not solved in the plan");
    let settings = PlanSettings::new(Mode::Optimal, Integrator::Euler).reorientation;
    assert!(GIVEN_AWAY < 1e-2 * settings.absolute_cost_tolerance);
    none(&|pair| !(pair.given_away <= GIVEN_AWAY), "given away in the plan");
}
