//! The variables of one stage with their barriers, and vectors over them.

use super::bounded::{Bounded, Centering, Target, larger};
use crate::Qp;
use crate::dense::{clamp, divisor};
use core::array::from_fn;

/// One number for every variable of a stage: a direction, a gradient or a residual.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageVector<const NX: usize, const NU: usize, const NG: usize> {
    pub x: [f64; NX],
    pub u: [f64; NU],
    pub dynamics: [f64; NX],
    pub path: [f64; NG],
}

impl<const NX: usize, const NU: usize, const NG: usize> StageVector<NX, NU, NG> {
    pub const ZERO: Self =
        Self { x: [0.0; NX], u: [0.0; NU], dynamics: [0.0; NX], path: [0.0; NG] };

    /// The largest entry; the entries must not be negative.
    pub fn largest(&self) -> f64 {
        let most = |values: &[f64]| values.iter().fold(0.0, |most, v| larger(most, *v));
        larger(larger(most(&self.x), most(&self.u)), larger(most(&self.dynamics), most(&self.path)))
    }

    /// Adds the barriers' gradient. The Lagrangian is maximised over multipliers: theirs is
    /// subtracted.
    #[inline(always)]
    pub fn add_barrier_gradient(&mut self, barrier: &Self) {
        fn add<const D: usize>(to: &mut [f64; D], what: &[f64; D]) {
            for (to, what) in to.iter_mut().zip(what) {
                *to += what;
            }
        }
        add(&mut self.x, &barrier.x);
        add(&mut self.u, &barrier.u);
        add(&mut self.dynamics, &barrier.dynamics.map(|v| -v));
        add(&mut self.path, &barrier.path.map(|v| -v));
    }

    /// Raises every entry to the magnitude of `other`'s entry.
    #[inline(always)]
    pub fn raise_to(&mut self, other: &Self) {
        self.combine(other, |worst, value| larger(worst, value.abs()));
    }

    /// Adds something for each finite entry of `other`, and infinity or NaN for each other one. Sums of positive
    /// numbers are valid operations, infinity included.
    #[inline(always)]
    pub fn spoil_by(&mut self, other: &Self) {
        self.combine(other, |sum, value| sum + value.abs() * f64::EPSILON);
    }

    /// Replaces every entry by what `of` makes of it and of `other`'s entry.
    #[inline(always)]
    fn combine(&mut self, other: &Self, of: impl Fn(f64, f64) -> f64) {
        #[inline(always)]
        fn replace<const D: usize>(
            to: &mut [f64; D],
            what: &[f64; D],
            of: &impl Fn(f64, f64) -> f64,
        ) {
            for (to, what) in to.iter_mut().zip(what) {
                *to = of(*to, *what);
            }
        }
        replace(&mut self.x, &other.x, &of);
        replace(&mut self.u, &other.u, &of);
        replace(&mut self.dynamics, &other.dynamics, &of);
        replace(&mut self.path, &other.path, &of);
    }

    /// The sum of all entries.
    pub fn sum(&self) -> f64 {
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        sum(&self.x) + sum(&self.u) + sum(&self.dynamics) + sum(&self.path)
    }
}

/// Mask of the variables that are not fixed, one byte each: there are many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Free<const D: usize>([u8; D]);

impl<const D: usize> Free<D> {
    pub const NONE: Self = Self([0; D]);
    pub const ALL: Self = Self([1; D]);

    /// One for each free variable, zero for each fixed one.
    #[inline(always)]
    pub fn factors(&self) -> [f64; D] {
        self.0.map(f64::from)
    }

    /// Whether variable `i` is fixed.
    pub fn is_fixed(&self, i: usize) -> bool {
        self.0.get(i) == Some(&0)
    }

    fn set(&mut self, i: usize, free: bool) {
        if let Some(entry) = self.0.get_mut(i) {
            *entry = u8::from(free);
        }
    }

