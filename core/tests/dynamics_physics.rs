//! The dynamics against physics: laws that hold for any arm, checked from outside.
//!
//! The reference is not another multibody code but a cloud of point masses, six a body with the
//! body's mass, centre and inertia, for which energy, momentum and the orbit's forces are plain
//! sums. Arms are general: skew joint axes, three-axis link inertias, one to five links. Mean
//! motions go up to 0.2 rad/s, two hundred times a real orbit's, so that a mistake in an orbital
//! term can't hide behind the others.

#[path = "physics/mod.rs"]
mod physics;

use nalgebra::{Quaternion, SVector, UnitQuaternion, Vector3, Vector4};
use physics::{Case, Point, about_center, cloud, lively, mean, on_mission, stacked};
use proptest::prelude::*;
use remora_core::advanced::dynamics::{
    Acceleration, Control, Integrator, Multibody, State, Stepping, SystemState, articulated,
};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::hcw_acceleration;

/// Failing cases are printed whole; no seeds are kept in files.
fn config() -> ProptestConfig {
    ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() }
}

/// Runs a check for arms of one, two, three and five links.
macro_rules! for_any_arm {
    ($($name:ident),* $(,)?) => {$(
        mod $name {
            use super::*;
            proptest! {
                #![proptest_config(config())]
                // Verifies REM-DYN-004.
                #[test]
                fn one_link(case in lively::<1, 8, 4>()) { super::$name(&case); }
                #[test]
                fn two_links(case in lively::<2, 10, 5>()) { super::$name(&case); }
                // Verifies REM-DYN-004.
                #[test]
                fn three_links(case in lively::<3, 12, 6>()) { super::$name(&case); }
                // Verifies REM-DYN-004.
                #[test]
                fn five_links(case in lively::<5, 16, 8>()) { super::$name(&case); }
            }
        }
    )*};
}

for_any_arm!(
    free_flight_conserves_momentum_and_energy,
    momentum_and_energy_balance_under_load_and_tide,
    newtons_law_holds_for_every_point_mass,
    two_algorithms_agree,
    torques_invert_accelerations,
    axes_of_the_bus_are_a_matter_of_taste,
    acceleration_derivatives,
    step_derivatives,
    nonsense_in_gives_nonsense_out,
);

/// What the laws of conservation are about, and how fast the loads change it.
struct Balance {
    /// Angular momentum about the system's centre of mass, inertial axes; then the Jacobi integral
    /// about it: kinetic energy relative to RTN, and the potential of tide and centrifugal force.
    amount: Vector4<f64>,
    rate: Vector4<f64>,
}

fn balance<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
    time: f64,
) -> Balance {
    let (n, state, control) = (case.mean_motion, &case.state, &case.control);
    let (cloud, center) = about_center(cloud(&case.servicer, state));
    let frame = Vector3::new(0.0, 0.0, n);
    let to_inertial = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), n * time);
    let bus = UnitQuaternion::new_normalize(Quaternion::from(state.attitude));
    let torque = bus * control.bus_torque;

    let (mut momentum, mut moment, mut jacobi) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for Point { mass, position: s, velocity: v } in &cloud {
        momentum += s.cross(&(v + frame.cross(s))) * *mass;
        let tide = (Vector3::new(3.0 * s.x, 0.0, 0.0) - s) * (n * n);
        moment += s.cross(&tide) * *mass;
        jacobi += mass * (v.dot(v) - n * n * (3.0 * s.x * s.x - s.z * s.z)) / 2.0;
    }
    for (link, rate) in case.servicer.links.iter().zip(&state.joint_rate) {
        jacobi += link.armature_kg_m2 * rate * rate / 2.0;
    }
    // The force acts at the bus centre of mass.
    moment += torque - center.position.cross(&case.force);
    let power = torque.dot(&state.rate) + control.joint_torque.dot(&state.joint_rate)
        - case.force.dot(&center.velocity);
    Balance {
        amount: (to_inertial * momentum).push(jacobi),
        rate: (to_inertial * moment).push(power),
    }
}

