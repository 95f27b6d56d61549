//! Hessian convexification that leaves the solution of the QP unchanged.
//!
//! After Verschueren et al., "A Sparsity Preserving Convexification Procedure for Indefinite
//! Quadratic Programs Arising in Direct Optimal Control", 2017. The Hessian of a Lagrangian is
//! positive definite on the null space of the active constraints, not stage by stage. Projecting
//! each stage's block makes the QP convex, but changes it. On the dynamics, `1/2 x+^T P x+` equals a
//! quadratic in `[x; u]` of the stage before, so that the cost-to-go `P` of the Riccati recursion
//! can be moved there; what remains is `(u + K x)^T R (u + K x)`, convex wherever `R` is. A fixed
//! component is zero, so that any multiple of its square may be added first: terminal constraints
//! make `R` definite that way.

use super::{Qp, QpStage};
use crate::dense::{cholesky_in_place, divisor, matrix, project_positive, zeros};
use crate::simd::multiversion;
use nalgebra::{SMatrix, SVector};

/// Curvature given to each fixed component.
const FIXED_CURVATURE: f64 = 100.0;

/// Curvature added to each state: blocks stay positive semidefinite under rounding.
const FLOOR: f64 = 1e-9;

/// Share of its convex part that a control block may lose and must stay positive definite.
const MARGIN: f64 = 0.1;

/// Time of a projection onto the positive semidefinite cone, where a convex stage takes 1.
const PROJECTION_WORK: usize = 9;

/// Blocks of one stage with the cost-to-go of the next stage added.
struct Condensed<const NX: usize, const NU: usize> {
    q: SMatrix<f64, NX, NX>,
    /// The cross block `S^T`: columns of the control.
    s: SMatrix<f64, NX, NU>,
    r: SMatrix<f64, NU, NU>,
    /// `s L^-T` with `r = L L^T`: its square is the Schur complement term `s r^-1 s^T`.
    schur: SMatrix<f64, NX, NU>,
}

multiversion! {
    /// Adds `p`, the cost-to-go after `stage`, to its blocks. `None` where the control block is not
    /// positive definite.
    fn condense<const NX: usize, const NU: usize, const NG: usize>(
        stage: &QpStage<NX, NU, NG>,
        p: &SMatrix<f64, NX, NX>,
        convex: &SVector<f64, NU>,
    ) -> Option<Condensed<NX, NU>> {
        let (mut pb, mut bt) = (zeros::<NX, NU>(), zeros::<NU, NX>());
        matrix::multiply(&mut pb.data.0, &p.data.0, &stage.b.data.0);
        matrix::transpose(&mut bt.data.0, &stage.b.data.0);
        let mut r = stage.hessian_uu + SMatrix::from_diagonal(convex);
        matrix::multiply_add_lower(&mut r.data.0, &bt.data.0, &pb.data.0);
        matrix::mirror_lower(&mut r.data.0);
        let mut factor = r - SMatrix::from_diagonal(&(convex * MARGIN));
        cholesky_in_place(&mut factor).ok()?;
        factor = r;
        cholesky_in_place(&mut factor).ok()?;
        let inverse = factor.diagonal().map(|pivot| 1.0 / divisor(pivot));

        let (mut pa, mut at) = (zeros::<NX, NX>(), zeros::<NX, NX>());
        matrix::multiply(&mut pa.data.0, &p.data.0, &stage.a.data.0);
        matrix::transpose(&mut at.data.0, &stage.a.data.0);
        let mut q = stage.hessian_xx;
        matrix::multiply_add_lower(&mut q.data.0, &at.data.0, &pa.data.0);
        let mut s = stage.hessian_ux.transpose();
        matrix::multiply_add(&mut s.data.0, &at.data.0, &pb.data.0);
        let mut schur = s;
        matrix::solve_lower_transposed(&mut schur.data.0, &factor.data.0, &inverse.data.0[0]);
        Some(Condensed { q, s, r, schur })
    }
}

impl<const NX: usize, const NU: usize> Condensed<NX, NU> {
    /// Leaves the Schur complement term at the stage and the rest, its cost-to-go, in `p`.
    fn split<const NG: usize>(
        &self,
        stage: &mut QpStage<NX, NU, NG>,
        p: &mut SMatrix<f64, NX, NX>,
    ) {
        let schur = &mut stage.hessian_xx;
        *schur = zeros();
        matrix::add_square(&mut schur.data.0, &self.schur.data.0);
        p.copy_from(&self.q);
        *p -= &*schur;
        matrix::mirror_lower(&mut p.data.0);
        for i in 0..NX {
            schur[(i, i)] += FLOOR;
        }
        matrix::transpose(&mut stage.hessian_ux.data.0, &self.s.data.0);
        stage.hessian_uu = self.r;
    }
}

/// Replaces the curvature of fixed components by [`FIXED_CURVATURE`].
fn fix<const NX: usize>(p: &mut SMatrix<f64, NX, NX>, is_fixed: impl Fn(usize) -> bool) {
    for i in 0..NX {
        if !is_fixed(i) {
            continue;
        }
        for j in 0..NX {
            p[(i, j)] = 0.0;
            p[(j, i)] = 0.0;
        }
        p[(i, i)] = FIXED_CURVATURE;
    }
}

