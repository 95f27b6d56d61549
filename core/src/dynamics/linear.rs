//! Exact derivatives of the accelerations with respect to state, torques and force.
//!
//! The forward dynamics solve `H(alpha) a + bias(x) = u`. Differentiating the *inverse* dynamics at
//! the accelerations found and solving with the same factor gives `da = H^-1 (du - d(H a + bias))`.
//!
//! The inverse dynamics are differentiated by one degree of freedom at a time, by its position and its
//! rate side by side. Turning a joint moves its subtree rigidly: seen from the subtree, the motion before
//! the joint turns back, and the subtree's wrench turns with it. No geometry is differentiated.

use super::forward::Evaluation;
use super::inverse::{GeneralizedForce, Rnea, SpatialAcceleration, Wrench};
use super::kinematics::{Kinematics, second_moment};
use super::{Acceleration, Control, Multibody, State};
use crate::math::{Lanes, Mat3, Scalar, Vec3};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

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

/// Derivatives by a position and by its rate, side by side.
type Both = Lanes<2>;

/// Initial values of the derivatives along one degree of freedom.
struct Seed {
    /// The joint, or none for the bus.
    joint: Option<usize>,
    /// The derivative of the motion of the joint's link, or of the bus.
    spatial: SpatialAcceleration<Both>,
    /// That of the force needed beyond the joint, from its turn alone.
    wrench: Wrench<Both>,
    /// That of the actuator force per unit of system mass.
    specific_force: Vec3<Both>,
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Accelerations and their derivatives with respect to state and torques.
    ///
    /// Exact to rounding. Cost: about 150 flops for each pair of state and link, and `NX + NU`
    /// solves; about 1 us for three links on a desktop core. No allocation.
    pub fn acceleration_jacobian<const NX: usize, const NU: usize>(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> (Acceleration<NL>, AccelerationJacobian<NL, NX, NU>) {
        const { assert!(NX == 6 + 2 * NL && NU == 3 + NL, "sizes of state and control") };
        let evaluation = self.evaluate(state, control, force);
        let (bus_state, joint_state) = self.state_jacobian(&evaluation);
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
        let to_specific = evaluation.rotation.transpose() / self.total_mass;
        // The force is felt by each body in proportion to its mass: a moment by its lever arm.
        let mut joint = SMatrix::<f64, NL, 3>::zeros();
        for (k, link) in evaluation.kinematics.links.iter().enumerate() {
            joint.set_row(k, &link.momentum.to_vector().transpose());
        }
        let bus = evaluation.kinematics.whole.first.to_vector().cross_matrix();
        let (bus, joint) = evaluation.factor.solve(-bus * to_specific, -joint * to_specific);
        ForceJacobian { bus: evaluation.rotation * bus, joint }
    }

    fn state_jacobian<const NX: usize>(
        &self,
        evaluation: &Evaluation<NL>,
    ) -> (SMatrix<f64, 3, NX>, SMatrix<f64, NL, NX>) {
        let Evaluation { rotation, kinematics, .. } = evaluation;
        let motion = &evaluation.motion;
        let rnea = self.rnea(kinematics, &evaluation.frame, motion);
        let mut bus = SMatrix::<f64, 3, NX>::zeros();
        let mut joint = SMatrix::<f64, NL, NX>::zeros();
        let mut set = |needed: GeneralizedForce<Both, NL>, lane: usize, column: usize| {
            bus.set_column(column, &-SVector::from(needed.bus.0.map(|x| x.0[lane])));
            joint.set_column(column, &-SVector::from(needed.joint.map(|x| x.0[lane])));
        };
        for k in 0..3 {
            let axis = Vec3(rotation.row(k).transpose().into());
            let needed = self.differentiate(evaluation, &self.bus_seed(evaluation, axis));
            set(needed, 0, k);
            set(needed, 1, 3 + NL + k);
        }
        for j in 0..NL {
            let seed = Self::joint_seed(kinematics, &rnea, motion.joint_rate[j], j);
            let needed = self.differentiate(evaluation, &seed);
            set(needed, 0, 3 + j);
            set(needed, 1, 6 + NL + j);
        }
        let (bus, joint) = evaluation.factor.solve(bus, joint);

        // Back to RTN: the bus axes turn with dtheta, and the frame rate couples to the rate.
        let mut bus = rotation * bus;
        let inertial = rotation * evaluation.motion.bus_acceleration.to_vector();
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

    /// The bus turning about `axis` (a constant direction of RTN, in bus axes): directions of RTN
    /// turn back in bus axes. And its rate about that axis.
    #[inline]
    fn bus_seed(&self, evaluation: &Evaluation<NL>, axis: Vec3<f64>) -> Seed {
        let frame = &evaluation.frame;
        let rate = both(frame.rate.cross(axis), axis);
        let radial = both(frame.radial.cross(axis), Vec3::ZERO);
        let three_n2 = 3.0 * self.mean_motion * self.mean_motion;
        let pull = frame.radial.scaled(-three_n2).lift();
        let gradient = Mat3::double_cross(rate, frame.rate.lift())
            + Mat3::double_cross(frame.rate.lift(), rate)
            + Mat3::outer(radial, pull)
            + Mat3::outer(pull, radial);
        Seed {
            joint: None,
            spatial: SpatialAcceleration { rate, gradient, at: Vec3::ZERO },
            wrench: Wrench::ZERO,
            specific_force: both(frame.specific_force.cross(axis), Vec3::ZERO),
        }
    }

    /// Seed of joint `j`, seen from its link.
    #[inline]
    fn joint_seed(kinematics: &Kinematics<NL>, rnea: &Rnea<NL>, joint_rate: f64, j: usize) -> Seed {
        let axis = kinematics.links[j].axis;
        let before = rnea.before(j);
        let (here, wrench) = (&rnea.links[j], &rnea.wrenches[j]);
        let rate = before.rate.cross(axis);
        let Mat3([x, y, z]) = before.gradient;
        // G [a x] - [a x] G: the gradient, turned back.
        let turned_after = Mat3([
            y.scaled(axis.0[2]) - z.scaled(axis.0[1]),
            z.scaled(axis.0[0]) - x.scaled(axis.0[2]),
            x.scaled(axis.0[1]) - y.scaled(axis.0[0]),
        ]);
        let turned_before = Mat3(before.gradient.0.map(|column| column.cross(axis)));
        let by_angle =
            turned_after + turned_before + Mat3::double_cross(rate.scaled(2.0 * joint_rate), axis);
        let by_rate = Mat3::double_cross(here.rate.scaled(2.0), axis);
        Seed {
            joint: Some(j),
            spatial: SpatialAcceleration {
                rate: both(rate, axis),
                gradient: Mat3([0, 1, 2].map(|k| both(by_angle.0[k], by_rate.0[k]))),
                at: both(here.at.cross(axis), Vec3::ZERO),
            },
            wrench: Wrench {
                force: both(axis.cross(wrench.force), Vec3::ZERO),
                moment: both(axis.cross(wrench.moment), Vec3::ZERO),
            },
            specific_force: Vec3::ZERO,
        }
    }

    /// Derivative of the inverse dynamics along one degree of freedom.
    #[inline]
    fn differentiate(
        &self,
        evaluation: &Evaluation<NL>,
        seed: &Seed,
    ) -> GeneralizedForce<Both, NL> {
        let Evaluation { kinematics, motion, .. } = evaluation;
        let mut spatial = seed.spatial;
        let mut wrenches = [Wrench::ZERO; NL];
        // Links before the joint do not move.
        let first = seed.joint.unwrap_or(0);
        let links = kinematics.links.iter().zip(&mut wrenches).zip(&motion.joint_rate);
        for (i, ((link, wrench), joint_rate)) in links.enumerate().skip(first) {
            if seed.joint != Some(i) {
                spatial.at += spatial.gradient.apply(link.lever.lift());
                let twice = spatial.rate.scaled(2.0 * joint_rate);
                spatial.gradient += Mat3::double_cross(twice, link.axis.lift());
            }
            *wrench = spatial.wrench(link);
        }

        let mut wrench = Wrench::ZERO;
        let mut joint = [Both::ZERO; NL];
        for i in (0..NL).rev() {
            let link = &kinematics.links[i];
            wrench.add(&wrenches[i]);
            joint[i] = link.axis.lift().dot(wrench.moment);
            if seed.joint == Some(i) {
                wrench.add(&seed.wrench);
            }
            wrench.shift(link.lever);
        }

        // The bus's centre of mass recoils, and all links with it.
        let base = seed.specific_force - wrench.force.scaled(1.0 / self.total_mass);
        for (torque, link) in joint.iter_mut().zip(&kinematics.links) {
            *torque += link.momentum.lift().dot(base);
        }
        let mut bus = wrench.moment + kinematics.whole.first.lift().cross(base);
        if seed.joint.is_none() {
            bus += seed.spatial.moment(&second_moment(&self.servicer.bus_inertia_kg_m2));
        }
        GeneralizedForce { bus, joint }
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

/// Derivatives by a position and by its rate, side by side.
#[inline]
fn both(by_position: Vec3<f64>, by_rate: Vec3<f64>) -> Vec3<Both> {
    Vec3([0, 1, 2].map(|i| Lanes([by_position.0[i], by_rate.0[i]])))
}
