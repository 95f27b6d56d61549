//! A reference for subproblems: another solver's point, made exact.
//!
//! An interior point method stops where complementarity is small, not zero: on flat programs it is
//! then a thousandth from the optimum. Here the constraints that its point says are active become
//! equations. What is left, linear and banded, is solved directly with refinement; where a sign
//! does not hold, the constraint changes sides, and again. A point at which all signs hold is the
//! optimum but for rounding. Nothing of it knows how either solver works.

mod active;
mod banded;

use active::{Active, BoundState, Side};
use banded::BandedMatrix;
use remora_core::advanced::qp::{Qp, Solution};
use remora_host::kkt::Kkt;

/// Most rounds of changed sides.
const ROUNDS: usize = 60;
/// From this round on only one constraint changes sides at a time: together they may go in circles.
const ALONE: usize = 20;
/// Tolerance on the signs of values and multipliers.
const TOLERANCE: f64 = 1e-11;
/// Added to the diagonal for the factors alone: where equations repeat each other it decides;
/// refinement takes it out again.
const REGULARISATION: f64 = 1e-10;
/// Rounds of refinement.
const REFINEMENTS: usize = 8;
/// Largest residual of an answer.
const RESIDUAL: f64 = 1e-9;

/// The optimum next to `point`; none where no set of active constraints was found at which all
/// signs hold.
pub fn polish<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    point: &Solution<N, NX, NU, NG>,
) -> Option<Box<Solution<N, NX, NU, NG>>> {
    let mut active = active::read(qp, point, None);
    for round in 0..ROUNDS {
        let found = System::new(qp, &active).solve()?;
        let next = active::read(qp, &found, Some((&active, TOLERANCE)));
        if next == active {
            return (Kkt::of(qp, &found).worst() <= RESIDUAL).then_some(found);
        }
        active = if round < ALONE { next } else { first_change(&active, next) };
    }
    None
}

/// The active constraints with the first change of `next` alone (Bland's rule).
fn first_change(active: &[Active], mut next: Vec<Active>) -> Vec<Active> {
    fn keep<T: Copy + PartialEq>(old: &[T], new: &mut [T], is_over: &mut bool) {
        for (old, new) in old.iter().zip(new) {
            if *is_over {
                *new = *old;
            }
            *is_over |= old != new;
        }
    }
    let mut is_over = false;
    for (old, new) in active.iter().zip(&mut next) {
        keep(&old.x, &mut new.x, &mut is_over);
        keep(&old.u, &mut new.u, &mut is_over);
        keep(&old.rows, &mut new.rows, &mut is_over);
        keep(&old.dynamics, &mut new.dynamics, &mut is_over);
    }
    next
}

/// Places of a node's unknowns in the system; none where a number is known.
struct Unknowns {
    x: Vec<Option<usize>>,
    u: Vec<Option<usize>>,
    rows: Vec<Option<usize>>,
    dynamics: Vec<Option<usize>>,
}

/// The equations of a set of active constraints.
struct System<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    qp: &'a Qp<N, NX, NU, NG>,
    active: &'a [Active],
    unknowns: Vec<Unknowns>,
    size: usize,
}

impl<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    System<'a, N, NX, NU, NG>
{
    fn new(qp: &'a Qp<N, NX, NU, NG>, active: &'a [Active]) -> Self {
        let mut size = 0;
        let mut unknown = |is_unknown: bool| {
            is_unknown.then(|| {
                size += 1;
                size - 1
            })
        };
        let unknowns = active
            .iter()
            .map(|node| Unknowns {
                x: node.x.iter().map(|place| unknown(*place == BoundState::Free)).collect(),
                u: node.u.iter().map(|place| unknown(*place == BoundState::Free)).collect(),
                rows: node.rows.iter().map(|side| unknown(*side == Side::On)).collect(),
                dynamics: node.dynamics.iter().map(|side| unknown(*side == Side::On)).collect(),
            })
            .collect();
        Self { qp, active, unknowns, size }
    }

    /// Solves it; none where it is singular.
    fn solve(&self) -> Option<Box<Solution<N, NX, NU, NG>>> {
        let matrix = self.matrix();
        let mut sign = vec![REGULARISATION; self.size];
        for at in self.unknowns.iter().flat_map(|node| node.rows.iter().chain(&node.dynamics)) {
            at.iter().for_each(|at| sign[*at] = -REGULARISATION);
        }
        let factors = matrix.factors(&sign)?;
        let mut point = self.known();
        let mut values = vec![0.0; self.size];
        for _ in 0..=REFINEMENTS {
            let correction = factors.solve(self.residuals(&point));
            for (value, more) in values.iter_mut().zip(correction) {
                *value -= more;
            }
            self.put(&values, &mut point);
        }
        self.bound_multipliers(&mut point);
        Some(point)
    }

