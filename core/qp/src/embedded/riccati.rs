//! The Newton system of one iteration, factored by a Riccati recursion.
//!
//! Riccati's recursion with a compliant joint (`joint.rs`) between nodes: backward once for the
//! matrices, backward and forward again for each right-hand side.

use super::joint::Joint;
use super::kernels::{NotPositiveDefinite, add_transposed_product, factor, solve, sub_product};
use super::node::{Entries, Free, Node};
use crate::Stage;
use crate::dense::matrix::{
    axpy, mirror_lower, multiply, multiply_add, multiply_vector_add, transpose,
};
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

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize, const NU: usize> Interval<NX, NU> {
    /// Storage that holds anything.
    pub fn filled(value: f64) -> Self {
        Self {
            a_transposed: [[value; NX]; NX],
            b_transposed: [[value; NU]; NX],
            joint: Joint::filled(value),
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
        joint: Joint::ZERO,
        control: [[0.0; NU]; NU],
        gain: [[0.0; NX]; NU],
        feedforward: [0.0; NU],
    };

    /// Copies what stays the same during all iterations on a program.
    pub fn pack<const NR: usize>(&mut self, stage: &Stage<NX, NU, NR>) {
        transpose(&mut self.a_transposed, &stage.a.data.0);
        transpose(&mut self.b_transposed, &stage.b.data.0);
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

/// Factors the system of all nodes. `regular` is added to the compliance; `initial` becomes the
/// factor for the first node's states.
///
/// Cost a node: `2 NX^2 (NX + NU)` for `P~ [A B]`, `2 NX^3 + 2 NX^2 NU + 2 NX NU^2` for
/// `[A B]^T P~ [A B]`, `3 NX^2 NU` for the controls' elimination, `5 NX^3` for the joint.
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
            let after = nodes.get(k + 1).map_or(Free::ALL, |next| next.free_x);
            let compliance = from_fn(|i| stiffness[i] + regular);
            let mut cost_to_go = [[0.0; NX]; NX];
            let softened = interval.joint.soften(&p, compliance, after, &mut cost_to_go);
            result = result.and(softened);
            let eliminated = eliminate(stage, node, interval, &cost_to_go, &mut block);
            result = result.and(eliminated);
        }
        mirror_lower(&mut block);
        mask(&mut block, &node.free_x.factors());
        p = block;
    }
    for (i, free) in nodes.first().map_or([1.0; NX], |n| n.free_x.factors()).iter().enumerate() {
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
    multiply(&mut pa, cost_to_go, &stage.a.data.0);
    multiply(&mut pb, cost_to_go, &stage.b.data.0);
    multiply_add(block, &interval.a_transposed, &pa);
    let mut cross = [[0.0; NX]; NU];
    transpose(&mut cross, &stage.hessian_ux.data.0);
    multiply_add(&mut cross, &interval.a_transposed, &pb);
    let mut control = stage.hessian_uu.data.0;
    multiply_add(&mut control, &interval.b_transposed, &pb);
    let stiffness = node.u.stiffness();
    let free = node.free_u.factors();
    mask(&mut control, &free);
    for i in 0..NU {
        control[i][i] += stiffness[i] + (1.0 - free[i]);
        for entry in &mut cross[i] {
            *entry *= free[i];
        }
    }
    let factored = factor(&mut control);
    // G = cross L^-T, then block - G D^-1 G^T, then K^T = G D^-1 L^-1.
    for j in 0..NU {
        let mut column = cross[j];
        for i in 0..j {
            axpy(&mut column, &cross[i], -control[i][j]);
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
            axpy(&mut column, &interval.gain[i], -control[j][i]);
        }
        interval.gain[j] = column;
    }
    interval.control = control;
    factored
}

/// Solves the factored system for the direction along which `right` (the condensed gradient)
/// vanishes; `right.dynamics` is the violation of the dynamics.
///
/// Cost a node: about `16 NX^2 + 12 NX NU + 4 NU^2` flops.
pub(super) fn direction<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    stages: &[Stage<NX, NU, NR>; N],
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &mut [Interval<NX, NU>; N],
    initial: &[[f64; NX]; NX],
    right: impl Fn(usize, &Node<NX, NU, NR>) -> Entries<NX, NU, NR>,
    out: &mut [Entries<NX, NU, NR>; N],
) {
    let slope = backward(stages, nodes, intervals, right, out);
    let mut x = slope.map(|s| -s);
    solve(initial, &mut x);
    forward(stages, nodes, intervals, x, out);
}

/// Slopes of the costs-to-go, from the last node to the first, whose slope is returned. `out` keeps
/// the right-hand sides for the way forward.
fn backward<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    stages: &[Stage<NX, NU, NR>; N],
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &mut [Interval<NX, NU>; N],
    right: impl Fn(usize, &Node<NX, NU, NR>) -> Entries<NX, NU, NR>,
    out: &mut [Entries<NX, NU, NR>; N],
) -> [f64; NX] {
    let mut slope = [0.0; NX];
    for (k, (((stage, node), interval), out)) in
        stages.iter().zip(nodes).zip(intervals.iter_mut()).zip(out.iter_mut()).enumerate().rev()
    {
        let b = right(k, node);
        let stiffness = node.row_stiffness();
        let mut x = b.x;
        let weighted = from_fn(|r| b.row[r] * stiffness[r]);
        add_transposed_product(&stage.row_x.data.0, &weighted, &mut x);
        if k + 1 < N {
            interval.joint.slope = slope;
            let (_, force) = interval.joint.yield_to(&b.dynamics);
            let mut u = b.u;
            multiply_vector_add(&mut x, &interval.a_transposed, &force);
            multiply_vector_add(&mut u, &interval.b_transposed, &force);
            for (u, free) in u.iter_mut().zip(node.free_u.factors()) {
                *u *= free;
            }
            sub_product(&interval.gain, &u, &mut x);
            interval.feedforward = u;
        }
        let free = node.free_x.factors();
        slope = from_fn(|i| x[i] * free[i]);
        *out = b;
    }
    slope
}

/// The direction itself, from the step `x` of the first node to the last. `out` holds the
/// right-hand sides on entry.
fn forward<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    stages: &[Stage<NX, NU, NR>; N],
    nodes: &[Node<NX, NU, NR>; N],
    intervals: &[Interval<NX, NU>; N],
    mut x: [f64; NX],
    out: &mut [Entries<NX, NU, NR>; N],
) {
    for (k, (((stage, node), interval), out)) in
        stages.iter().zip(nodes).zip(intervals).zip(out.iter_mut()).enumerate()
    {
        let b = *out;
        let stiffness = node.row_stiffness();
        let mut row = b.row;
        multiply_vector_add(&mut row, &stage.row_x.data.0, &x);
        *out = Entries { x, row: from_fn(|r| row[r] * stiffness[r]), ..Entries::ZERO };
        if k + 1 < N {
            let mut u = interval.feedforward.map(|u| -u);
            solve(&interval.control, &mut u);
            for (u, k) in u.iter_mut().zip(&interval.gain) {
                for (k, x) in k.iter().zip(&x) {
                    *u -= k * x;
                }
            }
            let mut y = b.dynamics;
            multiply_vector_add(&mut y, &stage.a.data.0, &x);
            multiply_vector_add(&mut y, &stage.b.data.0, &u);
            out.u = u;
            (x, out.dynamics) = interval.joint.yield_to(&y);
        }
    }
}
