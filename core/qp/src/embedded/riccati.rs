//! The Newton system of one iteration, factored by a Riccati recursion.
//!
//! One backward recursion factors the matrices; each right-hand side takes one backward and one
//! forward recursion. Dynamics that are not rigid are dual-regularised (`cost_to_go.rs`).

use super::cost_to_go::CostToGo;
use super::kernels::{NotPositiveDefinite, add_transposed_product, factor, solve, sub_product};
use super::leading::Leading;
use super::variables::{Free, StageVariables, StageVector};
use crate::QpStage;
use crate::dense::matrix::{
    axpy, mirror_lower, multiply, multiply_add, multiply_add_lower, multiply_vector_add, transpose,
};
use crate::simd::multiversion;
use core::array::from_fn;
use core::mem::swap;

/// The factored system of one interval, from a stage to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval<const NX: usize, const NU: usize> {
    /// `A^T`, `B^T` by columns.
    pub a_transposed: [[f64; NX]; NX],
    pub b_transposed: [[f64; NU]; NX],
    /// Cost-to-go of the next stage.
    cost_to_go: CostToGo<NX>,
    /// `L D L^T` factor of the control block.
    control: [[f64; NU]; NU],
    /// Feedback gain `K^T` by columns: `du = -K dx` at the optimum.
    pub gain: [[f64; NX]; NU],
    /// Gradient by the control, `dx = 0`: the feedforward before its factor is solved.
    feedforward: [f64; NU],
}

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize, const NU: usize> Interval<NX, NU> {
    /// Storage in which every number is `value`.
    pub fn filled(value: f64) -> Self {
        Self {
            a_transposed: [[value; NX]; NX],
            b_transposed: [[value; NU]; NX],
            cost_to_go: CostToGo::filled(value),
            control: [[value; NU]; NU],
            gain: [[value; NX]; NU],
            feedforward: [value; NU],
        }
    }
}

impl<const NX: usize, const NU: usize> Interval<NX, NU> {
    pub const ZERO: Self = Self {
        a_transposed: [[0.0; NX]; NX],
        b_transposed: [[0.0; NU]; NX],
        cost_to_go: CostToGo::ZERO,
        control: [[0.0; NU]; NU],
        gain: [[0.0; NX]; NU],
        feedforward: [0.0; NU],
    };

    /// Transposes the dynamics, once for all iterations on a QP.
    pub fn pack<const NG: usize>(&mut self, stage: &QpStage<NX, NU, NG>) {
        transpose(&mut self.a_transposed, &stage.a.data.0);
        transpose(&mut self.b_transposed, &stage.b.data.0);
    }
}

/// How dynamics enter the Newton system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dynamics {
    /// Whether they have neither slack nor regularisation, but for that of fixed components.
    pub are_rigid: bool,
    /// Dual regularisation of their multipliers.
    pub regularisation: f64,
}

/// Hessian block of one stage's states with the barriers of bounds and path constraints (its lower triangle).
#[inline(always)]
fn state_block<const NX: usize, const NU: usize, const NG: usize>(
    stage: &QpStage<NX, NU, NG>,
    vars: &StageVariables<NX, NU, NG>,
    block: &mut [[f64; NX]; NX],
) {
    *block = stage.hessian_xx.data.0;
    let scaling = vars.x.scaling();
    for i in 0..NX {
        block[i][i] += scaling[i];
    }
    let weight = vars.path_scaling();
    let mut rows = [[0.0; NX]; NG];
    transpose(&mut rows, &stage.path_jacobian.data.0);
    let weighted: [[f64; NG]; NX] = from_fn(|j| from_fn(|r| rows[r][j] * weight[r]));
    multiply_add_lower(block, &rows, &weighted);
}

/// Zeroes rows and columns of fixed variables.
#[inline(always)]
fn mask<const NX: usize>(p: &mut [[f64; NX]; NX], free: &[f64; NX]) {
    for (column, f) in p.iter_mut().zip(free) {
        for (entry, g) in column.iter_mut().zip(free) {
            *entry *= f * g;
        }
    }
}

