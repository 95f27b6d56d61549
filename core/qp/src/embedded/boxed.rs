//! Variables in boxes, with their barriers.
//!
//! The program is a saddle point: its Lagrangian is minimised over states and controls and
//! maximised over the multipliers of dynamics and rows, and *all* of them lie in boxes. A weight
//! `w` on the L1 norm of the dynamics' slack is nothing but a bound `|lambda| <= w`, a weight on a
//! row's violation a bound `0 <= nu <= w`; the slacks are the multipliers of those bounds. So one
//! kind of variable serves for all four.

/// `D` variables between bounds. Each bound makes a complementary pair: the distance to it, which
/// moves with the variable, and its multiplier. Where there is no bound, inverse and multiplier are
/// zero, which takes the pair out of every formula without a branch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boxed<const D: usize> {
    /// The variables.
    pub value: [f64; D],
    /// Pairs of the lower and of the upper bounds.
    lower: Side<D>,
    upper: Side<D>,
}

#[derive(Clone, Copy, Debug)]
struct Side<const D: usize> {
    distance: [f64; D],
    multiplier: [f64; D],
    /// `1 / distance`.
    inverse: [f64; D],
}

/// What the pairs' products are driven to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// The common target, `sigma mu`.
    pub product: f64,
    /// Share of the affine direction's second-order terms that is made up for.
    pub second_order: f64,
}

impl Aim {
    /// The affine direction: all products to zero, to first order.
    pub const AFFINE: Self = Self { product: 0.0, second_order: 0.0 };
}

/// An aim for variables whose affine direction is `affine`.
#[derive(Clone, Copy)]
pub(super) struct Target<'a, const D: usize> {
    pub aim: Aim,
    pub affine: &'a [f64; D],
}

impl<const D: usize> Side<D> {
    const NONE: Self = Self { distance: [0.0; D], multiplier: [0.0; D], inverse: [0.0; D] };

    /// Target of pair `i` over its distance, `affine` the distance's affine step.
    #[inline(always)]
    fn pull(&self, i: usize, aim: Aim, affine: f64) -> f64 {
        let stiffness = self.multiplier[i] * self.inverse[i];
        let multiplier = -self.multiplier[i] - stiffness * affine;
        (aim.product - aim.second_order * (affine * multiplier)) * self.inverse[i]
    }

