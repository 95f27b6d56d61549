//! The stage-structured program solved by Clarabel.
//!
//! Variables, in order: the nodes' `[x_k; u_k]`, then the slacks of the dynamics (positive and
//! negative parts, where they are soft), then the slacks of the rows. Structure and symbolic
//! factorisation are built at the first solve of a plan; later solves overwrite numbers in place.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use remora_core::advanced::qp::{Qp, QpOutcome, QpSolver, QpStage, QpStatus, Solution};
use remora_core::advanced::time::Deadline;

/// Clarabel behind the core's solver trait: single-threaded, presolve off, tolerances 1e-9.
///
/// Accuracy is absolute and relative 1e-9 in the scaled variables of the program. Memory: the
/// sparse factorisation, a few MiB for Stage 2.
pub struct ClarabelQp {
    built: Option<Built>,
    tolerance: f64,
}

impl ClarabelQp {
    /// With another accuracy than 1e-9, to compare others with.
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { built: None, tolerance }
    }
}

impl Default for ClarabelQp {
    fn default() -> Self {
        Self::with_tolerance(1e-9)
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> QpSolver<N, NX, NU, NG>
    for ClarabelQp
{
    fn reset(&mut self) {
        self.built = None;
    }

    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        if deadline.has_passed() {
            return QpOutcome { status: QpStatus::TimeLimit, iterations: 0 };
        }
        if !is_sound(qp) {
            return QpOutcome::default();
        }
        let fits = self.built.as_ref().is_some_and(|built| built.layout.fits(qp));
        let updated = fits && self.built.as_mut().is_some_and(|built| built.update(qp).is_ok());
        if !updated {
            let Some(fresh) = Built::new(qp, self.tolerance) else { return QpOutcome::default() };
            self.built = Some(fresh);
        }
        let Some(built) = &mut self.built else { return QpOutcome::default() };
        built.solver.solve();
        built.read(solution);
        let status = map_status(built.solver.solution.status);
        let status = match status.is_usable() && !solution.is_finite() {
            true => QpStatus::NumericalFailure,
            false => status,
        };
        QpOutcome { status, iterations: built.solver.solution.iterations }
    }
}

fn map_status(status: SolverStatus) -> QpStatus {
    match status {
        SolverStatus::Solved => QpStatus::Solved,
        SolverStatus::AlmostSolved => QpStatus::ReducedAccuracy,
        SolverStatus::PrimalInfeasible => QpStatus::Infeasible,
        SolverStatus::AlmostPrimalInfeasible => QpStatus::AlmostInfeasible,
        SolverStatus::DualInfeasible => QpStatus::Unbounded,
        SolverStatus::AlmostDualInfeasible => QpStatus::AlmostUnbounded,
        SolverStatus::MaxIterations => QpStatus::IterationLimit,
        SolverStatus::MaxTime => QpStatus::TimeLimit,
        SolverStatus::InsufficientProgress => QpStatus::Stalled,
        SolverStatus::CallbackTerminated => QpStatus::Interrupted,
        SolverStatus::NumericalError | SolverStatus::Unsolved => QpStatus::NumericalFailure,
    }
}

fn settings(tolerance: f64) -> Option<DefaultSettings<f64>> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .presolve_enable(false)
        .input_sparse_dropzeros(false)
        // The program comes scaled; without equilibration an update in place is exactly a rebuild.
        .equilibrate_enable(false)
        .max_threads(1)
        .direct_solve_method("qdldl".to_string())
        .max_iter(100)
        .tol_gap_abs(tolerance)
        .tol_gap_rel(tolerance)
        .tol_feas(tolerance)
        .build()
        .ok()
}

/// Where a number of the sparse program comes from.
#[derive(Clone, Copy)]
enum Source {
    Constant(f64),
    /// Entry of `[H_xx, H_ux^T; H_ux, H_uu]`, local indices.
    Hessian(usize, usize, usize),
    /// Minus an entry of `[A, B]`.
    Dynamics(usize, usize, usize),
    /// Entry of the soft rows.
    Row(usize, usize, usize),
    /// Entry of `c`.
    Offset(usize, usize),
    /// Minus an entry of the row offsets.
    RowOffset(usize, usize),
    /// Upper bound, local index over `[x; u]`.
    Upper(usize, usize),
    /// Minus a lower bound.
    Lower(usize, usize),
    /// Linear cost, local index over `[x; u]`.
    Gradient(usize, usize),
}

/// Which bounds a variable has; part of the program's structure.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Bounds {
    lower: bool,
    upper: bool,
    pinned: bool,
}

fn bounds_of(lower: f64, upper: f64) -> Bounds {
    let pinned = lower == upper;
    Bounds { pinned, lower: !pinned && lower.is_finite(), upper: !pinned && upper.is_finite() }
}

