//! Convexification that leaves the program's answer alone.
//!
//! The Hessian of a Lagrangian is positive definite on the null space of the active constraints,
//! not node by node. Clipping each node's block makes a convex program, but a stiffer one. Here
//! curvature is moved instead: on the dynamics, `1/2 x+^T P x+` equals the same quadratic in
//! `[x; u]` of the node before, so the indefinite part of a node's block can be handed back node by
//! node (after Verschueren et al., "A Sparsity Preserving Convexification Procedure for Indefinite
//! Quadratic Programs Arising in Direct Optimal Control", 2017). What is handed back is the
//! cost-to-go of the Riccati recursion; what stays is `(u + K x)^T R (u + K x)`, convex wherever
//! `R` is. A pinned component is zero, so any multiple of its square may be added first: that is
//! how terminal constraints make `R` definite.

use super::{Qp, Stage};
use crate::dense::{cholesky_in_place, matrix, project_positive, zeros};
use nalgebra::{SMatrix, SVector};

/// What is added to the square of each pinned component.
const PIN_CURVATURE: f64 = 100.0;

/// Added to each state's diagonal, so that blocks stay positive semidefinite under rounding.
const FLOOR: f64 = 1e-9;

/// A control block counts as positive definite if it stays so after losing this share of its
/// convex part.
const MARGIN: f64 = 0.1;

/// What a projection takes of time, where a node of the sweep without one takes 1.
const PROJECTION_WORK: usize = 9;

/// One node's blocks after the cost-to-go of the next node has been handed back to it.
struct Handed<const NX: usize, const NU: usize> {
    q: SMatrix<f64, NX, NX>,
    /// The cross block, transposed: columns of the control.
    s: SMatrix<f64, NX, NU>,
    r: SMatrix<f64, NU, NU>,
    /// `s L^-T`, `r = L L^T`: its square `s r^-1 s^T` is what the controls account for.
    kept: SMatrix<f64, NX, NU>,
}

impl<const NX: usize, const NU: usize> Handed<NX, NU> {
    /// Hands `p`, the cost-to-go after `stage`, back to it. `None` where the control block is not
    /// positive definite.
    fn new<const NR: usize>(
        stage: &Stage<NX, NU, NR>,
        p: &SMatrix<f64, NX, NX>,
        convex: &SVector<f64, NU>,
    ) -> Option<Self> {
        let (mut pb, mut bt) = (zeros::<NX, NU>(), zeros::<NU, NX>());
        matrix::multiply(&mut pb.data.0, &p.data.0, &stage.b.data.0);
        matrix::transpose(&mut bt.data.0, &stage.b.data.0);
        let mut r = stage.hessian_uu + SMatrix::from_diagonal(convex);
        matrix::multiply_add(&mut r.data.0, &bt.data.0, &pb.data.0);
        matrix::mirror_lower(&mut r.data.0);
        let mut factor = r - SMatrix::from_diagonal(&(convex * MARGIN));
        cholesky_in_place(&mut factor).ok()?;
        factor = r;
        cholesky_in_place(&mut factor).ok()?;
        let inverse = factor.diagonal().map(|pivot| 1.0 / pivot);

        let (mut pa, mut at) = (zeros::<NX, NX>(), zeros::<NX, NX>());
        matrix::multiply(&mut pa.data.0, &p.data.0, &stage.a.data.0);
        matrix::transpose(&mut at.data.0, &stage.a.data.0);
        let mut q = stage.hessian_xx;
        matrix::multiply_add(&mut q.data.0, &at.data.0, &pa.data.0);
        let mut s = stage.hessian_ux.transpose();
        matrix::multiply_add(&mut s.data.0, &at.data.0, &pb.data.0);
        let mut kept = s;
        matrix::solve_lower_transposed(&mut kept.data.0, &factor.data.0, &inverse.data.0[0]);
        Some(Self { q, s, r, kept })
    }

    /// Leaves what the controls account for at the node, and the rest, the cost-to-go before it,
    /// in `p`.
    fn split<const NR: usize>(&self, stage: &mut Stage<NX, NU, NR>, p: &mut SMatrix<f64, NX, NX>) {
        let kept = &mut stage.hessian_xx;
        *kept = zeros();
        matrix::add_square(&mut kept.data.0, &self.kept.data.0);
        p.copy_from(&self.q);
        *p -= &*kept;
        matrix::mirror_lower(&mut p.data.0);
        for i in 0..NX {
            kept[(i, i)] += FLOOR;
        }
        matrix::transpose(&mut stage.hessian_ux.data.0, &self.s.data.0);
        stage.hessian_uu = self.r;
    }
}

/// Pinned components carry no curvature of their own, and as much as is asked for.
fn pin<const NX: usize>(p: &mut SMatrix<f64, NX, NX>, is_pinned: impl Fn(usize) -> bool) {
    for i in 0..NX {
        if !is_pinned(i) {
            continue;
        }
        for j in 0..NX {
            p[(i, j)] = 0.0;
            p[(j, i)] = 0.0;
        }
        p[(i, i)] = PIN_CURVATURE;
    }
}

