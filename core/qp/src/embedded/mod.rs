//! The embedded solver: a primal-dual interior-point method over the stage structure.
//!
//! Mehrotra's predictor-corrector method on the saddle point of the Lagrangian:
//! `docs/concepts/scp-and-qp.md`. One file per object: bounded variables with their barriers (`bounded`),
//! the variables of one stage (`variables`), KKT residuals (`optimality`), the dual-regularised cost-to-go
//! (`cost_to_go`), the factored Newton system (`riccati`) and its dense kernels (`kernels`), the iteration
//! (`iteration`), the certificate of infeasibility (`infeasible`).

mod bounded;
mod cost_to_go;
mod infeasible;
mod iteration;
mod kernels;
mod leading;
mod optimality;
mod riccati;
mod settings;
mod variables;

pub use iteration::MAX_FACTORISATIONS;
pub use settings::{InteriorPointSettings, MAX_SOLVER_ITERATIONS};

use super::{Qp, QpOutcome, QpSolver, QpStatus, Solution};
use crate::dense::clamp;
use crate::time::Deadline;
use crate::{Checksum, Valid};
use bounded::larger;
use leading::TRANSLATION;
use nalgebra::SMatrix;
use optimality::{Optimality, optimality};
use riccati::Interval;
use variables::{InitialPoint, StageVariables, StageVector, Unusable};

/// Iterations after which a start is given up. Only random QPs and those whose slack is in use ever need
/// a restart.
const AGAIN_BUDGET: u32 = 15;
const COLD_BUDGET: u32 = 25;
const ELASTIC_BUDGET: u32 = 50;

/// Least complementarity of a solution that is re-centred.
const AGAIN_MU: f64 = 1e-4;

/// Most starts of a QP: from the last solution, cold, with slack, conservative.
pub const MAX_STARTS: usize = 4;

