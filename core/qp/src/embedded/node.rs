//! One node's variables with their barriers, and vectors over them.

use super::boxed::{Aim, Boxed, Target, larger};
use crate::{Qp, Solution};
use core::array::from_fn;

/// An entry for every variable of a node: a direction, a gradient, a residual.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entries<const NX: usize, const NU: usize, const NR: usize> {
    pub x: [f64; NX],
    pub u: [f64; NU],
    pub dynamics: [f64; NX],
    pub row: [f64; NR],
}

impl<const NX: usize, const NU: usize, const NR: usize> Entries<NX, NU, NR> {
    pub const ZERO: Self = Self { x: [0.0; NX], u: [0.0; NU], dynamics: [0.0; NX], row: [0.0; NR] };

    pub fn largest(&self) -> f64 {
        let most = |values: &[f64]| values.iter().fold(0.0, |most, v| larger(most, *v));
        larger(larger(most(&self.x), most(&self.u)), larger(most(&self.dynamics), most(&self.row)))
    }

    /// Adds a push to a gradient: multipliers are maximised over, theirs counts the other way.
    #[inline(always)]
    pub fn add_push(&mut self, push: &Self) {
        fn add<const D: usize>(to: &mut [f64; D], what: &[f64; D]) {
            for (to, what) in to.iter_mut().zip(what) {
                *to += what;
            }
        }
        add(&mut self.x, &push.x);
        add(&mut self.u, &push.u);
        add(&mut self.dynamics, &push.dynamics.map(|v| -v));
        add(&mut self.row, &push.row.map(|v| -v));
    }

    /// Raises every entry to the magnitude of `other`'s.
    #[inline(always)]
    pub fn raise_to(&mut self, other: &Self) {
        fn raise<const D: usize>(worst: &mut [f64; D], values: &[f64; D]) {
            for (worst, value) in worst.iter_mut().zip(values) {
                *worst = larger(*worst, value.abs());
            }
        }
        raise(&mut self.x, &other.x);
        raise(&mut self.u, &other.u);
        raise(&mut self.dynamics, &other.dynamics);
        raise(&mut self.row, &other.row);
    }

    pub fn sum(&self) -> f64 {
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        sum(&self.x) + sum(&self.u) + sum(&self.dynamics) + sum(&self.row)
    }
}

/// Which of some variables may move: a byte each, of which there are many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Free<const D: usize>([u8; D]);

impl<const D: usize> Free<D> {
    pub const NONE: Self = Self([0; D]);
    pub const ALL: Self = Self([1; D]);

    /// One where a variable may move, zero where it is pinned.
    #[inline(always)]
    pub fn factors(&self) -> [f64; D] {
        self.0.map(f64::from)
    }

    pub fn is_pinned(&self, i: usize) -> bool {
        self.0.get(i) == Some(&0)
    }

    fn set(&mut self, i: usize, free: bool) {
        if let Some(entry) = self.0.get_mut(i) {
            *entry = u8::from(free);
        }
    }

    /// Storage that holds anything.
    #[cfg(any(test, feature = "testing"))]
    pub fn filled(value: f64) -> Self {
        Self([value as u8; D])
    }
}

/// Variables of one node. The last node has neither controls nor dynamics: theirs stay free at
/// zero, and take part in nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<const NX: usize, const NU: usize, const NR: usize> {
    pub x: Boxed<NX>,
    pub u: Boxed<NU>,
    /// Multipliers of the dynamics to the next node, in `[-defect_weight, defect_weight]`.
    pub dynamics: Boxed<NX>,
    /// Multipliers of the rows, in `[0, row_weight]`.
    pub row: Boxed<NR>,
    pub free_x: Free<NX>,
    pub free_u: Free<NU>,
    pub free_row: Free<NR>,
}

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize, const NU: usize, const NR: usize> Node<NX, NU, NR> {
    /// Storage that holds anything.
    pub fn filled(value: f64) -> Self {
        Self {
            x: Boxed::filled(value),
            u: Boxed::filled(value),
            dynamics: Boxed::filled(value),
            row: Boxed::filled(value),
            free_x: Free::filled(value),
            free_u: Free::filled(value),
            free_row: Free::filled(value),
        }
    }
}

/// A program that can't be started on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unfit {
    /// A lower bound above its upper bound.
    EmptyBox,
    /// A bound or a weight that is not a number, a weight that is not positive, a row of infinite
    /// weight.
    Nonsense,
}

/// Where to start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Products of the complementary pairs.
    pub product: f64,
    /// Whether the multipliers given mean something.
    pub warm: bool,
}

