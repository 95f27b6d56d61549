//! The iteration: predictor, corrector, step.

use super::boxed::Aim;
use super::node::{Entries, Node};
use super::optimality::{Optimality, differentiate};
use super::{EmbeddedQp, infeasible, riccati};
use crate::dense::clamp;
use crate::time::Deadline;
use crate::{Qp, QpOutcome, QpStatus};

/// Share of the way to the nearest bound that a step may go.
const FRACTION: f64 = 0.995;

/// A step shorter than this is blocked: by a few pairs that are much nearer their bounds than the
/// rest. One that brings all to the same product is tried instead.
const SHORT: f64 = 0.3;

/// Products up to this are enough once residuals grow again: where rounding shows, smaller ones
/// make it worse.
const ENOUGH: f64 = 1e-11;

/// Steps shorter than this lead nowhere.
const SHORTEST: f64 = 1e-10;

/// Compliance added to the dynamics (a proximal term on their multipliers): keeps the costs-to-go
/// below its inverse and so the rounding of multipliers below the tolerance. The next residual
/// sees what it leaves undone.
const COMPLIANCE: f64 = 1e-8;

/// Factorisations tried, each with a hundred times the compliance of the one before.
pub const ATTEMPTS: usize = 3;

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> EmbeddedQp<N, NX, NU, NR> {
    /// Iterates to the end.
    pub(super) fn run(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        most: u32,
        deadline: &Deadline,
    ) -> QpOutcome {
        let settings = self.settings();
        let limit = settings.fixed_iterations.unwrap_or(most);
        let (mut iterations, mut before) = (0, f64::INFINITY);
        // Bound: solver_iterations.
        loop {
            differentiate(qp, &self.nodes, &self.intervals, &mut self.gradient);
            let at = Optimality::of(&self.nodes, &self.gradient, self.pairs);
            let grows = at.residual > before && at.residual > 0.3 * settings.tolerance;
            let solved = at.is_within(settings.tolerance, settings.complementarity)
                || (grows && at.is_within(settings.tolerance, ENOUGH));
            let free = settings.fixed_iterations.is_none();
            let stop = if !at.is_finite() {
                Some(QpStatus::NumericalFailure)
            } else if solved && (free || iterations >= limit) {
                Some(QpStatus::Solved)
            } else if iterations >= limit {
                Some(QpStatus::IterationLimit)
            } else if free && grows && at.product <= settings.complementarity {
                // Only rounding is left to be reduced.
                Some(QpStatus::Stalled)
            } else if deadline.has_passed() {
                Some(QpStatus::TimeLimit)
            } else {
                iterations += 1;
                self.iterate(qp, at.mean, at.residual).err()
            };
            before = at.residual;
            if let Some(status) = stop {
                return QpOutcome { status: self.judge(qp, status, at), iterations };
            }
        }
    }

    /// What an iteration that can't go on is worth. `at` is that of the iterate.
    fn judge(&self, qp: &Qp<N, NX, NU, NR>, status: QpStatus, at: Optimality) -> QpStatus {
        match status {
            QpStatus::Solved | QpStatus::TimeLimit => status,
            _ if at.is_within(self.settings().reduced, self.settings().reduced) => {
                QpStatus::ReducedAccuracy
            }
            _ if infeasible::is_proved(qp, &self.nodes, &self.intervals) => QpStatus::Infeasible,
            _ => status,
        }
    }

    /// One iteration.
    ///
    /// # Errors
    /// The reason where the iterate could not be moved; it is then left as it was.
    fn iterate(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        mean: f64,
        residual: f64,
    ) -> Result<(), QpStatus> {
        self.factorise(qp)?;
        self.direct(qp, Aim::AFFINE);
        let length = self.longest(Aim::AFFINE).min(1.0);
        let mut sum = Entries::<NX, NU, NR>::ZERO;
        for (node, affine) in self.nodes.iter().zip(&self.affine) {
            node.add_products(affine, Aim::AFFINE, affine, length, &mut sum);
        }
        // Mehrotra's rule; no lower than needed, where only rounding would be gained.
        let reached = clamp(sum.sum() / self.pairs / mean, 0.0, 1.0);
        let least = 0.1 * self.settings().complementarity;
        let product = (reached * reached * reached * mean).max(least);
        let mut aim = Aim { product, second_order: 1.0 };
        self.direct(qp, aim);
        let mut length = (FRACTION * self.longest(aim)).min(1.0);
        if length < SHORT {
            let central = Aim { product: mean.max(0.1 * residual), second_order: 0.0 };
            self.direct(qp, central);
            let other = (FRACTION * self.longest(central)).min(1.0);
            if other > length {
                (aim, length) = (central, other);
            } else {
                self.direct(qp, aim);
            }
        }
        // Written so that NaN fails.
        if !(length > SHORTEST) {
            return Err(QpStatus::Stalled);
        }
        for ((node, affine), step) in self.nodes.iter_mut().zip(&self.affine).zip(&self.step) {
            node.advance(step, aim, affine, length);
        }
        Ok(())
    }

    fn factorise(&mut self, qp: &Qp<N, NX, NU, NR>) -> Result<(), QpStatus> {
        let mut compliance = COMPLIANCE;
        // Bound: factorisations.
        for _ in 0..ATTEMPTS {
            let Self { nodes, intervals, initial, .. } = self;
            if riccati::factorise(&qp.stages, nodes, compliance, intervals, initial).is_ok() {
                return Ok(());
            }
            compliance *= 100.0;
        }
        Err(QpStatus::NumericalFailure)
    }

    /// Writes the direction of `aim`: into `affine` where it is that, else into `step`.
    fn direct(&mut self, qp: &Qp<N, NX, NU, NR>, aim: Aim) {
        let Self { nodes, intervals, initial, gradient, affine, step, .. } = self;
        let condensed = |k: usize, node: &Node<NX, NU, NR>, affine: &_| {
            let mut b = gradient.get(k).copied().unwrap_or(Entries::ZERO);
            b.add_push(&node.push(aim, affine));
            b
        };
        if aim.product == 0.0 {
            let right = |k: usize, node: &_| condensed(k, node, &Entries::ZERO);
            riccati::direction(&qp.stages, nodes, intervals, initial, right, affine);
        } else {
            let right =
                |k: usize, node: &_| condensed(k, node, affine.get(k).unwrap_or(&Entries::ZERO));
            riccati::direction(&qp.stages, nodes, intervals, initial, right, step);
        }
    }

    /// Longest step of `aim` that keeps all pairs positive; may exceed one.
    fn longest(&self, aim: Aim) -> f64 {
        let mut worst = Entries::<NX, NU, NR>::ZERO;
        for ((node, affine), step) in self.nodes.iter().zip(&self.affine).zip(&self.step) {
            let step = if aim.product == 0.0 { affine } else { step };
            node.limit_step(step, aim, affine, &mut worst);
        }
        1.0 / worst.largest().max(f64::MIN_POSITIVE)
    }
}
