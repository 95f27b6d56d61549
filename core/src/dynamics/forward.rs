//! Forward dynamics: accelerations from torques, by composite bodies.

use super::inverse::Motion;
use super::multibody::{BusFrame, LinkPose};
use super::{Acceleration, Control, Multibody, State};
use crate::math::{Mat3, Vec3, cholesky_in_place, cholesky_solve_in_place};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Generalised inertia of bus attitude and joints about the centre of mass, by blocks, bus axes.
///
/// The joint block is eliminated first: for a light arm on a heavy bus it is the better
/// conditioned half, and both blocks stay of const-generic size.
#[derive(Clone, Copy)]
pub(super) struct InertiaFactor<const NL: usize> {
    /// Cholesky factor of the joint block.
    joint: SMatrix<f64, NL, NL>,
    /// `joint^-1 * coupling^T`: how the joints follow the bus.
    follow: SMatrix<f64, NL, 3>,
    /// Cholesky factor of the bus block with the joints eliminated.
    bus: Matrix3<f64>,
}

impl<const NL: usize> InertiaFactor<NL> {
    /// Accelerations for generalised forces; `C` right-hand sides at once.
    #[inline]
    pub(super) fn solve<const C: usize>(
        &self,
        mut bus: SMatrix<f64, 3, C>,
        mut joint: SMatrix<f64, NL, C>,
    ) -> (SMatrix<f64, 3, C>, SMatrix<f64, NL, C>) {
        bus -= self.follow.tr_mul(&joint);
        cholesky_solve_in_place(&self.bus, &mut bus);
        cholesky_solve_in_place(&self.joint, &mut joint);
        joint -= self.follow * bus;
        (bus, joint)
    }
}

/// Everything about one evaluation of the forward dynamics that its derivatives need again.
pub(super) struct Evaluation<const NL: usize> {
    /// Bus axes to RTN.
    pub rotation: Matrix3<f64>,
    pub frame: BusFrame<f64>,
    pub poses: [LinkPose<f64>; NL],
    pub factor: InertiaFactor<NL>,
    /// The accelerations found, bus axes.
    pub motion: Motion<f64, NL>,
}

