//! The plan turned with the target: from where it was expected to be to where it is estimated.

use super::{FlightPlan, Reference};
use crate::math::quaternion;
use crate::model::{Mission, TargetState};
use nalgebra::{Matrix3, Vector3, Vector4};

/// A turn of RTN about the target's centre of mass, its rate and acceleration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    attitude: Vector4<f64>,
    matrix: Matrix3<f64>,
    /// Angular velocity of the turn, RTN [rad/s].
    rate: Vector3<f64>,
    /// Its derivative, RTN [rad/s^2].
    acceleration: Vector3<f64>,
    /// The whole turn, before it is faded in, as a rotation vector [rad].
    pub whole: Vector3<f64>,
}

impl Turn {
    /// The turn from the target as `planned` expects it to the target as it is, of which a `share` is
    /// in force that grows with `share_rate` [1/s].
    pub fn to<const NL: usize>(
        plan: &FlightPlan<NL>,
        mission: &Mission<NL>,
        planned: &Reference<NL>,
        is: &TargetState,
        [share, share_rate]: [f64; 2],
    ) -> Self {
        let away = quaternion::conjugate(&planned.target.attitude);
        let whole = quaternion::log(&quaternion::product(&is.attitude, &away));
        let attitude = quaternion::exp(&(whole * share));
        let matrix = quaternion::rotation_matrix(&attitude);
        let carried = matrix * planned.target.rate;
        let rate = (is.rate - carried) * share + whole * share_rate;
        let expected = matrix * planned.target_acceleration + rate.cross(&carried);
        let acceleration = (plan.turning(mission, is) - expected) * share;
        Self { attitude, matrix, rate, acceleration, whole }
    }

    /// The turn as a quaternion.
    pub fn attitude(&self) -> &Vector4<f64> {
        &self.attitude
    }

    /// A vector turned.
    pub fn turned(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * v
    }

    /// Turns a plan's reference: positions and attitudes, their rates and accelerations. The acceleration
    /// that fading in adds is left out.
    pub fn apply<const NL: usize>(&self, plan: &mut Reference<NL>) {
        let (m, rate) = (&self.matrix, &self.rate);
        plan.position = m * plan.position;
        let velocity = m * plan.velocity;
        let carried = rate.cross(&plan.position);
        plan.velocity = velocity + carried;
        plan.acceleration = m * plan.acceleration
            + rate.cross(&velocity) * 2.0
            + rate.cross(&carried)
            + self.acceleration.cross(&plan.position);
        plan.state.attitude = quaternion::product(&self.attitude, &plan.state.attitude);
        let bus_rate = m * plan.state.rate;
        plan.state.rate = bus_rate + rate;
        plan.state_acceleration.bus =
            m * plan.state_acceleration.bus + rate.cross(&bus_rate) + self.acceleration;
    }
}
