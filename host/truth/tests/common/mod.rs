//! The servicer and target of `docs/concepts/problem.md`, and an arm that nothing about is symmetric.
#![allow(dead_code)]

use nalgebra::{Matrix3, Vector3};
use remora_truth::{
    Body, Dispersion, Environment, Errors, Joint, Limits, Orbit, Servo, Setup, Start, Target,
    Vehicle,
};

/// Section 3: bus of 500 kg, three links about y.
pub fn servicer() -> Vehicle<3> {
    let lengths = [0.75, 0.75, 0.30];
    let joints = core::array::from_fn(|j| {
        let across = 10.0 * (3.0 * 0.05 * 0.05 + lengths[j] * lengths[j]) / 12.0;
        let along = 0.5 * 10.0 * 0.05 * 0.05;
        let height = if j == 0 { 0.116 } else { lengths[j - 1] };
        Joint {
            pivot: Vector3::new(0.0, 0.0, height),
            axis: Vector3::y(),
            link: Body {
                mass: 10.0,
                center: Vector3::new(0.0, 0.0, 0.5 * lengths[j]),
                inertia: Matrix3::from_diagonal(&Vector3::new(across, across, along)),
            },
            armature: 0.0,
        }
    });
    Vehicle {
        bus: Body {
            mass: 500.0,
            center: Vector3::zeros(),
            inertia: Matrix3::from_diagonal_element(83.3),
        },
        force_point: Vector3::zeros(),
        joints,
        tip: Vector3::new(0.0, 0.0, 0.30),
        approach: Vector3::z(),
        limits: Limits {
            force: [2.5; 3],
            bus_torque: [5e-3; 3],
            wheel_momentum: [f64::INFINITY; 3],
            joint_torque: [5e-3; 3],
        },
        servo: [Servo::DEFAULT; 3],
    }
}

/// A vector that has no symmetry.
fn odd(j: usize, scale: f64) -> Vector3<f64> {
    let x = (j % 3) as f64;
    Vector3::new(0.3 + 0.17 * x, 0.5 - 0.23 * x, 0.4 + 0.11 * x * x) * scale
}

/// Axes, tensors and centres askew, rotors, force point off the centre.
pub fn skewed<const NL: usize>() -> Vehicle<NL> {
    let tensor = |j: usize| {
        let v = odd(j, 1.0);
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.3, 0.8)) - v * v.transpose() * 0.4
    };
    Vehicle {
        bus: Body { mass: 120.0, center: odd(4, 0.05), inertia: tensor(3) * 20.0 },
        force_point: odd(1, 0.1),
        joints: core::array::from_fn(|j| {
            let axis = odd(j + 2, 1.0);
            Joint {
                pivot: odd(j, 0.6),
                axis: axis / axis.dot(&axis).sqrt(),
                link: Body { mass: 8.0 - j as f64, center: odd(j + 1, 0.3), inertia: tensor(j) },
                armature: 0.02 * j as f64,
            }
        }),
        tip: odd(2, 0.4),
        approach: Vector3::x(),
        limits: Limits::NONE,
        servo: [Servo::DEFAULT; NL],
    }
}

/// Section 2, tumbling.
pub fn target() -> Target {
    Target {
        inertia: Vector3::new(2.5, 3.0, 2.0),
        port: Vector3::new(0.0, 0.0, 0.2),
        normal: Vector3::z(),
        attitude: [0.1, -0.2, 0.3, 0.9273618495495703],
        rate: Vector3::new(8e-4, -6e-4, 1.6e-3),
        disturbance: Vector3::zeros(),
    }
}

pub fn orbit() -> Orbit {
    Orbit {
        semi_major_axis: 6.8e6,
        eccentricity: 1e-3,
        inclination: 97f64.to_radians(),
        argument_of_latitude: 0.7,
        argument_of_perigee: 0.2,
    }
}

/// A flight of any vehicle five metres from the target.
pub fn setup<const NL: usize>(vehicle: Vehicle<NL>) -> Setup<NL> {
    Setup {
        vehicle,
        target: target(),
        orbit: orbit(),
        environment: Environment::EARTH,
        start: Start {
            position: Vector3::new(3.0, -4.0, 1.0),
            velocity: Vector3::new(1e-3, 2e-3, -3e-3),
            attitude: [0.5, -0.5, 0.1, 0.7],
            rate: Vector3::new(1e-3, -2e-3, 1.5e-3),
            joint_angle: core::array::from_fn(|j| 0.4 - 0.7 * j as f64),
            joint_rate: core::array::from_fn(|j| 4e-3 - 3e-3 * j as f64),
            wheel_momentum: Vector3::zeros(),
        },
        contact_radius: 0.2,
    }
}

pub fn exact() -> Dispersion {
    Dispersion { errors: Errors::none(), seed: 1, run: 0 }
}

/// No errors and as good as no sensors: one sample a thousand seconds.
pub fn quiet() -> Dispersion {
    let mut dispersion = exact();
    let slow = remora_truth::Sampling { rate_hz: 1e-3, delay_s: 0.0 };
    dispersion.errors.sensors = remora_truth::Sensors::all(slow);
    dispersion
}
