//! Exact derivatives of the accelerations with respect to state, torques and force.
//!
//! The forward dynamics solve `H(alpha) a + bias(x) = u`. Differentiating the *inverse* dynamics at
//! the accelerations found and solving with the same factor gives `da = H^-1 (du - d(H a + bias))`:
//! the recursion runs once on dual numbers, the factorisation never.

use super::forward::Evaluation;
use super::inverse::Motion;
use super::multibody::BusFrame;
use super::{Acceleration, Control, Multibody, State};
use crate::math::{Dual, Vec3};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Derivatives of the accelerations. State columns are `[dtheta, alpha, rate, joint_rate]`
/// (`NX = 6 + 2 NL`), `dtheta` the left perturbation of the attitude in RTN axes; control columns
/// are `[bus_torque, joint_torque]` (`NU = 3 + NL`). SI units.
#[derive(Clone, Copy, Debug)]
pub struct AccelerationJacobian<const NL: usize, const NX: usize, const NU: usize> {
    /// Bus angular acceleration by state.
    pub bus_state: SMatrix<f64, 3, NX>,
    /// Joint accelerations by state.
    pub joint_state: SMatrix<f64, NL, NX>,
    /// Bus angular acceleration by control.
    pub bus_control: SMatrix<f64, 3, NU>,
    /// Joint accelerations by control.
    pub joint_control: SMatrix<f64, NL, NU>,
}

/// Derivatives of the accelerations with respect to the actuator force (RTN, N).
#[derive(Clone, Copy, Debug)]
pub struct ForceJacobian<const NL: usize> {
    /// Bus angular acceleration by force.
    pub bus: Matrix3<f64>,
    /// Joint accelerations by force.
    pub joint: SMatrix<f64, NL, 3>,
}

impl<const NL: usize> Multibody<NL> {
    /// Accelerations and their derivatives with respect to state and torques.
    ///
    /// Exact to rounding. Cost: one inverse dynamics on dual numbers of `NX` lanes and
    /// `NX + NU` solves; about 3 us for three links on a desktop core. No allocation.
    pub fn acceleration_jacobian<const NX: usize, const NU: usize>(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> (Acceleration<NL>, AccelerationJacobian<NL, NX, NU>) {
        const { assert!(NX == 6 + 2 * NL && NU == 3 + NL, "sizes of state and control") };
        let evaluation = self.evaluate(state, control, force);
        let (bus_state, joint_state) = self.state_jacobian(&evaluation, state);
        let (bus_control, joint_control) = Self::control_jacobian(&evaluation);
        let jacobian = AccelerationJacobian { bus_state, joint_state, bus_control, joint_control };
        (evaluation.acceleration(self, state), jacobian)
    }

    /// Derivatives of the accelerations with respect to the actuator force.
    pub fn force_jacobian(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> ForceJacobian<NL> {
        let evaluation = self.evaluate(state, control, force);
        let poses = &evaluation.poses;
        let to_specific = evaluation.rotation.transpose() / self.total_mass;
        // The force is felt by each body in proportion to its mass: a moment by its lever arm.
        let mut joint = SMatrix::<f64, NL, 3>::zeros();
        let (mut mass, mut moment) = (0.0, Vec3::ZERO);
        for k in (0..NL).rev() {
            mass += self.links[k].mass;
            moment += poses[k].center * self.links[k].mass;
            let lever = moment - poses[k].joint * mass;
            let row = poses[k].axis.cross(lever).to_vector();
            joint.set_row(k, &row.transpose());
        }
        let bus = self.first_moment(poses).to_vector().cross_matrix();
        let (bus, joint) = evaluation.factor.solve(-bus * to_specific, -joint * to_specific);
        ForceJacobian { bus: evaluation.rotation * bus, joint }
    }

    fn state_jacobian<const NX: usize>(
        &self,
        evaluation: &Evaluation<NL>,
        state: &State<NL>,
    ) -> (SMatrix<f64, 3, NX>, SMatrix<f64, NL, NX>) {
        let (frame, joint_angle, motion) = Self::seed::<NX>(self, evaluation, state);
        let poses = self.link_poses(&joint_angle);
        let needed = self.generalized_force(&poses, &frame, &motion);
        let bus = SMatrix::from_fn(|i, lane| -needed.bus.0[i].partial[lane]);
        let joint = SMatrix::from_fn(|i, lane| -needed.joint[i].partial[lane]);
        let (bus, joint) = evaluation.factor.solve(bus, joint);

        // Back to RTN: the bus axes turn with dtheta, and the frame rate couples to the rate.
        let mut bus = evaluation.rotation * bus;
        let inertial = evaluation.rotation * evaluation.motion.bus_acceleration.to_vector();
        let turning = -inertial.cross_matrix();
        let frame_rate = self.frame_rate().cross_matrix();
        for j in 0..3 {
            for i in 0..3 {
                bus[(i, j)] += turning[(i, j)];
                bus[(i, 3 + NL + j)] -= frame_rate[(i, j)];
            }
        }
        (bus, joint)
    }

    /// The evaluation's quantities as dual numbers along `[dtheta, alpha, rate, joint_rate]`.
    fn seed<const NX: usize>(
        &self,
        evaluation: &Evaluation<NL>,
        state: &State<NL>,
    ) -> (BusFrame<Dual<NX>>, [Dual<NX>; NL], Motion<Dual<NX>, NL>) {
        let to_bus = evaluation.rotation.transpose();
        // Bus components of a fixed RTN vector v change by R^T (v x dtheta).
        let turned = |v: Vector3<f64>| to_bus * v.cross_matrix();
        let with_attitude = |v: Vec3<f64>, by_theta: &Matrix3<f64>| {
            let mut out = Vec3::<Dual<NX>>::constant(&v.to_vector());
            for i in 0..3 {
                for j in 0..3 {
                    out.0[i].partial[j] = by_theta[(i, j)];
                }
            }
            out
        };
        let frame = &evaluation.frame;
        let mut rate = with_attitude(frame.rate, &turned(state.rate + self.frame_rate()));
        for i in 0..3 {
            for j in 0..3 {
                rate.0[i].partial[3 + NL + j] = to_bus[(i, j)];
            }
        }
        let force = evaluation.rotation * frame.specific_force.to_vector();
        let frame = BusFrame {
            rate,
            radial: with_attitude(frame.radial, &turned(Vector3::x())),
            specific_force: with_attitude(frame.specific_force, &turned(force)),
        };
        let motion = &evaluation.motion;
        let index = core::array::from_fn::<usize, NL, _>(|i| i);
        let joint_angle = index.map(|i| Dual::variable(state.joint_angle[i], 3 + i));
        let motion = Motion {
            joint_rate: index.map(|i| Dual::variable(state.joint_rate[i], 6 + NL + i)),
            bus_acceleration: Vec3::constant(&motion.bus_acceleration.to_vector()),
            joint_acceleration: motion.joint_acceleration.map(crate::math::Scalar::constant),
        };
        (frame, joint_angle, motion)
    }

    fn control_jacobian<const NU: usize>(
        evaluation: &Evaluation<NL>,
    ) -> (SMatrix<f64, 3, NU>, SMatrix<f64, NL, NU>) {
        let bus = SMatrix::from_fn(|i, j| if i == j { 1.0 } else { 0.0 });
        let joint = SMatrix::from_fn(|i, j| if 3 + i == j { 1.0 } else { 0.0 });
        let (bus, joint) = evaluation.factor.solve(bus, joint);
        (evaluation.rotation * bus, joint)
    }
}