    /// Storage in which every number is `value`.
    #[cfg(any(test, feature = "testing"))]
    pub fn filled(value: f64) -> Self {
        Self([value as u8; D])
    }
}

/// Variables of one stage. The last stage has neither controls nor dynamics: theirs stay free at
/// zero and enter no equation.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageVariables<const NX: usize, const NU: usize, const NG: usize> {
    pub x: Bounded<NX>,
    pub u: Bounded<NU>,
    /// Multipliers of the dynamics to the next stage, in `[-defect_penalty, defect_penalty]`, without bounds
    /// where there is no slack.
    pub dynamics: Bounded<NX>,
    /// Multipliers of the path constraints, in `[0, path_penalty]`.
    pub path: Bounded<NG>,
    pub free_x: Free<NX>,
    pub free_u: Free<NU>,
    pub free_path: Free<NG>,
    /// Whether the dynamics' multipliers have bounds.
    has_slack: bool,
}

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize, const NU: usize, const NG: usize> StageVariables<NX, NU, NG> {
    /// Storage in which every number is `value`.
    pub fn filled(value: f64) -> Self {
        Self {
            x: Bounded::filled(value),
            u: Bounded::filled(value),
            dynamics: Bounded::filled(value),
            path: Bounded::filled(value),
            free_x: Free::filled(value),
            free_u: Free::filled(value),
            free_path: Free::filled(value),
            has_slack: value > 0.0,
        }
    }
}

/// Why a QP is refused before the first iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unusable {
    /// A lower bound lies above its upper bound.
    EmptyBox,
    /// A bound or a penalty is NaN, a penalty is not positive, or that of the path constraints is
    /// infinite.
    InvalidProblem,
}

/// How the first iterate is chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct InitialPoint {
    /// Complementarity `s z` of every pair.
    pub mu: f64,
    /// Whether the dynamics have slack at the QP's price, or none.
    pub elastic: bool,
}

impl InitialPoint {
    /// With slack.
    pub const ELASTIC: Self = Self { mu: 0.1, elastic: true };
    /// Far from the bounds, for QPs whose first iterate is far from the optimum.
    pub const CONSERVATIVE: Self = Self { mu: 10.0, elastic: true };

    /// Without slack. Multipliers of active bounds are as large as the cost's gradient or a hundred times less:
    /// products begin in proportion, but not below what is good enough.
    pub fn cold<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
    ) -> Self {
        let last = qp.nodes().saturating_sub(1);
        let of_states = qp.used().iter().flat_map(|stage| stage.gradient_x.iter());
        let of_controls = qp.stages[..last].iter().flat_map(|stage| stage.gradient_u.iter());
        let largest = of_states.chain(of_controls).fold(0.0, |most, g| larger(most, g.abs()));
        let least = qp.good_enough().max(1e-6);
        Self { mu: clamp(0.01 * largest, least, Self::ELASTIC.mu), elastic: false }
    }
}

/// Bounds closer than this fix their variable.
const FIXED_WIDTH: f64 = 1e-11;

impl<const NX: usize, const NU: usize, const NG: usize> StageVariables<NX, NU, NG> {
    /// Storage, all bits zero.
    pub const ZERO: Self = Self {
        x: Bounded::FREE,
        u: Bounded::FREE,
        dynamics: Bounded::FREE,
        path: Bounded::FREE,
        free_x: Free::NONE,
        free_u: Free::NONE,
        free_path: Free::NONE,
        has_slack: false,
    };

