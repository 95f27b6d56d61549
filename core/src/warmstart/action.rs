//! What a network's answer means.
//!
//! [`Action::Torque`] is the paper's. An error of a torque grows with the square of time, and most
//! in the light outer joint. [`Action::Rate`] says which rates to reach by the next node: of the
//! bus, in the axes it has now, and of the joints. Inverse dynamics find the torques, so that what
//! the force of Stage 1 and the arm's motion do to the bus need not be learnt, and errors grow
//! with time only.

use super::Scene;
use crate::dynamics::{Control, Integrator, State, Stepping, Transition};
use crate::math::quaternion;
use crate::stages::LINKS;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::clamp;

/// Numbers of an action: three for the bus, one a joint.
pub const ACTION: usize = 3 + LINKS;

/// What the numbers of an action are.
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
    pub fn of(
        self,
        state: &State<LINKS>,
        control: &Control<LINKS>,
        next: &State<LINKS>,
    ) -> [f32; ACTION] {
        let (bus, joint) = match self {
            Self::Torque => (control.bus_torque, control.joint_torque),
            Self::Rate => {
                (quaternion::rotation_matrix(&state.attitude).tr_mul(&next.rate), next.joint_rate)
            }
        };
        core::array::from_fn(|i| if i < 3 { bus[i] } else { joint[i - 3] } as f32)
    }
}

impl Scene<'_> {
    /// Applies an action at node `k`, and says by which torques and where to. The torques are
    /// within their limits, and so are the rates asked of the joints; rates that constraints pin
    /// (joints from the preset on, bus at the last node) are asked for as pinned.
    ///
    /// `held` is the control of the interval before: for RK4 a start of the search.
    pub fn apply(
        &self,
        action: Action,
        k: usize,
        state: &State<LINKS>,
        numbers: &[f32; ACTION],
        held: &Control<LINKS>,
    ) -> (Control<LINKS>, State<LINKS>) {
        let (body, integrator, force) = (&self.body, self.integrator, &self.translation.force[k]);
        let bus = Vector3::from_fn(|i, _| f64::from(numbers[i]));
        let joint = SVector::<f64, LINKS>::from_fn(|i, _| f64::from(numbers[3 + i]));
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
                let (control, reached) = body.track_rates(&stepping, state, goal, known, force);
                (control, Some(reached))
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
        joint_rate: SVector<f64, LINKS>,
    ) -> (Vector3<f64>, SVector<f64, LINKS>) {
        let limits = &self.mission.servicer.max_joint_rate;
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
