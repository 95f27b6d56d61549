//! Programs as one dense system, solved in ways that know nothing of stages: linear equations, and all active sets
//! in turn.

use super::common::kkt::objective;
use remora_qp::nalgebra::{DMatrix, DVector};
use remora_qp::{Qp, Solution};

/// What holds of a variable's bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Inside,
    AtLower,
    AtUpper,
    Fixed,
}

/// What holds of a constraint that may be violated at a price: `-1` and `1` are violations that pay in full.
type Sign = i8;

/// `min 1/2 w^T H w + g^T w + ...` over `w = [x_0, u_0, x_1, u_1, ..., x_last]`.
pub struct Dense {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Rows of `A x + B u + c - x+`.
    dynamics: (DMatrix<f64>, DVector<f64>),
    /// Rows of `C x + d`.
    rows: (DMatrix<f64>, DVector<f64>),
    defect_penalty: f64,
    path_penalty: f64,
}

/// Tolerance of signs and ranges.
const ROUNDING: f64 = 1e-9;

impl Dense {
    pub fn of<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
    ) -> Self {
        let (wide, last) = (NX + NU, qp.nodes() - 1);
        let n = last * wide + NX;
        let mut dense = Self {
            hessian: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            lower: vec![0.0; n],
            upper: vec![0.0; n],
            dynamics: (DMatrix::zeros(last * NX, n), DVector::zeros(last * NX)),
            rows: (DMatrix::zeros((last + 1) * NG, n), DVector::zeros((last + 1) * NG)),
            defect_penalty: qp.defect_penalty,
            path_penalty: qp.path_penalty,
        };
        for (k, stage) in qp.used().iter().enumerate() {
            let (x, u) = (k * wide, k * wide + NX);
            dense.hessian.view_mut((x, x), (NX, NX)).copy_from(&stage.hessian_xx);
            dense.gradient.rows_mut(x, NX).copy_from(&stage.gradient_x);
            dense.rows.0.view_mut((k * NG, x), (NG, NX)).copy_from(&stage.path_jacobian);
            dense.rows.1.rows_mut(k * NG, NG).copy_from(&stage.path_offset);
            dense.lower[x..u].copy_from_slice(stage.lower_x.as_slice());
            dense.upper[x..u].copy_from_slice(stage.upper_x.as_slice());
            if k == last {
                continue;
            }
            dense.hessian.view_mut((u, x), (NU, NX)).copy_from(&stage.hessian_ux);
            dense.hessian.view_mut((x, u), (NX, NU)).copy_from(&stage.hessian_ux.transpose());
            dense.hessian.view_mut((u, u), (NU, NU)).copy_from(&stage.hessian_uu);
            dense.gradient.rows_mut(u, NU).copy_from(&stage.gradient_u);
            dense.lower[u..u + NU].copy_from_slice(stage.lower_u.as_slice());
            dense.upper[u..u + NU].copy_from_slice(stage.upper_u.as_slice());
            let (jacobian, offset) = &mut dense.dynamics;
            jacobian.view_mut((k * NX, x), (NX, NX)).copy_from(&stage.a);
            jacobian.view_mut((k * NX, u), (NX, NU)).copy_from(&stage.b);
            (0..NX).for_each(|i| jacobian[(k * NX + i, x + wide + i)] = -1.0);
            offset.rows_mut(k * NX, NX).copy_from(&stage.c);
        }
        dense
    }

    /// Solution of the program without bounds but for fixed variables, and without rows: one linear system.
    pub fn equations(&self) -> DVector<f64> {
        let side = |i: usize| match self.lower[i] == self.upper[i] {
            true => Side::Fixed,
            false => Side::Inside,
        };
        let sides: Vec<Side> = (0..self.lower.len()).map(side).collect();
        let none = vec![0; self.dynamics.1.len()];
        self.solve(&sides, &none, &vec![-1; self.rows.1.len()]).unwrap().0
    }

    /// Solution found by trying every active set.
    pub fn by_all_active_sets(&self) -> Option<DVector<f64>> {
        let sides: Vec<Vec<Side>> = (0..self.lower.len())
            .map(|i| match (self.lower[i], self.upper[i]) {
                (lower, upper) if lower == upper => vec![Side::Fixed],
                (lower, upper) => [
                    (Side::Inside, true),
                    (Side::AtLower, lower.is_finite()),
                    (Side::AtUpper, upper.is_finite()),
                ]
                .into_iter()
                .filter_map(|(side, exists)| exists.then_some(side))
                .collect(),
            })
            .collect();
        let is_soft = self.defect_penalty.is_finite();
        let signs: &[Sign] = if is_soft { &[0, -1, 1] } else { &[0] };
        let bases = sides.iter().map(Vec::len);
        let bases = bases.chain(vec![signs.len(); self.dynamics.1.len()]);
        let bases: Vec<usize> = bases.chain(vec![3; self.rows.1.len()]).collect();
        let mut digits = vec![0; bases.len()];
        let (n, m) = (self.lower.len(), self.dynamics.1.len());
        loop {
            let chosen: Vec<Side> = (0..n).map(|i| sides[i][digits[i]]).collect();
            let slack: Vec<Sign> = digits[n..n + m].iter().map(|d| signs[*d]).collect();
            let rows: Vec<Sign> = digits[n + m..].iter().map(|d| [-1, 0, 1][*d]).collect();
            if let Some((w, true)) = self.solve(&chosen, &slack, &rows) {
                return Some(w);
            }
            let next = (0..bases.len()).find(|i| digits[*i] + 1 < bases[*i])?;
            digits[next] += 1;
            digits[..next].fill(0);
        }
    }

    /// Point of an active set, and whether all signs and ranges hold there. `slack` and `rows` are the signs of the
    /// constraints' values; those of zero are equations.
    fn solve(&self, sides: &[Side], slack: &[Sign], rows: &[Sign]) -> Option<(DVector<f64>, bool)> {
        let n = sides.len();
        let mut gradient = self.gradient.clone();
        let mut equations: Vec<(DVector<f64>, f64)> = Vec::new();
        for (i, sign) in slack.iter().enumerate() {
            let row = self.dynamics.0.row(i).transpose();
            match sign {
                0 => equations.push((row, -self.dynamics.1[i])),
                sign => gradient += row * (f64::from(*sign) * self.defect_penalty),
            }
        }
        for (i, sign) in rows.iter().enumerate() {
            let row = self.rows.0.row(i).transpose();
            match sign {
                0 => equations.push((row, -self.rows.1[i])),
                1 => gradient += row * self.path_penalty,
                _ => (),
            }
        }
        for (i, side) in sides.iter().enumerate().filter(|(_, side)| **side != Side::Inside) {
            let mut unit = DVector::zeros(n);
            unit[i] = 1.0;
            let is_upper = *side == Side::AtUpper;
            equations.push((unit, if is_upper { self.upper[i] } else { self.lower[i] }));
        }
        let all = n + equations.len();
        let (mut matrix, mut rhs) = (DMatrix::zeros(all, all), DVector::zeros(all));
        matrix.view_mut((0, 0), (n, n)).copy_from(&self.hessian);
        rhs.rows_mut(0, n).copy_from(&-gradient);
        for (j, (row, value)) in equations.iter().enumerate() {
            matrix.view_mut((0, n + j), (n, 1)).copy_from(row);
            matrix.view_mut((n + j, 0), (1, n)).copy_from(&row.transpose());
            rhs[n + j] = *value;
        }
        let solved = matrix.clone().lu().solve(&rhs)?;
        let is_solved = (matrix * &solved - rhs).amax() <= ROUNDING;
        let w = solved.rows(0, n).into_owned();
        let holds = is_solved
            && self.holds(&w, solved.rows(n, equations.len()).as_slice(), sides, slack, rows);
        Some((w, holds))
    }

    /// Whether signs and ranges hold at `w` with the multipliers of an active set's equations, in their order.
    fn holds(
        &self,
        w: &DVector<f64>,
        multipliers: &[f64],
        sides: &[Side],
        slack: &[Sign],
        rows: &[Sign],
    ) -> bool {
        let mut multipliers = multipliers.iter();
        let mut next = || *multipliers.next().unwrap();
        // Constraints enter the Lagrangian with `A x + B u + c - x+`: positive multipliers pay for positive values.
        let values = &self.dynamics.0 * w + &self.dynamics.1;
        let mut holds = true;
        for (i, sign) in slack.iter().enumerate() {
            holds &= match sign {
                0 => next().abs() <= self.defect_penalty + ROUNDING,
                sign => f64::from(*sign) * values[i] >= -ROUNDING,
            };
        }
        let values = &self.rows.0 * w + &self.rows.1;
        for (i, sign) in rows.iter().enumerate() {
            holds &= match sign {
                0 => (-ROUNDING..=self.path_penalty + ROUNDING).contains(&next()),
                sign => f64::from(*sign) * values[i] >= -ROUNDING,
            };
        }
        for (i, side) in sides.iter().enumerate() {
            holds &= match side {
                Side::Inside => {
                    self.lower[i] - ROUNDING <= w[i] && w[i] <= self.upper[i] + ROUNDING
                }
                Side::AtLower => next() <= ROUNDING,
                Side::AtUpper => next() >= -ROUNDING,
                Side::Fixed => next().is_finite(),
            };
        }
        holds
    }
}

/// States and controls of a dense point.
pub fn point<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    w: &DVector<f64>,
) -> Box<Solution<N, NX, NU, NG>> {
    let mut point = Box::new(Solution::<N, NX, NU, NG>::ZERO);
    for k in 0..N {
        let at = k * (NX + NU);
        point.x[k].copy_from_slice(w.rows(at, NX).as_slice());
        if k + 1 < N {
            point.u[k].copy_from_slice(w.rows(at + NX, NU).as_slice());
        }
    }
    point
}

/// Objective of a dense point, penalties included.
pub fn value<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    w: &DVector<f64>,
) -> f64 {
    objective(qp, &point::<N, NX, NU, NG>(w))
}