    /// Values fixed by the active constraints: variables at bounds, multipliers at their penalties.
    fn known(&self) -> Box<Solution<N, NX, NU, NG>> {
        let mut point = Box::new(Solution::ZERO);
        let end = |place: BoundState, lower: f64, upper: f64| match place {
            BoundState::Free => 0.0,
            BoundState::Lower | BoundState::Fixed => lower,
            BoundState::Upper => upper,
        };
        for (k, (node, stage)) in self.active.iter().zip(&self.qp.stages).enumerate() {
            for (i, place) in node.x.iter().enumerate() {
                point.x[k][i] = end(*place, stage.lower_x[i], stage.upper_x[i]);
            }
            for (i, place) in node.u.iter().enumerate() {
                point.u[k][i] = end(*place, stage.lower_u[i], stage.upper_u[i]);
            }
            for (i, side) in node.rows.iter().enumerate() {
                let is_violated = *side == Side::Above;
                point.path_multiplier[k][i] = if is_violated { self.qp.path_penalty } else { 0.0 };
            }
            for (i, side) in node.dynamics.iter().enumerate() {
                point.defect_multiplier[k][i] = match side {
                    Side::On => 0.0,
                    Side::Above => -self.qp.defect_penalty,
                    Side::Below => self.qp.defect_penalty,
                };
            }
        }
        point
    }

    fn put(&self, values: &[f64], point: &mut Solution<N, NX, NU, NG>) {
        let set = |places: &[Option<usize>], to: &mut [f64]| {
            for (place, to) in places.iter().zip(to) {
                place.iter().for_each(|at| *to = values[*at]);
            }
        };
        for (k, node) in self.unknowns.iter().enumerate() {
            set(&node.x, point.x[k].as_mut_slice());
            set(&node.u, point.u[k].as_mut_slice());
            set(&node.rows, point.path_multiplier[k].as_mut_slice());
            set(&node.dynamics, point.defect_multiplier[k].as_mut_slice());
        }
    }

    /// Gradients of the Lagrangian over state and control of a node, but for bounds' multipliers.
    fn gradients(&self, point: &Solution<N, NX, NU, NG>, k: usize) -> (Vec<f64>, Vec<f64>) {
        let (stage, x, u) = (&self.qp.stages[k], &point.x[k], &point.u[k]);
        let mut of_x = stage.hessian_xx * x
            + stage.gradient_x
            + stage.path_jacobian.tr_mul(&point.path_multiplier[k]);
        if k > 0 {
            of_x -= point.defect_multiplier[k - 1];
        }
        if k + 1 == self.qp.nodes() {
            return (of_x.as_slice().to_vec(), Vec::new());
        }
        let l = &point.defect_multiplier[k];
        of_x += stage.hessian_ux.tr_mul(u) + stage.a.tr_mul(l);
        let of_u =
            stage.hessian_uu * u + stage.hessian_ux * x + stage.gradient_u + stage.b.tr_mul(l);
        (of_x.as_slice().to_vec(), of_u.as_slice().to_vec())
    }

    /// Residuals of the equations at a point.
    fn residuals(&self, point: &Solution<N, NX, NU, NG>) -> Vec<f64> {
        let mut residuals = vec![0.0; self.size];
        let mut note = |places: &[Option<usize>], values: &[f64]| {
            for (place, value) in places.iter().zip(values) {
                place.iter().for_each(|at| residuals[*at] = *value);
            }
        };
        for (k, (node, stage)) in self.unknowns.iter().zip(&self.qp.stages).enumerate() {
            let (of_x, of_u) = self.gradients(point, k);
            note(&node.x, &of_x);
            note(&node.u, &of_u);
            note(&node.rows, (stage.path_jacobian * point.x[k] + stage.path_offset).as_slice());
            note(&node.dynamics, (-self.qp.slack(point, k)).as_slice());
        }
        residuals
    }

    fn bound_multipliers(&self, point: &mut Solution<N, NX, NU, NG>) {
        for (k, node) in self.active.iter().enumerate() {
            let (of_x, of_u) = self.gradients(point, k);
            for (i, place) in node.x.iter().enumerate() {
                point.bound_multiplier_x[k][i] =
                    if *place == BoundState::Free { 0.0 } else { -of_x[i] };
            }
            for (i, place) in node.u.iter().enumerate() {
                point.bound_multiplier_u[k][i] =
                    if *place == BoundState::Free { 0.0 } else { -of_u[i] };
            }
        }
    }

    /// Derivatives of the residuals by the unknowns.
    fn matrix(&self) -> BandedMatrix {
        let mut matrix = BandedMatrix::zeros(self.size, 2 * NX + NU + NG);
        let mut both = |a: Option<usize>, b: Option<usize>, value: f64| {
            if let (Some(a), Some(b)) = (a, b) {
                matrix.add(a, b, value);
                if a != b {
                    matrix.add(b, a, value);
                }
            }
        };
        for (k, (node, stage)) in self.unknowns.iter().zip(&self.qp.stages).enumerate() {
            for i in 0..NX {
                (0..=i).for_each(|j| both(node.x[i], node.x[j], stage.hessian_xx[(i, j)]));
                (0..NG).for_each(|r| both(node.rows[r], node.x[i], stage.path_jacobian[(r, i)]));
            }
            for i in 0..node.u.len() {
                (0..=i).for_each(|j| both(node.u[i], node.u[j], stage.hessian_uu[(i, j)]));
                (0..NX).for_each(|j| both(node.u[i], node.x[j], stage.hessian_ux[(i, j)]));
            }
            for i in 0..node.dynamics.len() {
                (0..NX).for_each(|j| both(node.dynamics[i], node.x[j], stage.a[(i, j)]));
                (0..NU).for_each(|j| both(node.dynamics[i], node.u[j], stage.b[(i, j)]));
                both(node.dynamics[i], self.unknowns[k + 1].x[i], -1.0);
            }
        }
        matrix
    }
}
