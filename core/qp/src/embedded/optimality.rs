//! KKT residuals of an iterate.

use super::kernels::add_transposed_product;
use super::leading::Leading;
use super::riccati::Interval;
use super::variables::{StageVariables, StageVector};
use crate::dense::clamp;
use crate::dense::matrix::multiply_vector_add;
use crate::simd::multiversion;
use crate::{Qp, QpStage};

/// Largest factor on the tolerances for large states and controls: QPs come scaled.
const MAX_SCALE: f64 = 10.0;

/// KKT residuals of an iterate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Optimality {
    /// Largest entry of the Lagrangian's gradient, bounds' multipliers included, and of the violation
    /// of dynamics and path constraints.
    pub residual: f64,
    /// Mean complementarity `s z`.
    pub mu: f64,
    /// Largest complementarity `s z`.
    pub complementarity: f64,
    /// Largest state or control, from one to ten: tolerances are multiplied by it because rounding
    /// grows with it.
    pub scale: f64,
}

impl Optimality {
    /// Whether residual and complementarity are within these tolerances, scaled.
    pub fn is_within(&self, residual: f64, complementarity: f64) -> bool {
        self.residual <= residual * self.scale
            && self.complementarity <= complementarity * self.scale
    }

    /// Whether all of it is finite.
    pub fn is_finite(&self) -> bool {
        [self.residual, self.complementarity, self.scale].iter().all(|x| x.is_finite())
    }
}

multiversion! {
    /// KKT residuals of the iterate `variables`, at which the Lagrangian has `gradient`. NaN where any number is
    /// not finite. Cost: about `N (12 NX + 6 NU)` flops.
    pub(super) fn optimality<const NX: usize, const NU: usize, const NG: usize>(
        variables: &[StageVariables<NX, NU, NG>],
        gradient: &[StageVector<NX, NU, NG>],
        pairs: f64,
    ) -> Optimality {
        let (mut worst, mut sum) =
            (StageVector::<NX, NU, NG>::ZERO, StageVector::<NX, NU, NG>::ZERO);
        let (mut most, mut poison) = (sum, sum);
        let mut size = StageVector::<NX, NU, NG>::ZERO;
        for (vars, gradient) in variables.iter().zip(gradient) {
            let residual = vars.residual(gradient);
            // The comparisons below would drop a NaN.
            poison.spoil_by(&residual);
            worst.raise_to(&residual);
            vars.add_complementarity(&mut sum, &mut most);
            size.raise_to(&vars.point());
        }
        let sum = sum.sum();
        Optimality {
            residual: if poison.sum().is_finite() { worst.largest() } else { f64::NAN },
            mu: sum / pairs,
            complementarity: if sum.is_finite() { most.largest() } else { f64::NAN },
            scale: clamp(size.largest(), 1.0, MAX_SCALE),
        }
    }
}

multiversion! {
    /// Gradient of the Lagrangian at the iterate, without the bounds' multipliers.
    ///
    /// Cost: about `N (6 NX^2 + 8 NX NU + 2 NU^2)` flops.
    pub(super) fn differentiate<
        const N: usize, const NX: usize, const NU: usize, const NG: usize, const S: usize, const C: usize
    >(
        qp: &Qp<N, NX, NU, NG>,
        leading: Leading<S, C>,
        variables: &[StageVariables<NX, NU, NG>],
        intervals: &[Interval<NX, NU>],
        out: &mut [StageVector<NX, NU, NG>],
    ) {
        let mut before = [0.0; NX];
        let each = qp.used().iter().zip(variables).zip(intervals).zip(out).enumerate();
        for (k, (((stage, vars), interval), out)) in each {
            *out = own_gradient(stage, vars, leading, k + 1 == qp.nodes());
            for i in 0..NX {
                out.x[i] -= before[i];
            }
            if let Some(next) = variables.get(k + 1).filter(|_| k + 1 < qp.nodes()) {
                let lambda = &vars.dynamics.value;
                multiply_vector_add(&mut out.x, leading.states(&interval.a_transposed), lambda);
                multiply_vector_add(&mut out.u, leading.states(&interval.b_transposed), lambda);
                for i in 0..NX {
                    out.dynamics[i] -= next.x.value[i];
                }
                before = *lambda;
            }
        }
    }
}

/// One stage's share of the gradient: its cost, path constraints and side of the dynamics.
// Inlined where its caller is compiled for AVX2; elsewhere callers share it, which spares the
// Cortex-M7's image 10 kB.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn own_gradient<
    const NX: usize,
    const NU: usize,
    const NG: usize,
    const S: usize,
    const C: usize,
>(
    stage: &QpStage<NX, NU, NG>,
    vars: &StageVariables<NX, NU, NG>,
    leading: Leading<S, C>,
    last: bool,
) -> StageVector<NX, NU, NG> {
    let mut out = StageVector::ZERO;
    let x = &vars.x.value;
    out.x = stage.gradient_x.data.0[0];
    multiply_vector_add(&mut out.x, &stage.hessian_xx.data.0, x);
    add_transposed_product(&stage.path_jacobian.data.0, &vars.path.value, &mut out.x);
    out.path = stage.path_offset.data.0[0];
    multiply_vector_add(&mut out.path, &stage.path_jacobian.data.0, x);
    if !last {
        let u = &vars.u.value;
        add_transposed_product(&stage.hessian_ux.data.0, u, &mut out.x);
        out.u = stage.gradient_u.data.0[0];
        multiply_vector_add(&mut out.u, &stage.hessian_uu.data.0, u);
        multiply_vector_add(&mut out.u, leading.states(&stage.hessian_ux.data.0), x);
        out.dynamics = stage.c.data.0[0];
        multiply_vector_add(&mut out.dynamics, leading.states(&stage.a.data.0), x);
        multiply_vector_add(&mut out.dynamics, leading.controls(&stage.b.data.0), u);
    }
    out
}
