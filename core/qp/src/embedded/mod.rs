//! The embedded solver: a primal-dual interior-point method over the stage structure.
//!
//! Mehrotra's predictor-corrector on the saddle point of the program; `docs/qp.md` derives it. One
//! file per object: variables in boxes with their barriers (`boxed`), one node's variables
//! (`node`), distance from the optimum (`optimality`), the factored Newton system (`riccati`) and
//! its dense kernels (`kernels`), the iteration (`iteration`), the proof of infeasibility
//! (`infeasible`).

mod boxed;
mod infeasible;
mod iteration;
mod joint;
mod kernels;
mod node;
mod optimality;
mod riccati;
mod settings;

pub use iteration::ATTEMPTS;
pub use settings::{InteriorPointSettings, MAX_SOLVER_ITERATIONS};

use super::{Qp, QpOutcome, QpSolver, QpStatus, Solution};
use crate::dense::clamp;
use crate::time::Deadline;
use crate::{Checksum, Valid};
use nalgebra::SMatrix;
use node::{Entries, Node, Start, Unfit};
use optimality::{Optimality, differentiate};
use riccati::Interval;

/// Iterations after which a start is given up. Only random programs ever need a second one.
const WARM_PATIENCE: u32 = 15;
const COLD_PATIENCE: u32 = 50;

/// What is tried after a warm start, each with its patience; after a cold one the first is past.
const RESTARTS: [(Start, u32); 2] = [(Start::COLD, COLD_PATIENCE), (Start::FAR, u32::MAX)];

/// Most starts of a subproblem: the first and two restarts.
pub const STARTS: usize = 1 + RESTARTS.len();

