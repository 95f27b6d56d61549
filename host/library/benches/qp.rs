//! Cost of a subproblem: the embedded solver against Clarabel on the same programs, those that
//! plans of some public scenarios solve.
//!
//! Before Criterion's measurements it prints a table over all these programs: medians and their
//! ratio, and how much of the core's peak the embedded solver uses. Both solvers start from
//! nothing; Clarabel once with its structures to be built (the first program of a plan) and once
//! with its numbers updated in place (all others).

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::SVector;
use remora_core::advanced::qp::{EmbeddedQp, Qp, QpSolver, Solution};
use remora_core::advanced::stages::{NODES, size};
use remora_core::advanced::time::Deadline;
use remora_host::backend::{ClarabelQp, Solve};
use remora_host::formats::ScenarioSet;
use remora_host::memory::on_heap;
use remora_host::method::{Integrator, Method, Qp as Choice};
use remora_host::planning::{Planner, Subproblem, WallClock};
use remora_host::request::PlanRequest;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Every so many of the public scenarios is planned.
const EVERY: usize = 10;

/// The programs of one stage, with those of the first and the last iteration of each plan apart.
struct Programs<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    all: Vec<Qp<N, NX, NU, NG>>,
    early: Vec<usize>,
    late: Vec<usize>,
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Programs<N, NX, NU, NG> {
    fn new() -> Self {
        Self { all: Vec::new(), early: Vec::new(), late: Vec::new() }
    }

    fn add(&mut self, solve: &Solve<'_, N, NX, NU, NG>) {
        self.all.push(solve.qp.clone());
    }

    /// Marks what has been added since the last call as the programs of one plan.
    fn end_of_plan(&mut self, from: usize) {
        self.early.push(from);
        self.late.push(self.all.len() - 1);
    }
}

type OfOneSize = Qp<NODES, { size::NX }, { size::NU }, { size::NG }>;
type OfOneStage = Programs<NODES, { size::NX }, { size::NU }, { size::NG }>;

/// Plans and keeps what was solved in stages 1 and 2.
fn programs() -> (OfOneStage, OfOneStage) {
    let set = ScenarioSet::built_in().expect("the built-in scenarios");
    let method =
        Method { integrator: Integrator::Euler, qp: Choice::Embedded, ..Method::default() };
    let request = PlanRequest { method, ..PlanRequest::default() };
    let (mut ones, mut twos) = (OfOneStage::new(), OfOneStage::new());
    for scenario in set.scenarios.iter().step_by(EVERY) {
        let from = (ones.all.len(), twos.all.len());
        let mut watch = |solve: Subproblem<'_>| match solve.stage {
            1 => ones.add(&solve),
            _ => twos.add(&solve),
        };
        Planner::new().plan_watched(&WallClock::start(), &request, scenario, &mut watch);
        ones.end_of_plan(from.0);
        twos.end_of_plan(from.1);
    }
    (ones, twos)
}

/// States and controls of Stage 1 without padding: position, velocity and the force before; force.
const OWN: (usize, usize) = (9, 3);

/// A program of Stage 1 without the variables that pad it to Stage 2's size. In plans both have one, so that
/// they share memory: this is what that costs.
fn unpadded(qp: &OfOneSize) -> Qp<NODES, { OWN.0 }, { OWN.1 }, { size::NG }> {
    let mut own = Qp { unused: qp.unused, constant: qp.constant, ..Qp::ZERO };
    (own.defect_penalty, own.path_penalty) = (qp.defect_penalty, qp.path_penalty);
    for (to, from) in own.stages.iter_mut().zip(&qp.stages) {
        to.hessian_xx = from.hessian_xx.fixed_view::<{ OWN.0 }, { OWN.0 }>(0, 0).into();
        to.hessian_ux = from.hessian_ux.fixed_view::<{ OWN.1 }, { OWN.0 }>(0, 0).into();
        to.hessian_uu = from.hessian_uu.fixed_view::<{ OWN.1 }, { OWN.1 }>(0, 0).into();
        to.a = from.a.fixed_view::<{ OWN.0 }, { OWN.0 }>(0, 0).into();
        to.b = from.b.fixed_view::<{ OWN.0 }, { OWN.1 }>(0, 0).into();
        to.path_jacobian = from.path_jacobian.fixed_columns::<{ OWN.0 }>(0).into();
        to.path_offset = from.path_offset;
        let states = |all: &SVector<f64, { size::NX }>| all.fixed_rows::<{ OWN.0 }>(0).into();
        (to.gradient_x, to.c) = (states(&from.gradient_x), states(&from.c));
        (to.lower_x, to.upper_x) = (states(&from.lower_x), states(&from.upper_x));
        let controls = |all: &SVector<f64, { size::NU }>| all.fixed_rows::<{ OWN.1 }>(0).into();
        to.gradient_u = controls(&from.gradient_u);
        (to.lower_u, to.upper_u) = (controls(&from.lower_u), controls(&from.upper_u));
    }
    own
}