/// Whether all that counts is a number, or an infinity that means something. The solver would take
/// other infinities for bounds that do not exist, and never looks at half of each Hessian.
fn is_sound<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
) -> bool {
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    let bounds = |lower: &[f64], upper: &[f64]| {
        lower.iter().all(|v| *v < f64::INFINITY) && upper.iter().all(|v| *v > f64::NEG_INFINITY)
    };
    let node = |s: &QpStage<NX, NU, NG>| {
        finite(s.hessian_xx.as_slice())
            && finite(s.gradient_x.as_slice())
            && bounds(s.lower_x.as_slice(), s.upper_x.as_slice())
            && finite(s.path_jacobian.as_slice())
            && finite(s.path_offset.as_slice())
    };
    let interval = |s: &QpStage<NX, NU, NG>| {
        finite(s.hessian_ux.as_slice())
            && finite(s.hessian_uu.as_slice())
            && finite(s.gradient_u.as_slice())
            && finite(s.a.as_slice())
            && finite(s.b.as_slice())
            && finite(s.c.as_slice())
            && bounds(s.lower_u.as_slice(), s.upper_u.as_slice())
    };
    qp.defect_penalty > 0.0
        && finite(&[qp.constant, qp.path_penalty])
        && qp.used().iter().all(node)
        && qp.used().iter().take(qp.nodes() - 1).all(interval)
}

/// Entries of the blocks that may differ from zero, over all nodes.
#[derive(Clone, PartialEq)]
struct Pattern {
    hessian: Vec<bool>,
    dynamics: Vec<bool>,
    rows: Vec<bool>,
}

/// Entry of a node's data by local index over `[x; u]`.
trait Entries {
    fn hessian(&self, i: usize, j: usize) -> f64;
    fn dynamics(&self, i: usize, j: usize) -> f64;
    fn gradient(&self, i: usize) -> f64;
    fn bounds(&self, i: usize) -> (f64, f64);
}

impl<const NX: usize, const NU: usize, const NG: usize> Entries for QpStage<NX, NU, NG> {
    fn hessian(&self, i: usize, j: usize) -> f64 {
        match (i < NX, j < NX) {
            (true, true) => self.hessian_xx[(i, j)],
            (false, true) => self.hessian_ux[(i - NX, j)],
            (true, false) => self.hessian_ux[(j - NX, i)],
            (false, false) => self.hessian_uu[(i - NX, j - NX)],
        }
    }

    fn dynamics(&self, i: usize, j: usize) -> f64 {
        if j < NX { self.a[(i, j)] } else { self.b[(i, j - NX)] }
    }

    fn gradient(&self, i: usize) -> f64 {
        if i < NX { self.gradient_x[i] } else { self.gradient_u[i - NX] }
    }

    fn bounds(&self, i: usize) -> (f64, f64) {
        if i < NX {
            (self.lower_x[i], self.upper_x[i])
        } else {
            (self.lower_u[i - NX], self.upper_u[i - NX])
        }
    }
}

impl Pattern {
    fn of<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
    ) -> Self {
        let nz = NX + NU;
        let mut pattern = Self {
            hessian: vec![false; nz * nz],
            dynamics: vec![false; NX * nz],
            rows: vec![false; NG * NX],
        };
        for (k, stage) in qp.used().iter().enumerate() {
            let last = k + 1 == qp.nodes();
            let width = if last { NX } else { nz };
            for j in 0..width {
                for i in 0..=j {
                    pattern.hessian[i * nz + j] |= i == j || stage.hessian(i, j) != 0.0;
                }
                for i in 0..if last { 0 } else { NX } {
                    pattern.dynamics[i * nz + j] |= stage.dynamics(i, j) != 0.0;
                }
            }
            for j in 0..NX {
                for i in 0..NG {
                    pattern.rows[i * NX + j] |= stage.path_jacobian[(i, j)] != 0.0;
                }
            }
        }
        pattern
    }

    fn covers(&self, other: &Self) -> bool {
        let within = |a: &[bool], b: &[bool]| a.iter().zip(b).all(|(a, b)| *a || !*b);
        within(&self.hessian, &other.hessian)
            && within(&self.dynamics, &other.dynamics)
            && within(&self.rows, &other.rows)
    }
}

/// The structure of the sparse program and where each of its numbers comes from.
struct Layout {
    nodes: usize,
    pattern: Pattern,
    bounds: Vec<Bounds>,
    soft: bool,
    p: Vec<Source>,
    q: Vec<Source>,
    a: Vec<Source>,
    b: Vec<Source>,
}

struct Built {
    layout: Layout,
    solver: DefaultSolver<f64>,
    values: Vec<f64>,
}

