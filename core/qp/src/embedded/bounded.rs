//! Bounded variables with their log barriers.
//!
//! The QP is a saddle-point problem: its Lagrangian is minimised over states and controls and
//! maximised over the multipliers of dynamics and path constraints, and *all* of them are bounded.
//! An L1 penalty `w` on the dynamics' slack is the bound `|lambda| <= w`; a penalty on a path
//! constraint's violation is the bound `0 <= nu <= w`. The slacks are the multipliers of those
//! bounds, so that one type serves for all four kinds of variable.

use crate::dense::divisor;

/// `D` bounded variables. Each bound has a complementarity pair `(s, z)`: the distance to the bound
/// and its multiplier. A missing bound has `1/s = z = 0`, which removes the pair from every formula
/// without a branch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounded<const D: usize> {
    /// The variables.
    pub value: [f64; D],
    /// Complementarity pairs of the lower and of the upper bounds.
    lower: Side<D>,
    upper: Side<D>,
}

/// Complementarity pairs of the bounds on one side.
#[derive(Clone, Copy, Debug)]
struct Side<const D: usize> {
    /// `s`.
    distance: [f64; D],
    /// `z`.
    multiplier: [f64; D],
    /// `1 / s`.
    inverse: [f64; D],
}

/// Right-hand side of the complementarity equations `s z = sigma mu - corrector ds_aff dz_aff`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Centering {
    /// Target of every complementarity product, `sigma mu`.
    pub sigma_mu: f64,
    /// Share of Mehrotra's second-order corrector that is applied, 0 or 1.
    pub corrector: f64,
}

impl Centering {
    /// That of the affine (predictor) direction: no centering, no corrector.
    pub const AFFINE: Self = Self { sigma_mu: 0.0, corrector: 0.0 };
}

/// The centering of `D` variables whose affine direction is `affine`.
#[derive(Clone, Copy)]
pub(super) struct Target<'a, const D: usize> {
    pub centering: Centering,
    pub affine: &'a [f64; D],
}

impl<const D: usize> Side<D> {
    const NONE: Self = Self { distance: [0.0; D], multiplier: [0.0; D], inverse: [0.0; D] };

    /// `(sigma mu - corrector ds_aff dz_aff) / s` of pair `i`; `affine` is `ds_aff`.
    #[inline(always)]
    fn barrier_term(&self, i: usize, centering: Centering, affine: f64) -> f64 {
        let scaling = self.multiplier[i] * self.inverse[i];
        let multiplier = -self.multiplier[i] - scaling * affine;
        (centering.sigma_mu - centering.corrector * (affine * multiplier)) * self.inverse[i]
    }

