//! Forward dynamics by the articulated-body algorithm (ABA, Featherstone), in RTN axes about the bus.
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

fn rotated_inertia(rotation: &Matrix3<f64>, inertia: &Matrix3<f64>) -> Matrix3<f64> {
    rotation * inertia * rotation.transpose()
}

/// One joint with its link, in Featherstone's symbols. Motions and forces are about the bus centre of
/// mass.
#[derive(Clone, Copy)]
struct Joint {
    /// `S`: motion that the joint allows.
    motion: Vector6<f64>,
    /// `c`: velocity-product acceleration.
    bias_acceleration: Vector6<f64>,
    /// `I`: inertia of the link alone.
    link_inertia: Matrix6<f64>,
    /// `p`: bias force of the link alone.
    link_bias: Vector6<f64>,
    /// `U = I^A S`, with the articulated inertia.
    momentum: Vector6<f64>,
    /// `D = S . U`, and the rotor's own inertia.
    inertia: f64,
    /// `u`: torque that is left for acceleration.
    torque: f64,
}

impl Joint {
    const ZERO: Self = Self {
        motion: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        bias_acceleration: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        link_inertia: Matrix6::from_array_storage(nalgebra::ArrayStorage([[0.0; 6]; 6])),
        link_bias: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        momentum: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        inertia: 0.0,
        torque: 0.0,
    };
}

/// Accelerations of bus attitude and joints in `state` under `control` and actuator force `force`
/// (RTN, N), at mean motion `n` [rad/s]. Cost: about 1500 flops a link.
#[doc(alias = "ABA")]
pub fn acceleration<const NL: usize>(
    servicer: &Servicer<NL>,
    n: f64,
    state: &State<NL>,
    control: &Control<NL>,
    force: &Vector3<f64>,
) -> Acceleration<NL> {
    let bus_rotation = quaternion::rotation_matrix(&state.attitude);
    let bus = Body {
        mass: servicer.bus_mass_kg,
        inertia: rotated_inertia(&bus_rotation, &servicer.bus_inertia_kg_m2),
        center: Vector3::zeros(),
        velocity: spatial(state.rate, Vector3::zeros()),
    };
    let mut joints = outward(servicer, n, state, &bus);
    let (mut inertia, mut bias) = inward(&mut joints, control);

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
        motion += joint.bias_acceleration;
        let value = (joint.torque - joint.momentum.dot(&motion)) / joint.inertia;
        joint_acceleration[i] = value;
        motion += joint.motion * value;
    }
    Acceleration { bus: angular(&base), joint: joint_acceleration }
}

/// First pass, outwards: positions and velocities of the links, their inertias and bias forces.
#[inline]
fn outward<const NL: usize>(
    servicer: &Servicer<NL>,
    n: f64,
    state: &State<NL>,
    bus: &Body,
) -> [Joint; NL] {
    let mut joints = [Joint::ZERO; NL];
    let mut attitude = state.attitude;
    let mut position = quaternion::rotation_matrix(&attitude) * servicer.arm_base_m;
    let mut velocity = bus.velocity;
    for (i, (joint, link)) in joints.iter_mut().zip(&servicer.links).enumerate() {
        let turn = quaternion::exp(&(link.axis * state.joint_angle[i]));
        attitude = quaternion::product(&attitude, &turn);
        let rotation = quaternion::rotation_matrix(&attitude);
        let axis = rotation * link.axis;
        joint.motion = spatial(axis, position.cross(&axis));
        let turning = joint.motion * state.joint_rate[i];
        velocity += turning;
        joint.bias_acceleration = cross_motion(&velocity, &turning);
        let body = Body {
            mass: link.mass_kg,
            inertia: rotated_inertia(&rotation, &link.inertia_kg_m2),
            center: position + rotation * link.center_of_mass_m,
            velocity,
        };
        joint.inertia = link.armature_kg_m2;
        joint.link_inertia = body.spatial_inertia();
        joint.link_bias = body.bias(n);
        position += rotation * link.tip_m;
    }
    joints
}

/// Second pass, inwards: articulated inertia and bias force of the whole arm.
#[inline]
fn inward<const NL: usize>(
    joints: &mut [Joint; NL],
    control: &Control<NL>,
) -> (Matrix6<f64>, Vector6<f64>) {
    let (mut inertia, mut bias) = (Matrix6::zeros(), Vector6::zeros());
    for (i, joint) in joints.iter_mut().enumerate().rev() {
        inertia += joint.link_inertia;
        bias += joint.link_bias;
        joint.momentum = inertia * joint.motion;
        joint.inertia += joint.motion.dot(&joint.momentum);
        joint.torque = control.joint_torque[i] - joint.motion.dot(&bias);
        inertia -= joint.momentum * joint.momentum.transpose() / joint.inertia;
        bias += inertia * joint.bias_acceleration + joint.momentum * (joint.torque / joint.inertia);
    }
    (inertia, bias)
}