    /// Initialises the variables of stage `k` inside their bounds, as near zero as these allow.
    ///
    /// # Errors
    /// Empty bounds, or bounds that are NaN.
    pub fn initialise<const N: usize>(
        &mut self,
        k: usize,
        qp: &Qp<N, NX, NU, NG>,
        point: InitialPoint,
    ) -> Result<(), Unusable> {
        let Some(stage) = qp.used().get(k) else { return Err(Unusable::InvalidProblem) };
        for i in 0..NX {
            let bounds = (stage.lower_x[i], stage.upper_x[i]);
            let free = place(&mut self.x, i, bounds, point.mu)?;
            self.free_x.set(i, free);
        }
        for i in 0..NG {
            // The constraint's slack is the multiplier of the bound at zero.
            let bounds = (0.0, qp.path_penalty);
            let free = qp.path_penalty > FIXED_WIDTH;
            self.free_path.set(i, free);
            match free {
                true => {
                    self.path.place(i, bounds, 0.0, stage.path_offset[i], point.mu);
                }
                false => self.path.fix(i, 0.0),
            }
        }
        let most = if point.elastic { qp.defect_penalty } else { f64::INFINITY };
        self.has_slack = most < f64::INFINITY;
        if k + 1 >= qp.nodes() {
            // Nothing writes them later, so a flipped bit would stay for all QPs to come.
            (self.u, self.dynamics, self.free_u) = (Bounded::FREE, Bounded::FREE, Free::NONE);
            return Ok(());
        }
        for i in 0..NU {
            let bounds = (stage.lower_u[i], stage.upper_u[i]);
            let free = place(&mut self.u, i, bounds, point.mu)?;
            self.free_u.set(i, free);
        }
        for i in 0..NX {
            let bounds = (-most, most);
            self.dynamics.place(i, bounds, 0.0, 0.0, point.mu);
        }
        Ok(())
    }

    /// [`Bounded::recentre`] of all variables.
    pub fn recentre(&mut self, mu: f64) {
        self.x.recentre(mu);
        self.u.recentre(mu);
        self.dynamics.recentre(mu);
        self.path.recentre(mu);
    }

    /// Values of states and controls.
    #[inline(always)]
    pub fn point(&self) -> StageVector<NX, NU, NG> {
        StageVector { x: self.x.value, u: self.u.value, ..StageVector::ZERO }
    }

    /// Number of complementarity pairs.
    pub fn pairs(&self) -> u32 {
        self.x.pairs() + self.u.pairs() + self.dynamics.pairs() + self.path.pairs()
    }

    /// KKT residual: `gradient` of the Lagrangian with the bounds' multipliers, zero at the optimum.
    /// The Lagrangian is maximised over multipliers, so their bounds enter with the other sign.
    #[inline(always)]
    pub fn residual(&self, gradient: &StageVector<NX, NU, NG>) -> StageVector<NX, NU, NG> {
        let (x, u) = (self.x.multipliers(), self.u.multipliers());
        let (dynamics, row) = (self.dynamics.multipliers(), self.path.multipliers());
        let (free_x, free_u) = (self.free_x.factors(), self.free_u.factors());
        let free_path = self.free_path.factors();
        StageVector {
            x: from_fn(|i| (gradient.x[i] + x[i]) * free_x[i]),
            u: from_fn(|i| (gradient.u[i] + u[i]) * free_u[i]),
            dynamics: from_fn(|i| gradient.dynamics[i] - dynamics[i]),
            path: from_fn(|i| (gradient.path[i] - row[i]) * free_path[i]),
        }
    }

    /// Weight of `C^T C` in the Hessian for each path constraint; zero where it has no penalty.
    #[inline(always)]
    pub fn path_scaling(&self) -> [f64; NG] {
        let dual = self.path.scaling();
        from_fn(|i| if dual[i] > 0.0 { 1.0 / divisor(dual[i]) } else { 0.0 })
    }

    /// [`Bounded::barrier_gradient`] of all variables.
    #[inline(always)]
    pub fn barrier_gradient(
        &self,
        centering: Centering,
        affine: &StageVector<NX, NU, NG>,
    ) -> StageVector<NX, NU, NG> {
        let of_dynamics = Target { centering, affine: &affine.dynamics };
        StageVector {
            x: self.x.barrier_gradient(Target { centering, affine: &affine.x }),
            u: self.u.barrier_gradient(Target { centering, affine: &affine.u }),
            dynamics: match self.has_slack {
                true => self.dynamics.barrier_gradient(of_dynamics),
                false => [0.0; NX],
            },
            path: self.path.barrier_gradient(Target { centering, affine: &affine.path }),
        }
    }