multiversion! {
    /// Factors the Newton system of all stages by the Riccati recursion; `initial` becomes the factor of the
    /// first stage's states.
    ///
    /// Cost a stage: `2 NX^2 (NX + NU)` for `P~ [A B]`, `2 NX^3 + 2 NX^2 NU + 2 NX NU^2` for
    /// `[A B]^T P~ [A B]`, `3 NX^2 NU` for the controls' elimination, and where dynamics are not rigid
    /// `5 NX^3` for `P~`.
    ///
    /// # Errors
    /// A block is not positive definite; the intervals before it keep an earlier factor.
    // Not inlined: its frame is released before a direction is computed.
    #[inline(never)]
    pub(super) fn factorise<const NX: usize, const NU: usize, const NG: usize, const S: usize, const C: usize>(
        stages: &[QpStage<NX, NU, NG>],
        variables: &[StageVariables<NX, NU, NG>],
        leading: Leading<S, C>,
        dynamics: Dynamics,
        intervals: &mut [Interval<NX, NU>],
        initial: &mut [[f64; NX]; NX],
    ) -> Result<(), NotPositiveDefinite> {
        // Cost-to-go of the next stage and Hessian of this one, which becomes the next one's.
        let mut memory = [[[0.0; NX]; NX]; 2];
        let [p, block] = &mut memory;
        let (mut p, mut block) = (p, block);
        for (k, ((stage, vars), interval)) in
            stages.iter().zip(variables).zip(intervals.iter_mut()).enumerate().rev()
        {
            state_block(stage, vars, block);
            if k + 1 < stages.len() {
                let after = variables.get(k + 1).map_or(Free::ALL, |next| next.free_x);
                let next = &mut interval.cost_to_go;
                if dynamics.are_rigid {
                    next.of_rigid_dynamics(p, dynamics.regularisation, after);
                } else {
                    let scaling = vars.dynamics.scaling();
                    let d = from_fn(|i| scaling[i] + dynamics.regularisation);
                    next.schur_complement(p, d, after)?;
                }
                eliminate(stage, vars, leading, interval, p, block)?;
            }
            mirror_lower(block);
            if vars.free_x != Free::ALL {
                mask(block, &vars.free_x.factors());
            }
            swap(&mut p, &mut block);
        }
        for (i, free) in variables.first().map_or([1.0; NX], |n| n.free_x.factors()).iter().enumerate()
        {
            p[i][i] += 1.0 - free;
        }
        *initial = *p;
        factor(initial)
    }
}

/// Adds the next stage's `cost_to_go` to a stage's Hessian and eliminates its controls: `block`
/// becomes the cost-to-go of the stage (its lower triangle).
#[inline(always)]
fn eliminate<const NX: usize, const NU: usize, const NG: usize, const S: usize, const C: usize>(
    stage: &QpStage<NX, NU, NG>,
    vars: &StageVariables<NX, NU, NG>,
    leading: Leading<S, C>,
    interval: &mut Interval<NX, NU>,
    cost_to_go: &[[f64; NX]; NX],
    block: &mut [[f64; NX]; NX],
) -> Result<(), NotPositiveDefinite> {
    let (mut pa, mut pb) = ([[0.0; NX]; S], [[0.0; NX]; C]);
    let a_transposed = leading.states(&interval.a_transposed);
    let b_transposed = leading.states(&interval.b_transposed);
    let cost_to_go = leading.states(cost_to_go);
    multiply(&mut pa, cost_to_go, &stage.a.data.0);
    multiply(&mut pb, cost_to_go, &stage.b.data.0);
    multiply_add_lower(block, a_transposed, &pa);
    let mut cross = [[0.0; NX]; NU];
    transpose(&mut cross, &stage.hessian_ux.data.0);
    multiply_add(&mut cross, a_transposed, &pb);
    let mut control = stage.hessian_uu.data.0;
    multiply_add(&mut control, b_transposed, &pb);
    let scaling = vars.u.scaling();
    let free = vars.free_u.factors();
    mask(&mut control, &free);
    for i in 0..NU {
        control[i][i] += scaling[i] + (1.0 - free[i]);
        for entry in &mut cross[i] {
            *entry *= free[i];
        }
    }
    factor(&mut control)?;
    // G = cross L^-T, then block - G D^-1 G^T, then K^T = G D^-1 L^-1.
    for j in 0..C {
        let mut column = cross[j];
        for i in 0..j {
            axpy(&mut column, &cross[i], -control[i][j]);
        }
        cross[j] = column;
    }
    let scaled: [[f64; C]; S] = from_fn(|j| from_fn(|i| -(cross[i][j] * control[i][i])));
    multiply_add_lower(block, leading.controls(&cross), &scaled);
    interval.gain.iter_mut().skip(C).for_each(|padding| *padding = [0.0; NX]);
    for j in (0..C).rev() {
        let mut column = cross[j];
        for c in &mut column {
            *c *= control[j][j];
        }
        for i in j + 1..C {
            axpy(&mut column, &interval.gain[i], -control[j][i]);
        }
        interval.gain[j] = column;
    }
    interval.control = control;
    Ok(())
}