    /// Step of the multiplier of pair `i`, `step` that of the distance.
    #[inline(always)]
    fn multiplier_step(&self, i: usize, aim: Aim, affine: f64, step: f64) -> f64 {
        let stiffness = self.multiplier[i] * self.inverse[i];
        self.pull(i, aim, affine) - self.multiplier[i] - stiffness * step
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const D: usize> Boxed<D> {
    /// Storage that holds anything.
    pub fn filled(value: f64) -> Self {
        let side = Side { distance: [value; D], multiplier: [value; D], inverse: [value; D] };
        Self { value: [value; D], lower: side, upper: side }
    }
}

impl<const D: usize> Boxed<D> {
    /// Free variables at zero: all bits zero.
    pub const FREE: Self = Self { value: [0.0; D], lower: Side::NONE, upper: Side::NONE };

    /// Puts variable `i` near `wanted`, inside its bounds (`lower < upper`), the multipliers of its
    /// bounds near `multiplier` (positive at the upper bound, negative at the lower one) and their
    /// products with the distances near `product`.
    pub fn place(
        &mut self,
        i: usize,
        bounds: (f64, f64),
        wanted: f64,
        multiplier: f64,
        product: f64,
    ) {
        let (lower, upper) = bounds;
        let width = upper - lower;
        // What is held by a strong multiplier starts near its bound.
        let margin = |multiplier: f64| {
            let held = product / multiplier.max(product / MARGIN);
            held.min(0.25 * width)
        };
        let value = wanted.max(lower + margin(-multiplier)).min(upper - margin(multiplier));
        self.value[i] = value;
        self.lower.place(i, value - lower, -multiplier, product);
        self.upper.place(i, upper - value, multiplier, product);
    }

    /// Moves all variables away from their bounds, to products near `product`.
    pub fn reseat(&mut self, product: f64) {
        for i in 0..D {
            let bounds = (self.value[i] - self.lower.room(i), self.value[i] + self.upper.room(i));
            let multiplier = self.upper.multiplier[i] - self.lower.multiplier[i];
            if bounds.0 > f64::NEG_INFINITY || bounds.1 < f64::INFINITY {
                self.place(i, bounds, self.value[i], multiplier, product);
            }
        }
    }

    /// Fixes variable `i`.
    pub fn pin(&mut self, i: usize, value: f64) {
        self.value[i] = value;
        self.lower.place(i, f64::INFINITY, 0.0, 0.0);
        self.upper.place(i, f64::INFINITY, 0.0, 0.0);
    }

    /// Number of pairs.
    pub fn pairs(&self) -> u32 {
        let count = |side: &Side<D>| side.inverse.iter().filter(|v| **v != 0.0).count();
        (count(&self.lower) + count(&self.upper)) as u32
    }

    /// Multipliers: positive at upper, negative at lower bounds.
    #[inline(always)]
    pub fn multipliers(&self) -> [f64; D] {
        core::array::from_fn(|i| self.upper.multiplier[i] - self.lower.multiplier[i])
    }

    /// Diagonal that the barriers add to the Hessian.
    #[inline(always)]
    pub fn stiffness(&self) -> [f64; D] {
        core::array::from_fn(|i| {
            self.lower.multiplier[i] * self.lower.inverse[i]
                + self.upper.multiplier[i] * self.upper.inverse[i]
        })
    }

    /// What the barriers add to the gradient.
    #[inline(always)]
    pub fn push(&self, target: Target<D>) -> [f64; D] {
        core::array::from_fn(|i| {
            self.upper.pull(i, target.aim, -target.affine[i])
                - self.lower.pull(i, target.aim, target.affine[i])
        })
    }

    /// Raises `worst` to the largest relative decrease of a distance or multiplier along `step`:
    /// the inverse of the longest step that keeps all positive.
    #[inline(always)]
    pub fn limit_step(&self, step: &[f64; D], target: Target<D>, worst: &mut [f64; D]) {
        for i in 0..D {
            let (aim, affine) = (target.aim, target.affine[i]);
            let down = self.lower.multiplier_step(i, aim, affine, step[i]);
            let up = self.upper.multiplier_step(i, aim, -affine, -step[i]);
            let mut most = worst[i];
            most = larger(most, -step[i] * self.lower.inverse[i]);
            most = larger(most, step[i] * self.upper.inverse[i]);
            most = larger(most, -down / (self.lower.multiplier[i] + f64::MIN_POSITIVE));
            most = larger(most, -up / (self.upper.multiplier[i] + f64::MIN_POSITIVE));
            worst[i] = most;
        }
    }

    /// Adds the products of all pairs after a step of `length` along `step`.
    #[inline(always)]
    pub fn add_products(
        &self,
        step: &[f64; D],
        target: Target<D>,
        length: f64,
        sum: &mut [f64; D],
    ) {
        for i in 0..D {
            let (aim, affine) = (target.aim, target.affine[i]);
            let down = self.lower.multiplier_step(i, aim, affine, step[i]);
            let up = self.upper.multiplier_step(i, aim, -affine, -step[i]);
            sum[i] += (self.lower.distance[i] + length * step[i])
                * (self.lower.multiplier[i] + length * down)
                + (self.upper.distance[i] - length * step[i])
                    * (self.upper.multiplier[i] + length * up);
        }
    }

    /// Adds the products of all pairs to `sum`, raises `worst` to the largest.
    #[inline(always)]
    pub fn products(&self, sum: &mut [f64; D], worst: &mut [f64; D]) {
        for i in 0..D {
            let lower = self.lower.distance[i] * self.lower.multiplier[i];
            let upper = self.upper.distance[i] * self.upper.multiplier[i];
            sum[i] += lower + upper;
            worst[i] = larger(worst[i], larger(lower, upper));
        }
    }

    /// Takes a step of `length` along `step`.
    #[inline(always)]
    pub fn advance(&mut self, step: &[f64; D], target: Target<D>, length: f64) {
        for i in 0..D {
            let (aim, affine) = (target.aim, target.affine[i]);
            let down = self.lower.multiplier_step(i, aim, affine, step[i]);
            let up = self.upper.multiplier_step(i, aim, -affine, -step[i]);
            self.value[i] += length * step[i];
            self.lower.advance(i, length * step[i], length * down);
            self.upper.advance(i, -length * step[i], length * up);
        }
    }
}

impl<const D: usize> Side<D> {
    /// Distance to the bound; infinite where there is none.
    fn room(&self, i: usize) -> f64 {
        if self.inverse[i] == 0.0 { f64::INFINITY } else { self.distance[i] }
    }

    fn place(&mut self, i: usize, distance: f64, multiplier: f64, product: f64) {
        let exists = distance < f64::INFINITY;
        self.distance[i] = if exists { distance } else { 1.0 };
        self.inverse[i] = if exists { 1.0 / distance } else { 0.0 };
        self.multiplier[i] = if exists { multiplier.max(product / distance) } else { 0.0 };
    }

    #[inline(always)]
    fn advance(&mut self, i: usize, distance: f64, multiplier: f64) {
        let exists = self.inverse[i] != 0.0;
        let moved = self.distance[i] + distance;
        self.distance[i] = if exists { moved } else { 1.0 };
        self.inverse[i] = if exists { 1.0 / moved } else { 0.0 };
        self.multiplier[i] += multiplier;
    }
}

/// Distance from its bounds at which an unconstrained variable starts at least, where there is
/// room.
const MARGIN: f64 = 0.1;

/// The larger number, as one instruction; `b` where either is not a number.
#[inline(always)]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
