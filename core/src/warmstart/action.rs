//! Meaning of a network's answer.
//!
//! [`Action::Torque`] is the paper's. An error of a torque grows with the square of time, and most
//! in the light outer joint. [`Action::Rate`] says which rates to reach by the next node: of the
//! bus, in the axes it has now, and of the joints. Inverse dynamics find the torques, so that what
//! the force of Stage 1 and the arm's motion do to the bus need not be learnt, and errors grow
//! with time only.

use super::Scene;
use crate::dynamics::{Control, Integrator, State, Stepping, Transition};
use crate::math::quaternion;
use crate::stages::{LINKS, size};
use nalgebra::{SVector, Vector3};
use remora_qp::dense::clamp;

/// Numbers of an action of the built-in mission's arm: three for the bus, one a joint, as its torques.
pub const ACTION: usize = size::controls(LINKS);

/// Meaning of the numbers of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Action {
    /// Torques of bus and joints.
    Torque = 0,
    /// Rates of bus and joints at the next node.
    Rate = 1,
}

impl Action {
    /// Its number in a model file.
    pub const fn tag(self) -> u8 {
        self as u8
    }

    /// The one of this number.
    pub const fn of_tag(tag: u8) -> Option<Self> {
        match tag {
            0 => Some(Self::Torque),
            1 => Some(Self::Rate),
            _ => None,
        }
    }

    /// The action that leads from `state` under `control` to `next`.
    pub fn of<const NL: usize>(
        self,
        state: &State<NL>,
        control: &Control<NL>,
        next: &State<NL>,
    ) -> impl Iterator<Item = f32> + use<NL> {
        let (bus, joint) = match self {
            Self::Torque => (control.bus_torque, control.joint_torque),
            Self::Rate => {
                (quaternion::rotation_matrix(&state.attitude).tr_mul(&next.rate), next.joint_rate)
            }
        };
        let numbers = (0..3).map(move |i| bus[i]).chain((0..NL).map(move |i| joint[i]));
        numbers.map(|x| x as f32)
    }
}

impl<const NL: usize> Scene<'_, NL> {
    /// Applies an action, the first of `numbers`, at node `k`, and says by which torques and where to. The
    /// torques are within their limits, and so are the rates asked of the joints; rates that constraints pin
    /// (joints from the preset on, bus at the last node) are asked for as pinned.
    ///
    /// `held` is the control of the interval before: for RK4 a start of the search.
    pub fn apply(
        &self,
        action: Action,
        k: usize,
        state: &State<NL>,
        numbers: &[f32],
        held: &Control<NL>,
    ) -> (Control<NL>, State<NL>) {
        let (body, integrator, force) = (&self.body, self.integrator, &self.translation.force[k]);
        let number = |i: usize| numbers.get(i).copied().map_or(0.0, f64::from);
        let bus = Vector3::from_fn(|i, _| number(i));
        let joint = SVector::<f64, NL>::from_fn(|i, _| number(3 + i));
        let (wanted, reached) = match action {
            Action::Torque => (Control { bus_torque: bus, joint_torque: joint }, None),
            Action::Rate => {
                let rate = quaternion::rotation_matrix(&state.attitude) * bus;
                let (rate, joint_rate) = self.within_reach(k + 1, rate, joint);
                let there = match integrator {
                    // Inverse dynamics need no start.
                    Integrator::Euler => *state,
                    Integrator::Rk4 { .. } => body.step(integrator, self.dt, state, held, force),
                };
                let known = Transition { state, control: held, reached: &there };
                let goal = (&rate, &joint_rate);
                let stepping = Stepping { integrator, dt: self.dt, deadline: self.deadline };
                match body.track_rates(&stepping, state, goal, known, force) {
                    Some((control, reached)) => (control, Some(reached)),
                    None => (*held, None),
                }
            }
        };
        let control = wanted.within_limits(&self.mission.servicer);
        match reached {
            Some(reached) if control == wanted => (control, reached),
            _ => (control, body.step(integrator, self.dt, state, &control, force)),
        }
    }

    /// Rates for node `k` with the joints' limits kept and what is pinned there in place.
    fn within_reach(
        &self,
        k: usize,
        rate: Vector3<f64>,
        joint_rate: SVector<f64, NL>,
    ) -> (Vector3<f64>, SVector<f64, NL>) {
        let limits = &self.mission.servicer.joint_rate_limit_rad_s;
        let last = self.target.len() - 1;
        (
            if k >= last { self.target[last].rate } else { rate },
            match k >= self.preset {
                true => SVector::zeros(),
                false => joint_rate.zip_map(limits, |r, limit| clamp(r, -limit, limit)),
            },
        )
    }
}