impl Start {
    /// Where nothing is known. The products are tuned for few iterations on the public scenarios;
    /// none matters by more than an iteration or two there.
    pub const COLD: Self = Self { product: 0.1, warm: false };
    /// The same further from the bounds, for programs that are far from their optimum at first.
    pub const FAR: Self = Self { product: 10.0, warm: false };
    /// From the multipliers of the last subproblem.
    pub const WARM: Self = Self { product: 1e-4, warm: true };
}

/// Multipliers larger than this are no start.
const CREDIBLE: f64 = 1e8;

/// Boxes narrower than this are pins.
const NARROW: f64 = 1e-11;

impl<const NX: usize, const NU: usize, const NR: usize> Node<NX, NU, NR> {
    /// Storage, all bits zero.
    pub const ZERO: Self = Self {
        x: Boxed::FREE,
        u: Boxed::FREE,
        dynamics: Boxed::FREE,
        row: Boxed::FREE,
        free_x: Free::NONE,
        free_u: Free::NONE,
        free_row: Free::NONE,
    };

    /// Starts inside the boxes of node `k`, with the multipliers of `from` where they mean
    /// something.
    pub fn start<const N: usize>(
        &mut self,
        k: usize,
        qp: &Qp<N, NX, NU, NR>,
        from: &Solution<N, NX, NU, NR>,
        start: Start,
    ) -> Result<(), Unfit> {
        let known = |m: f64| if start.warm && m.abs() <= CREDIBLE { m } else { 0.0 };
        let (Some(stage), Some(bound_x), Some(row)) =
            (qp.stages.get(k), from.bound_multiplier_x.get(k), from.row_multiplier.get(k))
        else {
            return Err(Unfit::Nonsense);
        };
        for i in 0..NX {
            let bounds = (stage.lower_x[i], stage.upper_x[i]);
            let free = place(&mut self.x, i, bounds, known(bound_x[i]), start.product)?;
            self.free_x.set(i, free);
        }
        for i in 0..NR {
            // What the row has to spare is the multiplier of the bound at zero.
            let bounds = (0.0, qp.row_weight);
            let free = qp.row_weight > NARROW;
            self.free_row.set(i, free);
            match free {
                true => {
                    self.row.place(i, bounds, known(row[i]), stage.row_offset[i], start.product);
                }
                false => self.row.pin(i, 0.0),
            }
        }
        let (Some(bound_u), Some(dynamics), true) =
            (from.bound_multiplier_u.get(k), from.defect_multiplier.get(k), k + 1 < N)
        else {
            // Nothing moves them, but a flipped bit would stay here for all programs to come.
            (self.u, self.dynamics, self.free_u) = (Boxed::FREE, Boxed::FREE, Free::NONE);
            return Ok(());
        };
        for i in 0..NU {
            let bounds = (stage.lower_u[i], stage.upper_u[i]);
            let free = place(&mut self.u, i, bounds, known(bound_u[i]), start.product)?;
            self.free_u.set(i, free);
        }
        for i in 0..NX {
            let bounds = (-qp.defect_weight, qp.defect_weight);
            self.dynamics.place(i, bounds, known(dynamics[i]), 0.0, start.product);
        }
        Ok(())
    }

    /// Moves all variables away from their bounds.
    pub fn reseat(&mut self, product: f64) {
        self.x.reseat(product);
        self.u.reseat(product);
        self.dynamics.reseat(product);
        self.row.reseat(product);
    }

    /// States and controls.
    #[inline(always)]
    pub fn point(&self) -> Entries<NX, NU, NR> {
        Entries { x: self.x.value, u: self.u.value, ..Entries::ZERO }
    }

    /// Number of complementary pairs.
    pub fn pairs(&self) -> u32 {
        self.x.pairs() + self.u.pairs() + self.dynamics.pairs() + self.row.pairs()
    }

    /// The gradient with the bounds' multipliers: zero at the optimum. Multipliers are maximised
    /// over, so theirs pull the other way.
    #[inline(always)]
    pub fn residual(&self, gradient: &Entries<NX, NU, NR>) -> Entries<NX, NU, NR> {
        let (x, u) = (self.x.multipliers(), self.u.multipliers());
        let (dynamics, row) = (self.dynamics.multipliers(), self.row.multipliers());
        let (free_x, free_u) = (self.free_x.factors(), self.free_u.factors());
        let free_row = self.free_row.factors();
        Entries {
            x: from_fn(|i| (gradient.x[i] + x[i]) * free_x[i]),
            u: from_fn(|i| (gradient.u[i] + u[i]) * free_u[i]),
            dynamics: from_fn(|i| gradient.dynamics[i] - dynamics[i]),
            row: from_fn(|i| (gradient.row[i] - row[i]) * free_row[i]),
        }
    }