/// Time step and length of the flights below. The liveliest arms reach some 5 rad/s, so that RK4
/// and Simpson's rule err by up to (5 STEP)^4 / 100 = 2e-9 of the amounts' size in the flight;
/// the median is at 1e-14.
const STEP: f64 = 2e-3;
const STEPS: usize = 1000;
const FLIGHT_TOLERANCE: f64 = 1e-8;

fn free_flight_conserves_momentum_and_energy<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let (control, force) = (Control::ZERO, Vector3::zeros());
    let start = Case { mean_motion: 0.0, control, force, ..case.clone() };
    let before = balance(&start, 0.0);
    assert_eq!(before.rate, Vector4::zeros());
    let end = start.stepped(Integrator::Rk4 { substeps: STEPS }, STEP * STEPS as f64);
    let (after, before) = (balance(&end, 0.0).amount, before.amount);
    let momentum = (after.xyz() - before.xyz()).norm();
    assert!(momentum < FLIGHT_TOLERANCE * before.xyz().norm(), "momentum: {momentum:e}");
    let energy = (after.w - before.w).abs();
    assert!(energy < FLIGHT_TOLERANCE * before.w, "energy: {energy:e}");
}

fn momentum_and_energy_balance_under_load_and_tide<
    const NL: usize,
    const NX: usize,
    const NU: usize,
>(
    case: &Case<NL, NX, NU>,
) {
    let before = balance(case, 0.0);
    let (mut at, mut integral) = (case.clone(), Vector4::zeros());
    let (mut size, mut left) = (before.amount.abs(), before.rate);
    for k in 0..STEPS {
        // Simpson's rule over each step, through the state in its middle.
        let t = STEP * k as f64;
        at = at.stepped(Integrator::Rk4 { substeps: 1 }, STEP / 2.0);
        let middle = balance(&at, t + STEP / 2.0).rate;
        at = at.stepped(Integrator::Rk4 { substeps: 1 }, STEP / 2.0);
        let right = balance(&at, t + STEP).rate;
        integral += (left + middle * 4.0 + right) * (STEP / 6.0);
        size += middle.abs() * STEP;
        left = right;
    }
    let error = balance(&at, STEP * STEPS as f64).amount - before.amount - integral;
    let momentum = error.xyz().norm();
    assert!(momentum < FLIGHT_TOLERANCE * size.xyz().norm(), "momentum: {momentum:e}");
    assert!(error.w.abs() < FLIGHT_TOLERANCE * size.w, "Jacobi integral: {:e}", error.w);
}

