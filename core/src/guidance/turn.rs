//! The plan turned with the target: from where it was expected to be to where it is estimated.

use super::Reference;
use crate::math::quaternion;
use crate::model::TargetState;
use nalgebra::{Matrix3, Vector3, Vector4};

/// A turn of RTN about the target's centre of mass, and its rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    attitude: Vector4<f64>,
    matrix: Matrix3<f64>,
    /// Angular velocity of the turn, RTN [rad/s].
    rate: Vector3<f64>,
    /// Angle of the whole turn, before it is faded in [rad].
    pub angle: f64,
}

impl Turn {
    /// The turn from the target as a plan expects it to the target as it is, of which a `share` is
    /// in force that grows with `share_rate` [1/s].
    pub fn new(expected: &TargetState, is: &TargetState, [share, share_rate]: [f64; 2]) -> Self {
        let away = quaternion::conjugate(&expected.attitude);
        let whole = quaternion::log(&quaternion::product(&is.attitude, &away));
        let attitude = quaternion::exp(&(whole * share));
        let matrix = quaternion::rotation_matrix(&attitude);
        let rate = (is.rate - matrix * expected.rate) * share + whole * share_rate;
        Self { attitude, matrix, rate, angle: libm::sqrt(whole.dot(&whole)) }
    }

    /// The turn as a quaternion.
    pub fn attitude(&self) -> &Vector4<f64> {
        &self.attitude
    }

    /// A vector turned.
    pub fn turned(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * v
    }

    /// What the plan asks for, turned: positions and attitudes, their rates and accelerations. The
    /// turn's own acceleration is left out.
    pub fn apply<const NL: usize>(&self, plan: &Reference<NL>) -> Reference<NL> {
        let (m, rate) = (&self.matrix, &self.rate);
        let (position, velocity) = (m * plan.position, m * plan.velocity);
        let carried = rate.cross(&position);
        let bus_rate = m * plan.state.rate;
        let mut out = *plan;
        out.position = position;
        out.velocity = velocity + carried;
        out.acceleration =
            m * plan.acceleration + rate.cross(&velocity) * 2.0 + rate.cross(&carried);
        out.state.attitude = quaternion::product(&self.attitude, &plan.state.attitude);
        out.state.rate = bus_rate + rate;
        out.state_acceleration.bus = m * plan.state_acceleration.bus + rate.cross(&bus_rate);
        out
    }
}
