//! The servicer's dynamics against other algorithms and against what physics conserves.

use crate::common;

use nalgebra::{Matrix3, Rotation3, SMatrix, Unit, UnitQuaternion, Vector3};
use remora_truth::multibody::{Multibody, Rates};
use remora_truth::{
    Axes, Command, Environment, JointCommand, Oblateness, Setup, Vehicle, View, World,
};

const ATTITUDE: [f64; 4] = [0.5, -0.5, 0.1, 0.7];

fn pose_of<const NL: usize>(body: &Multibody<NL>) -> remora_truth::multibody::Pose<NL> {
    body.pose(&ATTITUDE, &core::array::from_fn(|j| 0.9 - 0.6 * j as f64))
}

fn mass_matrix_fits<const NL: usize>() {
    let body = Multibody::new(common::skewed::<NL>());
    let pose = pose_of(&body);
    let matrix = body.mass_matrix(&pose);
    // Room for 3 + 7 rows; rows that are not there are the identity's.
    let mut full = SMatrix::<f64, 10, 10>::identity();
    full.fixed_view_mut::<3, 3>(0, 0).copy_from(&matrix.system);
    for j in 0..NL {
        for i in 0..3 {
            full[(i, 3 + j)] = matrix.coupling[j][i];
            full[(3 + j, i)] = matrix.coupling[j][i];
        }
        for k in 0..NL {
            full[(3 + j, 3 + k)] = matrix.joints[j][k];
        }
    }
    assert!((full - full.transpose()).norm() < 1e-13 * full.norm());
    assert!(full.symmetric_eigenvalues().min() > 1e-3);

    let rates = Rates {
        bus: Vector3::new(0.3, -0.2, 0.5),
        joints: core::array::from_fn(|j| 0.4 - 0.3 * j as f64),
    };
    let momenta = matrix.momenta(&rates);
    let mut twice = momenta.system.dot(&rates.bus);
    for j in 0..NL {
        twice += momenta.joints[j] * rates.joints[j];
    }
    let energy = body.kinetic_energy(&pose, &rates);
    assert!((energy - 0.5 * twice).abs() < 1e-14 * energy);
    // Solving gives the rates back.
    let back = matrix.rates(&momenta, &[false; NL]);
    assert!((back.bus - rates.bus).norm() < 1e-13);
    for j in 0..NL {
        assert!((back.joints[j] - rates.joints[j]).abs() < 1e-13);
    }
}

#[test]
fn the_mass_matrix_is_symmetric_positive_and_makes_the_bodies_energy() {
    mass_matrix_fits::<1>();
    mass_matrix_fits::<2>();
    mass_matrix_fits::<3>();
    mass_matrix_fits::<7>();
}

/// Momenta of bodies at one instant, by rotation matrices from attitude and angles alone.
struct Bodies {
    centers: Vec<Vector3<f64>>,
    pivots: Vec<Vector3<f64>>,
    axes: Vec<Vector3<f64>>,
    inertias: Vec<Matrix3<f64>>,
    spins: Vec<Vector3<f64>>,
}

fn bodies<const NL: usize>(vehicle: &Vehicle<NL>, view: &View<NL>) -> Bodies {
    let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(view.attitude));
    let (mut rotation, mut place) = (q.to_rotation_matrix(), view.bus_position);
    let mut rate = view.bus_rate;
    let mut found =
        Bodies { centers: vec![], pivots: vec![], axes: vec![], inertias: vec![], spins: vec![] };
    for index in 0..=NL {
        if index > 0 {
            let joint = &vehicle.joints[index - 1];
            place += rotation * joint.pivot;
            let axis = rotation * joint.axis;
            rate += axis * view.joint_rate[index - 1];
            let unit = Unit::new_normalize(joint.axis);
            rotation *= Rotation3::from_axis_angle(&unit, view.joint_angle[index - 1]);
            found.pivots.push(place);
            found.axes.push(axis);
        }
        let body = vehicle.body(index);
        let inertia = rotation * body.inertia * rotation.transpose();
        found.centers.push(place + rotation * body.center);
        found.inertias.push(inertia);
        found.spins.push(inertia * rate);
    }
    found
}

/// Sixth-order central differences of a series with spacing `h`, first derivative.
fn first(series: &[Vector3<f64>; 7], h: f64) -> Vector3<f64> {
    let d = |k: usize| series[3 + k] - series[3 - k];
    (d(1) * 45.0 - d(2) * 9.0 + d(3)) / (60.0 * h)
}

/// The same, second derivative.
fn second(series: &[Vector3<f64>; 7], h: f64) -> Vector3<f64> {
    let d = |k: usize| series[3 + k] + series[3 - k] - series[3] * 2.0;
    (d(1) * 270.0 - d(2) * 27.0 + d(3) * 2.0) / (180.0 * h * h)
}