/// d'Alembert: what Newton's law leaves over on the point masses does no work but that of the
/// actuators, along any motion the joints allow.
fn newtons_law_holds_for_every_point_mass<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let (n, state) = (case.mean_motion, &case.state);
    let (position, velocity) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.3, 0.1, -0.2));
    let full = SystemState { position, velocity, internal: *state };
    let mission = case.mission();
    let body = Multibody::new(&mission);
    let rates = body.system_rates(&full, &case.control, &case.force);

    // A curve through the state with the rates and accelerations found.
    let along = |t: f64| {
        let theta = state.rate * t + rates.rate * (t * t / 2.0);
        let internal = State {
            attitude: quaternion::product(&quaternion::exp(&theta), &state.attitude),
            joint_angle: state.joint_angle
                + state.joint_rate * t
                + rates.joint_rate * (t * t / 2.0),
            ..*state
        };
        let bus = velocity * t + rates.bus * (t * t / 2.0);
        cloud(&case.servicer, &internal).into_iter().map(move |p| p.position + bus)
    };
    // Sixth-order second difference: rounds to 5 eps / h^2 = 6e-12 m/s^2, a few 1e-9 N on the bus,
    // which is what remains; terms here are of the order of 100 N.
    let (h, tolerance) = (1e-2, 3e-8);
    let mut acceleration = vec![Vector3::zeros(); 6 * (1 + NL)];
    for (step, weight) in [(0, -490.0), (1, 270.0), (2, -27.0), (3, 2.0)] {
        for sign in if step == 0 { &[0.0][..] } else { &[1.0, -1.0] } {
            for (a, p) in acceleration.iter_mut().zip(along(sign * h * step as f64)) {
                *a += p * (weight / (180.0 * h * h));
            }
        }
    }
    let points = cloud(&case.servicer, state);
    let left_over: Vec<_> = points
        .iter()
        .zip(acceleration)
        .map(|(p, a)| {
            let hcw = hcw_acceleration(n, &(position + p.position), &(velocity + p.velocity));
            (a - hcw) * p.mass
        })
        .collect();
    let total: Vector3<f64> = left_over.iter().sum();
    let error = (total - case.force).norm();
    assert!(error < tolerance, "whole system: {error:e} N");

    let bus = UnitQuaternion::new_normalize(Quaternion::from(state.attitude));
    let torque = bus * case.control.bus_torque;
    for j in 0..3 + NL {
        // Velocities for a unit rate of one degree of freedom are its virtual displacements.
        let mut unit = State { rate: Vector3::zeros(), joint_rate: SVector::zeros(), ..*state };
        let expected = if j < 3 {
            unit.rate[j] = 1.0;
            torque[j]
        } else {
            unit.joint_rate[j - 3] = 1.0;
            case.control.joint_torque[j - 3]
        };
        let displaced = cloud(&case.servicer, &unit);
        let mut work: f64 = displaced.iter().zip(&left_over).map(|(d, f)| d.velocity.dot(f)).sum();
        // The rotors' share: on each joint the torque that turns its own.
        for (i, link) in case.servicer.links.iter().enumerate() {
            work += link.armature_kg_m2 * rates.joint_rate[i] * unit.joint_rate[i];
        }
        let error = (work - expected).abs();
        assert!(error < tolerance, "degree of freedom {j}: {error:e} N m");
    }

    // The system's centre of mass, as the code under test has it, to rounding.
    let (offset, offset_rate) = body.center_of_mass(state);
    let (center, center_rate) = (mean(&points, |p| p.position), mean(&points, |p| p.velocity));
    assert!((offset - center).norm() < 1e-14);
    assert!((offset_rate - center_rate).norm() < 1e-14);
    let hcw = hcw_acceleration(n, &(position + center), &(velocity + center_rate));
    let expected = hcw + case.force / case.servicer.total_mass();
    assert!((rates.center_of_mass - expected).norm() < 1e-14);
}

fn two_algorithms_agree<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let Case { servicer, mean_motion, state, control, force } = case;
    let ours = case.acceleration();
    let theirs = articulated::acceleration(servicer, *mean_motion, state, control, force);
    let error = (ours - stacked::<NL, NU>(&theirs)).norm();
    // Both round: by some 20 eps times the inertia matrix's condition of up to a few hundred.
    assert!(error < 1e-12 * ours.norm(), "{error:e} of {:e}", ours.norm());
}

fn torques_invert_accelerations<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let mission = case.mission();
    let body = Multibody::new(&mission);
    let acceleration = body.acceleration(&case.state, &case.control, &case.force);
    let back = body.torques(&case.state, &case.force, &acceleration);
    // Torques are differences of inertial moments of up to some 100 N m, each rounded.
    assert!((back.bus_torque - case.control.bus_torque).norm() < 1e-12);
    assert!((back.joint_torque - case.control.joint_torque).norm() < 1e-12);
}

/// The same servicer with its bus and links resolved in other axes, turned by a third of a turn and then
/// some.
fn axes_of_the_bus_are_a_matter_of_taste<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let turn = quaternion::exp(&Vector3::new(1.1, -0.7, 1.6));
    let (to, mut other) = (quaternion::rotation_matrix(&turn), case.clone());
    let s = &mut other.servicer;
    s.bus_inertia_kg_m2 = to * s.bus_inertia_kg_m2 * to.transpose();
    s.arm_base_m = to * s.arm_base_m;
    for link in &mut s.links {
        link.inertia_kg_m2 = to * link.inertia_kg_m2 * to.transpose();
        (link.tip_m, link.axis) = (to * link.tip_m, to * link.axis);
        link.center_of_mass_m = to * link.center_of_mass_m;
    }
    other.control.bus_torque = to * other.control.bus_torque;
    let state = &mut other.state;
    state.attitude = quaternion::product(&state.attitude, &quaternion::conjugate(&turn));
    let (ours, theirs) = (case.acceleration(), other.acceleration());
    let error = (ours - theirs).norm();
    assert!(error < 1e-12 * ours.norm(), "{error:e} of {:e}", ours.norm());
}

