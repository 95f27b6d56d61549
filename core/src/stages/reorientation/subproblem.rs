//! Fills a subproblem's stages, on one core or two.

use super::linearise::Inputs;
use super::{Mode, Reorientation, ReorientationTrajectory};
use crate::dynamics::Integrator;
use crate::executor::ForkJoin;
use crate::stages::size::NG;
use nalgebra::SVector;
use remora_qp::{Convexification, Qp, QpStage, Solution};

/// Nodes that one core linearises while the other convexifies those after them.
const BATCH: usize = 6;

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Fills the whole subproblem with the Lagrangian's Hessian and convexifies it.
    ///
    /// The convexification runs from the last node to the first on one core, while the other linearises
    /// the nodes before, a batch at a time. It is fast except at indefinite curvature; the first core's
    /// spare time, counted in units of work rather than read from a clock, goes into linearisation too.
    pub(super) fn linearise_convex(
        &self,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: &Solution<N, NX, NU, NG>,
        convex: &SVector<f64, NU>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        let linearise =
            |k, stage: &mut QpStage<NX, NU, NG>| self.linearise_at(k, z, Some(multipliers), stage);
        let Some((last, stages)) = qp.used_mut().split_last_mut() else { return };
        linearise(self.last(), last);
        let mut convexification = Convexification::new(last, convex);
        // Nodes from `filled` on are linearised, those from `swept` on also convexified.
        let (mut filled, mut swept) = (stages.len(), stages.len());
        // Bound: constant, nodes in pieces.
        while swept > 0 {
            let from = filled.saturating_sub(BATCH);
            let parts = stages.get_disjoint_mut([0..from, from..filled, filled..swept]);
            let Ok([before, batch, ready]) = parts else { return };
            let budget = match filled - from {
                0 => usize::MAX,
                nodes => nodes * self.node_work(),
            };
            let sweep_and_help = || {
                let (done, work) =
                    convexification.advance(filled, ready, budget, |k, i| self.is_fixed(k, i));
                let help = budget.saturating_sub(work) / self.node_work();
                let helped = before.iter_mut().enumerate().rev().take(help);
                (
                    done,
                    helped.map(|(k, stage)| linearise(k, stage)).take_while(|done| *done).count(),
                )
            };
            let fill = || {
                (from..).zip(batch).all(|(k, stage)| linearise(k, stage));
            };
            let ((done, helped), ()) = self.executor.join(sweep_and_help, fill);
            filled = from.saturating_sub(helped);
            swept = swept.saturating_sub(done);
        }
        qp.constant += convexification.finish().0;
    }

    /// Time of a node's linearisation, where its convexification takes 1.
    fn node_work(&self) -> usize {
        match self.stepping.integrator {
            Integrator::Euler => 5,
            Integrator::Rk4 { substeps } => substeps.saturating_mul(20).max(1),
        }
    }

    /// Fills `stage` of node `k`, without convexification. Returns false once the deadline has passed;
    /// the stage is then not used.
    pub(super) fn linearise_at(
        &self,
        k: usize,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        stage: &mut QpStage<NX, NU, NG>,
    ) -> bool {
        *stage = QpStage::ZERO;
        if self.stepping.deadline.has_passed() {
            return false;
        }
        let (Some(state), Some(control)) = (z.states.get(k), z.controls.get(k)) else {
            return true;
        };
        self.fill_path_constraints(k, state, stage);
        if let Some(last) = multipliers {
            self.add_pointing_curvature(k, state, last.path_multiplier[k][0], stage);
            self.regularise_active_set(k, state, last, stage);
        }
        let Some(at) = z.states.get(k + 1).filter(|_| k < self.last()) else { return true };
        let inputs = Inputs { state, control, force: &self.translation.force[k] };
        let next = self.linearise_interval(k, inputs, at, stage);
        if let Some(last) = multipliers {
            self.add_curvature(k, inputs, &next, &last.defect_multiplier[k], stage);
        }
        self.apply_chart(k, &next, at, stage);
        if self.counts_motion() && self.mode == Mode::Optimal {
            self.add_motion_cost(state, stage);
        }
        let control = Self::stacked_control(control);
        for i in 0..NU {
            if self.mode == Mode::Optimal {
                stage.gradient_u[i] = self.marginal_cost(i, control[i]) * self.scale_u[i];
            }
        }
        true
    }
}
