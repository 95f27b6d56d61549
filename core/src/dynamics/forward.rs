//! Forward dynamics by the composite-rigid-body algorithm (CRBA): accelerations from torques.

use super::inverse::Motion;
use super::kinematics::Kinematics;
use super::multibody::BusFrame;
use super::{Acceleration, Control, Multibody, State};
use crate::math::Vec3;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use remora_qp::dense::{cholesky_in_place, cholesky_solve_in_place};

/// Generalised inertia of bus attitude and joints about the centre of mass, by blocks, bus axes.
///
/// The joint block is eliminated first: for a light arm on a heavy bus it is the better
/// conditioned half, and both blocks stay of const-generic size.
#[derive(Clone, Copy)]
pub(super) struct InertiaFactor<const NL: usize> {
    /// Cholesky factor of the joint block.
    joint: SMatrix<f64, NL, NL>,
    /// `joint^-1 * coupling^T`: joint accelerations by bus acceleration.
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

/// Intermediate results of the forward dynamics that the derivatives reuse.
pub(super) struct Evaluation<const NL: usize> {
    /// Bus axes to RTN.
    pub rotation: Matrix3<f64>,
    pub frame: BusFrame<f64>,
    pub kinematics: Kinematics<NL>,
    pub factor: InertiaFactor<NL>,
    /// The accelerations found, bus axes.
    pub motion: Motion<f64, NL>,
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Accelerations in `state` under `control` and actuator force `force` (RTN, N), by the CRBA.
    ///
    /// Not finite where the input is not. Cost: O(NL) for the recursions plus `NL^3 / 3` for the
    /// factorisation; about 0.4 us for three links on a desktop core. No allocation.
    #[doc(alias = "CRBA")]
    #[doc(alias = "forward_dynamics")]
    #[inline(never)]
    pub fn acceleration(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> Acceleration<NL> {
        let (rotation, frame) = self.bus_frame(state, force);
        let kinematics = self.kinematics(state);
        let motion = self.solve(&kinematics, &frame, state, control).1;
        self.relative(&rotation, &motion, state)
    }

    pub(super) fn evaluate(
        &self,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> Evaluation<NL> {
        let (rotation, frame) = self.bus_frame(state, force);
        let kinematics = self.kinematics(state);
        let (factor, motion) = self.solve(&kinematics, &frame, state, control);
        Evaluation { rotation, frame, kinematics, factor, motion }
    }

    /// The factored inertia, and the accelerations that it leads to.
    #[inline]
    fn solve(
        &self,
        kinematics: &Kinematics<NL>,
        frame: &BusFrame<f64>,
        state: &State<NL>,
        control: &Control<NL>,
    ) -> (InertiaFactor<NL>, Motion<f64, NL>) {
        let factor = self.factor_inertia(kinematics);
        let mut motion = Motion {
            joint_rate: Self::angles(&state.joint_rate),
            bus_acceleration: Vec3::ZERO,
            joint_acceleration: [0.0; NL],
        };
        let bias = self.generalized_force(kinematics, frame, &motion);
        let (bus, joint) = factor.solve(
            control.bus_torque - bias.bus.to_vector(),
            control.joint_torque - SVector::from(bias.joint),
        );
        motion.bus_acceleration = Vec3(bus.into());
        motion.joint_acceleration = Self::angles(&joint);
        (factor, motion)
    }

    /// Accelerations in the state's components: bus rate relative to RTN, RTN axes.
    #[inline]
    fn relative(
        &self,
        rotation: &Matrix3<f64>,
        motion: &Motion<f64, NL>,
        state: &State<NL>,
    ) -> Acceleration<NL> {
        let inertial = rotation * motion.bus_acceleration.to_vector();
        Acceleration {
            bus: inertial - self.frame_rate().cross(&state.rate),
            joint: SVector::from(motion.joint_acceleration),
        }
    }

    /// CRBA: each joint's subtree moves as one body. Its momentum for unit joint rate, projected onto the
    /// motion of each joint before, is an entry of the inertia matrix.
    #[inline(never)]
    fn factor_inertia(&self, kinematics: &Kinematics<NL>) -> InertiaFactor<NL> {
        let mut joint = SMatrix::<f64, NL, NL>::zeros();
        let mut coupling = SMatrix::<f64, NL, 3>::zeros();
        // The motion of the centre of mass is subtracted.
        let inverse_mass = 1.0 / self.total_mass;
        let h = kinematics.whole.first;
        for k in 0..NL {
            let link = &kinematics.links[k];
            let recoil = link.momentum.scaled(inverse_mass);
            let mut angular = link.subtree.inertia(link.axis);
            for j in (0..=k).rev() {
                let other = &kinematics.links[j];
                joint[(k, j)] = other.axis.dot(angular) - other.momentum.dot(recoil);
                // About the joint before, and at last about the bus centre of mass.
                angular += other.lever.cross(link.momentum);
            }
            joint[(k, k)] += self.servicer.links[k].armature_kg_m2;
            let row = angular - h.cross(recoil);
            coupling.set_row(k, &row.to_vector().transpose());
        }
        let columns = [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])]
            .map(|e| kinematics.whole.inertia(e) + h.cross(h.cross(e)).scaled(inverse_mass));
        let mut bus = Matrix3::from_columns(&columns.map(Vec3::to_vector));
        bus += self.servicer.bus_inertia_kg_m2;
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
    /// The accelerations in the state's components: bus rate relative to RTN, RTN axes.
    #[inline]
    pub(super) fn acceleration(
        &self,
        body: &Multibody<'_, NL>,
        state: &State<NL>,
    ) -> Acceleration<NL> {
        body.relative(&self.rotation, &self.motion, state)
    }
}