/// Floating-point operations that one interior-point iteration needs, multiplications and
/// additions alike. Of a symmetric result one triangle counts, though the solver computes blocks of
/// four rows for the sake of vector registers: more is done than is counted. What is linear in the
/// sizes is left out but for the vectors of the four bounds a variable can have.
fn flops_per_iteration(n: usize, nx: usize, nu: usize, nr: usize) -> f64 {
    let [n, nx, nu, nr] = [n, nx, nu, nr].map(|size| size as f64);
    let nz = nx + nu;
    // The soft rows' share of the Hessian: lower triangle of C^T D C.
    let rows = nr * nx * (nx + 1.0);
    // P [A B], and the lower triangle of [A B]^T P [A B].
    let products = 2.0 * nx * nx * nz + nx * nz * (nz + 1.0);
    // Cholesky of the control block, its solve for the gains, and the downdate of the state block.
    let controls = nu * nu * nu / 3.0 + nx * nu * nu + nu * nx * (nx + 1.0);
    // Predictor and corrector: forward and backward through A, B, gains, factors and P.
    let solve = 4.0 * nx * nz + 4.0 * nu * nx + 2.0 * nu * nu + 4.0 * nx * nx + 4.0 * nr * nx;
    // Residuals with the Hessian, the dynamics and the rows; and ten passes over all bounds.
    let residuals = 2.0 * nz * nz + 4.0 * nx * nz + 4.0 * nr * nx;
    let vectors = 10.0 * 4.0 * (nx + nu + nr);
    n * (rows + products + controls + 2.0 * solve + residuals + vectors)
}

/// Peak rate of one core [flop/s]: multiplications and additions in vectors of four, not fused,
/// with enough of them independent.
fn peak() -> f64 {
    const LANES: usize = 48;
    const ROUNDS: usize = 4_000_000;
    let mut values = [1.0f64; LANES];
    let (factor, term) = (black_box(0.999_999), black_box(1e-6));
    let best = (0..5).map(|_| {
        let started = Instant::now();
        for _ in 0..ROUNDS {
            values.iter_mut().for_each(|value| *value = *value * factor + term);
        }
        black_box(&mut values);
        started.elapsed().as_secs_f64()
    });
    (2 * LANES * ROUNDS) as f64 / best.fold(f64::INFINITY, f64::min)
}

/// A solver that has never solved anything.
fn fresh<const N: usize, const NX: usize, const NU: usize, const NG: usize>()
-> Box<EmbeddedQp<N, NX, NU, NG>> {
    on_heap(EmbeddedQp::new)
}

