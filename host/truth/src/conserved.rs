//! Conserved quantities: energy and momenta of the servicer, from all its bodies.

use crate::rotation::matrix;
use crate::world::World;
use nalgebra::Vector3;

impl<const NL: usize> World<NL> {
    /// Kinetic energy [J] of the servicer relative to the target's centre of mass.
    pub fn kinetic_energy(&self) -> f64 {
        let now = self.body.instant(&self.state, &self.locked());
        let v = self.state.velocity();
        0.5 * self.body.mass * v.dot(&v) + self.body.kinetic_energy(&now.pose, &now.rates)
    }

    /// Kinetic and gravitational energy [J] of the servicer in inertial space, body by body.
    pub fn energy(&self) -> f64 {
        let now = self.body.instant(&self.state, &self.locked());
        let (position, velocity) = self.track.orbit(self.time());
        let (center, v) = (position + self.state.position(), velocity + self.state.velocity());
        let vehicle = &self.body.vehicle;
        let bus = center + now.pose.bus_center;
        let mut potential = vehicle.bus.mass * self.environment.potential(&bus);
        for (joint, place) in vehicle.joints.iter().zip(&now.pose.centers) {
            potential += joint.link.mass * self.environment.potential(&(center + place));
        }
        let translation = 0.5 * self.body.mass * v.dot(&v);
        translation + self.body.kinetic_energy(&now.pose, &now.rates) + potential
    }

    /// Momentum [N s] of the servicer relative to the target's centre of mass, inertial axes.
    pub fn linear_momentum(&self) -> Vector3<f64> {
        self.state.velocity() * self.body.mass
    }

    /// Angular momentum [N m s] of all bodies about the servicer's centre of mass, inertial axes,
    /// summed body by body. With `wheel_momentum` the wheels' is part of it.
    pub fn angular_momentum(&self) -> Vector3<f64> {
        let now = self.body.instant(&self.state, &self.locked());
        let velocities = self.body.velocities(&now.pose, &now.rates);
        let vehicle = &self.body.vehicle;
        let mut sum = now.matrix.bus * now.rates.bus
            + now.pose.bus_center.cross(&(velocities.bus_center * vehicle.bus.mass));
        for j in 0..NL {
            let link = &velocities.links[j];
            let momentum = link.center * vehicle.joints[j].link.mass;
            sum += now.matrix.links[j] * link.rate + now.pose.centers[j].cross(&momentum);
        }
        if self.environment.wheel_momentum {
            sum += matrix(&self.state.attitude()) * self.state.wheels();
        }
        sum
    }
}