/// Newton's and Euler's laws of all bodies along a flight, from outside in: residuals of force,
/// moment and joint torques. Bodies' accelerations are differences of places and spins.
fn newton_euler<const NL: usize>(setup: &Setup<NL>, command: &Command<NL>, torques: &[f64; NL]) {
    let h = 0.25;
    let mut world = World::new(setup, &common::quiet()).unwrap();
    let mut views = vec![];
    for k in 1..=7 {
        world.advance(f64::from(k) * h, command).unwrap();
        views.push(world.view());
    }
    let rows: Vec<Bodies> = views.iter().map(|view| bodies(&setup.vehicle, view)).collect();
    let middle = &rows[3];
    let over = |get: &dyn Fn(&Bodies) -> Vector3<f64>| core::array::from_fn(|k| get(&rows[k]));
    let target = views[3].target.position;
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for i in (0..=NL).rev() {
        let body = setup.vehicle.body(i);
        let (center, inertia) = (middle.centers[i], middle.inertias[i]);
        let place = target + center;
        let gravity =
            setup.environment.acceleration(&place) - setup.environment.acceleration(&target);
        let mu = if setup.environment.has_gravity { setup.environment.mu } else { 0.0 };
        let gradient = 3.0 * mu / place.norm().powi(5);
        let push = (second(&over(&|b| b.centers[i]), h) - gravity) * body.mass;
        let twist = first(&over(&|b| b.spins[i]), h) - place.cross(&(inertia * place)) * gradient;
        force += push;
        // Moments about the target's centre of mass.
        moment += twist + center.cross(&push);
        if i > 0 {
            let j = i - 1;
            let about_axis = middle.axes[j].dot(&(moment - middle.pivots[j].cross(&force)));
            let rates: [Vector3<f64>; 7] =
                core::array::from_fn(|k| Vector3::new(views[k].joint_rate[j], 0.0, 0.0));
            let residual =
                about_axis + setup.vehicle.joints[j].armature * first(&rates, h).x - torques[j];
            assert!(residual.abs() < 2e-10, "joint {j}: {residual:e}");
        }
    }
    let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(views[3].attitude));
    let thrust = match command.axes {
        Axes::Inertial => command.force,
        Axes::Bus => q * command.force,
        Axes::Rtn => {
            let (r, v) = (target.normalize(), views[3].target.velocity);
            let n = target.cross(&v).normalize();
            Matrix3::from_columns(&[r, n.cross(&r), n]) * command.force
        }
    };
    assert!((force - thrust).norm() < 2e-9, "force: {:e}", (force - thrust).norm());
    let place = views[3].bus_position + q * setup.vehicle.force_point;
    let residual = moment - place.cross(&force) - q * command.bus_torque;
    assert!(residual.norm() < 2e-9, "moment: {:e}", residual.norm());
}

/// Flights of a skewed arm of `NL` joints with and without gravity, and with all kinds of axes.
fn newton_euler_for<const NL: usize>() {
    let mut setup = common::setup(common::skewed::<NL>());
    setup.start.rate *= 20.0;
    setup.start.joint_rate = setup.start.joint_rate.map(|rate| 8.0 * rate);
    let torques = core::array::from_fn(|j| 2e-3 * (j as f64 - 0.7));
    let oblate = Environment { oblateness: Some(Oblateness::EARTH), ..Environment::EARTH };
    for environment in [Environment::FREE, Environment::EARTH, oblate] {
        for axes in [Axes::Inertial, Axes::Bus, Axes::Rtn] {
            setup.environment = environment;
            let command = Command {
                force: Vector3::new(0.2, -0.1, 0.3),
                axes,
                bus_torque: Vector3::new(1e-2, -2e-2, 3e-2),
                joints: JointCommand::Torque(torques),
            };
            newton_euler(&setup, &command, &torques);
        }
    }
}

#[test]
fn all_bodies_obey_newton_and_euler() {
    newton_euler_for::<1>();
    newton_euler_for::<2>();
    newton_euler_for::<3>();
    newton_euler_for::<7>();
}

/// Flies without forces for 1200 s; largest relative changes of energy, momentum, linear momentum.
fn drift<const NL: usize>(vehicle: Vehicle<NL>, wheels: bool) -> [f64; 3] {
    let mut setup = common::setup(vehicle);
    setup.environment = Environment { wheel_momentum: wheels, ..Environment::FREE };
    setup.start.rate *= 5.0;
    setup.start.joint_rate = setup.start.joint_rate.map(|rate| 2.0 * rate);
    setup.start.wheel_momentum = Vector3::new(0.3, -0.2, 0.1);
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let look = |w: &World<NL>| (w.kinetic_energy(), w.angular_momentum(), w.linear_momentum());
    let before = look(&world);
    let mut worst = [0.0f64; 3];
    for k in 1..=12_000 {
        world.advance(f64::from(k) * 0.1, &Command::default()).unwrap();
        let now = look(&world);
        worst[0] = worst[0].max((now.0 - before.0).abs() / before.0);
        worst[1] = worst[1].max((now.1 - before.1).norm() / before.1.norm());
        worst[2] = worst[2].max((now.2 - before.2).norm() / before.2.norm());
    }
    println!("{NL} joints, wheels {wheels}: {worst:?}");
    worst
}

