//! Bus and arm as one floating multibody system, by momenta.
//!
//! Unknowns are, in inertial axes about the system's centre of mass, the angular momentum `H` of all
//! bodies and each joint's momentum `p_j`, the angular momentum of all outside joint `j` about its
//! pivot along its axis, with the rotor's. In velocities these are `[H; p] = M [w; alpha']`
//! ([`MassMatrix`], translation eliminated), and Newton's and Euler's laws for all bodies outside a
//! pivot that moves give (T. R. Kane, D. A. Levinson, *Dynamics: Theory and Applications*; the
//! quasi-momentum form of Boltzmann and Hamel)
//!
//! ```text
//! H'   = moment of all external forces about the centre of mass
//! p_j' = tau_j + e_j . N_j + (w x e_j) . L_j - e_j . (o_j' x P_j)
//! ```
//!
//! with `e_j` the joint's axis, `w` the rate of the body it is fixed in, `o_j` its pivot, and `P_j`,
//! `L_j`, `N_j` momentum, angular momentum and moment of external forces of what is outside, about
//! the pivot. Velocities and forces are those relative to the centre of mass: of a body's force,
//! `m_i` times the acceleration of the centre of mass is taken off. So without external moments `H`
//! does not change by as much as a bit, no accelerations have to be solved for, and a joint that
//! sticks loses exactly the momentum that its brake takes.

mod mass_matrix;
mod pose;

pub use mass_matrix::MassMatrix;
pub use pose::Pose;

use crate::vehicle::Vehicle;
use nalgebra::{Matrix3, Vector3};

/// Rates of bus and joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates<const NL: usize> {
    /// Of the bus, inertial axes [rad/s].
    pub bus: Vector3<f64>,
    /// Of the joints [rad/s].
    pub joints: [f64; NL],
}

/// Angular momenta, as in the module's head [N m s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momenta<const NL: usize> {
    /// Of all bodies about the centre of mass, inertial axes; without the wheels'.
    pub system: Vector3<f64>,
    /// Of the joints.
    pub joints: [f64; NL],
}

/// External force at a body's centre of mass and moment, inertial axes [N], [N m].
#[derive(Clone, Copy, Debug)]
pub struct Wrench {
    /// Force through the centre of mass.
    pub force: Vector3<f64>,
    /// Moment about it.
    pub moment: Vector3<f64>,
}

/// A vehicle with what is the same in every pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Multibody<const NL: usize> {
    /// The data.
    pub vehicle: Vehicle<NL>,
    /// Mass of all bodies [kg].
    pub mass: f64,
    /// Mass outside each joint [kg].
    outer: [f64; NL],
}

impl<const NL: usize> Multibody<NL> {
    /// Of a vehicle.
    pub fn new(vehicle: Vehicle<NL>) -> Self {
        let mut outer = [0.0; NL];
        let mut sum = 0.0;
        for j in (0..NL).rev() {
            sum += vehicle.joints[j].link.mass;
            outer[j] = sum;
        }
        Self { vehicle, mass: vehicle.mass(), outer }
    }

    /// Rates of the momenta [N m] but for the joints' torques.
    #[inline]
    pub(crate) fn momentum_rates(
        &self,
        pose: &Pose<NL>,
        matrix: &MassMatrix<NL>,
        rates: &Rates<NL>,
        (bus, links): (&Wrench, &[Wrench; NL]),
    ) -> (Momenta<NL>, Vector3<f64>) {
        let vehicle = &self.vehicle;
        let force = links.iter().fold(bus.force, |sum, wrench| sum + wrench.force);
        let acceleration = force / self.mass;
        let velocities = self.velocities(pose, rates);
        let mut joints = [0.0; NL];
        // Sums over all that is outside a pivot, about the centre of mass.
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        let (mut pull, mut twist) = (Vector3::zeros(), Vector3::zeros());
        for j in (0..NL).rev() {
            let (mass, motion) = (vehicle.joints[j].link.mass, &velocities.links[j]);
            let momentum = motion.center * mass;
            linear += momentum;
            angular += matrix.links[j] * motion.rate + pose.centers[j].cross(&momentum);
            let push = links[j].force - acceleration * mass;
            pull += push;
            twist += links[j].moment + pose.centers[j].cross(&push);
            let (axis, pivot) = (&pose.axes[j], &pose.pivots[j]);
            joints[j] = axis.dot(&(twist - pivot.cross(&pull)))
                + motion.rate.cross(axis).dot(&(angular - pivot.cross(&linear)))
                - axis.dot(&motion.pivot.cross(&linear));
        }
        let push = bus.force - acceleration * vehicle.bus.mass;
        let system = twist + bus.moment + pose.bus_center.cross(&push);
        (Momenta { system, joints }, acceleration)
    }