    /// Curvature that each row adds along itself; none where it weighs nothing.
    #[inline(always)]
    pub fn row_stiffness(&self) -> [f64; NR] {
        let compliance = self.row.stiffness();
        from_fn(|i| if compliance[i] > 0.0 { 1.0 / compliance[i] } else { 0.0 })
    }

    /// What the barriers add to the gradient.
    #[inline(always)]
    pub fn push(&self, aim: Aim, affine: &Entries<NX, NU, NR>) -> Entries<NX, NU, NR> {
        Entries {
            x: self.x.push(Target { aim, affine: &affine.x }),
            u: self.u.push(Target { aim, affine: &affine.u }),
            dynamics: self.dynamics.push(Target { aim, affine: &affine.dynamics }),
            row: self.row.push(Target { aim, affine: &affine.row }),
        }
    }

    /// [`Boxed::limit_step`] of all.
    #[inline(always)]
    pub fn limit_step(
        &self,
        step: &Entries<NX, NU, NR>,
        aim: Aim,
        affine: &Entries<NX, NU, NR>,
        worst: &mut Entries<NX, NU, NR>,
    ) {
        let at = |affine| Target { aim, affine };
        self.x.limit_step(&step.x, at(&affine.x), &mut worst.x);
        self.dynamics.limit_step(&step.dynamics, at(&affine.dynamics), &mut worst.dynamics);
        self.u.limit_step(&step.u, Target { aim, affine: &affine.u }, &mut worst.u);
        self.row.limit_step(&step.row, Target { aim, affine: &affine.row }, &mut worst.row);
    }

    /// [`Boxed::add_products`] of all.
    #[inline(always)]
    pub fn add_products(
        &self,
        step: &Entries<NX, NU, NR>,
        aim: Aim,
        affine: &Entries<NX, NU, NR>,
        length: f64,
        sum: &mut Entries<NX, NU, NR>,
    ) {
        let at = |affine| Target { aim, affine };
        self.x.add_products(&step.x, at(&affine.x), length, &mut sum.x);
        self.dynamics.add_products(&step.dynamics, at(&affine.dynamics), length, &mut sum.dynamics);
        self.u.add_products(&step.u, Target { aim, affine: &affine.u }, length, &mut sum.u);
        let target = Target { aim, affine: &affine.row };
        self.row.add_products(&step.row, target, length, &mut sum.row);
    }

    /// [`Boxed::products`] of all.
    #[inline(always)]
    pub fn products(&self, sum: &mut Entries<NX, NU, NR>, worst: &mut Entries<NX, NU, NR>) {
        self.x.products(&mut sum.x, &mut worst.x);
        self.u.products(&mut sum.u, &mut worst.u);
        self.dynamics.products(&mut sum.dynamics, &mut worst.dynamics);
        self.row.products(&mut sum.row, &mut worst.row);
    }

    /// [`Boxed::advance`] of all.
    #[inline(always)]
    pub fn advance(
        &mut self,
        step: &Entries<NX, NU, NR>,
        aim: Aim,
        affine: &Entries<NX, NU, NR>,
        length: f64,
    ) {
        self.x.advance(&step.x, Target { aim, affine: &affine.x }, length);
        self.u.advance(&step.u, Target { aim, affine: &affine.u }, length);
        let target = Target { aim, affine: &affine.dynamics };
        self.dynamics.advance(&step.dynamics, target, length);
        self.row.advance(&step.row, Target { aim, affine: &affine.row }, length);
    }
}

/// Puts variable `i` inside its bounds, or pins it; tells whether it is free.
fn place<const D: usize>(
    boxed: &mut Boxed<D>,
    i: usize,
    bounds: (f64, f64),
    multiplier: f64,
    product: f64,
) -> Result<bool, Unfit> {
    let (lower, upper) = bounds;
    if lower.is_nan() || upper.is_nan() {
        return Err(Unfit::Nonsense);
    }
    if lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
        return Err(Unfit::EmptyBox);
    }
    if upper - lower <= NARROW {
        boxed.pin(i, 0.5 * (lower + upper));
        return Ok(false);
    }
    boxed.place(i, bounds, 0.0, multiplier, product);
    Ok(true)
}
