//! The interior-point iteration: predictor, corrector, step length.

use super::bounded::Centering;
use super::optimality::{Optimality, differentiate};
use super::variables::{StageVariables, StageVector};
use super::{EmbeddedQp, infeasible, riccati};
use crate::dense::clamp;
use crate::time::Deadline;
use crate::{Qp, QpOutcome, QpStatus};

/// Fraction of the way to the nearest bound that a step may go.
const FRACTION_TO_BOUNDARY: f64 = 0.995;

/// Step length below which a pure centering direction is tried instead: a few pairs much nearer
/// their bounds than the rest block the step.
const SHORT_STEP: f64 = 0.3;

/// Complementarity that suffices once residuals grow again: below it rounding dominates.
const ROUNDING_COMPLEMENTARITY: f64 = 1e-11;

/// Step length below which the method stalls.
const MIN_STEP: f64 = 1e-10;

/// Dual (proximal) regularisation of the dynamics' multipliers. It bounds the cost-to-go by its
/// inverse and so the multipliers' rounding below the tolerance; the next residual contains its
/// error.
const DUAL_REGULARISATION: f64 = 1e-8;

/// Most factorisations an iteration, each with a hundred times the dual regularisation of the one
/// before.
pub const MAX_FACTORISATIONS: usize = 3;

/// Which direction of Mehrotra's method is computed.
#[derive(Clone, Copy, Debug)]
enum StepDirection {
    /// The predictor: no centering.
    Affine,
    /// The step: centering, with or without the second-order corrector.
    Combined(Centering),
}