/// All bounds of a program in variable order.
fn all_bounds<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
) -> impl Iterator<Item = Bounds> + '_ {
    qp.used().iter().enumerate().flat_map(|(k, stage)| {
        let width = if k + 1 == qp.nodes() { NX } else { NX + NU };
        (0..width).map(move |i| {
            let (lower, upper) = stage.bounds(i);
            bounds_of(lower, upper)
        })
    })
}

impl Layout {
    fn fits<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &self,
        qp: &Qp<N, NX, NU, NG>,
    ) -> bool {
        self.nodes == qp.nodes()
            && self.soft == qp.defect_penalty.is_finite()
            && all_bounds(qp).eq(self.bounds.iter().copied())
            && self.pattern.covers(&Pattern::of(qp))
    }
}

/// A sparse matrix under construction, by columns, with the source of each entry.
struct Columns(Vec<Vec<(usize, Source)>>);

impl Columns {
    fn compress(mut self, rows: usize) -> (CscMatrix<f64>, Vec<Source>) {
        let (mut pointers, mut indices, mut sources) = (vec![0], Vec::new(), Vec::new());
        for column in &mut self.0 {
            column.sort_by_key(|(row, _)| *row);
            for (row, source) in column.iter() {
                indices.push(*row);
                sources.push(*source);
            }
            pointers.push(indices.len());
        }
        let zeros = vec![0.0; indices.len()];
        (CscMatrix::new(rows, self.0.len(), pointers, indices, zeros), sources)
    }
}

/// Clarabel's matrices and vectors in the making: where each entry comes from.
struct Assembly<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    qp: &'a Qp<N, NX, NU, NG>,
    pattern: Pattern,
    bounds: Vec<Bounds>,
    soft: bool,
    p: Columns,
    q: Vec<Source>,
    a: Columns,
    b: Vec<Source>,
}

impl<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    Assembly<'a, N, NX, NU, NG>
{
    /// States and controls of a node.
    const NZ: usize = NX + NU;
    fn new(qp: &'a Qp<N, NX, NU, NG>) -> Self {
        let soft = qp.defect_penalty.is_finite();
        let mut assembly = Self {
            qp,
            pattern: Pattern::of(qp),
            bounds: all_bounds(qp).collect(),
            soft,
            p: Columns(Vec::new()),
            q: Vec::new(),
            a: Columns(Vec::new()),
            b: Vec::new(),
        };
        let variables = assembly.row_slack() + qp.nodes() * NG;
        assembly.p.0.resize(variables, Vec::new());
        assembly.a.0.resize(variables, Vec::new());
        assembly
    }

    /// The first slack: behind states and controls, of which the last node has none.
    fn slack(&self) -> usize {
        let nodes = self.qp.nodes();
        nodes * NX + (nodes - 1) * NU
    }

    /// The first slack of the soft rows: behind those of soft dynamics, two for each.
    fn row_slack(&self) -> usize {
        self.slack() + if self.soft { 2 * (self.qp.nodes() - 1) * NX } else { 0 }
    }

    fn variables(&self) -> usize {
        self.a.0.len()
    }

    fn objective(&mut self) {
        for k in 0..self.qp.nodes() {
            let width = if k + 1 == self.qp.nodes() { NX } else { Self::NZ };
            for j in 0..width {
                self.q.push(Source::Gradient(k, j));
                for i in 0..=j {
                    if self.pattern.hessian[i * Self::NZ + j] {
                        let entry = (k * Self::NZ + i, Source::Hessian(k, i, j));
                        self.p.0[k * Self::NZ + j].push(entry);
                    }
                }
            }
        }
        self.q.resize(self.row_slack(), Source::Constant(self.qp.defect_penalty));
        self.q.resize(self.variables(), Source::Constant(self.qp.path_penalty));
    }

    /// The dynamics, then the pinned variables; returns how many there are.
    fn equalities(&mut self) -> usize {
        for k in 0..self.qp.nodes() - 1 {
            for i in 0..NX {
                let row = self.b.len();
                for j in 0..Self::NZ {
                    if self.pattern.dynamics[i * Self::NZ + j] {
                        self.a.0[k * Self::NZ + j].push((row, Source::Dynamics(k, i, j)));
                    }
                }
                self.a.0[(k + 1) * Self::NZ + i].push((row, Source::Constant(1.0)));
                if self.soft {
                    let at = self.slack() + 2 * (k * NX + i);
                    self.a.0[at].push((row, Source::Constant(-1.0)));
                    self.a.0[at + 1].push((row, Source::Constant(1.0)));
                }
                self.b.push(Source::Offset(k, i));
            }
        }
        for v in 0..self.bounds.len() {
            if self.bounds[v].pinned {
                self.row(v, 1.0, Source::Upper(v / Self::NZ, v % Self::NZ));
            }
        }
        self.b.len()
    }

