//! The Newton system of one iteration, factored by a Riccati recursion.
//!
//! With `D` the barriers' stiffness of the multipliers of the dynamics, the linearised dynamics read
//! `dx+ = A dx + B du + r - D dlambda`: a *compliant* joint between nodes, as `docs/qp.md` derives.
//! A cost-to-go `1/2 dx+^T P dx+` seen through it is `P~ = (P^-1 + D)^-1 = P - P (P + D^-1)^-1 P`,
//! and that of a pinned component, infinite, becomes `1 / D`: pins need nothing else.

use super::joint::Joint;
use super::kernels::{
    NotPositiveDefinite, add_matrix_product, add_product, factor, product, solve, sub_product,
    transpose,
};
use super::node::{Entries, Node};
use crate::qp::Stage;
use core::array::from_fn;

/// What one interval leaves for the solves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval<const NX: usize, const NU: usize> {
    /// `A^T`, `B^T` by columns.
    pub a_transposed: [[f64; NX]; NX],
    pub b_transposed: [[f64; NU]; NX],
    joint: Joint<NX>,
    /// Factor of the control block.
    control: [[f64; NU]; NU],
    /// `K^T` by columns: along the optimum `du = -K dx`.
    pub gain: [[f64; NX]; NU],
    /// Control step at `dx = 0`, negated.
    feedforward: [f64; NU],
}

impl<const NX: usize, const NU: usize> Interval<NX, NU> {
    pub const ZERO: Self = Self {
        a_transposed: [[0.0; NX]; NX],
        b_transposed: [[0.0; NU]; NX],
        joint: Joint::ZERO,
        control: [[0.0; NU]; NU],
        gain: [[0.0; NX]; NU],
        feedforward: [0.0; NU],
    };

    /// Copies what stays the same during all iterations on a program.
    pub fn pack<const NR: usize>(&mut self, stage: &Stage<NX, NU, NR>) {
        transpose(&stage.a.data.0, &mut self.a_transposed);
        transpose(&stage.b.data.0, &mut self.b_transposed);
    }
}

/// Hessian of one node's states with all barriers, pinned rows and columns zero.
#[inline(always)]
fn state_block<const NX: usize, const NU: usize, const NR: usize>(
    stage: &Stage<NX, NU, NR>,
    node: &Node<NX, NU, NR>,
) -> [[f64; NX]; NX] {
    let mut block = stage.hessian_xx.data.0;
    let stiffness = node.x.stiffness();
    for i in 0..NX {
        block[i][i] += stiffness[i];
    }
    let stiffness = node.row_stiffness();
    for (r, weight) in stiffness.iter().enumerate() {
        let row: [f64; NX] = from_fn(|i| stage.row_x[(r, i)]);
        for (column, factor) in block.iter_mut().zip(&row) {
            for (entry, c) in column.iter_mut().zip(&row) {
                *entry += c * (factor * weight);
            }
        }
    }
    block
}

/// Zeroes rows and columns of what is pinned.
#[inline(always)]
fn mask<const NX: usize>(p: &mut [[f64; NX]; NX], free: &[f64; NX]) {
    for (column, f) in p.iter_mut().zip(free) {
        for (entry, g) in column.iter_mut().zip(free) {
            *entry *= f * g;
        }
    }
}

/// Copies the lower triangle to the upper one.
#[inline(always)]
fn mirror<const R: usize>(m: &mut [[f64; R]; R]) {
    for j in 1..R {
        for i in 0..j {
            m[j][i] = m[i][j];
        }
    }
}

/// Factors the system of all nodes. `regular` is added to the compliance: zero unless the dynamics
/// are hard. The first node's states are solved for with `initial`.
///
/// Cost a node: `2 NX^2 (NX + NU)` for `P~ [A B]`, `2 NX^3 + 2 NX^2 NU + 2 NX NU^2` for
/// `[A B]^T P~ [A B]`, `3 NX^2 NU` for the controls' elimination, `4 NX^3` for the compliance.
pub(super) fn factorise<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    stages: &[Stage<NX, NU, NR>; N],
    nodes: &[Node<NX, NU, NR>; N],
    regular: f64,
    intervals: &mut [Interval<NX, NU>; N],
    initial: &mut [[f64; NX]; NX],
) -> Result<(), NotPositiveDefinite> {
    let mut result = Ok(());
    let mut p = [[0.0; NX]; NX];
    for (k, ((stage, node), interval)) in
        stages.iter().zip(nodes).zip(intervals.iter_mut()).enumerate().rev()
    {
        let mut block = state_block(stage, node);
        if k + 1 < N {
            let stiffness = node.dynamics.stiffness();
            let after = nodes.get(k + 1).map_or([1.0; NX], |next| next.free_x);
            let compliance = from_fn(|i| stiffness[i] + regular);
            let mut cost_to_go = [[0.0; NX]; NX];
            let softened = interval.joint.soften(&p, compliance, after, &mut cost_to_go);
            result = result.and(softened);
            let eliminated = eliminate(stage, node, interval, &cost_to_go, &mut block);
            result = result.and(eliminated);
        }
        mirror(&mut block);
        mask(&mut block, &node.free_x);
        p = block;
    }
    for (i, free) in nodes.first().map_or([1.0; NX], |n| n.free_x).iter().enumerate() {
        p[i][i] += 1.0 - free;
    }
    *initial = p;
    result.and(factor(initial))
}