/// The embedded solver with all the memory it needs.
///
/// Never allocates, never panics. Cost: an iteration is about
/// `N (11 NX^3 + 14 NX^2 NU + 5 NX NU^2 + 50 NX (NX + NU))` flops; programs of the planner take 5 to
/// 15. Memory: [`EmbeddedQp::BYTES`], about `8 N (4 NX^2 + 2 NX NU + NU^2 + 26 NX + 13 NU)`.
#[derive(Clone, Debug)]
pub struct EmbeddedQp<const N: usize, const NX: usize, const NU: usize, const NR: usize> {
    /// How it works, where that was told; the defaults otherwise, so that fresh storage is zero
    /// bits. (The `None` of an option of settings would not be: it hides in the flag's spare values.)
    settings: InteriorPointSettings,
    is_configured: bool,
    /// The iterate.
    nodes: [Node<NX, NU, NR>; N],
    /// The Newton system, factored.
    intervals: [Interval<NX, NU>; N],
    initial: [[f64; NX]; NX],
    /// Gradient of the Lagrangian at the iterate.
    gradient: [Entries<NX, NU, NR>; N],
    /// The predictor and the step.
    affine: [Entries<NX, NU, NR>; N],
    step: [Entries<NX, NU, NR>; N],
    /// Number of complementary pairs, at least one.
    pairs: f64,
    /// Whether the last program of this plan was solved.
    solved: bool,
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> EmbeddedQp<N, NX, NU, NR> {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Storage for any number of solves, with the default settings. Place it in static memory or
    /// on a heap: it is too large for a small stack. All bits are zero, so that static memory costs
    /// no room in an image.
    pub const fn new() -> Self {
        Self {
            settings: InteriorPointSettings::BLANK,
            is_configured: false,
            nodes: [Node::ZERO; N],
            intervals: [Interval::ZERO; N],
            initial: [[0.0; NX]; NX],
            gradient: [Entries::ZERO; N],
            affine: [Entries::ZERO; N],
            step: [Entries::ZERO; N],
            pairs: 0.0,
            solved: false,
        }
    }

    /// How it works.
    pub fn settings(&self) -> InteriorPointSettings {
        if self.is_configured { self.settings } else { InteriorPointSettings::DEFAULT }
    }

    /// Changes how it works, from the next solve on.
    pub fn configure(&mut self, settings: Valid<InteriorPointSettings>) {
        (self.settings, self.is_configured) = (settings.into_inner(), true);
    }

    /// Puts the iterate inside the boxes.
    fn start(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        from: &Solution<N, NX, NU, NR>,
        start: Start,
    ) -> Result<(), Unfit> {
        let sound = qp.defect_weight > 0.0 && qp.row_weight >= 0.0 && qp.row_weight < f64::INFINITY;
        if !(sound && qp.constant.is_finite()) {
            return Err(Unfit::Nonsense);
        }
        let mut pairs = 0;
        for (k, node) in self.nodes.iter_mut().enumerate() {
            node.start(k, qp, from, start)?;
            pairs += node.pairs();
        }
        self.pairs = f64::from(pairs).max(1.0);
        Ok(())
    }

    /// Starts near the multipliers of `from`, unless these are further from the optimum than none
    /// at all; tells whether they were used.
    fn start_warm(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        from: &Solution<N, NX, NU, NR>,
    ) -> Result<bool, Unfit> {
        self.start(qp, from, Start::COLD)?;
        let without = self.residual(qp);
        self.start(qp, from, Start::WARM)?;
        if self.residual(qp) <= without {
            return Ok(true);
        }
        self.start(qp, from, Start::COLD).map(|_| false)
    }

    /// Largest KKT residual at the iterate.
    fn residual(&mut self, qp: &Qp<N, NX, NU, NR>) -> f64 {
        differentiate(qp, &self.nodes, &self.intervals, &mut self.gradient);
        Optimality::of(&self.nodes, &self.gradient, self.pairs).residual
    }

    /// Copies the iterate out.
    fn write(&self, solution: &mut Solution<N, NX, NU, NR>) {
        for (k, (node, gradient)) in self.nodes.iter().zip(&self.gradient).enumerate() {
            solution.x[k].data.0[0] = node.x.value;
            solution.u[k].data.0[0] = node.u.value;
            solution.defect_multiplier[k].data.0[0] = node.dynamics.value;
            solution.row_multiplier[k].data.0[0] = node.row.value;
            // A pin's multiplier is what balances the gradient.
            let bounds = node.x.multipliers();
            for i in 0..NX {
                let pinned = node.free_x.is_pinned(i);
                solution.bound_multiplier_x[k][i] = if pinned { -gradient.x[i] } else { bounds[i] };
            }
            let bounds = node.u.multipliers();
            for i in 0..NU {
                let pinned = node.free_u.is_pinned(i);
                solution.bound_multiplier_u[k][i] = if pinned { -gradient.u[i] } else { bounds[i] };
            }
        }
    }

    /// Iterates from where the iterate stands and copies the result out. Where that leads nowhere,
    /// starts again: without earlier knowledge (if it was `warm`), then further from the bounds.
    fn finish(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        solution: &mut Solution<N, NX, NU, NR>,
        warm: bool,
        deadline: &Deadline,
    ) -> QpOutcome {
        let most = self.settings().max_iterations;
        let mut outcome = match warm {
            true => self.run(qp, most.min(WARM_PATIENCE), deadline),
            false => self.run(qp, most.min(COLD_PATIENCE), deadline),
        };
        // Bound: starts.
        for (start, patience) in RESTARTS.into_iter().skip(if warm { 0 } else { 1 }) {
            let left = most.saturating_sub(outcome.iterations);
            let ended = matches!(outcome.status, QpStatus::Solved | QpStatus::TimeLimit);
            let fixed = self.settings().fixed_iterations.is_some();
            if ended || fixed || left == 0 || self.start(qp, solution, start).is_err() {
                break;
            }
            let spent = outcome.iterations;
            outcome = self.run(qp, left.min(patience), deadline);
            outcome.iterations += spent;
        }
        self.write(solution);
        self.solved = outcome.status.is_usable();
        outcome
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> EmbeddedQp<N, NX, NU, NR> {
    /// Overwrites all that it works with.
    pub fn fill(&mut self, value: f64) {
        let entries =
            Entries { x: [value; NX], u: [value; NU], dynamics: [value; NX], row: [value; NR] };
        self.nodes.fill(Node::filled(value));
        self.intervals.fill(Interval::filled(value));
        self.initial = [[value; NX]; NX];
        for all in [&mut self.gradient, &mut self.affine, &mut self.step] {
            all.fill(entries);
        }
        (self.pairs, self.solved) = (value, true);
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> Default
    for EmbeddedQp<N, NX, NU, NR>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> QpSolver<N, NX, NU, NR>
    for EmbeddedQp<N, NX, NU, NR>
{
    fn reset(&mut self) {
        self.solved = false;
    }

    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        solution: &mut Solution<N, NX, NU, NR>,
        deadline: &Deadline,
    ) -> QpOutcome {
        let warm = self.settings().warm_start && self.solved;
        self.solved = false;
        for (interval, stage) in self.intervals.iter_mut().zip(&qp.stages) {
            interval.pack(stage);
        }
        let started = match warm {
            true => self.start_warm(qp, solution),
            false => self.start(qp, solution, Start::COLD).map(|_| false),
        };
        let status = match started {
            Ok(warm) => return self.finish(qp, solution, warm, deadline),
            Err(Unfit::EmptyBox) => QpStatus::Infeasible,
            Err(Unfit::Nonsense) => QpStatus::NumericalFailure,
        };
        QpOutcome { status, iterations: 0 }
    }

    /// Goes on from the solution of the program before, with its packed matrices.
    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        solution: &mut Solution<N, NX, NU, NR>,
        deadline: &Deadline,
    ) -> QpOutcome {
        if !self.solved {
            return self.solve(qp, solution, deadline);
        }
        let product = clamp(0.01 * self.residual(qp), Start::WARM.product, Start::COLD.product);
        for node in &mut self.nodes {
            node.reseat(product);
        }
        self.finish(qp, solution, true, deadline)
    }

    /// That of the last iteration's Newton system, barriers included; none where the last program
    /// was not solved.
    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        let interval = self.intervals.get(k).filter(|_| k + 1 < N && self.solved)?;
        Some(SMatrix::from_fn(|i, j| -interval.gain[i][j]))
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.bytes(b"embedded interior point 1");
        self.settings().identify(checksum);
    }
}
