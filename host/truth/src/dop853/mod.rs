//! Dormand and Prince's explicit Runge-Kutta method of order 8 with error estimates of orders 5 and
//! 3 and dense output of order 7, after Hairer, Norsett, Wanner, *Solving Ordinary Differential
//! Equations I*, section II.5. No allocation; only libm's functions.

mod coefficients;
mod dense;

pub use dense::Segment;

use coefficients::{ERROR_3, ERROR_5, NODES, Row, STAGES};

/// State that is integrated: its numbers can be summed and their error can be measured.
pub trait State: Copy {
    /// All components zero.
    const ZERO: Self;
    /// Number of components.
    const SIZE: usize;

    /// `self + scale * sum(weight * slopes[stage])`.
    fn moved(&self, scale: f64, row: Row, slopes: &[Self]) -> Self;

    /// Sum of the squares of each component of the error `self` over its allowance, which is
    /// `absolute + relative * max(|before|, |after|)`.
    fn squares(&self, before: &Self, after: &Self, tolerance: &Tolerance) -> f64;
}

impl<const N: usize> State for [f64; N] {
    const ZERO: Self = [0.0; N];
    const SIZE: usize = N;

    #[inline]
    fn moved(&self, scale: f64, row: Row, slopes: &[Self]) -> Self {
        let mut sum = [0.0; N];
        for &(stage, weight) in row {
            for i in 0..N {
                sum[i] += weight * slopes[stage][i];
            }
        }
        for i in 0..N {
            sum[i] = self[i] + scale * sum[i];
        }
        sum
    }

    #[inline]
    fn squares(&self, before: &Self, after: &Self, tolerance: &Tolerance) -> f64 {
        let mut sum = 0.0;
        for i in 0..N {
            let (a, b) = (before[i].abs(), after[i].abs());
            let ratio = self[i] / (tolerance.absolute + tolerance.relative * a.max(b));
            sum += ratio * ratio;
        }
        sum
    }
}

/// A differential equation `y' = f(t, y)`.
pub trait Equation {
    /// Its unknowns.
    type State: State;

    /// `f(t, y)`.
    fn slope(&self, time: f64, state: &Self::State) -> Self::State;
}

/// Error allowed in a step, by component: the root mean square over the components of error over
/// allowance is at most one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// In the units of each component.
    pub absolute: f64,
    /// In parts of the component's magnitude.
    pub relative: f64,
}

/// The integration could not go on.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IntegrationError {
    /// Steps became too small for the numbers' precision, or something is not a number.
    #[error("the integration stops at {time} s: its steps became too small")]
    StepTooSmall {
        /// Where [s].
        time: f64,
    },
    /// More steps than were allowed: something moves faster than can be followed.
    #[error("the integration stops at {time} s: it takes too many steps")]
    TooManySteps {
        /// Where [s].
        time: f64,
    },
}

/// Steps that may be taken in flight by `time` [s], after so many changes of what acts. What needs more moves as no
/// spacecraft does, and would be followed for ever.
pub(crate) fn most_steps(time: f64, changes: u64) -> u64 {
    const AT_FIRST: u64 = 1000;
    const A_SECOND: f64 = 100.0;
    const A_CHANGE: u64 = 10;
    let over_time = AT_FIRST.saturating_add((A_SECOND * time) as u64);
    over_time.saturating_add(changes.saturating_mul(A_CHANGE))
}

/// The integrator: its memory and the step it would take next.
#[derive(Clone, Debug)]
pub struct Dop853<S> {
    tolerance: Tolerance,
    longest: f64,
    /// The step to try next [s].
    step: f64,
    slopes: [S; 16],
    taken: u64,
    refused: u64,
    /// Steps taken and refused that are allowed, in all.
    most: u64,
}

impl<S: State> Dop853<S> {
    /// An integrator whose steps are never longer than `longest` [s].
    pub fn new(tolerance: Tolerance, longest: f64) -> Self {
        let slopes = [S::ZERO; 16];
        Self { tolerance, longest, step: longest, slopes, taken: 0, refused: 0, most: u64::MAX }
    }

    /// Allows so many steps, taken and refused, from the first on; any number where it is not called.
    pub fn allow(&mut self, most: u64) {
        self.most = most;
    }

