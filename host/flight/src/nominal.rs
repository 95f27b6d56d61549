//! The truth's world as the planner believes it to be: the setup whose errors a dispersion draws.

use nalgebra::{Matrix3, Vector3, Vector4};
use remora_core::advanced::dynamics::{EndEffectorPose, Multibody, State};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario, Switch};
use remora_truth::{
    Body, Environment, Joint, Limits, Orbit, Rtn, Servo, Setup, Start, Target, Vehicle, rotation,
};

/// Farthest from the port that the tip's passage of the port's plane ends a flight [m].
const CONTACT_RADIUS: f64 = 0.1;

/// Choices about the world besides mission and scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Gravity and what follows from it; its strength is the mission's.
    pub environment: Environment,
    /// Argument of latitude at the start, from the ascending node [rad].
    pub argument_of_latitude: f64,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { environment: Environment::EARTH, argument_of_latitude: 0.0 }
    }
}

/// The nominal world of a scenario: servicer and target as the mission has them, on the mission's orbit
/// about its body. Where the orbit is an ellipse, the perigee is at the ascending node.
pub fn setup<const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    surroundings: &Surroundings,
) -> Setup<NL> {
    let orbit = Orbit {
        semi_major_axis: mission.orbit.semi_major_axis_m,
        eccentricity: mission.orbit.eccentricity,
        inclination: mission.orbit.inclination_rad,
        argument_of_latitude: surroundings.argument_of_latitude,
        argument_of_perigee: 0.0,
    };
    let mut environment =
        surroundings.environment.about(mission.orbit.gravitational_parameter_m3_s2);
    environment.target_gravity_gradient &= mission.target.gravity_gradient != Switch::Off;
    let (r, v) = orbit.state(environment.mu);
    let frame = Rtn::of(&r, &v);
    let (axes, spin) = (&frame.axes, Vector3::new(0.0, 0.0, frame.rate));
    let first = State::at_start(mission, scenario);
    let vehicle = vehicle(mission);
    let start = Start {
        position: axes * scenario.position,
        velocity: axes * (scenario.velocity + spin.cross(&scenario.position)),
        attitude: to_inertial(axes, &first.attitude),
        rate: axes * (first.rate + spin),
        joint_angle: first.joint_angle.data.0[0],
        joint_rate: first.joint_rate.data.0[0],
        wheel_momentum: Vector3::zeros(),
    }
    .from_center_of_mass(&vehicle);
    let attitude = to_inertial(axes, &scenario.target_attitude);
    let to_body = quaternion::rotation_matrix(&scenario.target_attitude).transpose();
    Setup {
        vehicle,
        target: Target {
            inertia: mission.target.inertia_kg_m2,
            port: mission.target.port_position_m,
            normal: mission.target.port_normal,
            attitude,
            rate: scenario.target_rate + to_body * spin,
            disturbance: Vector3::zeros(),
        },
        orbit,
        environment,
        start,
        contact_radius: CONTACT_RADIUS,
    }
}

/// Attitude to inertial axes of a body whose attitude to RTN is `q`.
fn to_inertial(axes: &Matrix3<f64>, q: &Vector4<f64>) -> rotation::Quaternion {
    let frame = quaternion::from_rotation_matrix(axes);
    quaternion::product(&frame, q).data.0[0]
}

/// The mission's servicer.
fn vehicle<const NL: usize>(mission: &Mission<NL>) -> Vehicle<NL> {
    let servicer = &mission.servicer;
    let joints = core::array::from_fn(|i| {
        let link = &servicer.links[i];
        let pivot = match i.checked_sub(1) {
            None => servicer.arm_base_m,
            Some(before) => servicer.links[before].tip_m,
        };
        let body =
            Body { mass: link.mass_kg, center: link.center_of_mass_m, inertia: link.inertia_kg_m2 };
        Joint { pivot, axis: link.axis, link: body, armature: link.armature_kg_m2 }
    });
    Vehicle {
        bus: Body {
            mass: servicer.bus_mass_kg,
            center: Vector3::zeros(),
            inertia: servicer.bus_inertia_kg_m2,
        },
        force_point: Vector3::zeros(),
        joints,
        tip: servicer.links.last().map_or(servicer.arm_base_m, |link| link.tip_m),
        approach: approach(mission),
        limits: Limits {
            force: servicer.force_limit_n.data.0[0],
            bus_torque: servicer.bus_torque_limit_n_m.data.0[0],
            wheel_momentum: [f64::INFINITY; 3],
            joint_torque: servicer.joint_torque_limit_n_m.data.0[0],
        },
        servo: [Servo::DEFAULT; NL],
    }
}

/// The axis of the last link that the plan points at the port: from the centre of mass to the end
/// effector in the capture configuration.
fn approach<const NL: usize>(mission: &Mission<NL>) -> Vector3<f64> {
    let captured =
        State { joint_angle: mission.servicer.capture_joint_angle_rad, ..State::<NL>::ZERO };
    let EndEffectorPose { position, rotation } = Multibody::new(mission).end_effector(&captured);
    let along = rotation.tr_mul(&position);
    along / libm::sqrt(along.dot(&along))
}
