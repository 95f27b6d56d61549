//! Forward dynamics by articulated bodies (Featherstone), in RTN axes about the bus.
//!
//! A second derivation of the same accelerations, for the verifier and for tests. It shares
//! nothing with [`super::Multibody`]'s evaluation but the servicer description: spatial vectors
//! instead of body-frame recursions, an articulated instead of a composite inertia, and the
//! orbital terms exactly as the problem definition writes them (HCW force on every body,
//! rotating-frame and gravity-gradient moments as external moments).

use super::{Acceleration, Control, State};
use crate::math::quaternion;
use crate::model::{Servicer, hcw_acceleration};
use nalgebra::{Matrix3, Matrix6, SVector, Vector3, Vector6};
use remora_qp::dense::{cholesky_in_place, cholesky_solve_in_place};

/// A spatial vector: angular part, then linear part about the bus centre of mass.
fn spatial(angular: Vector3<f64>, linear: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}

fn angular(v: &Vector6<f64>) -> Vector3<f64> {
    v.fixed_rows::<3>(0).into_owned()
}

fn linear(v: &Vector6<f64>) -> Vector3<f64> {
    v.fixed_rows::<3>(3).into_owned()
}

/// Spatial cross product of two motions.
fn cross_motion(v: &Vector6<f64>, m: &Vector6<f64>) -> Vector6<f64> {
    spatial(
        angular(v).cross(&angular(m)),
        linear(v).cross(&angular(m)) + angular(v).cross(&linear(m)),
    )
}

/// Spatial cross product of a motion with a force.
fn cross_force(v: &Vector6<f64>, f: &Vector6<f64>) -> Vector6<f64> {
    spatial(
        angular(v).cross(&angular(f)) + linear(v).cross(&linear(f)),
        angular(v).cross(&linear(f)),
    )
}

/// One rigid body at one instant, RTN axes, positions from the bus centre of mass.
struct Body {
    mass: f64,
    inertia: Matrix3<f64>,
    center: Vector3<f64>,
    velocity: Vector6<f64>,
}

impl Body {
    fn spatial_inertia(&self) -> Matrix6<f64> {
        let c = self.center.cross_matrix();
        let mut inertia = Matrix6::zeros();
        let rotational = self.inertia - c * c * self.mass;
        inertia.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotational);
        inertia.fixed_view_mut::<3, 3>(0, 3).copy_from(&(c * self.mass));
        inertia.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-c * self.mass));
        inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * self.mass));
        inertia
    }

    /// Wrench of orbit and rotating frame about the bus centre of mass, which stands at the origin
    /// of RTN: where it really is changes only the motion of the centre of mass.
    fn orbital_wrench(&self, n: f64) -> Vector6<f64> {
        let w = angular(&self.velocity);
        let center_rate = linear(&self.velocity) + w.cross(&self.center);
        let force = hcw_acceleration(n, &self.center, &center_rate) * self.mass;
        let frame = Vector3::new(0.0, 0.0, n);
        let total = w + frame;
        let gravity_gradient = Vector3::x().cross(&(self.inertia * Vector3::x())) * (3.0 * n * n);
        let moment = w.cross(&(self.inertia * w))
            - self.inertia * frame.cross(&w)
            - total.cross(&(self.inertia * total))
            + gravity_gradient;
        spatial(moment + self.center.cross(&force), force)
    }

    /// Force the body needs at zero acceleration, less what acts on it.
    fn bias(&self, n: f64) -> Vector6<f64> {
        cross_force(&self.velocity, &(self.spatial_inertia() * self.velocity))
            - self.orbital_wrench(n)
    }
}

fn rotated_inertia(rotation: &Matrix3<f64>, moments: &Vector3<f64>) -> Matrix3<f64> {
    rotation * Matrix3::from_diagonal(moments) * rotation.transpose()
}

