//! The interior-point iteration: predictor, corrector, step length.

use super::bounded::Centering;
use super::leading::{Leading, TRANSLATION};
use super::optimality::{Optimality, differentiate};
use super::riccati::Dynamics;
use super::variables::{StageVariables, StageVector};
use super::{EmbeddedQp, infeasible, riccati};
use crate::dense::{clamp, divisor};
use crate::simd::multiversion;
use crate::time::Deadline;
use crate::{Qp, QpOutcome, QpStatus};

/// Fraction of the way to the nearest bound that a step may go.
const FRACTION_TO_BOUNDARY: f64 = 0.999;

/// Step length below which a pure centering direction is tried instead: a few pairs much nearer
/// their bounds than the rest block the step.
const SHORT_STEP: f64 = 0.3;

/// Multiple of the complementarity asked for that suffices once residuals grow again: rounding dominates.
const ROUNDING_COMPLEMENTARITY: f64 = 100.0;

/// Multiple of the slack's price beyond which a multiplier of dynamics without slack does not come back.
const HOPELESS: f64 = 10.0;

/// Share of the tolerance above which a residual that grows tells that the dynamics need regularisation.
const RIGID_ROUNDING: f64 = 3e-3;

/// Largest KKT residual over the complementarity that is good enough.
const RESIDUAL: f64 = 0.01;

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
        let complementarity = self.complementarity(qp);
        let (mut iterations, mut before) = (0, f64::INFINITY);
        let mut was_complementary = false;
        // Bound: solver_iterations.
        loop {
            self.differentiate(qp);
            let at = self.optimality();
            let grows = at.residual > before;
            let is_rounding = grows && !self.is_rigid && at.residual > 0.3 * settings.tolerance;
            // Rounding is larger without regularisation.
            self.is_rigid &= !(grows && at.residual > RIGID_ROUNDING * settings.tolerance);
            let enough = match is_rounding {
                true => ROUNDING_COMPLEMENTARITY * complementarity,
                false => complementarity,
            };
            let solved = at.is_within(self.tolerance(qp), enough);
            let free = settings.fixed_iterations.is_none();
            let stop = if !at.is_finite() {
                Some(QpStatus::NumericalFailure)
            } else if solved && (free || iterations >= limit) {
                // A solution without slack solves the QP with slack if its multipliers are within the penalty.
                match self.multipliers_are_within(qp.defect_penalty) {
                    true => Some(QpStatus::Solved),
                    false => Some(QpStatus::Stalled),
                }
            } else if iterations >= limit {
                Some(QpStatus::IterationLimit)
            } else if free && is_rounding && was_complementary {
                // Only rounding is left in the residual. In the step that reaches complementarity it may still
                // be that of a weakly active variable on its way, whose next step is short.
                Some(QpStatus::Stalled)
            } else if free && !self.multipliers_are_within(HOPELESS * qp.defect_penalty) {
                // Slack is cheaper, or there is no solution without.
                Some(QpStatus::Stalled)
            } else if free && infeasible::is_proved(qp, &self.variables, &self.intervals) {
                Some(QpStatus::Infeasible)
            } else if deadline.has_passed() {
                Some(QpStatus::TimeLimit)
            } else {
                iterations += 1;
                self.iterate(qp, at.mu, at.residual).err()
            };
            before = at.residual;
            was_complementary = at.complementarity <= complementarity;
            if let Some(status) = stop {
                return QpOutcome { status: self.classify(qp, status, at), iterations };
            }
        }
    }

    /// Largest complementarity of a solution: what the QP calls good enough, if that is more than the settings'.
    pub(super) fn complementarity(&self, qp: &Qp<N, NX, NU, NG>) -> f64 {
        qp.good_enough().max(self.settings().complementarity)
    }

    /// Largest KKT residual of a solution: the settings', or a share of the complementarity that is good enough.
    pub(super) fn tolerance(&self, qp: &Qp<N, NX, NU, NG>) -> f64 {
        (RESIDUAL * qp.good_enough()).max(self.settings().tolerance)
    }

    /// Maps the stop reason to the final status; `at` belongs to the last iterate.
    fn classify(&self, qp: &Qp<N, NX, NU, NG>, status: QpStatus, at: Optimality) -> QpStatus {
        match status {
            QpStatus::Solved | QpStatus::TimeLimit | QpStatus::Infeasible => status,
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
        let sum = complementarity_after(&self.variables[..self.nodes()], &self.affine, length);
        // Mehrotra's rule sigma = (mu_aff / mu)^3, bounded below where only rounding would be gained.
        let ratio = clamp(sum / self.pairs / divisor(mu), 0.0, 1.0);
        let least = 0.1 * self.complementarity(qp);
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
        advance(&mut self.variables[..nodes], &self.affine, &self.step, centering, length);
        Ok(())
    }

    /// The gradient of the Lagrangian at the iterate.
    pub(super) fn differentiate(&mut self, qp: &Qp<N, NX, NU, NG>) {
        let leaves_padding_out = self.leaves_padding_out();
        let Self { variables, intervals, gradient, .. } = self;
        match leaves_padding_out {
            true => differentiate(qp, TRANSLATION, variables, intervals, gradient),
            false => differentiate(qp, Leading::<NX, NU>, variables, intervals, gradient),
        }
    }

    /// Factors the Newton system, with more dual regularisation where that fails.
    fn factorise(&mut self, qp: &Qp<N, NX, NU, NG>) -> Result<(), QpStatus> {
        let mut dynamics =
            Dynamics { are_rigid: self.is_rigid, regularisation: DUAL_REGULARISATION };
        let leaves_padding_out = self.leaves_padding_out();
        // Bound: factorisations.
        for _ in 0..MAX_FACTORISATIONS {
            let Self { variables, intervals, initial, .. } = self;
            let stages = qp.used();
            let factored = match leaves_padding_out {
                true => {
                    riccati::factorise(stages, variables, TRANSLATION, dynamics, intervals, initial)
                }
                false => riccati::factorise(
                    stages,
                    variables,
                    Leading::<NX, NU>,
                    dynamics,
                    intervals,
                    initial,
                ),
            };
            if factored.is_ok() {
                return Ok(());
            }
            dynamics.regularisation *= 100.0;
        }
        Err(QpStatus::NumericalFailure)
    }

    /// Solves the factored system for a direction: the predictor into `affine`, others into `step`.
    fn compute_direction(&mut self, qp: &Qp<N, NX, NU, NG>, direction: StepDirection) {
        let (nodes, leaves_padding_out) = (self.nodes(), self.leaves_padding_out());
        let Self { variables, intervals, initial, gradient, affine, step, .. } = self;
        let variables = &variables[..nodes];
        let out = match direction {
            StepDirection::Affine => {
                condense_affine(variables, gradient, affine);
                affine
            }
            StepDirection::Combined(centering) => {
                condense(variables, gradient, affine, centering, step);
                step
            }
        };
        let stages = qp.used();
        match leaves_padding_out {
            true => riccati::direction(stages, variables, TRANSLATION, intervals, initial, out),
            false => {
                riccati::direction(stages, variables, Leading::<NX, NU>, intervals, initial, out)
            }
        }
    }

    /// Length of the step by the fraction-to-boundary rule, at most one.
    fn step_length(&self, centering: Centering) -> f64 {
        (FRACTION_TO_BOUNDARY * self.longest_step(StepDirection::Combined(centering))).min(1.0)
    }

    /// Longest step along `direction` that keeps all pairs positive; may exceed one.
    fn longest_step(&self, direction: StepDirection) -> f64 {
        let step = match direction {
            StepDirection::Affine => &self.affine,
            StepDirection::Combined(_) => &self.step,
        };
        let variables = &self.variables[..self.nodes()];
        let worst = worst_step(variables, &self.affine, step, direction.centering());
        1.0 / worst.max(f64::MIN_POSITIVE)
    }
}

