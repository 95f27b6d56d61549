//! The target's orbit and tumbling against solutions in closed form.

use crate::common;

use nalgebra::{UnitQuaternion, Vector3};
use remora_truth::rotation::{inverse, product};
use remora_truth::{Command, Environment, Oblateness, Orbit, TargetState, World};

/// The target's motion at some times [s].
fn motions(times: &[f64], change: impl FnOnce(&mut remora_truth::Setup<3>)) -> Vec<TargetState> {
    let mut setup = common::setup(common::servicer());
    change(&mut setup);
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let mut at = |&time: &f64| {
        world.advance(time, &Command::default()).unwrap();
        world.view().target
    };
    times.iter().map(&mut at).collect()
}

/// Angle between two attitudes [rad].
fn apart(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let [x, y, z, w] = product(a, &inverse(b));
    2.0 * Vector3::new(x, y, z).norm().atan2(w.abs())
}

#[test]
fn the_orbit_is_keplers() {
    let mut orbit = common::orbit();
    orbit.eccentricity = 0.02;
    let mu = Environment::EARTH.mu;
    let n = (mu / orbit.semi_major_axis.powi(3)).sqrt();
    let e = orbit.eccentricity;
    let root = ((1.0 + e) / (1.0 - e)).sqrt();
    let start: f64 = orbit.argument_of_latitude - orbit.argument_of_perigee;
    let eccentric = 2.0 * ((0.5 * start).tan() / root).atan();
    let mean = eccentric - e * eccentric.sin();
    for time in [300.0, 1234.5] {
        let m = mean + n * time;
        let mut anomaly = m;
        for _ in 0..50 {
            anomaly -= (anomaly - e * anomaly.sin() - m) / (1.0 - e * anomaly.cos());
        }
        let truth = 2.0 * (root * (0.5 * anomaly).tan()).atan();
        let there = Orbit { argument_of_latitude: truth + orbit.argument_of_perigee, ..orbit };
        let (r, v) = there.state(mu);
        let state = motions(&[time], |setup| setup.orbit = orbit)[0];
        assert!((state.position - r).norm() < 1e-6, "{:e}", (state.position - r).norm());
        assert!((state.velocity - v).norm() < 1e-9);
    }
}

#[test]
fn oblateness_turns_the_node_as_it_should() {
    // Mean rate of the node: -3/2 J2 (R/p)^2 n cos i; over whole revolutions short periods vanish.
    let mut orbit = common::orbit();
    orbit.eccentricity = 0.0;
    orbit.inclination = 1.0;
    let o = Oblateness::EARTH;
    let mu = Environment::EARTH.mu;
    let n = (mu / orbit.semi_major_axis.powi(3)).sqrt();
    let time = 2.0 * core::f64::consts::TAU / n;
    let state = motions(&[time], |setup| {
        setup.orbit = orbit;
        setup.environment.oblateness = Some(o);
    })[0];
    let momentum = state.position.cross(&state.velocity);
    let node = momentum.x.atan2(-momentum.y);
    let ratio = o.radius / orbit.semi_major_axis;
    let wanted = -1.5 * o.j2 * ratio * ratio * n * orbit.inclination.cos() * time;
    assert!((node - wanted).abs() < 0.01 * wanted.abs(), "{node} {wanted}");
}

#[test]
fn a_symmetric_top_turns_as_euler_says() {
    let (across, along) = (2.5, 1.4);
    let (start, rate) = (common::target().attitude, Vector3::new(8e-3, -6e-3, 1.6e-2));
    let states = motions(&[1.0, 400.0, 1200.0], |setup| {
        setup.environment.target_gravity_gradient = false;
        setup.target.inertia = Vector3::new(across, across, along);
        setup.target.rate = rate;
    });
    let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(start));
    let q0: [f64; 4] = q.into_inner().coords.into();
    for (time, state) in [1.0, 400.0, 1200.0].into_iter().zip(states) {
        // Turns about the momentum at L / across, and about its own axis by what is left.
        let momentum = q * Vector3::new(across * rate.x, across * rate.y, along * rate.z);
        let own = rate.z * (1.0 - along / across);
        let precession = UnitQuaternion::new(momentum / across * time);
        let spin = UnitQuaternion::new(Vector3::z() * own * time);
        let wanted = precession * UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(q0));
        let wanted: [f64; 4] = (wanted * spin).into_inner().coords.into();
        let error = apart(&state.attitude, &wanted);
        println!("{time} s: attitude off by {error:.1e} rad");
        assert!(error < 1e-11, "{error:e} rad at {time} s");
    }
}

#[test]
fn an_asymmetric_body_keeps_energy_and_momentum() {
    let inertia = common::target().inertia;
    let times: Vec<f64> = (1..=120).map(|k| f64::from(k) * 10.0 - 0.37).collect();
    let states = motions(&times, |setup| {
        setup.environment.target_gravity_gradient = false;
        setup.target.rate *= 20.0;
    });
    let look = |s: &TargetState| {
        let body = inertia.component_mul(&s.rate);
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(s.attitude));
        (s.rate.dot(&body), q * body)
    };
    let before = look(&states[0]);
    for state in &states {
        let now = look(state);
        assert!((now.0 - before.0).abs() < 1e-11 * before.0);
        assert!((now.1 - before.1).norm() < 1e-11 * before.1.norm());
    }
}

#[test]
fn gravity_gradient_makes_pitch_librate() {
    // Small pitch on a circular orbit: theta'' = -3 n^2 (Ix - Iz) / Iy theta, x along track, z
    // radial, y normal. From rest at 1e-4 rad, an eighth of a period later it is at
    // cos 45 deg of that.
    let inertia: Vector3<f64> = Vector3::new(3.0, 2.8, 1.2);
    let mut orbit = common::orbit();
    (orbit.eccentricity, orbit.inclination, orbit.argument_of_latitude) = (0.0, 0.0, 0.0);
    let n = (Environment::EARTH.mu / orbit.semi_major_axis.powi(3)).sqrt();
    let frequency = n * (3.0 * (inertia.x - inertia.z) / inertia.y).sqrt();
    let pitch = 1e-4;
    // Body axes: x along T, y along -N, z along -R, turned by the pitch about N.
    let axes = nalgebra::Matrix3::from_columns(&[Vector3::y(), -Vector3::z(), -Vector3::x()]);
    let base = nalgebra::Rotation3::from_matrix_unchecked(axes);
    let turned = nalgebra::Rotation3::new(Vector3::z() * pitch) * base;
    let attitude: [f64; 4] =
        UnitQuaternion::from_rotation_matrix(&turned).into_inner().coords.into();
    let time = core::f64::consts::FRAC_PI_4 / frequency;
    let state = motions(&[time], |setup| {
        setup.orbit = orbit;
        setup.target.inertia = inertia;
        setup.target.attitude = attitude;
        setup.target.rate = turned.inverse() * (Vector3::z() * n);
    })[0];
    let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(state.attitude));
    let radial = -(q * Vector3::z());
    let angle = radial.y.atan2(radial.x) - n * time;
    let wanted = pitch * core::f64::consts::FRAC_1_SQRT_2;
    println!("pitch {angle:e}, wanted {wanted:e}");
    assert!((angle - wanted).abs() < 1e-6 * pitch, "{angle:e} {wanted:e}");
}