    /// Step `dz` of the multiplier of pair `i`; `step` is `ds`, `affine` is `ds_aff`.
    #[inline(always)]
    fn multiplier_step(&self, i: usize, centering: Centering, affine: f64, step: f64) -> f64 {
        let scaling = self.multiplier[i] * self.inverse[i];
        self.barrier_term(i, centering, affine) - self.multiplier[i] - scaling * step
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const D: usize> Bounded<D> {
    /// Storage in which every number is `value`.
    pub fn filled(value: f64) -> Self {
        let side = Side { distance: [value; D], multiplier: [value; D], inverse: [value; D] };
        Self { value: [value; D], lower: side, upper: side }
    }
}

impl<const D: usize> Bounded<D> {
    /// Free variables at zero: all bits zero.
    pub const FREE: Self = Self { value: [0.0; D], lower: Side::NONE, upper: Side::NONE };

    /// Moves variable `i` from `wanted` into the interior of its bounds (`lower < upper`) and sets
    /// its pairs to `s z` of at least `mu`. `multiplier` is the initial guess of `z`: positive for
    /// the upper bound, negative for the lower one.
    pub fn place(&mut self, i: usize, bounds: (f64, f64), wanted: f64, multiplier: f64, mu: f64) {
        let (lower, upper) = bounds;
        let width = upper - lower;
        // A variable with a large multiplier starts near its bound.
        let margin = |multiplier: f64| {
            let central = mu / multiplier.max(mu / MARGIN);
            central.min(0.25 * width)
        };
        let value = wanted.max(lower + margin(-multiplier)).min(upper - margin(multiplier));
        self.value[i] = value;
        self.lower.place(i, value - lower, -multiplier, mu);
        self.upper.place(i, upper - value, multiplier, mu);
    }

    /// Moves all variables away from their bounds, to products `s z` of at least `mu`.
    pub fn recentre(&mut self, mu: f64) {
        for i in 0..D {
            let bounds = (
                self.value[i] - self.lower.distance_or_infinity(i),
                self.value[i] + self.upper.distance_or_infinity(i),
            );
            let multiplier = self.upper.multiplier[i] - self.lower.multiplier[i];
            if bounds.0 > f64::NEG_INFINITY || bounds.1 < f64::INFINITY {
                self.place(i, bounds, self.value[i], multiplier, mu);
            }
        }
    }

    /// Fixes variable `i` at `value`: it has no bounds and takes no steps.
    pub fn fix(&mut self, i: usize, value: f64) {
        self.value[i] = value;
        self.lower.place(i, f64::INFINITY, 0.0, 0.0);
        self.upper.place(i, f64::INFINITY, 0.0, 0.0);
    }

    /// Number of complementarity pairs.
    pub fn pairs(&self) -> u32 {
        let count = |side: &Side<D>| side.inverse.iter().filter(|v| **v != 0.0).count();
        (count(&self.lower) + count(&self.upper)) as u32
    }

    /// Multipliers of the bounds, `z_upper - z_lower`.
    #[inline(always)]
    pub fn multipliers(&self) -> [f64; D] {
        core::array::from_fn(|i| self.upper.multiplier[i] - self.lower.multiplier[i])
    }

    /// Diagonal `Z/S` that the barriers add to the Hessian.
    #[inline(always)]
    pub fn scaling(&self) -> [f64; D] {
        core::array::from_fn(|i| {
            self.lower.multiplier[i] * self.lower.inverse[i]
                + self.upper.multiplier[i] * self.upper.inverse[i]
        })
    }

    /// Gradient of the barriers, the centering included.
    #[inline(always)]
    pub fn barrier_gradient(&self, target: Target<D>) -> [f64; D] {
        core::array::from_fn(|i| {
            self.upper.barrier_term(i, target.centering, -target.affine[i])
                - self.lower.barrier_term(i, target.centering, target.affine[i])
        })
    }

    /// Raises `worst` to the largest relative decrease of an `s` or `z` along `step`: the inverse of
    /// the longest step that keeps all of them positive.
    #[inline(always)]
    pub fn limit_step(&self, step: &[f64; D], target: Target<D>, worst: &mut [f64; D]) {
        for i in 0..D {
            let (centering, affine) = (target.centering, target.affine[i]);
            let down = self.lower.multiplier_step(i, centering, affine, step[i]);
            let up = self.upper.multiplier_step(i, centering, -affine, -step[i]);
            let mut most = worst[i];
            most = larger(most, -step[i] * self.lower.inverse[i]);
            most = larger(most, step[i] * self.upper.inverse[i]);
            most = larger(most, -down / (self.lower.multiplier[i] + f64::MIN_POSITIVE));
            most = larger(most, -up / (self.upper.multiplier[i] + f64::MIN_POSITIVE));
            worst[i] = most;
        }
    }

    /// Adds the complementarity `s z` of all pairs after a step of `length` along `step`.
    #[inline(always)]
    pub fn add_complementarity_after(
        &self,
        step: &[f64; D],
        target: Target<D>,
        length: f64,
        sum: &mut [f64; D],
    ) {
        for i in 0..D {
            let (centering, affine) = (target.centering, target.affine[i]);
            let down = self.lower.multiplier_step(i, centering, affine, step[i]);
            let up = self.upper.multiplier_step(i, centering, -affine, -step[i]);
            sum[i] += (self.lower.distance[i] + length * step[i])
                * (self.lower.multiplier[i] + length * down)
                + (self.upper.distance[i] - length * step[i])
                    * (self.upper.multiplier[i] + length * up);
        }
    }

    /// Adds the complementarity `s z` of all pairs to `sum`; raises `worst` to the largest.
    #[inline(always)]
    pub fn add_complementarity(&self, sum: &mut [f64; D], worst: &mut [f64; D]) {
        for i in 0..D {
            let lower = self.lower.distance[i] * self.lower.multiplier[i];
            let upper = self.upper.distance[i] * self.upper.multiplier[i];
            sum[i] += lower + upper;
            worst[i] = larger(worst[i], larger(lower, upper));
        }
    }

    /// Takes a step of `length` along `step` where no variable has a bound.
    #[inline(always)]
    pub fn move_by(&mut self, step: &[f64; D], length: f64) {
        for (value, step) in self.value.iter_mut().zip(step) {
            *value += length * step;
        }
    }

    /// Takes a step of `length` along `step`, multipliers included.
    #[inline(always)]
    pub fn advance(&mut self, step: &[f64; D], target: Target<D>, length: f64) {
        // Whole vectors, a pair, one: a short loop would be made of vectors with unused lanes, whose divisions trap.
        let (four, two) = (D & !3, D & !1);
        let Target { centering, affine, .. } = target;
        for i in 0..four {
            self.advance_one(i, step[i], centering, affine[i], length);
        }
        for i in four..two {
            self.advance_one(i, step[i], centering, affine[i], length);
        }
        for i in two..D {
            self.advance_one(i, step[i], centering, affine[i], length);
        }
    }

    #[inline(always)]
    fn advance_one(&mut self, i: usize, step: f64, centering: Centering, affine: f64, length: f64) {
        let down = self.lower.multiplier_step(i, centering, affine, step);
        let up = self.upper.multiplier_step(i, centering, -affine, -step);
        self.value[i] += length * step;
        self.lower.advance(i, length * step, length * down);
        self.upper.advance(i, -length * step, length * up);
    }
}

impl<const D: usize> Side<D> {
    /// Distance to the bound; infinite where there is none.
    fn distance_or_infinity(&self, i: usize) -> f64 {
        if self.inverse[i] == 0.0 { f64::INFINITY } else { self.distance[i] }
    }

    /// Sets pair `i`; an infinite distance means that there is no bound.
    fn place(&mut self, i: usize, distance: f64, multiplier: f64, mu: f64) {
        let exists = distance < f64::INFINITY;
        self.distance[i] = if exists { distance } else { 1.0 };
        self.inverse[i] = if exists { 1.0 / divisor(distance) } else { 0.0 };
        self.multiplier[i] = if exists { multiplier.max(mu / divisor(distance)) } else { 0.0 };
    }

    /// Adds the steps `distance` and `multiplier` to pair `i`.
    #[inline(always)]
    fn advance(&mut self, i: usize, distance: f64, multiplier: f64) {
        let exists = self.inverse[i] != 0.0;
        let moved = self.distance[i] + distance;
        self.distance[i] = if exists { moved } else { 1.0 };
        self.inverse[i] = if exists { 1.0 / divisor(moved) } else { 0.0 };
        self.multiplier[i] += multiplier;
    }
}

/// Least distance from its bounds at which a variable without multipliers starts, where the bounds
/// are far enough apart.
const MARGIN: f64 = 0.1;

/// The larger number, as one instruction; `b` where either is NaN.
#[inline(always)]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests;