/// Derivative at zero by sixth-order central differences of step `h`.
fn difference_quotient<const R: usize>(
    h: f64,
    f: impl Fn(f64) -> SVector<f64, R>,
) -> SVector<f64, R> {
    let executor = |k: f64| f(k * h) - f(-k * h);
    (executor(1.0) * 45.0 - executor(2.0) * 9.0 + executor(3.0)) / (60.0 * h)
}

/// Fails where `ours` is not `expected`: the difference quotient of something of size `size`.
/// Truncation is `h^6 / 140` of the seventh derivative, rounding `eps size / h`.
fn assert_derivative<const R: usize>(
    what: &str,
    column: usize,
    ours: SVector<f64, R>,
    expected: SVector<f64, R>,
    size: f64,
) {
    let (error, scale) = ((ours - expected).norm(), expected.norm());
    assert!(error < 1e-9 * scale + 1e-12 * size, "{what} {column}: {error:e} of {scale:e}");
}

fn acceleration_derivatives<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let (mission, size) = (case.mission(), case.acceleration().norm());
    let body = Multibody::new(&mission);
    let Case { state, control, force, .. } = case;
    let (value, by) = body.acceleration_jacobian::<NX, NU>(state, control, force);
    assert_eq!(value, body.acceleration(state, control, force));
    for j in 0..NX {
        let (bus, joint) = (by.bus_state.column(j).into(), by.joint_state.column(j).into());
        let expected = difference_quotient(4e-3, |h| case.with_state_moved(j, h).acceleration());
        assert_derivative("state", j, stacked(&Acceleration { bus, joint }), expected, size);
    }
    // Linear in torques and force: any step will do.
    for j in 0..NU {
        let (bus, joint) = (by.bus_control.column(j).into(), by.joint_control.column(j).into());
        let expected = difference_quotient(1.0, |h| case.with_control_moved(j, h).acceleration());
        assert_derivative("control", j, stacked(&Acceleration { bus, joint }), expected, size);
    }
    let by = body.force_jacobian(state, control, force);
    for j in 0..3 {
        let (bus, joint) = (by.bus.column(j).into(), by.joint.column(j).into());
        let expected = difference_quotient(1.0, |h| case.with_force_moved(j, h).acceleration());
        assert_derivative("force", j, stacked(&Acceleration { bus, joint }), expected, size);
    }
}

const INTEGRATORS: [Integrator; 3] =
    [Integrator::Euler, Integrator::Rk4 { substeps: 1 }, Integrator::Rk4 { substeps: 4 }];

/// Steps of the difference quotients.
struct Steps {
    angle: f64,
    rate: f64,
    bus_torque: f64,
    joint_torque: f64,
}

fn check_step_derivatives<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
    integrator: Integrator,
    dt: f64,
    steps: &Steps,
) {
    let mission = case.mission();
    let body = Multibody::new(&mission);
    let Case { state, control, force, .. } = case;
    let (next, by) =
        body.step_jacobian::<NX, NU>(&Stepping::new(integrator, dt), state, control, force);
    assert_eq!(next, case.stepped(integrator, dt).state);
    // Where a neighbour lands, seen from where the case itself does.
    let landing = |moved: Case<NL, NX, NU>| {
        let end = moved.stepped(integrator, dt).state;
        let turn = quaternion::difference(&end.attitude, &next.attitude);
        let angles = turn.iter().chain(end.joint_angle.iter());
        let rates = end.rate.iter().chain(end.joint_rate.iter());
        SVector::<f64, NX>::from_iterator(angles.chain(rates).copied())
    };
    let size = landing(case.clone()).norm();
    for j in 0..NX {
        let h = if j < 3 + NL { steps.angle } else { steps.rate };
        let expected = difference_quotient(h, |h| landing(case.with_state_moved(j, h)));
        assert_derivative("state", j, by.state.column(j).into(), expected, size);
    }
    for j in 0..NU {
        let h = if j < 3 { steps.bus_torque } else { steps.joint_torque };
        let expected = difference_quotient(h, |h| landing(case.with_control_moved(j, h)));
        assert_derivative("control", j, by.control.column(j).into(), expected, size);
    }
}