/// Adds the cost-to-go to a node's blocks and eliminates its controls: `block` becomes the
/// cost-to-go of the node (its lower triangle).
#[inline(always)]
fn eliminate<const NX: usize, const NU: usize, const NR: usize>(
    stage: &Stage<NX, NU, NR>,
    node: &Node<NX, NU, NR>,
    interval: &mut Interval<NX, NU>,
    cost_to_go: &[[f64; NX]; NX],
    block: &mut [[f64; NX]; NX],
) -> Result<(), NotPositiveDefinite> {
    let (mut pa, mut pb) = ([[0.0; NX]; NX], [[0.0; NX]; NU]);
    product(cost_to_go, &stage.a.data.0, &mut pa);
    product(cost_to_go, &stage.b.data.0, &mut pb);
    add_matrix_product(&interval.a_transposed, &pa, block);
    let mut cross = [[0.0; NX]; NU];
    transpose(&stage.hessian_ux.data.0, &mut cross);
    add_matrix_product(&interval.a_transposed, &pb, &mut cross);
    let mut control = stage.hessian_uu.data.0;
    add_matrix_product(&interval.b_transposed, &pb, &mut control);
    let stiffness = node.u.stiffness();
    mask(&mut control, &node.free_u);
    for i in 0..NU {
        control[i][i] += stiffness[i] + (1.0 - node.free_u[i]);
        for entry in &mut cross[i] {
            *entry *= node.free_u[i];
        }
    }
    let factored = factor(&mut control);
    // G = cross L^-T, then block - G D^-1 G^T, then K^T = G D^-1 L^-1.
    for j in 0..NU {
        let mut column = cross[j];
        for i in 0..j {
            for (c, g) in column.iter_mut().zip(&cross[i]) {
                *c -= g * control[i][j];
            }
        }
        cross[j] = column;
    }
    for j in 0..NX {
        let scaled: [f64; NU] = from_fn(|i| cross[i][j] * control[i][i]);
        sub_product(&cross, &scaled, &mut block[j]);
    }
    for j in (0..NU).rev() {
        let mut column = cross[j];
        for c in &mut column {
            *c *= control[j][j];
        }
        for i in j + 1..NU {
            for (c, k) in column.iter_mut().zip(&interval.gain[i]) {
                *c -= k * control[j][i];
            }
        }
        interval.gain[j] = column;
    }
    interval.control = control;
    factored
}

/// Solves the factored system for the direction along which `right` (the condensed gradient)
/// vanishes; `right.dynamics` is the violation of the dynamics.
///
/// Cost a node: about `8 NX^2 + 8 NX NU + 2 NU^2` flops.
pub(super) fn direction<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    stages: &[Stage<NX, NU, NR>; N],
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &mut [Interval<NX, NU>; N],
    initial: &[[f64; NX]; NX],
    right: impl Fn(usize, &Node<NX, NU, NR>) -> Entries<NX, NU, NR>,
    out: &mut [Entries<NX, NU, NR>; N],
) {
    // Backward: slopes of the costs-to-go. `out` keeps what the way forward needs again.
    let mut slope = [0.0; NX];
    for (k, (((stage, node), interval), out)) in
        stages.iter().zip(nodes).zip(intervals.iter_mut()).zip(out.iter_mut()).enumerate().rev()
    {
        let b = right(k, node);
        let mut x = b.x;
        let stiffness = node.row_stiffness();
        for r in 0..NR {
            let weighted = b.row[r] * stiffness[r];
            for i in 0..NX {
                x[i] += stage.row_x[(r, i)] * weighted;
            }
        }
        if k + 1 < N {
            interval.joint.slope = slope;
            let (_, q) = interval.joint.yield_to(&b.dynamics);
            let mut u = b.u;
            add_product(&interval.a_transposed, &q, &mut x);
            add_product(&interval.b_transposed, &q, &mut u);
            for i in 0..NU {
                u[i] *= node.free_u[i];
            }
            sub_product(&interval.gain, &u, &mut x);
            interval.feedforward = u;
        }
        for i in 0..NX {
            slope[i] = x[i] * node.free_x[i];
        }
        *out = b;
    }
    // Forward.
    let mut x: [f64; NX] = slope.map(|s| -s);
    solve(initial, &mut x);
    for (k, (((stage, interval), node), out)) in
        stages.iter().zip(intervals.iter_mut()).zip(nodes).zip(out.iter_mut()).enumerate()
    {
        let b = *out;
        out.x = x;
        let stiffness = node.row_stiffness();
        for r in 0..NR {
            let mut moved = b.row[r];
            for i in 0..NX {
                moved += stage.row_x[(r, i)] * x[i];
            }
            out.row[r] = moved * stiffness[r];
        }
        if k + 1 == N {
            out.u = [0.0; NU];
            out.dynamics = [0.0; NX];
            break;
        }
        let mut u = interval.feedforward.map(|u| -u);
        solve(&interval.control, &mut u);
        for (u, k) in u.iter_mut().zip(&interval.gain) {
            for (k, x) in k.iter().zip(&x) {
                *u -= k * x;
            }
        }
        out.u = u;
        let mut y = b.dynamics;
        add_product(&stage.a.data.0, &x, &mut y);
        add_product(&stage.b.data.0, &u, &mut y);
        (x, out.dynamics) = interval.joint.yield_to(&y);
    }
}
