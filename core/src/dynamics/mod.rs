//! Coupled dynamics of bus and arm about the system's centre of mass (section 4).
//!
//! HCW is linear, so the motion about the centre of mass does not depend on where the centre of
//! mass is. What remains is a tree of bodies with `3 + NL` degrees of freedom: bus attitude and
//! joint angles. In inertial rates the rotating-frame terms of the problem definition reduce to
//! Euler's equations, a tidal force `m_i G s_i` (`G = n^2 (3 e_R e_R^T - 1)`, `s_i` from the centre
//! of mass) and the gravity-gradient moment `3 n^2 e_R x I e_R`; all are evaluated in bus axes,
//! where the arm's geometry depends on the joint angles alone.
//!
//! Two independent algorithms compute accelerations: [`Multibody`] by the composite-rigid-body
//! algorithm (CRBA, the planner's), [`articulated`] by the articulated-body algorithm in RTN axes (ABA,
//! the verifier's).

pub mod articulated;
mod curvature;
mod forward;
mod inverse;
mod kinematics;
mod linear;
mod multibody;
mod pose;
mod step;
mod system;

pub use crate::model::Integrator;
pub use curvature::TorqueCurvature;
pub use inverse::{TRACKING_ITERATIONS, Transition};
pub use linear::{AccelerationJacobian, ForceJacobian};
pub use multibody::Multibody;
pub use pose::ArmPose;
pub use step::{StepJacobian, Stepping};
pub use system::{EndEffectorPose, SystemRates, SystemState};

use crate::math::quaternion;
use crate::model::{Mission, Scenario, Servicer, Start};
use nalgebra::{SVector, Vector3, Vector4};
use remora_qp::dense::clamp;

/// State of Stage 2: attitude and arm, with their rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const NL: usize> {
    /// Bus attitude, body to RTN, `(x, y, z, w)`.
    pub attitude: Vector4<f64>,
    /// Joint angles [rad].
    pub joint_angle: SVector<f64, NL>,
    /// Bus angular velocity relative to RTN, resolved in RTN [rad/s].
    pub rate: Vector3<f64>,
    /// Joint rates [rad/s].
    pub joint_rate: SVector<f64, NL>,
}

impl<const NL: usize> State<NL> {
    /// At rest relative to RTN, aligned with it, arm straight.
    pub const ZERO: Self = Self {
        attitude: quaternion::IDENTITY,
        joint_angle: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
        rate: Vector3::new(0.0, 0.0, 0.0),
        joint_rate: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };

    /// State of a scenario at t = 0.
    pub fn at_start(mission: &Mission<NL>, scenario: &Scenario<NL>) -> Self {
        Self {
            attitude: mission.bus_attitude_at_start(scenario),
            joint_angle: mission.joint_angle_at_start(scenario),
            rate: scenario.start.bus_rate,
            joint_rate: scenario.start.joint_rate,
        }
    }

    /// It as the start of a scenario.
    pub fn as_start(&self) -> Start<NL> {
        Start {
            bus_attitude: Some(self.attitude),
            bus_rate: self.rate,
            joint_angle: Some(self.joint_angle),
            joint_rate: self.joint_rate,
        }
    }

    /// The midpoint between this state and a near one.
    pub fn midpoint(&self, other: &Self) -> Self {
        Self {
            attitude: quaternion::normalized(&(self.attitude + other.attitude)),
            joint_angle: (self.joint_angle + other.joint_angle) * 0.5,
            rate: (self.rate + other.rate) * 0.5,
            joint_rate: (self.joint_rate + other.joint_rate) * 0.5,
        }
    }

    /// Whether every component is a finite number.
    pub fn is_finite(&self) -> bool {
        let Self { attitude, joint_angle, rate, joint_rate } = self;
        let numbers = attitude.iter().chain(joint_angle).chain(rate).chain(joint_rate);
        // Without a branch for each.
        numbers.fold(true, |sound, x| sound & x.is_finite())
    }
}

/// Control of Stage 2, held over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control<const NL: usize> {
    /// Bus torque, bus body axes [N m].
    pub bus_torque: Vector3<f64>,
    /// Joint torques [N m]; positive increases the angle.
    pub joint_torque: SVector<f64, NL>,
}

impl<const NL: usize> Control<NL> {
    /// No torque.
    pub const ZERO: Self = Self {
        bus_torque: Vector3::new(0.0, 0.0, 0.0),
        joint_torque: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };

    /// The control projected onto the torque limits; NaN stays NaN.
    pub(crate) fn within_limits(&self, servicer: &Servicer<NL>) -> Self {
        let within = |torque: f64, limit: f64| clamp(torque, -limit, limit);
        Self {
            bus_torque: self.bus_torque.zip_map(&servicer.bus_torque_limit_n_m, within),
            joint_torque: self.joint_torque.zip_map(&servicer.joint_torque_limit_n_m, within),
        }
    }

    /// Whether every component is a finite number.
    pub fn is_finite(&self) -> bool {
        self.bus_torque.iter().chain(self.joint_torque.iter()).all(|x| x.is_finite())
    }
}

/// Accelerations of bus attitude and joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acceleration<const NL: usize> {
    /// RTN-component derivative of the bus rate [rad/s^2].
    pub bus: Vector3<f64>,
    /// Joint accelerations [rad/s^2].
    pub joint: SVector<f64, NL>,
}

impl<const NL: usize> Acceleration<NL> {
    /// None.
    pub(crate) const ZERO: Self = Self {
        bus: Vector3::new(0.0, 0.0, 0.0),
        joint: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };
}
