//! The plan in force as the initial guess of the next one.

use crate::dynamics::{Control, State};
use crate::math::quaternion;
use crate::model::{Grid, MIN_NODES};
use crate::stages::{LINKS, NODES, ReorientationTrajectory};
use nalgebra::{SVector, Vector3};
use remora_qp::dense::{clamp, count, divisor};

/// Share of an interval that is rounding.
const ROUNDING: f64 = 1e-9;

/// A plan in force: bus and arm over its horizon, for as long as the next plan is made.
///
/// ```
/// use remora_core::prelude::*;
///
/// let mut planner = Box::new(Planner::new());
/// let mission = Mission::default().validated()?;
/// let options = Options::builder().mode(Mode::Feasible).build()?;
/// let scenario = Scenario::default().validated()?;
/// let plan = planner.plan(&mission, &scenario, &options)?;
/// let nominal = plan.nominal();
/// // 300 s later, a little beside the plan: position and velocity measured, bus and arm as planned.
/// let later = nominal.at(300.0);
/// let (duration, nodes) = nominal.left(300.0);
/// assert_eq!((duration, nodes), (900.0, 46));
/// let scenario = Scenario {
///     position: Vector3::new(0.01, 0.0, 3.6),
///     velocity: Vector3::new(0.0, 1.0e-3, -4.0e-3),
///     start: later.as_start(),
///     duration: Some(duration),
///     nodes: Some(nodes),
///     ..Scenario::default()
/// }
/// .validated()?;
/// let guess = InitialGuess::Nominal { plan: &nominal, elapsed: 300.0 };
/// let options = Options::builder().mode(Mode::Feasible).initial_guess(guess).build()?;
/// assert!(planner.plan(&mission, &scenario, &options)?.is_verified());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal<const NL: usize = LINKS> {
    /// Bus and arm at the nodes, of which the first [`Nominal::nodes`] are the plan's.
    pub reorientation: ReorientationTrajectory<NODES, NL>,
    /// Its nodes, at least two.
    pub nodes: usize,
    /// Time from its first node to its last [s].
    pub duration: f64,
}

impl<const NL: usize> Nominal<NL> {
    pub(crate) fn interval(&self) -> f64 {
        self.duration / self.last() as f64
    }

    /// The last node, not the first.
    fn last(&self) -> usize {
        self.nodes.clamp(2, NODES) - 1
    }

    /// Time of node `k` [s].
    pub fn time(&self, k: usize) -> f64 {
        self.duration * k as f64 / self.last() as f64
    }

    /// Rest of the plan `elapsed` [s] after its start: the time [s], and nodes that are no farther apart
    /// than its own. Both are meant for the scenario that plans again, see [`Nominal`].
    pub fn left(&self, elapsed: f64) -> (f64, usize) {
        let time = f64::max(self.duration - elapsed, 0.0);
        // Saturates, and makes nothing of NaN.
        let intervals = count(libm::ceil(time / self.interval() - ROUNDING));
        (time, intervals.saturating_add(1).clamp(MIN_NODES, NODES))
    }

    /// Interval that holds `time`, and the share of it that has passed by then.
    pub(crate) fn place(&self, time: f64) -> (usize, f64) {
        let at = clamp(time / self.interval(), 0.0, self.last() as f64);
        // A NaN gives zero.
        let k = count(at).min(self.last() - 1);
        (k, at - k as f64)
    }

    /// The state at `time` [s]; before the first node and after the last that of the node.
    ///
    /// Angles by the cubic through angles and rates at both ends, rates linear.
    pub fn at(&self, time: f64) -> State<NL> {
        let (k, s) = self.place(time);
        let states = &self.reorientation.states;
        let (Some(a), Some(b)) = (states.get(k), states.get(k + 1)) else { return State::ZERO };
        let h = self.interval();
        // Hermite's basis: of the end's angle and of both rates.
        let (end, first, last) =
            (s * s * (3.0 - 2.0 * s), s * (1.0 - s) * (1.0 - s) * h, s * s * (s - 1.0) * h);
        let turn = quaternion::product(&b.attitude, &quaternion::conjugate(&a.attitude));
        let turn: Vector3<f64> = quaternion::log(&turn) * end + a.rate * first + b.rate * last;
        let travel: SVector<f64, NL> =
            (b.joint_angle - a.joint_angle) * end + a.joint_rate * first + b.joint_rate * last;
        State {
            attitude: quaternion::normalized(&quaternion::product(
                &quaternion::exp(&turn),
                &a.attitude,
            )),
            joint_angle: a.joint_angle + travel,
            rate: a.rate + (b.rate - a.rate) * s,
            joint_rate: a.joint_rate + (b.joint_rate - a.joint_rate) * s,
        }
    }

