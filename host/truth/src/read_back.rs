//! Drawn values, read back from the truth itself: a dispersion that never took effect shows.

use crate::orbit::eccentricity;
use crate::vehicle::Body;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// One number of the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its name: section and key of the errors file, with what it belongs to.
    pub name: String,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// Its value in the truth.
    pub value: f64,
}

/// A list under construction.
struct List(Vec<Quantity>);

impl List {
    fn add(&mut self, name: String, unit: &'static str, value: f64) {
        self.0.push(Quantity { name, unit, value });
    }

    fn vector(&mut self, name: &str, unit: &'static str, v: &Vector3<f64>) {
        for (axis, value) in ["x", "y", "z"].iter().zip(v.iter()) {
            self.add(format!("{name}.{axis}"), unit, *value);
        }
    }

    fn row(&mut self, name: &str, unit: &'static str, values: &[f64]) {
        for (i, value) in values.iter().enumerate() {
            self.add(format!("{name}[{i}]"), unit, *value);
        }
    }

    fn tensor(&mut self, name: &str, m: &Matrix3<f64>) {
        let elements = [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2)];
        for (axes, row, column) in elements.into_iter().chain([("yz", 1, 2)]) {
            self.add(format!("{name}.{axes}"), "kg m^2", m[(row, column)]);
        }
    }

    fn body(&mut self, name: &str, body: &Body) {
        self.add(format!("mass.{name}.mass"), "kg", body.mass);
        self.tensor(&format!("mass.{name}.inertia"), &body.inertia);
        self.vector(&format!("mass.{name}.center"), "m", &body.center);
    }
}

impl<const NL: usize> World<NL> {
    /// Reads this run's drawn values from the bodies, actuators and sensors that fly. At time
    /// zero these are the draw's values; the target's motion and drifts go on with time.
    pub fn read_back(&self) -> Vec<Quantity> {
        let mut list = List(Vec::new());
        self.read_servicer(&mut list);
        self.read_actuators(&mut list);
        self.read_target(&mut list);
        self.read_sensors(&mut list);
        list.0
    }

    fn read_servicer(&self, list: &mut List) {
        let vehicle = &self.body.vehicle;
        list.body("bus", &vehicle.bus);
        for (i, joint) in vehicle.joints.iter().enumerate() {
            list.body(&format!("link[{i}]"), &joint.link);
        }
        if let Some(first) = vehicle.joints.first() {
            list.vector("geometry.arm_base", "m", &first.pivot);
        }
    }

    fn read_actuators(&self, list: &mut List) {
        let a = &self.actuators;
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let column = a.thrusters.gain.column(axis).into_owned();
            list.vector(&format!("thrusters.{name}"), "", &column);
        }
        list.row("wheels.scale", "", &a.wheels.scale);
        list.row("wheels.bias", "N m", &a.wheels.bias);
        list.row("joints.scale", "", &a.joints.gain);
        list.row("joints.bias", "N m", &a.joints.bias);
        list.row("joints.friction", "N m", &a.joints.friction);
        list.vector("orbit.disturbance", "N m", &a.disturbance);
        list.add("orbit.drag".into(), "m/s^2", a.drag);
    }

    fn read_target(&self, list: &mut List) {
        let motion = self.track.at(self.time());
        list.vector("geometry.port", "m", &self.target.port);
        list.vector("tumble.rate", "rad/s", &motion.rate);
        for (name, value) in ["x", "y", "z", "w"].iter().zip(motion.attitude) {
            list.add(format!("tumble.attitude.{name}"), "", value);
        }
        list.vector("tumble.inertia", "kg m^2", self.track.inertia());
        list.vector("orbit.target_disturbance", "N m", self.track.disturbance());
        // A straight line has none.
        let e = match self.environment.has_gravity {
            true => eccentricity(&motion.position, &motion.velocity, self.environment.mu),
            false => Vector3::zeros(),
        };
        list.vector("orbit.eccentricity", "", &e);
    }

    fn read_sensors(&self, list: &mut List) {
        let s = &self.sensors;
        list.row("joints.angle_bias", "rad", &s.encoder_bias);
        list.vector("navigation.position_drift", "m", s.biases.position.drift.value());
        list.vector("navigation.attitude_drift", "rad", s.biases.attitude.drift.value());
        let drift = s.biases.target_attitude.drift.value();
        list.vector("navigation.target_attitude_drift", "rad", drift);
        list.vector("geometry.wrist_camera", "m", &s.biases.wrist_camera);
    }
}