/// The embedded solver with all the memory it needs.
///
/// Never allocates, never panics. Cost: an iteration is about
/// `N (6 NX^3 + 14 NX^2 NU + 5 NX NU^2 + 45 NX (NX + NU))` flops, where slack is in use `5 NX^3` more; the planner's
/// QPs take 4 to 15. Memory: [`EmbeddedQp::BYTES`], about `8 N (4 NX^2 + 2 NX NU + NU^2 + 26 NX + 13 NU)`.
#[derive(Clone, Debug)]
pub struct EmbeddedQp<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// The settings once configured; a flag rather than an `Option` keeps fresh storage all zero
    /// bits.
    settings: InteriorPointSettings,
    is_configured: bool,
    /// The current iterate.
    variables: [StageVariables<NX, NU, NG>; N],
    /// The factored Newton system.
    intervals: [Interval<NX, NU>; N],
    initial: [[f64; NX]; NX],
    /// Gradient of the Lagrangian at the iterate.
    gradient: [StageVector<NX, NU, NG>; N],
    /// The predictor (affine) direction and the step.
    affine: [StageVector<NX, NU, NG>; N],
    step: [StageVector<NX, NU, NG>; N],
    /// Number of complementarity pairs, at least one.
    pairs: f64,
    /// How many stages at the end the QP leaves out.
    unused: usize,
    /// Whether the QP is known to have the states and controls of a translation alone, the others being padding.
    is_translation: bool,
    /// Whether the Newton system is of dynamics without slack and regularisation.
    is_rigid: bool,
    /// Whether the last QP since [`QpSolver::reset`] was solved.
    solved: bool,
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> EmbeddedQp<N, NX, NU, NG> {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Storage for any number of solves, with the default settings. Place it in static memory or
    /// on a heap: it is too large for a small stack. All bits are zero, so that static memory costs
    /// no room in an image.
    pub const fn new() -> Self {
        Self {
            settings: InteriorPointSettings::BLANK,
            is_configured: false,
            variables: [StageVariables::ZERO; N],
            intervals: [Interval::ZERO; N],
            initial: [[0.0; NX]; NX],
            gradient: [StageVector::ZERO; N],
            affine: [StageVector::ZERO; N],
            step: [StageVector::ZERO; N],
            pairs: 0.0,
            unused: 0,
            is_translation: false,
            is_rigid: false,
            solved: false,
        }
    }

    /// The settings in force.
    pub fn settings(&self) -> InteriorPointSettings {
        if self.is_configured { self.settings } else { InteriorPointSettings::DEFAULT }
    }

    /// Sets the settings, from the next solve on.
    pub fn configure(&mut self, settings: Valid<InteriorPointSettings>) {
        (self.settings, self.is_configured) = (settings.into_inner(), true);
    }

    /// Initialises the iterate inside the bounds.
    ///
    /// # Errors
    /// Empty bounds, or an invalid QP.
    fn initialise(&mut self, qp: &Qp<N, NX, NU, NG>, point: InitialPoint) -> Result<(), Unusable> {
        let sound =
            qp.defect_penalty > 0.0 && qp.path_penalty >= 0.0 && qp.path_penalty < f64::INFINITY;
        if !(sound && qp.constant.is_finite()) {
            return Err(Unusable::InvalidProblem);
        }
        // A number of iterations that is fixed has to do whether slack is in use or not.
        let elastic = point.elastic || self.settings().fixed_iterations.is_some();
        let point = InitialPoint { elastic, ..point };
        (self.unused, self.is_rigid) = (qp.unused, !elastic);
        let mut pairs = 0;
        for (k, vars) in self.variables.iter_mut().enumerate().take(qp.nodes()) {
            vars.initialise(k, qp, point)?;
            pairs += vars.pairs();
        }
        self.pairs = f64::from(pairs).max(1.0);
        Ok(())
    }

    /// Whether there is code for a translation's size too. It is compiled on x86-64 alone: elsewhere it is dearer
    /// than the work. So it is for other arms than the usual one of three joints (12 states).
    const HAS_TWO_SIZES: bool = cfg!(target_arch = "x86_64") && NX == 12;

    /// Whether products leave the padding of a translation out.
    fn leaves_padding_out(&self) -> bool {
        Self::HAS_TWO_SIZES && self.is_translation
    }

    /// Transposes the QP's matrices and initialises the iterate of its first start.
    ///
    /// # Errors
    /// The status of a QP that has none.
    fn start(&mut self, qp: &Qp<N, NX, NU, NG>) -> Result<(), QpStatus> {
        for (interval, stage) in self.intervals.iter_mut().zip(qp.used()) {
            interval.pack(stage);
        }
        self.is_translation = Self::HAS_TWO_SIZES && TRANSLATION.are_all_of(qp.used());
        self.initialise(qp, InitialPoint::cold(qp)).map_err(|unusable| match unusable {
            Unusable::EmptyBox => QpStatus::Infeasible,
            Unusable::InvalidProblem => QpStatus::NumericalFailure,
        })
    }

    /// Largest KKT residual at the iterate.
    fn residual(&mut self, qp: &Qp<N, NX, NU, NG>) -> f64 {
        self.differentiate(qp);
        self.optimality().residual
    }

    /// KKT residuals at the iterate of the last gradient.
    fn optimality(&self) -> Optimality {
        let nodes = self.nodes();
        optimality(&self.variables[..nodes], &self.gradient, self.pairs)
    }

    /// Number of stages of the QP.
    fn nodes(&self) -> usize {
        N - self.unused.min(N)
    }

    /// The variables of the QP's stages.
    fn used(&self) -> core::slice::Iter<'_, StageVariables<NX, NU, NG>> {
        self.variables[..self.nodes()].iter()
    }

    /// Whether no multiplier of the dynamics is larger than `most`.
    fn multipliers_are_within(&self, most: f64) -> bool {
        self.used().all(|vars| vars.dynamics.value.iter().all(|value| value.abs() <= most))
    }

    /// Copies the iterate to `solution`.
    fn write(&self, solution: &mut Solution<N, NX, NU, NG>) {
        for (k, (vars, gradient)) in self.used().zip(&self.gradient).enumerate() {
            solution.x[k].data.0[0] = vars.x.value;
            solution.u[k].data.0[0] = vars.u.value;
            solution.defect_multiplier[k].data.0[0] = vars.dynamics.value;
            solution.path_multiplier[k].data.0[0] = vars.path.value;
            // A fix's multiplier is what balances the gradient.
            let bounds = vars.x.multipliers();
            for i in 0..NX {
                let is_fixed = vars.free_x.is_fixed(i);
                solution.bound_multiplier_x[k][i] =
                    if is_fixed { -gradient.x[i] } else { bounds[i] };
            }
            let bounds = vars.u.multipliers();
            for i in 0..NU {
                let is_fixed = vars.free_u.is_fixed(i);
                solution.bound_multiplier_u[k][i] =
                    if is_fixed { -gradient.u[i] } else { bounds[i] };
            }
        }
        solution.clear_from(self.nodes());
    }

    /// Iterates from the current iterate and copies the result to `solution`. Restarts where that
    /// fails, or has a multiplier beyond the price of slack: with slack, then far from the bounds too.
    /// Where no start comes to its end, the best one of reduced accuracy counts.
    fn finish(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        again: bool,
        deadline: &Deadline,
    ) -> QpOutcome {
        let most = self.settings().max_iterations;
        let budget = if again { AGAIN_BUDGET } else { COLD_BUDGET };
        let mut outcome = self.run(qp, most.min(budget), deadline);
        // Error of the solution that is kept.
        let mut least = None;
        let restarts = [
            (InitialPoint::cold(qp), COLD_BUDGET),
            (InitialPoint::ELASTIC, ELASTIC_BUDGET),
            (InitialPoint::CONSERVATIVE, u32::MAX),
        ];
        // Bound: starts.
        for (point, budget) in restarts.into_iter().skip(if again { 0 } else { 1 }) {
            let left = most.saturating_sub(outcome.iterations);
            let fixed = self.settings().fixed_iterations.is_some();
            if outcome.status.is_final() || fixed || left == 0 {
                break;
            }
            if self.is_better(qp, outcome.status, least) {
                self.write(solution);
                least = Some(self.error(qp));
            }
            if self.initialise(qp, point).is_err() {
                break;
            }
            let spent = outcome.iterations;
            outcome = self.run(qp, left.min(budget), deadline);
            outcome.iterations += spent;
        }
        self.solved = outcome.status.is_usable();
        if least.is_none() || outcome.status.is_final() || self.is_better(qp, outcome.status, least)
        {
            self.write(solution);
            return outcome;
        }
        // The iterate is not the solution that is kept: the next solve must not go on from it.
        self.solved = false;
        QpOutcome { status: QpStatus::ReducedAccuracy, ..outcome }
    }

    /// Whether the iterate, where a start ended with `status`, is a solution of less error than `least`.
    fn is_better(&self, qp: &Qp<N, NX, NU, NG>, status: QpStatus, least: Option<f64>) -> bool {
        let is_priced = self.multipliers_are_within(qp.defect_penalty);
        status.is_usable() && is_priced && least.is_none_or(|least| self.error(qp) < least)
    }

    /// Residuals of the iterate over what is asked for.
    fn error(&self, qp: &Qp<N, NX, NU, NG>) -> f64 {
        let at = self.optimality();
        let residual = at.residual / self.tolerance(qp);
        larger(residual, at.complementarity / self.complementarity(qp)) / at.scale
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> EmbeddedQp<N, NX, NU, NG> {
    /// Overwrites all working memory with `value`.
    pub fn fill(&mut self, value: f64) {
        let entries = StageVector {
            x: [value; NX],
            u: [value; NU],
            dynamics: [value; NX],
            path: [value; NG],
        };
        self.variables.fill(StageVariables::filled(value));
        self.intervals.fill(Interval::filled(value));
        self.initial = [[value; NX]; NX];
        for all in [&mut self.gradient, &mut self.affine, &mut self.step] {
            all.fill(entries);
        }
        (self.pairs, self.solved) = (value, true);
        self.is_translation = value > 0.0;
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Default
    for EmbeddedQp<N, NX, NU, NG>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> QpSolver<N, NX, NU, NG>
    for EmbeddedQp<N, NX, NU, NG>
{
    fn reset(&mut self) {
        self.solved = false;
    }

    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.solved = false;
        match self.start(qp) {
            Ok(()) => self.finish(qp, solution, false, deadline),
            Err(status) => QpOutcome { status, iterations: 0 },
        }
    }

    /// Re-centres the last solution and goes on from it, with the matrices already transposed.
    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        if !self.solved {
            return self.solve(qp, solution, deadline);
        }
        let mu = clamp(0.01 * self.residual(qp), AGAIN_MU, InitialPoint::ELASTIC.mu);
        let nodes = self.nodes();
        for vars in &mut self.variables[..nodes] {
            vars.recentre(mu);
        }
        self.finish(qp, solution, true, deadline)
    }

    /// The Riccati gain of the last iteration, barriers included; `None` where the last QP was not
    /// solved.
    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        let interval = self.intervals.get(k).filter(|_| k + 1 < self.nodes() && self.solved)?;
        Some(SMatrix::from_fn(|i, j| -interval.gain[i][j]))
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.bytes(b"embedded interior point 4");
        self.settings().identify(checksum);
    }
}

#[cfg(test)]
mod tests;