    /// [`Bounded::limit_step`] of all variables.
    #[inline(always)]
    pub fn limit_step(
        &self,
        step: &StageVector<NX, NU, NG>,
        centering: Centering,
        affine: &StageVector<NX, NU, NG>,
        worst: &mut StageVector<NX, NU, NG>,
    ) {
        let at = |affine| Target { centering, affine };
        self.x.limit_step(&step.x, at(&affine.x), &mut worst.x);
        if self.has_slack {
            self.dynamics.limit_step(&step.dynamics, at(&affine.dynamics), &mut worst.dynamics);
        }
        self.u.limit_step(&step.u, Target { centering, affine: &affine.u }, &mut worst.u);
        self.path.limit_step(
            &step.path,
            Target { centering, affine: &affine.path },
            &mut worst.path,
        );
    }

    /// [`Bounded::add_complementarity_after`] of all variables.
    #[inline(always)]
    pub fn add_complementarity_after(
        &self,
        step: &StageVector<NX, NU, NG>,
        centering: Centering,
        affine: &StageVector<NX, NU, NG>,
        length: f64,
        sum: &mut StageVector<NX, NU, NG>,
    ) {
        let at = |affine| Target { centering, affine };
        self.x.add_complementarity_after(&step.x, at(&affine.x), length, &mut sum.x);
        if self.has_slack {
            self.dynamics.add_complementarity_after(
                &step.dynamics,
                at(&affine.dynamics),
                length,
                &mut sum.dynamics,
            );
        }
        self.u.add_complementarity_after(
            &step.u,
            Target { centering, affine: &affine.u },
            length,
            &mut sum.u,
        );
        let target = Target { centering, affine: &affine.path };
        self.path.add_complementarity_after(&step.path, target, length, &mut sum.path);
    }

    /// [`Bounded::add_complementarity`] of all variables.
    #[inline(always)]
    pub fn add_complementarity(
        &self,
        sum: &mut StageVector<NX, NU, NG>,
        worst: &mut StageVector<NX, NU, NG>,
    ) {
        self.x.add_complementarity(&mut sum.x, &mut worst.x);
        self.u.add_complementarity(&mut sum.u, &mut worst.u);
        if self.has_slack {
            self.dynamics.add_complementarity(&mut sum.dynamics, &mut worst.dynamics);
        }
        self.path.add_complementarity(&mut sum.path, &mut worst.path);
    }

    /// [`Bounded::advance`] of all variables.
    #[inline(always)]
    pub fn advance(
        &mut self,
        step: &StageVector<NX, NU, NG>,
        centering: Centering,
        affine: &StageVector<NX, NU, NG>,
        length: f64,
    ) {
        self.x.advance(&step.x, Target { centering, affine: &affine.x }, length);
        self.u.advance(&step.u, Target { centering, affine: &affine.u }, length);
        let target = Target { centering, affine: &affine.dynamics };
        match self.has_slack {
            true => self.dynamics.advance(&step.dynamics, target, length),
            false => self.dynamics.move_by(&step.dynamics, length),
        }
        self.path.advance(&step.path, Target { centering, affine: &affine.path }, length);
    }
}

/// Moves variable `i` inside its bounds, or fixes it; returns whether it is free.
fn place<const D: usize>(
    bounded: &mut Bounded<D>,
    i: usize,
    bounds: (f64, f64),
    mu: f64,
) -> Result<bool, Unusable> {
    let (lower, upper) = bounds;
    if lower.is_nan() || upper.is_nan() {
        return Err(Unusable::InvalidProblem);
    }
    if lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
        return Err(Unusable::EmptyBox);
    }
    if upper - lower <= FIXED_WIDTH {
        bounded.fix(i, 0.5 * (lower + upper));
        return Ok(false);
    }
    bounded.place(i, bounds, 0.0, 0.0, mu);
    Ok(true)
}