    /// The mean of the controls between two times [s].
    fn mean_control(&self, from: f64, to: f64) -> Control<NL> {
        let ((first, from), (last, to)) = (self.place(from), self.place(to));
        let mut sum = Control::ZERO;
        let mut total = 0.0;
        for (k, control) in
            self.reorientation.controls.iter().enumerate().take(last + 1).skip(first)
        {
            let begin = if k == first { from } else { 0.0 };
            let share = if k == last { to } else { 1.0 } - begin;
            sum.bus_torque += control.bus_torque * share;
            sum.joint_torque += control.joint_torque * share;
            total += share;
        }
        let scale = if total > 0.0 { 1.0 / divisor(total) } else { 0.0 };
        Control { bus_torque: sum.bus_torque * scale, joint_torque: sum.joint_torque * scale }
    }

    /// Writes what is left of it after `elapsed` [s] on another grid, whose first node is then.
    pub(super) fn resample(
        &self,
        elapsed: f64,
        grid: &Grid,
        out: &mut ReorientationTrajectory<NODES, NL>,
    ) {
        let time = |k: usize| elapsed + grid.time(k);
        let nodes = out.states.iter_mut().zip(&mut out.controls).enumerate().take(grid.nodes);
        for (k, (state, control)) in nodes {
            *state = self.at(time(k));
            *control = match k < grid.last() {
                true => self.mean_control(time(k), time(k + 1)),
                false => Control::ZERO,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Mission;

    /// Angles of constant acceleration, torques that count the intervals.
    fn nominal() -> Nominal {
        let mut reorientation = ReorientationTrajectory::ZERO;
        for k in 0..NODES {
            let t = 20.0 * k as f64;
            let state = &mut reorientation.states[k];
            let turn = Vector3::new(0.0, 1e-4 * t + 1e-7 * t * t, 0.0);
            state.attitude = quaternion::exp(&turn);
            state.rate.y = 1e-4 + 2e-7 * t;
            state.joint_angle[1] = 1e-4 * t + 1e-7 * t * t;
            state.joint_rate[1] = 1e-4 + 2e-7 * t;
            reorientation.controls[k].bus_torque.x = k as f64;
        }
        Nominal { reorientation, nodes: NODES, duration: 1180.0 }
    }

    #[test]
    fn constant_acceleration_is_met_between_nodes_too() {
        let plan = nominal();
        for t in [0.0, 7.0, 20.0, 333.3, 1179.0, 1180.0] {
            let state = plan.at(t);
            let angle = 1e-4 * t + 1e-7 * t * t;
            assert!((state.joint_angle[1] - angle).abs() < 1e-12, "{t}");
            assert!((state.joint_rate[1] - 1e-4 - 2e-7 * t).abs() < 1e-14, "{t}");
            let turn = quaternion::log(&state.attitude);
            assert!((turn - Vector3::new(0.0, angle, 0.0)).norm() < 1e-12, "{t}");
        }
        assert_eq!(plan.at(5000.0), plan.at(1180.0));
    }

    #[test]
    fn what_is_left_keeps_its_times_and_its_impulse() {
        let plan = nominal();
        let mut grid = Mission::default().own_grid();
        let mut left = ReorientationTrajectory::ZERO;
        grid.duration = 580.0;
        plan.resample(600.0, &grid, &mut left);
        assert!((left.states[59].joint_angle - plan.at(1180.0).joint_angle).norm() < 1e-12);
        assert!((left.states[0].joint_angle - plan.at(600.0).joint_angle).norm() < 1e-12);
        let impulse = |z: &ReorientationTrajectory<NODES, LINKS>, from: usize, dt: f64| {
            z.controls[from..59].iter().map(|u| u.bus_torque.x * dt).sum::<f64>()
        };
        let before = impulse(&plan.reorientation, 30, 20.0);
        let after = impulse(&left, 0, 580.0 / 59.0);
        assert!((after / before - 1.0).abs() < 1e-12, "{after} {before}");
        assert_eq!(left.controls[59], Control::ZERO);
        // Resampled from its beginning on its own grid, the plan is itself.
        grid.duration = 1180.0;
        plan.resample(0.0, &grid, &mut left);
        for (a, b) in left.states.iter().zip(&plan.reorientation.states) {
            assert!((a.joint_angle - b.joint_angle).norm() < 1e-12);
        }
    }
}