/// What the inward pass leaves at a joint for the outward one.
#[derive(Clone, Copy)]
struct Joint {
    /// Motion the joint allows, about the bus centre of mass.
    motion: Vector6<f64>,
    /// Velocity-product acceleration.
    drift: Vector6<f64>,
    /// Articulated inertia times `motion`.
    weight: Vector6<f64>,
    /// `motion . weight`.
    stiffness: f64,
    /// Torque left for acceleration.
    torque: f64,
}

impl Joint {
    const ZERO: Self = Self {
        motion: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        drift: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        weight: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        stiffness: 0.0,
        torque: 0.0,
    };
}

/// Accelerations of bus attitude and joints in `state` under `control` and actuator force `force`
/// (RTN, N), at mean motion `n` [rad/s]. Cost: about 1500 flops a link.
pub fn acceleration<const NL: usize>(
    servicer: &Servicer<NL>,
    n: f64,
    state: &State<NL>,
    control: &Control<NL>,
    force: &Vector3<f64>,
) -> Acceleration<NL> {
    let bus_rotation = quaternion::rotation_matrix(&state.attitude);
    let bus = Body {
        mass: servicer.bus_mass,
        inertia: rotated_inertia(&bus_rotation, &servicer.bus_inertia),
        center: Vector3::zeros(),
        velocity: spatial(state.rate, Vector3::zeros()),
    };

    // Outwards: where the links are and how they move.
    let mut joints = [Joint::ZERO; NL];
    let mut inertias = [Matrix6::zeros(); NL];
    let mut biases = [Vector6::zeros(); NL];
    let mut attitude = state.attitude;
    let mut position = bus_rotation * servicer.arm_base;
    let mut velocity = bus.velocity;
    for (i, link) in servicer.links.iter().enumerate() {
        let turn = quaternion::exp(&(link.axis * state.joint_angle[i]));
        attitude = quaternion::product(&attitude, &turn);
        let rotation = quaternion::rotation_matrix(&attitude);
        let axis = rotation * link.axis;
        joints[i].motion = spatial(axis, position.cross(&axis));
        let turning = joints[i].motion * state.joint_rate[i];
        velocity += turning;
        joints[i].drift = cross_motion(&velocity, &turning);
        let body = Body {
            mass: link.mass,
            inertia: rotated_inertia(&rotation, &link.inertia),
            center: position + rotation * link.center_of_mass,
            velocity,
        };
        inertias[i] = body.spatial_inertia();
        biases[i] = body.bias(n);
        position += rotation * link.tip;
    }

    // Inwards: articulated inertias and bias forces.
    let (mut inertia, mut bias) = (Matrix6::zeros(), Vector6::zeros());
    for i in (0..NL).rev() {
        inertia += inertias[i];
        bias += biases[i];
        let joint = &mut joints[i];
        joint.weight = inertia * joint.motion;
        joint.stiffness = joint.motion.dot(&joint.weight);
        joint.torque = control.joint_torque[i] - joint.motion.dot(&bias);
        inertia -= joint.weight * joint.weight.transpose() / joint.stiffness;
        bias += inertia * joint.drift + joint.weight * (joint.torque / joint.stiffness);
    }

    // The bus, then outwards again.
    inertia += bus.spatial_inertia();
    bias += bus.bias(n);
    let applied = spatial(bus_rotation * control.bus_torque, *force);
    let mut base = applied - bias;
    // Positive definite for every valid servicer; not finite where the input is not.
    let _ = cholesky_in_place(&mut inertia);
    cholesky_solve_in_place(&inertia, &mut base);
    let mut motion = base;
    let mut joint_acceleration = SVector::zeros();
    for (i, joint) in joints.iter().enumerate() {
        motion += joint.drift;
        let value = (joint.torque - joint.weight.dot(&motion)) / joint.stiffness;
        joint_acceleration[i] = value;
        motion += joint.motion * value;
    }
    Acceleration { bus: angular(&base), joint: joint_acceleration }
}