impl StepDirection {
    /// Right-hand side of the complementarity equations.
    #[inline(always)]
    fn centering(self) -> Centering {
        match self {
            Self::Affine => Centering::AFFINE,
            Self::Combined(centering) => centering,
        }
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> EmbeddedQp<N, NX, NU, NG> {
    /// Iterates from the current iterate until a stopping criterion holds, at most `most` times.
    pub(super) fn run(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        most: u32,
        deadline: &Deadline,
    ) -> QpOutcome {
        let settings = self.settings();
        let limit = settings.fixed_iterations.unwrap_or(most);
        let (mut iterations, mut before) = (0, f64::INFINITY);
        // Bound: solver_iterations.
        loop {
            differentiate(qp, &self.variables, &self.intervals, &mut self.gradient);
            let at = self.optimality();
            let grows = at.residual > before && at.residual > 0.3 * settings.tolerance;
            let solved = at.is_within(settings.tolerance, settings.complementarity)
                || (grows && at.is_within(settings.tolerance, ROUNDING_COMPLEMENTARITY));
            let free = settings.fixed_iterations.is_none();
            let stop = if !at.is_finite() {
                Some(QpStatus::NumericalFailure)
            } else if solved && (free || iterations >= limit) {
                Some(QpStatus::Solved)
            } else if iterations >= limit {
                Some(QpStatus::IterationLimit)
            } else if free && grows && at.complementarity <= settings.complementarity {
                // Only rounding is left in the residual.
                Some(QpStatus::Stalled)
            } else if deadline.has_passed() {
                Some(QpStatus::TimeLimit)
            } else {
                iterations += 1;
                self.iterate(qp, at.mu, at.residual).err()
            };
            before = at.residual;
            if let Some(status) = stop {
                return QpOutcome { status: self.classify(qp, status, at), iterations };
            }
        }
    }

    /// Maps the stop reason to the final status; `at` belongs to the last iterate.
    fn classify(&self, qp: &Qp<N, NX, NU, NG>, status: QpStatus, at: Optimality) -> QpStatus {
        match status {
            QpStatus::Solved | QpStatus::TimeLimit => status,
            _ if at.is_within(self.settings().reduced, self.settings().reduced) => {
                QpStatus::ReducedAccuracy
            }
            _ if infeasible::is_proved(qp, &self.variables, &self.intervals) => {
                QpStatus::Infeasible
            }
            _ => status,
        }
    }

    /// One iteration from an iterate with mean complementarity `mu` and KKT residual `residual`.
    ///
    /// # Errors
    /// Why no step was taken; the iterate is then unchanged.
    fn iterate(&mut self, qp: &Qp<N, NX, NU, NG>, mu: f64, residual: f64) -> Result<(), QpStatus> {
        self.factorise(qp)?;
        self.compute_direction(qp, StepDirection::Affine);
        let length = self.longest_step(StepDirection::Affine).min(1.0);
        let mut sum = StageVector::<NX, NU, NG>::ZERO;
        for (vars, affine) in self.used().zip(&self.affine) {
            vars.add_complementarity_after(affine, Centering::AFFINE, affine, length, &mut sum);
        }
        // Mehrotra's rule sigma = (mu_aff / mu)^3, bounded below where only rounding would be gained.
        let ratio = clamp(sum.sum() / self.pairs / mu, 0.0, 1.0);
        let least = 0.1 * self.settings().complementarity;
        let sigma_mu = (ratio * ratio * ratio * mu).max(least);
        let mut centering = Centering { sigma_mu, corrector: 1.0 };
        self.compute_direction(qp, StepDirection::Combined(centering));
        let mut length = self.step_length(centering);
        if length < SHORT_STEP {
            let central = Centering { sigma_mu: mu.max(0.1 * residual), corrector: 0.0 };
            self.compute_direction(qp, StepDirection::Combined(central));
            let other = self.step_length(central);
            if other > length {
                (centering, length) = (central, other);
            } else {
                self.compute_direction(qp, StepDirection::Combined(centering));
            }
        }
        // Written so that NaN fails.
        if !(length > MIN_STEP) {
            return Err(QpStatus::Stalled);
        }
        let nodes = self.nodes();
        let each = self.variables.iter_mut().take(nodes).zip(&self.affine).zip(&self.step);
        for ((vars, affine), step) in each {
            vars.advance(step, centering, affine, length);
        }
        Ok(())
    }

    /// Factors the Newton system, with more dual regularisation where that fails.
    fn factorise(&mut self, qp: &Qp<N, NX, NU, NG>) -> Result<(), QpStatus> {
        let mut regularisation = DUAL_REGULARISATION;
        // Bound: factorisations.
        for _ in 0..MAX_FACTORISATIONS {
            let Self { variables, intervals, initial, .. } = self;
            if riccati::factorise(qp.used(), variables, regularisation, intervals, initial).is_ok()
            {
                return Ok(());
            }
            regularisation *= 100.0;
        }
        Err(QpStatus::NumericalFailure)
    }

    /// Solves the factored system for a direction: the predictor into `affine`, others into `step`.
    fn compute_direction(&mut self, qp: &Qp<N, NX, NU, NG>, direction: StepDirection) {
        let centering = direction.centering();
        let Self { variables, intervals, initial, gradient, affine, step, .. } = self;
        let condensed = |k: usize, vars: &StageVariables<NX, NU, NG>, affine: &_| {
            let mut b = gradient.get(k).copied().unwrap_or(StageVector::ZERO);
            b.add_barrier_gradient(&vars.barrier_gradient(centering, affine));
            b
        };
        if matches!(direction, StepDirection::Affine) {
            let rhs = |k: usize, vars: &_| condensed(k, vars, &StageVector::ZERO);
            riccati::direction(qp.used(), variables, intervals, initial, rhs, affine);
        } else {
            let rhs = |k: usize, vars: &_| {
                condensed(k, vars, affine.get(k).unwrap_or(&StageVector::ZERO))
            };
            riccati::direction(qp.used(), variables, intervals, initial, rhs, step);
        }
    }

    /// Length of the step by the fraction-to-boundary rule, at most one.
    fn step_length(&self, centering: Centering) -> f64 {
        (FRACTION_TO_BOUNDARY * self.longest_step(StepDirection::Combined(centering))).min(1.0)
    }

    /// Longest step along `direction` that keeps all pairs positive; may exceed one.
    fn longest_step(&self, direction: StepDirection) -> f64 {
        let centering = direction.centering();
        let mut worst = StageVector::<NX, NU, NG>::ZERO;
        for ((vars, affine), step) in self.used().zip(&self.affine).zip(&self.step) {
            let step = if matches!(direction, StepDirection::Affine) { affine } else { step };
            vars.limit_step(step, centering, affine, &mut worst);
        }
        1.0 / worst.largest().max(f64::MIN_POSITIVE)
    }
}
