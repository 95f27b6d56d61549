//! Certificate that hard dynamics have no solution within the bounds.

use super::bounded::larger;
use super::riccati::Interval;
use super::variables::StageVariables;
use crate::Qp;
use crate::dense::matrix::multiply_vector_add;
use core::array::from_fn;

/// Entries of the certificate's gradient up to this count as rounding.
const ROUNDING: f64 = 1e-9;

/// Whether the multipliers `y` of the dynamics, which diverge where the QP is infeasible, prove it:
/// `y^T (A x + B u + c - x+)`, summed over all stages, is positive for *every* point within the
/// bounds (Farkas' lemma). False where nothing is proved. Cost: `N (2 NX^2 + 2 NX NU)` flops.
pub(super) fn is_proved<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    variables: &[StageVariables<NX, NU, NG>],
    intervals: &[Interval<NX, NU>],
) -> bool {
    let size = variables
        .iter()
        .flat_map(|vars| vars.dynamics.value)
        .fold(0.0, |size, v| larger(size, v.abs()));
    if qp.defect_penalty < f64::INFINITY || !(size > 1.0) {
        return false;
    }
    let (mut least, mut scale) = (0.0, 0.0);
    let mut add = |coefficient: f64, lower: f64, upper: f64| {
        if !(coefficient.abs() <= ROUNDING && lower.max(-upper) == f64::NEG_INFINITY) {
            let upper = if coefficient < 0.0 { upper } else { 0.0 };
            // Zero times an infinite bound would be an invalid operation.
            let term = coefficient * if coefficient > 0.0 { lower } else { upper };
            least += term;
            scale += term.abs();
        }
    };
    let mut before = [0.0; NX];
    for (k, ((stage, vars), interval)) in qp.used().iter().zip(variables).zip(intervals).enumerate()
    {
        let y: [f64; NX] = match k + 1 < qp.nodes() {
            true => from_fn(|i| vars.dynamics.value[i] / size),
            false => [0.0; NX],
        };
        let mut x: [f64; NX] = from_fn(|i| -before[i]);
        let mut u = [0.0; NU];
        if k + 1 < qp.nodes() {
            multiply_vector_add(&mut x, &interval.a_transposed, &y);
            multiply_vector_add(&mut u, &interval.b_transposed, &y);
            for i in 0..NU {
                add(u[i], stage.lower_u[i], stage.upper_u[i]);
            }
            for i in 0..NX {
                add(y[i], stage.c[i], stage.c[i]);
            }
        }
        for i in 0..NX {
            add(x[i], stage.lower_x[i], stage.upper_x[i]);
        }
        before = y;
    }
    // Rounding of the sum counts against the proof.
    least > ROUNDING * scale.max(1.0)
}
