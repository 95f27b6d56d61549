//! How far from optimal an iterate is.

use super::kernels::add_transposed_product;
use super::node::{Entries, Node};
use super::riccati::Interval;
use crate::dense::clamp;
use crate::dense::matrix::multiply_vector_add;
use crate::{Qp, Stage};

/// States and controls beyond this are no excuse for larger residuals: programs come scaled.
const LARGE: f64 = 10.0;

/// What is known of an iterate's optimality.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Optimality {
    /// Largest entry of the Lagrangian's gradient by states and controls, bounds' multipliers
    /// included, and largest violation of dynamics and rows.
    pub residual: f64,
    /// Mean product of the complementary pairs.
    pub mean: f64,
    /// Largest product of a pair.
    pub product: f64,
    /// Largest state or control, from one to ten: what residuals are measured by, for rounding
    /// grows with it.
    pub scale: f64,
}

impl Optimality {
    /// Of the iterate `nodes`, at which the Lagrangian has `gradient`. NaN where anything is not
    /// finite. Cost: about `N (12 NX + 6 NU)` flops.
    pub fn of<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
        nodes: &[Node<NX, NU, NR>; N],
        gradient: &[Entries<NX, NU, NR>; N],
        pairs: f64,
    ) -> Self {
        let (mut worst, mut sum) = (Entries::<NX, NU, NR>::ZERO, Entries::<NX, NU, NR>::ZERO);
        let (mut most, mut poison) = (Entries::<NX, NU, NR>::ZERO, 0.0);
        let mut size = Entries::<NX, NU, NR>::ZERO;
        for (node, gradient) in nodes.iter().zip(gradient) {
            let residual = node.residual(gradient);
            // The comparisons below would drop a NaN.
            poison += residual.sum() * 0.0;
            worst.raise_to(&residual);
            node.products(&mut sum, &mut most);
            size.raise_to(&node.point());
        }
        let sum = sum.sum();
        Self {
            residual: worst.largest() + poison,
            mean: sum / pairs,
            product: most.largest() + sum * 0.0,
            scale: clamp(size.largest(), 1.0, LARGE),
        }
    }

    /// Whether residual and products are small enough.
    pub fn is_within(&self, residual: f64, product: f64) -> bool {
        self.residual <= residual * self.scale && self.product <= product * self.scale
    }

    /// Whether all of it is finite.
    pub fn is_finite(&self) -> bool {
        ((self.residual + self.product) * 0.0 + self.scale).is_finite()
    }
}

/// Gradient of the Lagrangian at the iterate, without the bounds' multipliers.
///
/// Cost: about `N (6 NX^2 + 8 NX NU + 2 NU^2)` flops.
pub(super) fn differentiate<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    qp: &Qp<N, NX, NU, NR>,
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &[Interval<NX, NU>; N],
    out: &mut [Entries<NX, NU, NR>; N],
) {
    let mut before = [0.0; NX];
    let each = qp.stages.iter().zip(nodes).zip(intervals).zip(out).enumerate();
    for (k, (((stage, node), interval), out)) in each {
        *out = own_gradient(stage, node, k + 1 == N);
        for i in 0..NX {
            out.x[i] -= before[i];
        }
        if let Some(next) = nodes.get(k + 1) {
            let lambda = &node.dynamics.value;
            multiply_vector_add(&mut out.x, &interval.a_transposed, lambda);
            multiply_vector_add(&mut out.u, &interval.b_transposed, lambda);
            for i in 0..NX {
                out.dynamics[i] -= next.x.value[i];
            }
            before = *lambda;
        }
    }
}

/// One node's share: its cost and rows, and its side of the dynamics.
fn own_gradient<const NX: usize, const NU: usize, const NR: usize>(
    stage: &Stage<NX, NU, NR>,
    node: &Node<NX, NU, NR>,
    last: bool,
) -> Entries<NX, NU, NR> {
    let mut out = Entries::ZERO;
    let x = &node.x.value;
    out.x = stage.gradient_x.data.0[0];
    multiply_vector_add(&mut out.x, &stage.hessian_xx.data.0, x);
    add_transposed_product(&stage.row_x.data.0, &node.row.value, &mut out.x);
    out.row = stage.row_offset.data.0[0];
    multiply_vector_add(&mut out.row, &stage.row_x.data.0, x);
    if !last {
        let u = &node.u.value;
        add_transposed_product(&stage.hessian_ux.data.0, u, &mut out.x);
        out.u = stage.gradient_u.data.0[0];
        multiply_vector_add(&mut out.u, &stage.hessian_uu.data.0, u);
        multiply_vector_add(&mut out.u, &stage.hessian_ux.data.0, x);
        out.dynamics = stage.c.data.0[0];
        multiply_vector_add(&mut out.dynamics, &stage.a.data.0, x);
        multiply_vector_add(&mut out.dynamics, &stage.b.data.0, u);
    }
    out
}
