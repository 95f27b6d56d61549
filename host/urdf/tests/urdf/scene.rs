//! An arm at given angles, as bodies and joint axes in the bus frame; and what follows from these.

use nalgebra::{Matrix3, SMatrix, Vector3};
use remora_urdf::Arm;

/// Of a bus and seven joints; rows of joints that are not there are zero.
pub type MassMatrix = SMatrix<f64, 13, 13>;
type Jacobian = SMatrix<f64, 3, 13>;

/// A body in the bus frame.
pub struct Rigid {
    /// Joints between the bus and it.
    pub joints: usize,
    pub mass: f64,
    pub center_of_mass: Vector3<f64>,
    pub inertia: Matrix3<f64>,
}

pub struct Scene {
    /// Position and axis of each joint.
    pub joints: Vec<(Vector3<f64>, Vector3<f64>)>,
    pub bodies: Vec<Rigid>,
    pub end_effector: (Vector3<f64>, Matrix3<f64>),
}

/// Rodrigues' formula.
pub fn turn(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

/// The frames of an arm are parallel: each turn is about an axis that its body and the one before
/// it share.
pub fn of_arm(arm: &Arm, angles: &[f64]) -> Scene {
    let (mut at, mut rotation) = (arm.arm_base, Matrix3::identity());
    let mut scene = Scene { joints: Vec::new(), bodies: Vec::new(), end_effector: (at, rotation) };
    scene.bodies.extend(arm.base.iter().map(|base| Rigid {
        joints: 0,
        mass: base.body.mass,
        center_of_mass: base.body.center_of_mass,
        inertia: base.body.inertia,
    }));
    for (i, (joint, angle)) in arm.joints.iter().zip(angles).enumerate() {
        scene.joints.push((at, rotation * joint.axis));
        rotation *= turn(&joint.axis, *angle);
        scene.bodies.push(Rigid {
            joints: i + 1,
            mass: joint.body.mass,
            center_of_mass: at + rotation * joint.body.center_of_mass,
            inertia: rotation * joint.body.inertia * rotation.transpose(),
        });
        scene.end_effector =
            (at + rotation * arm.end_effector.position, rotation * arm.end_effector.rotation);
        at += rotation * joint.tip;
    }
    scene
}

impl Scene {
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.mass).sum()
    }

    pub fn center_of_mass(&self) -> Vector3<f64> {
        let moment: Vector3<f64> =
            self.bodies.iter().map(|body| body.center_of_mass * body.mass).sum();
        moment / self.mass()
    }

    /// The kinetic energy's matrix: the bus's six freedoms at its frame's origin, linear before
    /// angular, then the joints. Of a bus that cannot move the first six rows and columns are zero.
    pub fn mass_matrix(&self, is_free: bool) -> MassMatrix {
        let mut matrix = MassMatrix::zeros();
        for body in &self.bodies {
            let (mut linear, mut angular) = (Jacobian::zeros(), Jacobian::zeros());
            for i in (0..6).filter(|_| is_free) {
                let unit = Matrix3::identity().column(i % 3).into_owned();
                if i < 3 {
                    linear.set_column(i, &unit);
                } else {
                    angular.set_column(i, &unit);
                    linear.set_column(i, &unit.cross(&body.center_of_mass));
                }
            }
            for (i, (at, axis)) in self.joints.iter().take(body.joints).enumerate() {
                angular.set_column(6 + i, axis);
                linear.set_column(6 + i, &axis.cross(&(body.center_of_mass - at)));
            }
            matrix += linear.transpose() * linear * body.mass;
            matrix += angular.transpose() * (body.inertia * angular);
        }
        matrix
    }
}