/// Solves from nothing; returns the iterations.
fn cold<S, const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    solver: &mut S,
    qp: &Qp<N, NX, NU, NG>,
    point: &mut Solution<N, NX, NU, NG>,
) -> u32
where
    S: QpSolver<N, NX, NU, NG>,
{
    point.clear_multipliers();
    solver.solve(black_box(qp), point, &Deadline::never()).iterations
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Median time of a few runs [s].
fn timed(runs: usize, mut run: impl FnMut()) -> f64 {
    let once = |_| {
        let started = Instant::now();
        run();
        started.elapsed().as_secs_f64()
    };
    median((0..runs).map(once).collect())
}

/// The table's line of one stage.
fn summary<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    name: &str,
    programs: &[Qp<N, NX, NU, NG>],
    peak: f64,
) {
    let mut point = Box::new(Solution::ZERO);
    let mut ours = fresh();
    let (mut embedded, mut first, mut in_place) = (Vec::new(), Vec::new(), Vec::new());
    let (mut iterations, mut rates) = (Vec::new(), Vec::new());
    let flops = flops_per_iteration(N, NX, NU, NG);
    for qp in programs {
        let mut count = 0;
        let time = timed(9, || {
            QpSolver::<N, NX, NU, NG>::reset(&mut *ours);
            count = cold(&mut *ours, qp, &mut point);
        });
        embedded.push(time);
        iterations.push(f64::from(count));
        rates.push(flops * f64::from(count) / time);
        first.push(timed(3, || {
            cold(&mut ClarabelQp::default(), qp, &mut point);
        }));
        let mut theirs = ClarabelQp::default();
        cold(&mut theirs, qp, &mut point);
        in_place.push(timed(3, || {
            cold(&mut theirs, qp, &mut point);
        }));
    }
    let [embedded, first, in_place, iterations, rate] =
        [embedded, first, in_place, iterations, rates].map(median);
    println!(
        "{name:<16} {:>5}  {:>8.3}  {:>5} x {:>6.3}  {:>8.2} ({:>5.1} x)  {:>8.2} ({:>5.1} x)",
        programs.len(),
        embedded * 1e3,
        iterations,
        embedded / iterations * 1e3,
        first * 1e3,
        first / embedded,
        in_place * 1e3,
        in_place / embedded,
    );
    println!(
        "{:<16} {:.2} Mflop an iteration, {:.2} Gflop/s, {:.0} % of the peak of {:.1} Gflop/s",
        "",
        flops * 1e-6,
        rate * 1e-9,
        100.0 * rate / peak,
        peak * 1e-9,
    );
}

/// Criterion's measurements over programs one after the other.
fn compare<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    c: &mut Criterion,
    name: &str,
    programs: Vec<&Qp<N, NX, NU, NG>>,
) {
    let mut group = c.benchmark_group(name);
    group.sample_size(20).warm_up_time(Duration::from_millis(300));
    group.measurement_time(Duration::from_secs(2));
    let mut point = Box::new(Solution::ZERO);
    let mut ours = fresh();
    let mut next = programs.iter().cycle();
    group.bench_function("embedded", |b| {
        b.iter(|| {
            QpSolver::<N, NX, NU, NG>::reset(&mut *ours);
            next.next().map(|qp| cold(&mut *ours, qp, &mut point))
        });
    });
    let mut next = programs.iter().cycle();
    group.bench_function("clarabel first", |b| {
        b.iter(|| next.next().map(|qp| cold(&mut ClarabelQp::default(), qp, &mut point)));
    });
    let mut theirs: Vec<ClarabelQp> = Vec::new();
    theirs.resize_with(programs.len(), ClarabelQp::default);
    for (solver, qp) in theirs.iter_mut().zip(&programs) {
        cold(solver, qp, &mut point);
    }
    let mut turn = (0..programs.len()).cycle();
    group.bench_function("clarabel in place", |b| {
        b.iter(|| turn.next().map(|i| cold(&mut theirs[i], programs[i], &mut point)));
    });
    group.finish();
}

fn qp(c: &mut Criterion) {
    let (one, two) = programs();
    let peak = peak();
    println!("median over the programs, cold       time [ms]");
    println!("stage            count  embedded  iterations      clarabel first     in place");
    summary("1 translation", &one.all, peak);
    let own: Vec<_> = one.all.iter().map(unpadded).collect();
    summary("1 unpadded", &own, peak);
    summary("2 reorientation", &two.all, peak);
    println!();
    fn pick<'a, T>(all: &'a [T], which: &[usize]) -> Vec<&'a T> {
        which.iter().map(|i| &all[*i]).collect()
    }
    compare(c, "stage 1 early", pick(&one.all, &one.early));
    compare(c, "stage 1 late", pick(&one.all, &one.late));
    compare(c, "stage 2 early", pick(&two.all, &two.early));
    compare(c, "stage 2 late", pick(&two.all, &two.late));
}

criterion_group!(benches, qp);
criterion_main!(benches);