/// A convexification under way, from the last stage back. It reads only the stages that it has
/// reached, so that earlier stages may still be filled meanwhile.
pub struct Convexification<'a, const NX: usize, const NU: usize> {
    /// Cost-to-go of the stages convexified. It lies in the last stage's unused dynamics.
    p: &'a mut SMatrix<f64, NX, NX>,
    convex: &'a SVector<f64, NU>,
    constant: f64,
    /// Number of stages whose cost-to-go was projected.
    projected: usize,
    /// Whether a stage could not be made convex.
    has_failed: bool,
}

impl<'a, const NX: usize, const NU: usize> Convexification<'a, NX, NU> {
    /// Begins at the last stage; `diag(convex)` is the convex part of every stage's control Hessian.
    pub fn new<const NG: usize>(
        last: &'a mut QpStage<NX, NU, NG>,
        convex: &'a SVector<f64, NU>,
    ) -> Self {
        last.a.copy_from(&last.hessian_xx);
        // In place: a temporary would stay on the stack during the whole convexification.
        last.hessian_xx.fill(0.0);
        last.hessian_xx.fill_diagonal(FLOOR);
        Self { p: &mut last.a, convex, constant: 0.0, projected: 0, has_failed: false }
    }

    /// Convexifies `stages`, those from `first` up to the ones done before, from the last back, until
    /// its work reaches `budget`. `is_fixed(k, i)` says whether component `i` of the state at stage
    /// `k` is fixed at zero. Returns the number of stages done and the work: 1 a stage, more for each
    /// projection.
    // Not inlined: its frame is released while the QP is filled.
    #[inline(never)]
    pub fn advance<const NG: usize>(
        &mut self,
        first: usize,
        stages: &mut [QpStage<NX, NU, NG>],
        budget: usize,
        is_fixed: impl Fn(usize, usize) -> bool,
    ) -> (usize, usize) {
        let (mut done, mut work) = (0, 0);
        for (j, stage) in stages.iter_mut().enumerate().rev() {
            if work >= budget {
                break;
            }
            let before = self.projected;
            if !self.has_failed {
                fix(self.p, |i| is_fixed(first + j + 1, i));
                self.convexify_stage(stage);
            }
            done += 1;
            work += 1 + (self.projected - before) * PROJECTION_WORK;
        }
        (done, work)
    }

    /// Moves the cost-to-go to `stage`, the one before it.
    // Not inlined: `advance` has a copy for each kind of problem.
    #[inline(never)]
    fn convexify_stage<const NG: usize>(&mut self, stage: &mut QpStage<NX, NU, NG>) {
        let mut tried = condense(stage, self.p, self.convex);
        if tried.is_none() {
            self.projected += 1;
            project_positive(self.p);
            tried = condense(stage, self.p, self.convex);
        }
        if tried.is_none() {
            // The stage's own curvature is indefinite: without it.
            stage.hessian_uu.fill(0.0);
            stage.hessian_ux.fill(0.0);
            tried = condense(stage, self.p, self.convex);
        }
        // A block that is not finite stays indefinite; the solver refuses it.
        let Some(condensed) = tried else {
            self.has_failed = true;
            return;
        };
        // The quadratic of x+ = A x + B u + c has linear and constant parts too.
        let p: &SMatrix<f64, NX, NX> = self.p;
        let pc = p * stage.c;
        stage.gradient_x += stage.a.tr_mul(&pc);
        stage.gradient_u += stage.b.tr_mul(&pc);
        self.constant += 0.5 * stage.c.dot(&pc);
        condensed.split(stage, self.p);
    }

    /// Ends after the first stage. Returns the constant that the objective gains, and the number of
    /// stages whose curvature was projected: `None` where one could not be made convex.
    pub fn finish(self) -> (f64, Option<usize>) {
        self.p.fill(0.0);
        (self.constant, (!self.has_failed).then_some(self.projected))
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Qp<N, NX, NU, NG> {
    /// Makes every stage's Hessian positive semidefinite.
    ///
    /// On entry the Hessian blocks hold curvature of any sign *without* the convex part, which is
    /// `diag(convex)` on every control. `is_fixed(k, i)` says whether component `i` of the state at
    /// stage `k` is fixed at zero. Where a control block comes out indefinite, the cost-to-go is
    /// projected onto the positive semidefinite cone. Returns the number of such stages: zero near a
    /// strict minimum, and then the objective is unchanged on steps that satisfy the dynamics.
    /// Cost: one Riccati recursion, about `N (6 NX^3 + 6 NX^2 NU)` flops.
    pub fn convexify(
        &mut self,
        convex: &SVector<f64, NU>,
        is_fixed: impl Fn(usize, usize) -> bool,
    ) -> usize {
        let Some((last, stages)) = self.used_mut().split_last_mut() else { return 0 };
        let mut convexification = Convexification::new(last, convex);
        convexification.advance(0, stages, usize::MAX, is_fixed);
        let (constant, projected) = convexification.finish();
        self.constant += constant;
        projected.unwrap_or(self.nodes())
    }
}