    /// Steps taken and steps refused by the error estimate so far.
    pub fn steps(&self) -> (u64, u64) {
        (self.taken, self.refused)
    }

    /// From `start` to `end` [s], which is met exactly. Twelve evaluations a step.
    ///
    /// # Errors
    ///
    /// [`IntegrationError`]; the state is then unknown.
    pub fn integrate<E: Equation<State = S>>(
        &mut self,
        equation: &E,
        start: f64,
        state: &S,
        end: f64,
    ) -> Result<S, IntegrationError> {
        let (mut time, mut state) = (start, *state);
        while time < end {
            (time, state) = self.advance(equation, time, &state, end)?;
        }
        Ok(state)
    }

    /// One step of the size the error allows, towards `end` [s] and never beyond.
    ///
    /// # Errors
    ///
    /// [`IntegrationError`].
    pub fn advance<E: Equation<State = S>>(
        &mut self,
        equation: &E,
        time: f64,
        state: &S,
        end: f64,
    ) -> Result<(f64, S), IntegrationError> {
        self.slopes[0] = equation.slope(time, state);
        loop {
            if self.taken + self.refused >= self.most {
                return Err(IntegrationError::TooManySteps { time });
            }
            let left = end - time;
            let last = !(self.step < left);
            let step = if last { left } else { self.step };
            let after = self.stages(equation, time, state, step);
            let error = self.error(step, state, &after);
            let longer = step * growth(error);
            if error <= 1.0 {
                self.taken += 1;
                // A step that was cut short to meet the end says little about the next one.
                let wanted = if last { longer.max(self.step) } else { longer };
                self.step = wanted.min(self.longest);
                return Ok((if last { end } else { time + step }, after));
            }
            self.refused += 1;
            self.step = longer;
            if !(longer > 1e-14 * time.abs().max(1e-3)) {
                return Err(IntegrationError::StepTooSmall { time });
            }
        }
    }

    /// One step of the given size whatever its error: for measuring the method's order.
    pub fn fixed<E: Equation<State = S>>(
        &mut self,
        equation: &E,
        time: f64,
        state: &S,
        step: f64,
    ) -> S {
        self.slopes[0] = equation.slope(time, state);
        self.stages(equation, time, state, step)
    }

    /// Interpolates within the step just taken, at the cost of four evaluations.
    pub fn segment<E: Equation<State = S>>(
        &mut self,
        equation: &E,
        (start, before): (f64, &S),
        (end, after): (f64, &S),
    ) -> Segment<S> {
        let step = end - start;
        self.slopes[12] = equation.slope(end, after);
        for stage in 13..16 {
            let point = before.moved(step, STAGES[stage], &self.slopes);
            self.slopes[stage] = equation.slope(start + NODES[stage] * step, &point);
        }
        Segment::new(start, end, before, after, &self.slopes)
    }

    #[inline]
    fn stages<E: Equation<State = S>>(&mut self, equation: &E, time: f64, y: &S, step: f64) -> S {
        for stage in 1..12 {
            let point = y.moved(step, STAGES[stage], &self.slopes);
            self.slopes[stage] = equation.slope(time + NODES[stage] * step, &point);
        }
        y.moved(step, STAGES[12], &self.slopes)
    }

    /// Hairer's combination of both estimates: at most one where the step is good.
    fn error(&self, step: f64, before: &S, after: &S) -> f64 {
        let squares =
            |row| S::ZERO.moved(1.0, row, &self.slopes).squares(before, after, &self.tolerance);
        let (fifth, third) = (squares(ERROR_5), squares(ERROR_3));
        let sum = fifth + 0.01 * third;
        if sum == 0.0 {
            return 0.0;
        }
        step.abs() * fifth / libm::sqrt(sum * S::SIZE as f64)
    }
}

/// Growth of the next step: the error goes with the eighth power. Between a third and
/// six times; a third where the error is not a number.
fn growth(error: f64) -> f64 {
    if error < 1e-8 {
        6.0
    } else if error < f64::INFINITY {
        (0.9 * libm::pow(error, -0.125)).clamp(1.0 / 3.0, 6.0)
    } else {
        1.0 / 3.0
    }
}