/// Solves the factored system for the direction along which the condensed gradient vanishes: that gradient
/// stands in `out` on entry, with the residual of the dynamics.
///
/// Cost a stage: about `16 NX^2 + 12 NX NU + 4 NU^2` flops.
pub(super) fn direction<
    const NX: usize,
    const NU: usize,
    const NG: usize,
    const S: usize,
    const C: usize,
>(
    stages: &[QpStage<NX, NU, NG>],
    variables: &[StageVariables<NX, NU, NG>],
    leading: Leading<S, C>,
    intervals: &mut [Interval<NX, NU>],
    initial: &[[f64; NX]; NX],
    out: &mut [StageVector<NX, NU, NG>],
) {
    let gradient = backward(stages, variables, leading, intervals, out);
    let mut x = gradient.map(|s| -s);
    solve(initial, &mut x);
    forward(stages, variables, leading, intervals, x, out);
}

multiversion! {
    /// Gradients of the costs-to-go from the last stage to the first, whose gradient is returned.
    fn backward<const NX: usize, const NU: usize, const NG: usize, const S: usize, const C: usize>(
        stages: &[QpStage<NX, NU, NG>],
        variables: &[StageVariables<NX, NU, NG>],
        leading: Leading<S, C>,
        intervals: &mut [Interval<NX, NU>],
        rhs: &[StageVector<NX, NU, NG>],
    ) -> [f64; NX] {
        let mut gradient = [0.0; NX];
        for (k, (((stage, vars), interval), b)) in
            stages.iter().zip(variables).zip(intervals.iter_mut()).zip(rhs).enumerate().rev()
        {
            let scaling = vars.path_scaling();
            let mut x = b.x;
            let weighted = from_fn(|r| b.path[r] * scaling[r]);
            add_transposed_product(&stage.path_jacobian.data.0, &weighted, &mut x);
            if k + 1 < stages.len() {
                interval.cost_to_go.gradient = gradient;
                let (_, lambda) = interval.cost_to_go.substitute(&b.dynamics);
                let mut u = b.u;
                multiply_vector_add(&mut x, leading.states(&interval.a_transposed), &lambda);
                multiply_vector_add(&mut u, leading.states(&interval.b_transposed), &lambda);
                for (u, free) in u.iter_mut().zip(vars.free_u.factors()) {
                    *u *= free;
                }
                sub_product(leading.controls(&interval.gain), &u, &mut x);
                interval.feedforward = u;
            }
            let free = vars.free_x.factors();
            gradient = from_fn(|i| x[i] * free[i]);
        }
        gradient
    }
}

multiversion! {
    /// The direction from the step `start` of the first stage to the last. `out` holds the right-hand sides
    /// on entry.
    fn forward<const NX: usize, const NU: usize, const NG: usize, const S: usize, const C: usize>(
        stages: &[QpStage<NX, NU, NG>],
        variables: &[StageVariables<NX, NU, NG>],
        leading: Leading<S, C>,
        intervals: &[Interval<NX, NU>],
        start: [f64; NX],
        out: &mut [StageVector<NX, NU, NG>],
    ) {
        let mut x = start;
        for (k, (((stage, vars), interval), out)) in
            stages.iter().zip(variables).zip(intervals).zip(out.iter_mut()).enumerate()
        {
            let b = *out;
            let scaling = vars.path_scaling();
            let mut row = b.path;
            multiply_vector_add(&mut row, &stage.path_jacobian.data.0, &x);
            *out = StageVector { x, path: from_fn(|r| row[r] * scaling[r]), ..StageVector::ZERO };
            if k + 1 < stages.len() {
                let mut u = interval.feedforward.map(|u| -u);
                solve(&interval.control, &mut u);
                for (u, k) in u.iter_mut().zip(leading.controls(&interval.gain)) {
                    for (k, x) in leading.states(k).iter().zip(&x) {
                        *u -= k * x;
                    }
                }
                let mut y = b.dynamics;
                multiply_vector_add(&mut y, leading.states(&stage.a.data.0), &x);
                multiply_vector_add(&mut y, leading.controls(&stage.b.data.0), &u);
                out.u = u;
                (x, out.dynamics) = interval.cost_to_go.substitute(&y);
            }
        }
    }
}