    /// Boxes, soft rows, slacks.
    fn inequalities(&mut self) {
        for v in 0..self.bounds.len() {
            let Bounds { upper, lower, .. } = self.bounds[v];
            if upper {
                self.row(v, 1.0, Source::Upper(v / Self::NZ, v % Self::NZ));
            }
            if lower {
                self.row(v, -1.0, Source::Lower(v / Self::NZ, v % Self::NZ));
            }
        }
        let row_slack = self.row_slack();
        for k in 0..self.qp.nodes() {
            for i in 0..NG {
                for j in 0..NX {
                    if self.pattern.rows[i * NX + j] {
                        let entry = (self.b.len(), Source::Row(k, i, j));
                        self.a.0[k * Self::NZ + j].push(entry);
                    }
                }
                self.row(row_slack + k * NG + i, -1.0, Source::RowOffset(k, i));
            }
        }
        for v in self.slack()..self.variables() {
            self.row(v, -1.0, Source::Constant(0.0));
        }
    }

    /// Ends a row with an entry of one variable, and its right-hand side.
    fn row(&mut self, variable: usize, factor: f64, right: Source) {
        self.a.0[variable].push((self.b.len(), Source::Constant(factor)));
        self.b.push(right);
    }
}

impl Built {
    fn new<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
        tolerance: f64,
    ) -> Option<Self> {
        let mut assembly = Assembly::new(qp);
        assembly.objective();
        let equalities = assembly.equalities();
        assembly.inequalities();
        let variables = assembly.variables();
        let Assembly { pattern, bounds, soft, p, q, a, b, .. } = assembly;
        let cones = [
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(b.len() - equalities),
        ];
        let (mut p_matrix, p) = p.compress(variables);
        let (mut a_matrix, a) = a.compress(b.len());
        let layout = Layout { nodes: qp.nodes(), pattern, bounds, soft, p, q, a, b };
        fill(&layout.p, qp, &mut p_matrix.nzval);
        fill(&layout.a, qp, &mut a_matrix.nzval);
        let (mut q, mut b) = (Vec::new(), Vec::new());
        fill(&layout.q, qp, &mut q);
        fill(&layout.b, qp, &mut b);
        let solver =
            DefaultSolver::new(&p_matrix, &q, &a_matrix, &b, &cones, settings(tolerance)?).ok()?;
        Some(Self { layout, solver, values: Vec::new() })
    }

    fn update<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
    ) -> Result<(), clarabel::solver::DataUpdateError> {
        let Self { layout, solver, values } = self;
        fill(&layout.p, qp, values);
        solver.update_P(values)?;
        fill(&layout.q, qp, values);
        solver.update_q(values)?;
        fill(&layout.a, qp, values);
        solver.update_A(values)?;
        fill(&layout.b, qp, values);
        solver.update_b(values)
    }

    fn read<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &self,
        out: &mut Solution<N, NX, NU, NG>,
    ) {
        let (nz, nodes) = (NX + NU, self.layout.nodes);
        let solution = &self.solver.solution;
        *out = Solution::ZERO;
        for k in 0..nodes {
            out.x[k].copy_from_slice(&solution.x[k * nz..k * nz + NX]);
            if k + 1 < nodes {
                out.u[k].copy_from_slice(&solution.x[k * nz + NX..(k + 1) * nz]);
                // Clarabel's multiplier belongs to `x+ - A x - B u - xi - c`.
                for i in 0..NX {
                    out.defect_multiplier[k][i] = -solution.z[k * NX + i];
                }
            }
        }
        for (source, z) in self.layout.b.iter().zip(&solution.z) {
            let (k, i, multiplier) = match *source {
                Source::Upper(k, i) => (k, i, *z),
                Source::Lower(k, i) => (k, i, -*z),
                Source::RowOffset(k, i) => {
                    out.path_multiplier[k][i] = *z;
                    continue;
                }
                _ => continue,
            };
            if i < NX {
                out.bound_multiplier_x[k][i] += multiplier;
            } else {
                out.bound_multiplier_u[k][i - NX] += multiplier;
            }
        }
    }
}

fn fill<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    sources: &[Source],
    qp: &Qp<N, NX, NU, NG>,
    values: &mut Vec<f64>,
) {
    values.clear();
    values.extend(sources.iter().map(|source| match *source {
        Source::Constant(value) => value,
        Source::Hessian(k, i, j) => qp.stages[k].hessian(i, j),
        Source::Dynamics(k, i, j) => -qp.stages[k].dynamics(i, j),
        Source::Row(k, i, j) => qp.stages[k].path_jacobian[(i, j)],
        Source::Offset(k, i) => qp.stages[k].c[i],
        Source::RowOffset(k, i) => -qp.stages[k].path_offset[i],
        Source::Upper(k, i) => qp.stages[k].bounds(i).1,
        Source::Lower(k, i) => -qp.stages[k].bounds(i).0,
        Source::Gradient(k, i) => qp.stages[k].gradient(i),
    }));
}