#[test]
fn energy_and_momenta_last_twenty_minutes() {
    for worst in [
        drift(common::servicer(), false),
        drift(common::skewed::<3>(), false),
        drift(common::skewed::<3>(), true),
        drift(common::skewed::<7>(), false),
    ] {
        assert!(worst.iter().all(|&change| change < 1e-11), "{worst:?}");
    }
}

#[test]
fn with_gravity_the_energy_in_space_is_conserved() {
    let mut setup = common::setup(common::skewed::<3>());
    setup.environment.oblateness = Some(Oblateness::EARTH);
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let before = world.energy();
    for k in 1..=120 {
        world.advance(f64::from(k) * 10.0, &Command::default()).unwrap();
    }
    let change = (world.energy() - before) / before;
    println!("energy changes by {change:e}");
    assert!(change.abs() < 1e-11, "{change:e}");
}

#[test]
fn work_of_the_torques_is_the_energy_gained() {
    let mut setup = common::setup(common::skewed::<2>());
    setup.environment = Environment::FREE;
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let torques = [2e-3, -1e-3];
    let command = Command { joints: JointCommand::Torque(torques), ..Command::default() };
    let (energy, angles) = (world.kinetic_energy(), world.view().joint_angle);
    world.advance(50.0, &command).unwrap();
    let now = world.view().joint_angle;
    let work: f64 = (0..2).map(|j| torques[j] * (now[j] - angles[j])).sum();
    assert!((world.kinetic_energy() - energy - work).abs() < 1e-12, "{work}");
}

#[test]
fn a_difference_of_gravity_loses_no_digits() {
    let earth = Environment::EARTH;
    let center = Vector3::new(4.1e6, -3.3e6, 4.2e6);
    let field = earth.around(&center);
    // Over kilometres the naive difference has digits enough.
    let far = Vector3::new(3e3, 5e3, -2e3);
    let naive = earth.acceleration(&(center + far)) - earth.acceleration(&center);
    assert!((field.difference(&far) - naive).norm() < 3e-13 * naive.norm().max(1.0));
    // Over millimetres it has none; the tensor of the gradient has all.
    let near = Vector3::new(1e-3, 2e-3, -1e-3);
    let (r, mu) = (center.norm(), earth.mu);
    let radial = center / r;
    let gradient = (radial * 3.0 * radial.dot(&near) - near) * (mu / r.powi(3));
    let exact = field.difference(&near);
    assert!((exact - gradient).norm() < 1e-9 * gradient.norm());
    let naive = earth.acceleration(&(center + near)) - earth.acceleration(&center);
    let (good, bad) = ((exact - gradient).norm(), (naive - gradient).norm());
    println!("relative errors {:e}, naive {:e}", good / gradient.norm(), bad / gradient.norm());
    assert!(bad > 20.0 * good);
}

#[test]
fn without_forces_a_circular_orbit_gives_hill_clohessy_wiltshire() {
    let mut setup = common::setup(common::servicer());
    setup.orbit.eccentricity = 0.0;
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let frame = world.rtn();
    let n = frame.rate;
    let local = |world: &World<3>| {
        let (view, rtn) = (world.view(), world.rtn());
        let r = rtn.axes.transpose() * view.center;
        let v = rtn.axes.transpose() * view.center_velocity - Vector3::z().cross(&r) * rtn.rate;
        (r, v)
    };
    let (r, v) = local(&world);
    let time = 1200.0;
    let (s, c) = (n * time).sin_cos();
    let radial = (4.0 - 3.0 * c) * r.x + s / n * v.x + 2.0 * (1.0 - c) / n * v.y;
    let along = 6.0 * (s - n * time) * r.x + r.y - 2.0 * (1.0 - c) / n * v.x
        + (4.0 * s / n - 3.0 * time) * v.y;
    let normal = c * r.z + s / n * v.z;
    world.advance(time, &Command::default()).unwrap();
    let error = local(&world).0 - Vector3::new(radial, along, normal);
    // What is left is of second order: (10 m)^2 / 6800 km times a few.
    println!("off HCW by {error:?}");
    assert!(error.norm() < 1e-4, "{error:?}");
}
