//! The sparse program of a stage-structured one: its structure, and where each number comes from.
//!
//! Variables, in order: the nodes' `[x_k; u_k]`, then the slacks of the dynamics (positive and
//! negative parts, where they are soft), then the slacks of the rows.

use clarabel::algebra::CscMatrix;
use remora_core::advanced::qp::{Qp, QpStage};

/// Where a number of the sparse program comes from.
#[derive(Clone, Copy)]
pub(super) enum Source {
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
pub(super) struct Bounds {
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
pub(super) fn is_sound<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
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
pub(super) struct Pattern {
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
pub(super) struct Layout {
    pub nodes: usize,
    pub pattern: Pattern,
    pub bounds: Vec<Bounds>,
    pub soft: bool,
    pub p: Vec<Source>,
    pub q: Vec<Source>,
    pub a: Vec<Source>,
    pub b: Vec<Source>,
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
    pub fn fits<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
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
pub(super) struct Columns(Vec<Vec<(usize, Source)>>);

impl Columns {
    pub fn compress(mut self, rows: usize) -> (CscMatrix<f64>, Vec<Source>) {
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
pub(super) struct Assembly<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    qp: &'a Qp<N, NX, NU, NG>,
    pub pattern: Pattern,
    pub bounds: Vec<Bounds>,
    pub soft: bool,
    pub p: Columns,
    pub q: Vec<Source>,
    pub a: Columns,
    pub b: Vec<Source>,
}

impl<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    Assembly<'a, N, NX, NU, NG>
{
    /// States and controls of a node.
    const NZ: usize = NX + NU;
    pub fn new(qp: &'a Qp<N, NX, NU, NG>) -> Self {
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

    pub fn variables(&self) -> usize {
        self.a.0.len()
    }

    pub fn objective(&mut self) {
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
    pub fn equalities(&mut self) -> usize {
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
    pub fn inequalities(&mut self) {
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

pub(super) fn fill<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
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
