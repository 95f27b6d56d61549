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
use crate::math::{cholesky_in_place, cholesky_solve_in_place, project_positive};
use nalgebra::{SMatrix, SVector};

/// What is added to the square of each pinned component.
const PIN_CURVATURE: f64 = 100.0;

/// Added to each state's diagonal, so that blocks stay positive semidefinite under rounding.
const FLOOR: f64 = 1e-9;

/// A control block counts as positive definite if it stays so after losing this share of its
/// convex part.
const MARGIN: f64 = 0.1;

/// One node's blocks after the cost-to-go of the next node has been handed back to it.
struct Handed<const NX: usize, const NU: usize> {
    q: SMatrix<f64, NX, NX>,
    s: SMatrix<f64, NU, NX>,
    r: SMatrix<f64, NU, NU>,
    /// What the controls account for, `s^T r^-1 s`: it stays.
    kept: SMatrix<f64, NX, NX>,
}

impl<const NX: usize, const NU: usize> Handed<NX, NU> {
    /// Hands `p`, the cost-to-go after `stage`, back to it. `None` where the control block is not
    /// positive definite.
    fn new<const NR: usize>(
        stage: &Stage<NX, NU, NR>,
        p: &SMatrix<f64, NX, NX>,
        convex: &SVector<f64, NU>,
    ) -> Option<Self> {
        let (pa, pb): (SMatrix<f64, NX, NX>, SMatrix<f64, NX, NU>) = (p * stage.a, p * stage.b);
        let q = stage.hessian_xx + stage.a.tr_mul(&pa);
        let s = stage.hessian_ux + stage.b.tr_mul(&pa);
        let r = stage.hessian_uu + stage.b.tr_mul(&pb);
        let r = (r + r.transpose()) * 0.5 + SMatrix::from_diagonal(convex);
        let mut factor = r - SMatrix::from_diagonal(&(convex * MARGIN));
        cholesky_in_place(&mut factor).ok()?;
        factor = r;
        cholesky_in_place(&mut factor).ok()?;
        let mut gain = s;
        cholesky_solve_in_place(&factor, &mut gain);
        let kept = s.tr_mul(&gain);
        Some(Self { q, s, r, kept: (kept + kept.transpose()) * 0.5 })
    }

    /// The cost-to-go before the node.
    fn cost_to_go(&self) -> SMatrix<f64, NX, NX> {
        let p = self.q - self.kept;
        (p + p.transpose()) * 0.5
    }
}

/// Pinned components carry no curvature of their own, and as much as is asked for.
fn pin<const NX: usize>(p: &mut SMatrix<f64, NX, NX>, is_pinned: impl Fn(usize) -> bool) {
    for i in (0..NX).filter(|i| is_pinned(*i)) {
        for j in 0..NX {
            p[(i, j)] = 0.0;
            p[(j, i)] = 0.0;
        }
        p[(i, i)] = PIN_CURVATURE;
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
        let mut dropped = 0;
        let mut p = self.stages[N - 1].hessian_xx;
        self.stages[N - 1].hessian_xx = SMatrix::identity() * FLOOR;
        for k in (0..N - 1).rev() {
            pin(&mut p, |i| is_pinned(k + 1, i));
            let stage = &mut self.stages[k];
            let mut tried = Handed::new(stage, &p, convex);
            if tried.is_none() {
                dropped += 1;
                project_positive(&mut p);
                tried = Handed::new(stage, &p, convex);
            }
            if tried.is_none() {
                // Not the curvature handed over, but the node's own: do without.
                stage.hessian_uu.fill(0.0);
                stage.hessian_ux.fill(0.0);
                tried = Handed::new(stage, &p, convex);
            }
            // What is not finite stays indefinite; the solver will refuse it.
            let Some(handed) = tried else { return N };
            // The same quadratic of x+ = A x + B u + c, its linear and constant parts included.
            let pc: SVector<f64, NX> = p * stage.c;
            stage.gradient_x += stage.a.tr_mul(&pc);
            stage.gradient_u += stage.b.tr_mul(&pc);
            self.constant += 0.5 * stage.c.dot(&pc);
            stage.hessian_xx = handed.kept + SMatrix::identity() * FLOOR;
            stage.hessian_ux = handed.s;
            stage.hessian_uu = handed.r;
            p = handed.cost_to_go();
        }
        dropped
    }
}