fn step_derivatives<const NL: usize, const NX: usize, const NU: usize>(case: &Case<NL, NX, NU>) {
    for integrator in INTEGRATORS {
        let steps = Steps { angle: 4e-3, rate: 4e-3, bus_torque: 0.1, joint_torque: 4e-3 };
        check_step_derivatives(case, integrator, 0.5, &steps);
    }
}

proptest! {
    #![proptest_config(config())]

    // Verifies REM-DYN-003.
    #[test]
    fn step_derivatives_on_mission(case in on_mission()) {
        // One node, in which each of these turns bus or joint by a few mrad.
        let steps = Steps { angle: 2e-3, rate: 1e-4, bus_torque: 1e-3, joint_torque: 3e-6 };
        for integrator in INTEGRATORS {
            check_step_derivatives(&case, integrator, 1200.0 / 59.0, &steps);
        }
    }

    /// Each substep is a step: the quaternion is renormalised after each of them.
    #[test]
    fn substeps_are_steps(case in on_mission()) {
        let whole = case.stepped(Integrator::Rk4 { substeps: 4 }, 20.0);
        let mut parts = case;
        for _ in 0..4 {
            parts = parts.stepped(Integrator::Rk4 { substeps: 1 }, 5.0);
        }
        prop_assert_eq!(whole.state, parts.state);
    }
}

fn inputs<const NL: usize, const NX: usize, const NU: usize>(
    case: &mut Case<NL, NX, NU>,
) -> impl Iterator<Item = &mut f64> {
    let Case { mean_motion, state, control, force, .. } = case;
    let angles = state.attitude.iter_mut().chain(&mut state.joint_angle);
    let rates = state.rate.iter_mut().chain(&mut state.joint_rate);
    let torques = control.bus_torque.iter_mut().chain(&mut control.joint_torque);
    angles.chain(rates).chain(torques).chain(force).chain([mean_motion])
}

fn nonsense_in_gives_nonsense_out<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) {
    let count = inputs(&mut case.clone()).count();
    for input in 0..count {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200, -1e-320] {
            let mut spoilt = case.clone();
            *inputs(&mut spoilt).nth(input).unwrap() = value;
            // None of these may panic; where a number is too large, what comes out is free.
            let finite = finite_results(&spoilt);
            assert!(value.is_finite() || finite.is_empty(), "input {input} = {value}: {finite:?}");
        }
    }
}

/// Which results look sound. Every one of them depends on every input.
fn finite_results<const NL: usize, const NX: usize, const NU: usize>(
    case: &Case<NL, NX, NU>,
) -> Vec<String> {
    let mission = case.mission();
    let body = Multibody::new(&mission);
    let Case { servicer, mean_motion, state, control, force } = case;
    let sound = |a: Acceleration<NL>| stacked::<NL, NU>(&a).iter().all(|x| x.is_finite());
    let acceleration = body.acceleration(state, control, force);
    let mut results = vec![("acceleration".into(), sound(acceleration))];
    let articulated = articulated::acceleration(servicer, *mean_motion, state, control, force);
    results.push(("articulated".into(), sound(articulated)));
    let torques = body.torques(state, force, &acceleration);
    results.push(("torques".into(), torques.is_finite()));
    let (value, _) = body.acceleration_jacobian::<NX, NU>(state, control, force);
    results.push(("value beside the jacobian".into(), sound(value)));
    let _ = body.force_jacobian(state, control, force);
    for integrator in INTEGRATORS {
        let next = body.step(integrator, 0.5, state, control, force);
        results.push((format!("{integrator:?}"), next.is_finite()));
        let (next, _) =
            body.step_jacobian::<NX, NU>(&Stepping::new(integrator, 0.5), state, control, force);
        results.push((format!("{integrator:?} with jacobian"), next.is_finite()));
    }
    let _ = (body.center_of_mass(state), body.end_effector(state));
    let (position, velocity) = (Vector3::x(), Vector3::zeros());
    let full = SystemState { position, velocity, internal: *state };
    let rates = body.system_rates(&full, control, force);
    results.push(("system rates".into(), rates.bus.iter().all(|x| x.is_finite())));
    results.into_iter().filter_map(|(what, sound)| sound.then_some(what)).collect()
}
