//! The retraction of Stage 2: a rollout along the dynamics.

use super::{NG, Reorientation, ReorientationTrajectory};
use crate::dynamics::{Control, Integrator, State, Stepping, Transition};
use crate::executor::ForkJoin;
use crate::math::quaternion;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::clamp;
use remora_qp::{Qp, Solution};

/// Gain of the rates on the drift from the planned pose. A gain of one is deadbeat for Euler and rings
/// for RK4, whose zero-order hold has a zero on the unit circle.
const TRACKING_GAIN: f64 = 0.6;

/// A change of the terminal pose, spread over the rates of the whole horizon.
pub(super) struct RateOffset<const NL: usize> {
    /// Turn of the bus, RTN [rad].
    pub turn: Vector3<f64>,
    /// Joint angles [rad].
    pub joint: SVector<f64, NL>,
}

impl<const NL: usize> RateOffset<NL> {
    /// No change.
    pub const ZERO: Self = Self {
        turn: Vector3::new(0.0, 0.0, 0.0),
        joint: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };
}

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Blending weight of a pose offset in the rates of node `k`, of those free up to node `end` [1/s]:
    /// a parabola, so that it starts and ends without a jump.
    fn blending_weight(&self, k: usize, end: usize) -> f64 {
        if k == 0 || k >= end {
            return 0.0;
        }
        let (k, n) = (k as f64, end as f64);
        // The sum of k (n - k) from 1 to n - 1 is n (n^2 - 1) / 6.
        6.0 * k * (n - k) / (n * (n * n - 1.0)) / self.stepping.dt
    }

    /// Share of a pose offset that the blended rates have made up at node `k`: the integral of
    /// [`Self::blending_weight`], by the rule that the integrator integrates rates by.
    fn blending_share(&self, k: usize, end: usize) -> f64 {
        if k == 0 || k >= end {
            return if k == 0 { 0.0 } else { 1.0 };
        }
        // The sum of j (n - j) from 1 to k - 1 is k (k - 1) (3 n - 2 k + 1) / 6.
        let (j, n) = (k as f64, end as f64);
        let before = j * (j - 1.0) * (3.0 * n - 2.0 * j + 1.0) / (n * (n * n - 1.0));
        match self.stepping.integrator {
            Integrator::Euler => before,
            Integrator::Rk4 { .. } => {
                before + 0.5 * self.stepping.dt * self.blending_weight(k, end)
            }
        }
    }

    /// Drift of `state` at node `k` from the pose that `step` and `offset` plan.
    fn drift(
        &self,
        k: usize,
        from: &ReorientationTrajectory<N, NL>,
        step: &Solution<N, NX, NU, NG>,
        offset: &RateOffset<NL>,
        state: &State<NL>,
    ) -> RateOffset<NL> {
        let d = step.x[k].component_mul(&self.scale_x);
        let turn = self.axes(k) * Vector3::new(d[0], d[1], d[2]);
        let planned = quaternion::product(&quaternion::exp(&turn), &from.states[k].attitude);
        let turned = offset.turn * self.blending_share(k, self.last());
        let joint = from.states[k].joint_angle + offset.joint * self.blending_share(k, self.preset);
        RateOffset {
            turn: quaternion::difference(&state.attitude, &planned) - turned,
            joint: SVector::from_fn(|i, _| state.joint_angle[i] - joint[i] - d[3 + i]),
        }
    }

    /// Rolls the planned rates of `step` out through the non-linear dynamics; returns the error at the
    /// fixed poses. On entry `to` is a near trajectory, whose controls initialise the new ones.
    ///
    /// Inverse-dynamics tracking: at each node the control is the one that reaches the planned rates
    /// (less the subproblem's slack), and the next state is where it leads. Defects remain only where a
    /// state is fixed or a torque limit is active; there the trajectory goes on as planned, so that one
    /// weak interval does not spoil the later ones.
    pub(super) fn rollout(
        &self,
        from: &ReorientationTrajectory<N, NL>,
        qp: &Qp<N, NX, NU, NG>,
        step: &Solution<N, NX, NU, NG>,
        offset: &RateOffset<NL>,
        to: &mut ReorientationTrajectory<N, NL>,
    ) -> RateOffset<NL> {
        let mut gap = RateOffset::<NL>::ZERO;
        let mut known = to.states[0];
        to.states[0] = from.states[0];
        for k in 0..self.last() {
            // The result is not used after the deadline.
            if self.stepping.deadline.has_passed() {
                return gap;
            }
            let slack = qp.slack(step, k).component_mul(&self.scale_x);
            let (rate, joint_rate) = self.planned_rates(k, from, step, offset, &to.states[k]);
            let goal = (
                &Vector3::from_fn(|i, _| rate[i] - slack[3 + NL + i]),
                &SVector::<f64, NL>::from_fn(|i, _| joint_rate[i] - slack[6 + NL + i]),
            );
            let transition =
                Transition { state: &known, control: &to.controls[k], reached: &to.states[k + 1] };
            let (state, force) = (&to.states[k], &self.translation.force[k]);
            let tracked = self
                .body
                .track_rates(&self.stepping, state, goal, transition, force)
                .filter(|(_, next)| next.is_finite());
            // A diverged search is discarded for the control of the last trajectory.
            let control = tracked.map_or(to.controls[k], |(control, _)| control);
            let control = control.within_limits(&self.mission.servicer);
            let Stepping { integrator, dt, .. } = self.stepping;
            let mut next = match tracked {
                Some((_, next)) => next,
                None => self.body.step(integrator, dt, state, &control, force),
            };
            self.add_slack(k, &slack, &mut next);
            self.project_state(k + 1, &mut next, &mut gap);
            known = to.states[k + 1];
            to.states[k + 1] = next;
            to.controls[k] = control;
        }
        to.controls[self.last()] = Control::ZERO;
        gap
    }

    /// Rates of bus and joints at node `k + 1` [rad/s] that track `step` from `state` at node `k`.
    fn planned_rates(
        &self,
        k: usize,
        from: &ReorientationTrajectory<N, NL>,
        step: &Solution<N, NX, NU, NG>,
        offset: &RateOffset<NL>,
        state: &State<NL>,
    ) -> (Vector3<f64>, SVector<f64, NL>) {
        let at = &from.states[k + 1];
        let d = step.x[k + 1].component_mul(&self.scale_x);
        let drift = self.drift(k, from, step, offset, state);
        let turning = match k + 1 < self.last() {
            true => {
                offset.turn * self.blending_weight(k + 1, self.last())
                    - drift.turn * (TRACKING_GAIN / self.stepping.dt)
            }
            false => Vector3::zeros(),
        };
        let bending = match k + 1 < self.preset {
            true => {
                offset.joint * self.blending_weight(k + 1, self.preset)
                    - drift.joint * (TRACKING_GAIN / self.stepping.dt)
            }
            false => SVector::zeros(),
        };
        let rate = Vector3::from_fn(|i, _| at.rate[i] + d[3 + NL + i] + turning[i]);
        let joint_rate = SVector::<f64, NL>::from_fn(|i, _| {
            let limit = self.joint_rate_limit(k + 1, i);
            clamp(at.joint_rate[i] + d[6 + NL + i] + bending[i], -limit, limit)
        });
        (rate, joint_rate)
    }

    /// Adds the subproblem's slack of the dynamics to the state at node `k + 1`.
    fn add_slack(&self, k: usize, slack: &SVector<f64, NX>, next: &mut State<NL>) {
        let turn = self.axes(k + 1) * Vector3::new(slack[0], slack[1], slack[2]);
        next.attitude = quaternion::product(&quaternion::exp(&turn), &next.attitude);
        for i in 0..NL {
            let limit = self.joint_rate_limit(k + 1, i);
            next.joint_angle[i] += slack[3 + i];
            next.joint_rate[i] = clamp(next.joint_rate[i] + slack[6 + NL + i], -limit, limit);
        }
        for i in 0..3 {
            next.rate[i] += slack[3 + NL + i];
        }
    }

    /// Projects the state at node `k` onto fixed values and joint limits; writes the error at fixed
    /// poses to `gap`.
    fn project_state(&self, k: usize, state: &mut State<NL>, gap: &mut RateOffset<NL>) {
        if k == self.preset {
            gap.joint = state.joint_angle - self.mission.servicer.capture_joint_angle_rad;
        }
        self.fix_arm(k, state);
        if k == self.last() {
            gap.turn = -self.fix_terminal(state);
        }
        for i in 0..NL {
            let (lower, upper) = self.joint_limits(k, i);
            state.joint_angle[i] = clamp(state.joint_angle[i], lower, upper);
        }
        state.attitude = quaternion::normalized(&state.attitude);
    }
}
