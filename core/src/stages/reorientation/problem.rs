//! Stage 2 as the SCP solver sees it.

use super::rollout::RateOffset;
use super::{Mode, Reorientation, ReorientationTrajectory};
use crate::dynamics::{Control, Integrator};
use crate::executor::{ForkJoin, Sequential};
use crate::math::quaternion;
use crate::scp::{Problem, Residuals};
use crate::stages::size::NG;
use crate::stages::worse;
use nalgebra::{SMatrix, SVector};
use remora_qp::dense::clamp;
use remora_qp::{Qp, QpStage, Solution};

/// Least curvature of the controls relative to the largest: keeps steps finite where torques are
/// almost free.
const LEAST_CURVATURE: f64 = 1e-3;

/// Fraction of each tolerance that the SCP solver may use; the verifier has the rest.
const MARGIN: f64 = 0.5;

/// Weight of the proximal term on the joint angles (scaled) in the first iterations. Large first steps
/// end in poor local minima: without it costs are 10 % higher in the mean.
const PROXIMAL: f64 = 3e-3;

/// Most rollouts of a step: the second corrects the terminal pose error of the first, where that counts.
const ROLLOUTS: usize = 2;

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Problem<N, NX, NU, NG> for Reorientation<'_, P, N, NL, NX, NU>
{
    type Trajectory = ReorientationTrajectory<N, NL>;

    fn project(&self, z: &mut Self::Trajectory) {
        let servicer = &self.mission.servicer;
        for (k, state) in z.states.iter_mut().enumerate().take(self.nodes()) {
            for i in 0..NL {
                let (lower, upper) = self.joint_limits(k, i);
                state.joint_angle[i] = clamp(state.joint_angle[i], lower, upper);
                let limit = self.joint_rate_limit(k, i);
                state.joint_rate[i] = clamp(state.joint_rate[i], -limit, limit);
            }
            self.fix_arm(k, state);
            state.attitude = quaternion::normalized(&state.attitude);
        }
        z.states[0] = self.initial;
        self.fix_terminal(&mut z.states[self.last()]);
        for control in &mut z.controls {
            *control = control.within_limits(servicer);
        }
        z.controls[self.last()] = Control::ZERO;
    }

    fn linearise(
        &mut self,
        z: &Self::Trajectory,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        qp.defect_penalty = 1.0;
        qp.constant = 0.0;
        qp.unused = N - self.nodes();
        let own = SVector::<f64, NU>::from_fn(|i, _| {
            let unit = self.scale_u[i] / self.cost_unit[i];
            2.0 * self.cost_scale * self.weight(i) * unit * unit
        });
        let convex = own.map(|c| c.max(LEAST_CURVATURE * own.max()));
        if let Some(multipliers) = multipliers
            && self.mode == Mode::Optimal
        {
            return self.linearise_convex(z, multipliers, &convex, qp);
        }
        let middle = self.nodes() / 2;
        let (early, late) = qp.stages[..self.nodes()].split_at_mut(middle);
        let half = |first: usize, stages: &mut [QpStage<NX, NU, NG>]| {
            for (k, stage) in (first..).zip(stages) {
                if !self.linearise_at(k, z, None, stage) {
                    return;
                }
                stage.hessian_uu = SMatrix::from_diagonal(&convex);
                for i in 3..3 + NL {
                    stage.hessian_xx[(i, i)] = PROXIMAL;
                }
            }
        };
        self.executor.join(|| half(0, early), || half(middle, late));
    }

    fn bound(&self, z: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NG>) {
        for (k, stage) in qp.stages.iter_mut().enumerate().take(self.nodes()) {
            let state = &z.states[k];
            for i in 0..NX {
                let (angle, reach) = (self.scale_x[0], radius / self.scale_x[0]);
                let (lower, upper) = match i {
                    _ if self.is_fixed(k, i) => (0.0, 0.0),
                    i if i < 3 => (-reach, reach),
                    i if i < 3 + NL => {
                        let at = state.joint_angle[i - 3];
                        let (lower, upper) = self.joint_limits(k, i - 3);
                        (((lower - at) / angle).max(-reach), ((upper - at) / angle).min(reach))
                    }
                    i if i < 6 + NL => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => {
                        let (at, limit) =
                            (state.joint_rate[i - 6 - NL], self.joint_rate_limit(k, i - 6 - NL));
                        let scale = self.scale_x[i];
                        ((-limit - at) / scale, (limit - at) / scale)
                    }
                };
                stage.lower_x[i] = lower;
                stage.upper_x[i] = upper;
            }
            let control = Self::stacked_control(&z.controls[k]);
            for i in 0..NU {
                let limit = Self::max_torque(self.mission, i);
                stage.lower_u[i] = (-limit - control[i]) / self.scale_u[i];
                stage.upper_u[i] = (limit - control[i]) / self.scale_u[i];
            }
        }
    }

    fn retract(
        &self,
        from: &Self::Trajectory,
        qp: &Qp<N, NX, NU, NG>,
        step: &Solution<N, NX, NU, NG>,
        to: &mut Self::Trajectory,
    ) {
        // Each rollout starts from the controls of the last.
        *to = *from;
        let mut offset = RateOffset::<NL>::ZERO;
        for _ in 0..ROLLOUTS {
            let gap = self.rollout(from, qp, step, &offset, to);
            if self.is_ignored(&gap) {
                break;
            }
            offset.turn -= gap.turn;
            offset.joint -= gap.joint;
        }
    }

    fn residuals(&self, z: &Self::Trajectory, out: &mut Residuals<N, NX, NG>) {
        self.begin_residuals(z, out);
        let middle = self.nodes() / 2;
        let (early_defects, late_defects) = out.defect.split_at_mut(middle);
        let (early_paths, late_paths) = out.path.split_at_mut(middle);
        let early = || self.residuals_from(0, z, early_defects, early_paths);
        let late = || self.residuals_from(middle, z, late_defects, late_paths);
        match self.stepping.integrator {
            // Too little work for two cores.
            Integrator::Euler => Sequential.join(early, late),
            Integrator::Rk4 { .. } => self.executor.join(early, late),
        };
    }

    fn violation(&self, residuals: &Residuals<N, NX, NG>) -> f64 {
        let mut worst = 0.0;
        for (k, (row, defect)) in residuals.path.iter().zip(&residuals.defect).enumerate() {
            let row = row.component_div(&self.path_tolerances(k));
            worst = row.iter().fold(worst, |worst, r| worse(worst, *r));
            let defect = defect.component_mul(&self.scale_x).component_div(&self.tolerance_x);
            worst = defect.iter().fold(worst, |worst, d| worse(worst, d.abs()));
        }
        worst / MARGIN
    }

    fn step_length(&self, step: &Solution<N, NX, NU, NG>) -> f64 {
        let angles =
            |x: &SVector<f64, NX>| x.iter().take(3 + NL).fold(0.0f64, |m, v| m.max(v.abs()));
        step.x.iter().map(angles).fold(0.0, f64::max) * self.scale_x[0]
    }

    fn number(motion: &mut Self::Trajectory, k: usize, element: usize) -> Option<&mut f64> {
        motion.number(k, element)
    }
}