multiversion! {
    /// The gradient of the Lagrangian with that of the barriers, for the predictor: into `out`.
    fn condense_affine<const NX: usize, const NU: usize, const NG: usize>(
        variables: &[StageVariables<NX, NU, NG>],
        gradient: &[StageVector<NX, NU, NG>],
        out: &mut [StageVector<NX, NU, NG>],
    ) {
        for ((vars, gradient), out) in variables.iter().zip(gradient).zip(out) {
            *out = *gradient;
            out.add_barrier_gradient(&vars.barrier_gradient(Centering::AFFINE, &StageVector::ZERO));
        }
    }
}

multiversion! {
    /// The gradient for the combined step, with centering and the corrector of the predictor: into `out`.
    fn condense<const NX: usize, const NU: usize, const NG: usize>(
        variables: &[StageVariables<NX, NU, NG>],
        gradient: &[StageVector<NX, NU, NG>],
        affine: &[StageVector<NX, NU, NG>],
        centering: Centering,
        out: &mut [StageVector<NX, NU, NG>],
    ) {
        for (((vars, gradient), affine), out) in
            variables.iter().zip(gradient).zip(affine).zip(out)
        {
            *out = *gradient;
            out.add_barrier_gradient(&vars.barrier_gradient(centering, affine));
        }
    }
}

multiversion! {
    /// Sum of all products `s z` after a step of `length` along the predictor.
    fn complementarity_after<const NX: usize, const NU: usize, const NG: usize>(
        variables: &[StageVariables<NX, NU, NG>],
        affine: &[StageVector<NX, NU, NG>],
        length: f64,
    ) -> f64 {
        let mut sum = StageVector::<NX, NU, NG>::ZERO;
        for (vars, affine) in variables.iter().zip(affine) {
            vars.add_complementarity_after(affine, Centering::AFFINE, affine, length, &mut sum);
        }
        sum.sum()
    }
}

multiversion! {
    /// Largest relative decrease of an `s` or `z` along `step`.
    fn worst_step<const NX: usize, const NU: usize, const NG: usize>(
        variables: &[StageVariables<NX, NU, NG>],
        affine: &[StageVector<NX, NU, NG>],
        step: &[StageVector<NX, NU, NG>],
        centering: Centering,
    ) -> f64 {
        let mut worst = StageVector::<NX, NU, NG>::ZERO;
        for ((vars, affine), step) in variables.iter().zip(affine).zip(step) {
            vars.limit_step(step, centering, affine, &mut worst);
        }
        worst.largest()
    }
}

multiversion! {
    /// Takes a step of `length`.
    fn advance<const NX: usize, const NU: usize, const NG: usize>(
        variables: &mut [StageVariables<NX, NU, NG>],
        affine: &[StageVector<NX, NU, NG>],
        step: &[StageVector<NX, NU, NG>],
        centering: Centering,
        length: f64,
    ) {
        for ((vars, affine), step) in variables.iter_mut().zip(affine).zip(step) {
            vars.advance(step, centering, affine, length);
        }
    }
}