    /// Velocities of all bodies relative to the system's centre of mass.
    #[inline]
    pub fn velocities(&self, pose: &Pose<NL>, rates: &Rates<NL>) -> Velocities<NL> {
        let zero = Vector3::zeros();
        let mut links = [BodyVelocity { rate: zero, pivot: zero, center: zero }; NL];
        // First relative to the bus's origin, then all less the centre of mass's velocity.
        let (mut rate, mut place, mut velocity) = (rates.bus, pose.bus_origin, zero);
        let bus = rate.cross(&(pose.bus_center - place));
        let mut sum = bus * self.vehicle.bus.mass;
        for j in 0..NL {
            velocity += rate.cross(&(pose.pivots[j] - place));
            place = pose.pivots[j];
            rate += pose.axes[j] * rates.joints[j];
            let center = velocity + rate.cross(&(pose.centers[j] - place));
            sum += center * self.vehicle.joints[j].link.mass;
            links[j] = BodyVelocity { rate, pivot: velocity, center };
        }
        let mean = sum / self.mass;
        for link in &mut links {
            link.pivot -= mean;
            link.center -= mean;
        }
        Velocities { bus_origin: -mean, bus_center: bus - mean, links }
    }

    /// Kinetic energy [J] of the motion relative to the centre of mass, body by body.
    pub fn kinetic_energy(&self, pose: &Pose<NL>, rates: &Rates<NL>) -> f64 {
        let velocities = self.velocities(pose, rates);
        let energy = |mass: f64, v: &Vector3<f64>, inertia: &Matrix3<f64>, w: &Vector3<f64>| {
            0.5 * (mass * v.dot(v) + w.dot(&(inertia * w)))
        };
        let bus = &self.vehicle.bus;
        let turned = |body: &Matrix3<f64>, by: &Matrix3<f64>| crate::rotation::turned(body, by);
        let mut sum = energy(
            bus.mass,
            &velocities.bus_center,
            &turned(&bus.inertia, &pose.bus_rotation),
            &rates.bus,
        );
        for j in 0..NL {
            let (joint, v) = (&self.vehicle.joints[j], &velocities.links[j]);
            let inertia = turned(&joint.link.inertia, &pose.rotations[j]);
            sum += energy(joint.link.mass, &v.center, &inertia, &v.rate);
            sum += 0.5 * joint.armature * rates.joints[j] * rates.joints[j];
        }
        sum
    }
}

/// Velocities relative to the system's centre of mass, inertial axes [m/s], [rad/s].
#[derive(Clone, Copy, Debug)]
pub struct Velocities<const NL: usize> {
    /// Of the bus frame's origin.
    pub bus_origin: Vector3<f64>,
    /// Of the bus's centre of mass.
    pub bus_center: Vector3<f64>,
    /// Of the links.
    pub links: [BodyVelocity; NL],
}

/// Of one link.
#[derive(Clone, Copy, Debug)]
pub struct BodyVelocity {
    /// Angular [rad/s].
    pub rate: Vector3<f64>,
    /// Of the joint's pivot [m/s].
    pub pivot: Vector3<f64>,
    /// Of the centre of mass [m/s].
    pub center: Vector3<f64>,
}
