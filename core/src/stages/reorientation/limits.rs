//! Limits and fixed values of a state at a node: joint stops and rates behind a given start, the arm's
//! preset, the terminal state.

use super::Reorientation;
use crate::dynamics::State;
use crate::executor::ForkJoin;
use nalgebra::Vector3;

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Angle limits of joint `i` in planning at node `k`, lower and upper [rad]: less the margin, but not
    /// within the mission's own angles. Behind a given start the margin fades in; behind one beyond a
    /// stop there is no limit.
    pub(super) fn joint_limits(&self, k: usize, i: usize) -> (f64, f64) {
        let (s, margin) = (&self.mission.servicer, self.margins.joint_angle_rad);
        let (least, most) = (s.min_joint_angle_rad[i], s.max_joint_angle_rad[i]);
        let (initial, capture) = (s.initial_joint_angle_rad[i], s.capture_joint_angle_rad[i]);
        let (lower, upper) = match self.has_margins {
            true => (
                (least + margin).min(initial).min(capture),
                (most - margin).max(initial).max(capture),
            ),
            false => (least, most),
        };
        match self.share_of_start(k) {
            Some(_) if self.recovery.joint[i] => (f64::NEG_INFINITY, f64::INFINITY),
            // An arm that brakes for the margin and is beside its plan needs all there is.
            Some(share) => (
                lower - (lower - least).max(0.0) * share * (2.0 - share),
                upper + (most - upper).max(0.0) * share * (2.0 - share),
            ),
            None => (lower, upper),
        }
    }

    /// Rate limit of joint `i` in planning at node `k` [rad/s]: less the margin. A given start beyond that
    /// is led back at an even pace.
    pub(super) fn joint_rate_limit(&self, k: usize, i: usize) -> f64 {
        let margin = if self.has_margins { self.margins.joint_rate } else { 0.0 };
        let limit = self.mission.servicer.joint_rate_limit_rad_s[i] * (1.0 - margin);
        match self.share_of_start(k) {
            Some(share) => limit + (self.initial.joint_rate[i].abs() - limit).max(0.0) * share,
            None => limit,
        }
    }

    /// Share of a given start's excess that node `k` may still have; `None` once it is led back.
    pub(super) fn share_of_start(&self, k: usize) -> Option<f64> {
        let until = self.grid.recovery_node();
        (self.is_given && k < until).then(|| 1.0 - k as f64 / until as f64)
    }

    /// Whether an equality constraint fixes component `i` of the state at node `k`.
    pub(super) fn is_fixed(&self, k: usize, i: usize) -> bool {
        let (angle, rate) = ((3..3 + NL).contains(&i), i >= 6 + NL);
        let (after, last) = (k >= self.preset, k == self.last());
        k == 0
            || (angle && if self.is_held { after } else { k == self.preset })
            || (rate && if self.is_held { last } else { after })
            || (last && (i == 1 || i == 2 || (3 + NL..6 + NL).contains(&i)))
            || (last && i == 0 && self.terminal.roll.is_some())
    }

    /// Sets the arm of `state` at node `k` to the values that are fixed there.
    pub(super) fn fix_arm(&self, k: usize, state: &mut State<NL>) {
        if self.is_fixed(k, 3) {
            state.joint_angle = self.mission.servicer.capture_joint_angle_rad;
        }
        if self.is_fixed(k, 6 + NL) {
            state.joint_rate.fill(0.0);
        }
    }

    /// Sets `state` at the last node to the values that are fixed there; returns its turn [rad, RTN].
    pub(super) fn fix_terminal(&self, state: &mut State<NL>) -> Vector3<f64> {
        state.rate = self.terminal_rate;
        let (attitude, turn) = self.terminal.fixed(&state.attitude);
        state.attitude = attitude;
        turn
    }
}
