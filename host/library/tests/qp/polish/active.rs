//! Active constraints of a subproblem, and how they are read from a point.

use remora_core::advanced::qp::{Qp, Solution};

/// A variable's place in its box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BoundState {
    Free,
    Lower,
    Upper,
    /// The box is a point.
    Fixed,
}

/// State of a soft constraint. A component of the dynamics is `On` where it holds, or its slack
/// pays the penalty `Above` or `Below`. A row is `Below` its limit, `On` it, or `Above`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Below,
    On,
    Above,
}

/// Active constraints at a node and over the interval that follows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Active {
    pub x: Vec<BoundState>,
    pub u: Vec<BoundState>,
    pub rows: Vec<Side>,
    pub dynamics: Vec<Side>,
}

/// A value and the ends and multiplier of its box.
#[derive(Clone, Copy)]
struct BoxedValue {
    value: f64,
    lower: f64,
    upper: f64,
    multiplier: f64,
}

impl BoxedValue {
    /// The more plausible of distance and multiplier.
    fn guess(self) -> BoundState {
        let Self { value, lower, upper, multiplier } = self;
        if lower == upper {
            BoundState::Fixed
        } else if multiplier > upper - value {
            BoundState::Upper
        } else if -multiplier > value - lower {
            BoundState::Lower
        } else {
            BoundState::Free
        }
    }

    /// The next place, where signs do not hold.
    fn next(self, place: BoundState, tolerance: f64) -> BoundState {
        let Self { value, lower, upper, multiplier } = self;
        match place {
            BoundState::Fixed => BoundState::Fixed,
            BoundState::Upper if multiplier < -tolerance => BoundState::Free,
            BoundState::Lower if multiplier > tolerance => BoundState::Free,
            BoundState::Free if value > upper + tolerance => BoundState::Upper,
            BoundState::Free if value < lower - tolerance => BoundState::Lower,
            held => held,
        }
    }
}

/// A soft constraint's value and its multiplier's distance from either end of its range.
#[derive(Clone, Copy)]
struct Soft {
    /// Positive where the constraint is violated upwards.
    value: f64,
    /// From the multiplier of `Below`.
    from_below: f64,
    /// From the multiplier of `Above`.
    from_above: f64,
}

impl Soft {
    fn guess(self) -> Side {
        if self.value > self.from_above {
            Side::Above
        } else if -self.value > self.from_below {
            Side::Below
        } else {
            Side::On
        }
    }

    fn next(self, side: Side, tolerance: f64) -> Side {
        match side {
            Side::On if self.from_below < -tolerance => Side::Below,
            Side::On if self.from_above < -tolerance => Side::Above,
            Side::Below if self.value > tolerance => Side::On,
            Side::Above if self.value < -tolerance => Side::On,
            held => held,
        }
    }
}

/// Active constraints at a point: guessed afresh, or updated from `before`.
pub(super) fn read<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    point: &Solution<N, NX, NU, NG>,
    before: Option<(&[Active], f64)>,
) -> Vec<Active> {
    let node = |k: usize| {
        let stage = &qp.stages[k];
        let known = before.map(|(active, tolerance)| (&active[k], tolerance));
        let place = |boxed: BoxedValue, old: Option<(BoundState, f64)>| match old {
            Some((place, tolerance)) => boxed.next(place, tolerance),
            None => boxed.guess(),
        };
        let side = |soft: Soft, old: Option<(Side, f64)>| match old {
            Some((side, tolerance)) => soft.next(side, tolerance),
            None => soft.guess(),
        };
        let (is_last, rows) =
            (k + 1 == qp.nodes(), stage.path_jacobian * point.x[k] + stage.path_offset);
        let slack = qp.slack(point, k);
        Active {
            x: (0..NX)
                .map(|i| {
                    let (lower, upper) = (stage.lower_x[i], stage.upper_x[i]);
                    let multiplier = point.bound_multiplier_x[k][i];
                    let boxed = BoxedValue { value: point.x[k][i], lower, upper, multiplier };
                    place(boxed, known.map(|(active, t)| (active.x[i], t)))
                })
                .collect(),
            u: (0..if is_last { 0 } else { NU })
                .map(|i| {
                    let (lower, upper) = (stage.lower_u[i], stage.upper_u[i]);
                    let multiplier = point.bound_multiplier_u[k][i];
                    let boxed = BoxedValue { value: point.u[k][i], lower, upper, multiplier };
                    place(boxed, known.map(|(active, t)| (active.u[i], t)))
                })
                .collect(),
            rows: (0..NG)
                .map(|i| {
                    let r = point.path_multiplier[k][i];
                    let soft =
                        Soft { value: rows[i], from_below: r, from_above: qp.path_penalty - r };
                    side(soft, known.map(|(active, t)| (active.rows[i], t)))
                })
                .collect(),
            dynamics: (0..if is_last { 0 } else { NX })
                .map(|i| {
                    if !qp.defect_penalty.is_finite() {
                        return Side::On;
                    }
                    let (l, weight) = (point.defect_multiplier[k][i], qp.defect_penalty);
                    let soft =
                        Soft { value: slack[i], from_below: weight - l, from_above: weight + l };
                    side(soft, known.map(|(active, t)| (active.dynamics[i], t)))
                })
                .collect(),
        }
    };
    (0..qp.nodes()).map(node).collect()
}
