//! Cases and the reference that the dynamics are checked against.

use nalgebra::{Matrix3, Quaternion, SVector, Unit, UnitQuaternion, Vector3, Vector4};
use proptest::prelude::*;
use remora_core::advanced::dynamics::{Acceleration, Control, Integrator, Multibody, State};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{
    Corridor, Link, Margins, Mission, Orbit, ScenarioRanges, Servicer,
};

/// A servicer in an orbit, in some state, under some load. `NX` and `NU` are the sizes of state and
/// control that go with `NL` links.
#[derive(Clone, Debug)]
pub struct Case<const NL: usize, const NX: usize, const NU: usize> {
    pub servicer: Servicer<NL>,
    pub mean_motion: f64,
    pub state: State<NL>,
    pub control: Control<NL>,
    pub force: Vector3<f64>,
}

impl<const NL: usize, const NX: usize, const NU: usize> Case<NL, NX, NU> {
    pub fn mission(&self) -> Mission<NL> {
        let Mission { target, approach, weights, tolerances, .. } = Mission::default();
        let orbit = Orbit {
            gravitational_parameter_m3_s2: self.mean_motion * self.mean_motion,
            semi_major_axis_m: 1.0,
            ..Orbit::default()
        };
        let servicer = self.servicer;
        Mission {
            orbit,
            target,
            servicer,
            approach,
            weights,
            tolerances,
            margins: Margins::default(),
            corridor: Corridor::default(),
            scenarios: ScenarioRanges::default(),
            typical_magnitudes: None,
            roll: None,
        }
    }

    /// Accelerations, bus first.
    pub fn acceleration(&self) -> SVector<f64, NU> {
        stacked(&Multibody::new(&self.mission()).acceleration(
            &self.state,
            &self.control,
            &self.force,
        ))
    }

    pub fn stepped(&self, integrator: Integrator, dt: f64) -> Self {
        let mission = self.mission();
        let body = Multibody::new(&mission);
        let state = body.step(integrator, dt, &self.state, &self.control, &self.force);
        Self { state, ..self.clone() }
    }

    /// The state moved by `amount` along tangent direction `[dtheta, alpha, rate, joint_rate]`.
    pub fn with_state_moved(&self, direction: usize, amount: f64) -> Self {
        let mut moved = self.clone();
        let state = &mut moved.state;
        match direction {
            j if j < 3 => {
                let turn = quaternion::exp(&Vector3::ith(j, amount));
                state.attitude = quaternion::product(&turn, &state.attitude);
            }
            j if j < 3 + NL => state.joint_angle[j - 3] += amount,
            j if j < 6 + NL => state.rate[j - 3 - NL] += amount,
            j => state.joint_rate[j - 6 - NL] += amount,
        }
        moved
    }

    pub fn with_control_moved(&self, direction: usize, amount: f64) -> Self {
        let mut moved = self.clone();
        match direction {
            j if j < 3 => moved.control.bus_torque[j] += amount,
            j => moved.control.joint_torque[j - 3] += amount,
        }
        moved
    }

    pub fn with_force_moved(&self, direction: usize, amount: f64) -> Self {
        let mut moved = self.clone();
        moved.force[direction] += amount;
        moved
    }
}

pub fn stacked<const NL: usize, const NU: usize>(a: &Acceleration<NL>) -> SVector<f64, NU> {
    SVector::from_iterator(a.bus.iter().chain(a.joint.iter()).copied())
}

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn joints<const NL: usize>(limit: f64) -> impl Strategy<Value = SVector<f64, NL>> {
    prop::array::uniform::<_, NL>(-limit..limit).prop_map(SVector::from)
}

fn unit_vector() -> impl Strategy<Value = Vector3<f64>> {
    vector(1.0).prop_filter("not near zero", |v| v.norm() > 0.1).prop_map(|v| v.normalize())
}

fn attitude() -> impl Strategy<Value = Vector4<f64>> {
    prop::array::uniform4(-1.0..1.0)
        .prop_map(Vector4::from)
        .prop_filter("not near zero", |q| q.norm() > 0.1)
        .prop_map(|q| quaternion::normalized(&q))
}

/// Moments that a body can have: none above the sum of the other two.
fn moments(low: f64, high: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(low..high).prop_map(|[a, b, c]| Vector3::new(b + c, c + a, a + b))
}

/// An inertia tensor with these moments about any three axes.
fn inertia(low: f64, high: f64) -> impl Strategy<Value = Matrix3<f64>> {
    (moments(low, high), attitude()).prop_map(|(moments, attitude)| {
        let axes = quaternion::rotation_matrix(&attitude);
        let tensor = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
        (tensor + tensor.transpose()) * 0.5
    })
}

fn link() -> impl Strategy<Value = Link> {
    (vector(0.8), vector(0.4), 5.0..20.0, inertia(0.2, 1.0), unit_vector(), 0.0..2.0).prop_map(
        |(tip, center_of_mass, mass, inertia, axis, armature)| Link {
            tip_m: tip,
            center_of_mass_m: center_of_mass,
            mass_kg: mass,
            inertia_kg_m2: inertia,
            axis,
            armature_kg_m2: armature,
            radius_m: 0.05,
            ..Link::default()
        },
    )
}