impl<const NL: usize> Multibody<NL> {
    /// Accelerations in `state` under `control` and actuator force `force` (RTN, N).
    ///
    /// Not finite where the input is not. Cost: O(NL) for the recursions plus `NL^3 / 3` for the
    /// factorisation; about 0.5 us for three links on a desktop core. No allocation.
    #[inline]
    pub fn acceleration(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> Acceleration<NL> {
        self.evaluate(state, control, force).acceleration(self, state)
    }

    pub(super) fn evaluate(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> Evaluation<NL> {
        let (rotation, frame) = self.bus_frame(state, force);
        let poses = self.link_poses(&Self::angles(&state.joint_angle));
        let factor = self.factor_inertia(&poses);
        let mut motion = Motion {
            joint_rate: Self::angles(&state.joint_rate),
            bus_acceleration: Vec3::ZERO,
            joint_acceleration: [0.0; NL],
        };
        let bias = self.generalized_force(&poses, &frame, &motion);
        let (bus, joint) = factor.solve(
            control.bus_torque - bias.bus.to_vector(),
            control.joint_torque - SVector::from(bias.joint),
        );
        motion.bus_acceleration = Vec3(bus.into());
        motion.joint_acceleration = Self::angles(&joint);
        Evaluation { rotation, frame, poses, factor, motion }
    }

    /// Composite bodies: the links from each joint outwards move as one.
    #[inline]
    fn factor_inertia(&self, poses: &[LinkPose<f64>; NL]) -> InertiaFactor<NL> {
        let mut composite = Composite::ZERO;
        let mut momenta = [Momentum::ZERO; NL];
        let mut joint = SMatrix::<f64, NL, NL>::zeros();
        for k in (0..NL).rev() {
            composite.add_link(&self.links[k], &poses[k]);
            momenta[k] = composite.momentum(&poses[k]);
            for j in 0..=k {
                joint[(k, j)] = momenta[k].along(&poses[j]);
            }
        }
        // The centre of mass does not take part: take out what would move it.
        let mut coupling = SMatrix::<f64, NL, 3>::zeros();
        let inverse_mass = 1.0 / self.total_mass;
        for k in 0..NL {
            for j in 0..=k {
                joint[(k, j)] -= momenta[k].linear.dot(momenta[j].linear) * inverse_mass;
            }
            let moment = composite.first_moment.cross(momenta[k].linear) * inverse_mass;
            let row = momenta[k].angular - moment;
            coupling.set_row(k, &row.to_vector().transpose());
        }
        let h = composite.first_moment;
        let mut bus = composite.inertia_matrix() + Matrix3::from_diagonal(&self.bus_inertia);
        let shift = h.dot(h) * inverse_mass;
        for i in 0..3 {
            bus[(i, i)] -= shift;
            for j in 0..3 {
                bus[(i, j)] += h.0[i] * h.0[j] * inverse_mass;
            }
        }
        // Inertia matrices are positive definite for every valid servicer; where the input is
        // not finite the factors are not either, and the caller sees it in the result.
        let _ = cholesky_in_place(&mut joint);
        let mut follow = coupling;
        cholesky_solve_in_place(&joint, &mut follow);
        bus -= coupling.tr_mul(&follow);
        let _ = cholesky_in_place(&mut bus);
        InertiaFactor { joint, follow, bus }
    }
}

impl<const NL: usize> Evaluation<NL> {
    /// The accelerations as the state has them: bus rate relative to and resolved in RTN.
    #[inline]
    pub(super) fn acceleration(&self, body: &Multibody<NL>, state: &State<NL>) -> Acceleration<NL> {
        let inertial = self.rotation * self.motion.bus_acceleration.to_vector();
        Acceleration {
            bus: inertial - body.frame_rate().cross(&state.rate),
            joint: SVector::from(self.motion.joint_acceleration),
        }
    }
}

/// Momentum about the bus centre of mass of the links from a joint outwards, for unit joint rate.
#[derive(Clone, Copy)]
struct Momentum {
    linear: Vec3<f64>,
    angular: Vec3<f64>,
}

impl Momentum {
    const ZERO: Self = Self { linear: Vec3::ZERO, angular: Vec3::ZERO };

    /// Its component along the motion of another joint.
    #[inline]
    fn along(&self, pose: &LinkPose<f64>) -> f64 {
        pose.axis.dot(self.angular) - pose.axis.cross(pose.joint).dot(self.linear)
    }
}

/// Mass, first moment and inertia of some links about the bus centre of mass.
struct Composite {
    mass: f64,
    first_moment: Vec3<f64>,
    inertia: Mat3<f64>,
}

impl Composite {
    const ZERO: Self =
        Self { mass: 0.0, first_moment: Vec3::ZERO, inertia: Mat3([Vec3::ZERO; 3]) };

    #[inline]
    fn add_link(&mut self, link: &crate::model::Link, pose: &LinkPose<f64>) {
        self.mass += link.mass;
        self.first_moment += pose.center * link.mass;
        let c = pose.center;
        let c2 = c.dot(c) * link.mass;
        let Mat3([x, y, z]) = pose.rotation;
        let moments = [(x, link.inertia.x), (y, link.inertia.y), (z, link.inertia.z)];
        for j in 0..3 {
            for i in 0..3 {
                let mut entry = -c.0[i] * c.0[j] * link.mass;
                if i == j {
                    entry += c2;
                }
                for (axis, moment) in &moments {
                    entry += axis.0[i] * axis.0[j] * moment;
                }
                self.inertia.0[j].0[i] += entry;
            }
        }
    }

    /// Momentum for unit rate about a joint.
    #[inline]
    fn momentum(&self, pose: &LinkPose<f64>) -> Momentum {
        // The motion is a x (x - p): a rotation about the origin plus a velocity.
        let velocity = pose.joint.cross(pose.axis);
        Momentum {
            linear: velocity * self.mass + pose.axis.cross(self.first_moment),
            angular: self.inertia.apply(pose.axis) + self.first_moment.cross(velocity),
        }
    }

    fn inertia_matrix(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&self.inertia.0.map(Vec3::to_vector))
    }
}