/// A sweep under way, from the last node back: it needs the nodes from some node on, and none before
/// it, so that those may still be in the making.
pub struct Sweep<'a, const NX: usize, const NU: usize> {
    /// The cost-to-go before the nodes swept. It lies where the last node's dynamics would.
    p: &'a mut SMatrix<f64, NX, NX>,
    convex: &'a SVector<f64, NU>,
    constant: f64,
    dropped: usize,
    /// Whether a node was met that cannot be made convex.
    is_stuck: bool,
}

impl<'a, const NX: usize, const NU: usize> Sweep<'a, NX, NU> {
    /// Begins at the last node; `diag(convex)` is the convex part of every control's curvature.
    pub fn new<const NR: usize>(
        last: &'a mut Stage<NX, NU, NR>,
        convex: &'a SVector<f64, NU>,
    ) -> Self {
        last.a.copy_from(&last.hessian_xx);
        // In place: a matrix in between would be on the stack all through the sweep.
        last.hessian_xx.fill(0.0);
        last.hessian_xx.fill_diagonal(FLOOR);
        Self { p: &mut last.a, convex, constant: 0.0, dropped: 0, is_stuck: false }
    }

    /// Goes on over `stages`, the nodes from `first` up to those swept before, from the last back,
    /// until its work comes to `budget`. `is_pinned(k, i)` tells which components of which states
    /// are pinned to zero steps. Returns how many nodes it swept, and its work: 1 a node, and
    /// more for each that was indefinite.
    // Its memory is not on the stack while the program is filled.
    #[inline(never)]
    pub fn over<const NR: usize>(
        &mut self,
        first: usize,
        stages: &mut [Stage<NX, NU, NR>],
        budget: usize,
        is_pinned: impl Fn(usize, usize) -> bool,
    ) -> (usize, usize) {
        let (mut swept, mut work) = (0, 0);
        for (j, stage) in stages.iter_mut().enumerate().rev() {
            if work >= budget {
                break;
            }
            let before = self.dropped;
            if !self.is_stuck {
                pin(self.p, |i| is_pinned(first + j + 1, i));
                self.hand_back(stage);
            }
            swept += 1;
            work += 1 + (self.dropped - before) * PROJECTION_WORK;
        }
        (swept, work)
    }

    /// Hands the cost-to-go back to the node before it.
    fn hand_back<const NR: usize>(&mut self, stage: &mut Stage<NX, NU, NR>) {
        let mut tried = Handed::new(stage, self.p, self.convex);
        if tried.is_none() {
            self.dropped += 1;
            project_positive(self.p);
            tried = Handed::new(stage, self.p, self.convex);
        }
        if tried.is_none() {
            // Not the curvature handed over, but the node's own: do without.
            stage.hessian_uu.fill(0.0);
            stage.hessian_ux.fill(0.0);
            tried = Handed::new(stage, self.p, self.convex);
        }
        // What is not finite stays indefinite; the solver will refuse it.
        let Some(handed) = tried else {
            self.is_stuck = true;
            return;
        };
        // The same quadratic of x+ = A x + B u + c, its linear and constant parts included.
        let p: &SMatrix<f64, NX, NX> = self.p;
        let pc = p * stage.c;
        stage.gradient_x += stage.a.tr_mul(&pc);
        stage.gradient_u += stage.b.tr_mul(&pc);
        self.constant += 0.5 * stage.c.dot(&pc);
        handed.split(stage, self.p);
    }

    /// Ends after the first node; returns the constant that the objective gains, and at how many
    /// nodes curvature was dropped: `None` where a node could not be made convex.
    pub fn end(self) -> (f64, Option<usize>) {
        self.p.fill(0.0);
        (self.constant, (!self.is_stuck).then_some(self.dropped))
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> Qp<N, NX, NU, NR> {
    /// Makes every node's Hessian positive semidefinite.
    ///
    /// On entry the Hessian blocks hold curvature of any sign *without* the convex part, which is
    /// `diag(convex)` on every control. `is_pinned(k, i)` tells which components of which states
    /// are pinned to zero steps. Where a control block comes out indefinite, the negative part of
    /// the curvature handed to that node is dropped; returns at how many nodes: zero near a strict
    /// minimum, and then the objective is unchanged on steps that satisfy the dynamics.
    /// Cost: one Riccati sweep, about `N (6 NX^3 + 6 NX^2 NU)` flops.
    pub fn convexify(
        &mut self,
        convex: &SVector<f64, NU>,
        is_pinned: impl Fn(usize, usize) -> bool,
    ) -> usize {
        let Some((last, stages)) = self.stages.split_last_mut() else { return 0 };
        let mut sweep = Sweep::new(last, convex);
        sweep.over(0, stages, usize::MAX, is_pinned);
        let (constant, dropped) = sweep.end();
        self.constant += constant;
        dropped.unwrap_or(N)
    }
}