fn servicer<const NL: usize>() -> impl Strategy<Value = Servicer<NL>> {
    let links = prop::array::uniform::<_, NL>(link());
    (100.0..500.0, inertia(10.0, 40.0), vector(0.5), links).prop_map(
        |(bus_mass, bus_inertia, arm_base, links)| Servicer {
            bus_mass_kg: bus_mass,
            bus_inertia_kg_m2: bus_inertia,
            bus_half_extents_m: Vector3::repeat(0.5),
            boresight: Vector3::z(),
            arm_base_m: arm_base,
            links,
            min_joint_angle_rad: SVector::repeat(-3.0),
            max_joint_angle_rad: SVector::repeat(3.0),
            joint_rate_limit_rad_s: SVector::repeat(1.0),
            initial_joint_angle_rad: SVector::zeros(),
            capture_joint_angle_rad: SVector::zeros(),
            force_limit_n: Vector3::repeat(1.0),
            bus_torque_limit_n_m: Vector3::repeat(1.0),
            joint_torque_limit_n_m: SVector::repeat(1.0),
        },
    )
}

fn state<const NL: usize>(rate: f64, joint_rate: f64) -> impl Strategy<Value = State<NL>> {
    (attitude(), joints(3.0), vector(rate), joints(joint_rate)).prop_map(
        |(attitude, joint_angle, rate, joint_rate)| State {
            attitude,
            joint_angle,
            rate,
            joint_rate,
        },
    )
}

fn control<const NL: usize>(bus: f64, joint: f64) -> impl Strategy<Value = Control<NL>> {
    (vector(bus), joints(joint))
        .prop_map(|(bus_torque, joint_torque)| Control { bus_torque, joint_torque })
}

/// A lively arm: all terms of the equations are of comparable size, and things happen in seconds.
pub fn lively<const NL: usize, const NX: usize, const NU: usize>()
-> impl Strategy<Value = Case<NL, NX, NU>> {
    (servicer(), 0.0..0.2, state(0.3, 0.5), control(5.0, 0.5), vector(5.0)).prop_map(
        |(servicer, mean_motion, state, control, force)| Case {
            servicer,
            mean_motion,
            state,
            control,
            force,
        },
    )
}

/// The mission's own servicer and orbit, at the magnitudes its plans have.
pub fn on_mission() -> impl Strategy<Value = Case<3, 12, 6>> {
    (state(2e-3, 5e-3), control(5e-4, 5e-4), vector(0.05)).prop_map(|(state, control, force)| {
        let (servicer, mean_motion) = (Servicer::default(), Orbit::default().mean_motion());
        Case { servicer, mean_motion, state, control, force }
    })
}

/// RTN axes, relative to the bus centre of mass; the velocity relative to RTN.
pub struct Point {
    pub mass: f64,
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
}

/// The servicer as point masses: six a body, in pairs along its principal axes. Rotors have no mass of
/// their own: their inertia is the joint's alone.
pub fn cloud<const NL: usize>(servicer: &Servicer<NL>, state: &State<NL>) -> Vec<Point> {
    let mut points = Vec::new();
    let mut add = |mass: f64, inertia: Matrix3<f64>, turn, center, velocity, rate: Vector3<f64>| {
        // The second moments along the axes that these moments of inertia come from.
        let principal = inertia.symmetric_eigen();
        let spread = Vector3::repeat(principal.eigenvalues.sum() / 2.0) - principal.eigenvalues;
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let along: Vector3<f64> = principal.eigenvectors.column(axis).into();
            let arm = turn * along * (sign * (3.0 * spread[axis] / mass).sqrt());
            let (position, velocity) = (center + arm, velocity + rate.cross(&arm));
            points.push(Point { mass: mass / 6.0, position, velocity });
        }
    };
    let mut turn = UnitQuaternion::new_normalize(Quaternion::from(state.attitude));
    let (mut rate, origin) = (state.rate, Vector3::zeros());
    add(servicer.bus_mass_kg, servicer.bus_inertia_kg_m2, turn, origin, origin, rate);
    let mut joint = turn * servicer.arm_base_m;
    let mut joint_velocity = rate.cross(&joint);
    for (i, link) in servicer.links.iter().enumerate() {
        rate += turn * link.axis * state.joint_rate[i];
        let axis = Unit::new_unchecked(link.axis);
        turn *= UnitQuaternion::from_axis_angle(&axis, state.joint_angle[i]);
        let (center, tip) = (turn * link.center_of_mass_m, turn * link.tip_m);
        let velocity = joint_velocity + rate.cross(&center);
        add(link.mass_kg, link.inertia_kg_m2, turn, joint + center, velocity, rate);
        joint += tip;
        joint_velocity += rate.cross(&tip);
    }
    points
}

/// Mass-weighted mean of something over the cloud.
pub fn mean(cloud: &[Point], what: impl Fn(&Point) -> Vector3<f64>) -> Vector3<f64> {
    let mass: f64 = cloud.iter().map(|p| p.mass).sum();
    cloud.iter().map(|p| what(p) * (p.mass / mass)).sum()
}

/// The cloud seen from its own centre of mass, and that centre (from the bus).
pub fn about_center(mut cloud: Vec<Point>) -> (Vec<Point>, Point) {
    let (position, velocity) = (mean(&cloud, |p| p.position), mean(&cloud, |p| p.velocity));
    for p in &mut cloud {
        p.position -= position;
        p.velocity -= velocity;
    }
    let mass = cloud.iter().map(|p| p.mass).sum();
    (cloud, Point { mass, position, velocity })
}
