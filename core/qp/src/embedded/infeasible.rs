//! The proof that hard dynamics have no point within the boxes.

use super::boxed::larger;
use super::node::Node;
use super::riccati::Interval;
use crate::Qp;
use crate::dense::matrix::multiply_vector_add;
use core::array::from_fn;

/// Entries of a certificate's gradient up to this are taken for rounding.
const NOTHING: f64 = 1e-9;

/// Whether the multipliers of the dynamics, which diverge where these have no point, prove just
/// that: `y^T (A x + B u + c - x+)`, summed over all nodes, is positive for *every* point in the
/// boxes (Farkas). False where nothing is proved. Cost: `N (2 NX^2 + 2 NX NU)` flops.
pub(super) fn is_proved<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    qp: &Qp<N, NX, NU, NR>,
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &[Interval<NX, NU>; N],
) -> bool {
    let size = nodes
        .iter()
        .flat_map(|node| node.dynamics.value)
        .fold(0.0, |size, v| larger(size, v.abs()));
    if qp.defect_weight < f64::INFINITY || !(size > 1.0) {
        return false;
    }
    let (mut least, mut scale) = (0.0, 0.0);
    let mut add = |coefficient: f64, lower: f64, upper: f64| {
        if !(coefficient.abs() <= NOTHING && lower.max(-upper) == f64::NEG_INFINITY) {
            let bound = if coefficient > 0.0 { lower } else { upper };
            let term = if coefficient == 0.0 { 0.0 } else { coefficient * bound };
            least += term;
            scale += term.abs();
        }
    };
    let mut before = [0.0; NX];
    for (k, ((stage, node), interval)) in qp.stages.iter().zip(nodes).zip(intervals).enumerate() {
        let y: [f64; NX] = match k + 1 < N {
            true => from_fn(|i| node.dynamics.value[i] / size),
            false => [0.0; NX],
        };
        let mut x: [f64; NX] = from_fn(|i| -before[i]);
        let mut u = [0.0; NU];
        if k + 1 < N {
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
    least > NOTHING * scale.max(1.0)
}
