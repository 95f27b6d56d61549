//! Every key of an errors file moves the truth, and only what it should.

use crate::common;

use nalgebra::Vector3;
use remora_truth::{
    Axes, Class, Command, Dispersion, Errors, Faults, JointCommand, JointStuck, Sample,
    TargetRateChange, ThrusterLost, World, WorldError,
};
use serde_json::Value;
use std::collections::BTreeMap;

type Series = BTreeMap<String, Vec<f64>>;

/// What a short flight shows: quantities read back, the true motion, all sensors' samples.
#[derive(Debug)]
struct Seen {
    read_back: Series,
    truth: Vec<f64>,
    sensors: Series,
}

/// A flight of 30 s near the port, every actuator at work.
fn fly(errors: &Errors, run: u64) -> Seen {
    let mut setup = common::setup(common::servicer());
    setup.target.attitude = [0.0, 0.0, 0.0, 1.0];
    setup.start.attitude = [1.0, 0.0, 0.0, 0.0];
    setup.start.position = Vector3::new(0.3, 0.1, 3.0);
    let dispersion = Dispersion { errors: errors.clone(), seed: 5, run };
    let mut world = World::new(&setup, &dispersion).unwrap();
    let mut seen = Seen { read_back: Series::new(), truth: vec![], sensors: Series::new() };
    for quantity in world.read_back() {
        seen.read_back.insert(quantity.name, vec![quantity.value]);
    }
    for step in 1..=300 {
        let command = Command {
            force: Vector3::new(0.1, -0.2, 0.15),
            axes: Axes::Bus,
            bus_torque: Vector3::new(1e-3, 2e-3, -1e-3),
            joints: JointCommand::Torque([1e-3, -5e-4, 1e-4]),
        };
        world.advance(0.1 * f64::from(step), &command).unwrap();
        if step % 3 == 0 {
            look(&world, &mut seen);
        }
    }
    seen
}

fn look(world: &World<3>, seen: &mut Seen) {
    let (view, told) = (world.view(), world.measure());
    seen.truth.extend(view.tip.iter().chain(view.bus_rate.iter()).chain(view.port.iter()));
    seen.truth.extend(view.target.rate.iter().copied().chain(view.joint_rate));
    let mut add = |name: &str, sample: Option<(f64, Vec<f64>)>| {
        let series = seen.sensors.entry(name.into()).or_default();
        let (time, values) = sample.unwrap_or((-1.0, vec![0.0; 3]));
        series.push(time);
        series.extend(values);
    };
    let vector = |s: Option<Sample<Vector3<f64>>>| s.map(|s| (s.time, s.value.as_slice().to_vec()));
    let four = |s: Option<Sample<[f64; 4]>>| s.map(|s| (s.time, s.value.to_vec()));
    let three = |s: Option<Sample<[f64; 3]>>| s.map(|s| (s.time, s.value.to_vec()));
    add("position", vector(told.position));
    add("velocity", vector(told.velocity));
    add("attitude", four(told.attitude));
    add("target_attitude", four(told.target_attitude));
    add("bus_rate", vector(told.bus_rate));
    add("target_rate", vector(told.target_rate));
    add("joint_angle", three(told.joint_angle));
    add("joint_rate", three(told.joint_rate));
    add("wrist_camera", vector(told.wrist_camera));
}

/// Whether anything is different by more than integration does where its steps end elsewhere.
fn moved(a: &[f64], b: &[f64]) -> bool {
    a.len() != b.len() || a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-8 * b.abs() + 1e-9)
}

/// The series that are different.
fn changes(a: &Series, b: &Series) -> Vec<String> {
    let names = a.iter().filter(|(name, series)| moved(series, &b[*name]));
    names.map(|(name, _)| name.clone()).collect()
}

/// Typical errors, and whatever is zero there, and all faults.
fn base() -> Errors {
    let mut errors = Errors::typical();
    errors.orbit.target_disturbance_n_m = 1e-5;
    errors.navigation.wrist_camera_noise_m = 1e-4;
    errors.sensors.wrist_camera_range_m = 5.0;
    errors.faults = Faults {
        thruster_lost: Some(ThrusterLost { axis: 1, time_s: 20.0 }),
        joint_stuck: Some(JointStuck { joint: 1, time_s: 15.0 }),
        target_rate: Some(TargetRateChange { factor: 1.2, time_s: 10.0 }),
        drawn_within_s: None,
    };
    errors
}

/// All keys of a tree with their numbers, as paths.
fn keys(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                keys(value, &format!("{path}/{key}"), found);
            }
        }
        _ => found.push(path.into()),
    }
}

/// What a key may move: the start of names read back; whether the true motion; which sensors, none
/// meaning all that see the true motion.
fn expected(key: &str) -> (&'static str, bool, &'static str) {
    match key {
        "/navigation/position_drift_m" => ("navigation.position_drift", false, "position"),
        "/navigation/position_drift_time_s"
        | "/navigation/position_drift_range_m"
        | "/navigation/position_noise_m" => ("-", false, "position"),
        "/navigation/velocity_noise_m_s" => ("-", false, "velocity"),
        "/navigation/attitude_drift_rad" => ("navigation.attitude_drift", false, "attitude"),
        "/navigation/attitude_drift_time_s" => ("-", false, "attitude"),
        "/navigation/target_attitude_drift_rad" => {
            ("navigation.target_attitude_drift", false, "target_attitude")
        }
        "/navigation/target_attitude_drift_time_s" => ("-", false, "target_attitude"),
        "/navigation/bus_rate_noise_rad_s" => ("-", false, "bus_rate"),
        "/navigation/target_rate_noise_rad_s" => ("-", false, "target_rate"),
        "/navigation/wrist_camera_noise_m" => ("-", false, "wrist_camera"),
        "/thrusters/scale" | "/thrusters/direction_rad" => ("thrusters.", true, ""),
        "/wheels/scale" => ("wheels.scale", true, ""),
        "/wheels/bias_n_m" => ("wheels.bias", true, ""),
        "/joints/scale" => ("joints.scale", true, ""),
        "/joints/bias_n_m" => ("joints.bias", true, ""),
        "/joints/friction_n_m" => ("joints.friction", true, ""),
        "/joints/angle_bias_rad" => ("joints.angle_bias", false, "joint_angle"),
        "/joints/angle_noise_rad" => ("-", false, "joint_angle"),
        "/joints/rate_noise_rad_s" => ("-", false, "joint_rate"),
        "/mass/mass" | "/mass/inertia" | "/mass/inertia_axes_rad" => ("mass.", true, ""),
        "/mass/bus_center_m" => ("mass.bus.center", true, ""),
        "/mass/link_center_m" => ("mass.link", true, ""),
        "/tumble/rate" | "/tumble/rate_direction_rad" => ("tumble.rate", true, ""),
        "/tumble/attitude_rad" => ("tumble.attitude", true, ""),
        "/tumble/inertia_ratio" => ("tumble.inertia", true, ""),
        "/geometry/port_m" => ("geometry.port", true, ""),
        "/geometry/arm_base_m" => ("geometry.arm_base", true, ""),
        "/geometry/wrist_camera_m" => ("geometry.wrist_camera", false, "wrist_camera"),
        "/orbit/eccentricity" => ("orbit.eccentricity", true, ""),
        "/orbit/drag_m_s2" => ("orbit.drag", true, ""),
        "/orbit/disturbance_n_m" => ("orbit.disturbance", true, ""),
        "/orbit/target_disturbance_n_m" => ("orbit.target_disturbance", true, ""),
        "/sensors/wrist_camera_range_m" => ("-", false, "wrist_camera"),
        key if key.starts_with("/sensors/") => ("-", false, sensor(key)),
        // Noise, periods and faults: nothing that is drawn at the start.
        _ => ("-", true, ""),
    }
}

fn sensor(key: &str) -> &'static str {
    let names = ["target_attitude", "target_rate", "bus_rate", "joint_angle", "joint_rate"];
    let others = ["wrist_camera", "position", "velocity", "attitude"];
    let name = key.split('/').nth(2).unwrap();
    names.into_iter().chain(others).find(|known| *known == name).unwrap()
}

#[test]
fn every_key_moves_what_it_should_and_nothing_else() {
    let errors = base();
    let tree = serde_json::to_value(&errors).unwrap();
    let mut paths = vec![];
    keys(&tree, "", &mut paths);
    assert_eq!(paths.len(), 69, "a new key needs a line in `expected`: {paths:#?}");
    let before = fly(&errors, 2);
    assert!(before.sensors["wrist_camera"][0] >= 0.0, "the camera sees the port");
    for path in paths {
        let mut tree = tree.clone();
        let leaf = tree.pointer_mut(&path).unwrap();
        *leaf = match leaf.as_u64() {
            Some(index) => (index - 1).into(),
            None if path.ends_with("delay_s") => 0.35.into(),
            None if path.ends_with("rate_hz") => 8.0.into(),
            None if path.ends_with("range_m") => 0.1.into(),
            None => (leaf.as_f64().unwrap() * 1.25).into(),
        };
        let changed: Errors = serde_json::from_value(tree).unwrap();
        let after = fly(&changed, 2);
        let (prefix, motion, only) = expected(&path);
        let read = changes(&before.read_back, &after.read_back);
        assert!(read.iter().all(|name| name.starts_with(prefix)), "{path} moves {read:?}");
        assert_eq!(read.is_empty(), prefix == "-", "{path} is not read back");
        assert_eq!(moved(&before.truth, &after.truth), motion, "{path}: the true motion");
        let sensors = changes(&before.sensors, &after.sensors);
        if !only.is_empty() {
            assert_eq!(sensors, [only], "{path}");
        }
    }
}

#[test]
fn without_errors_the_truth_is_the_nominal_world() {
    let setup = common::setup(common::skewed::<3>());
    let dispersion = Dispersion { errors: Errors::none(), seed: 9, run: 9 };
    assert_eq!(dispersion.disperse(&setup), setup);
    let one = fly(&Errors::none(), 0);
    let other = fly(&Errors::none(), 1);
    assert_eq!(one.truth, other.truth);
    assert_eq!(one.sensors, other.sensors);
    assert_eq!(one.read_back, other.read_back);
}

#[test]
fn one_sources_numbers_do_not_depend_on_the_others() {
    let all = fly(&Errors::typical(), 4).read_back;
    for class in Class::ALL {
        let alone = Errors::typical().only(class);
        let without = Errors::typical().scaled(class, 0.0);
        let (alone, without) = (fly(&alone, 4).read_back, fly(&without, 4).read_back);
        let none = fly(&Errors::none(), 4).read_back;
        for (name, value) in &all {
            let drawn = !moved(&alone[name], value);
            assert!(drawn || alone[name] == none[name], "{name}: neither nominal nor drawn");
            assert!(drawn || without[name] == *value, "{name} changes without {class:?}");
        }
    }
}

#[test]
fn files_are_complete_and_take_no_unknown_key() {
    let text = toml::to_string(&base()).unwrap();
    assert_eq!(toml::from_str::<Errors>(&text).unwrap(), base());
    for section in ["navigation", "thrusters", "sensors.position", "faults.joint_stuck"] {
        let header = format!("[{section}]\n");
        assert!(text.contains(&header), "{text}");
        let wrong = text.replace(&header, &format!("{header}surprise = 1.0\n"));
        let refusal = toml::from_str::<Errors>(&wrong).unwrap_err().to_string();
        assert!(refusal.contains("surprise"), "{refusal}");
    }
    assert!(toml::from_str::<Errors>(&format!("[surprise]\n{text}")).is_err());
    // Without faults nothing fails.
    let text = toml::to_string(&Errors::typical()).unwrap();
    let short: String = text.split("[faults]").next().unwrap().into();
    assert_eq!(toml::from_str::<Errors>(&short).unwrap(), Errors::typical());
}

#[test]
fn numbers_that_make_no_sense_are_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Errors)| {
        let mut errors = base();
        change(&mut errors);
        let dispersion = Dispersion { errors, seed: 1, run: 1 };
        World::new(&common::setup(common::servicer()), &dispersion).unwrap_err().to_string()
    };
    assert!(refused(&|e| e.mass.inertia = -0.1).starts_with("mass.inertia is -0.1"));
    assert!(refused(&|e| e.wheels.noise_n_m = f64::NAN).starts_with("wheels.noise_n_m"));
    assert!(refused(&|e| e.sensors.bus_rate.rate_hz = 0.0).starts_with("sensors.bus_rate"));
    assert!(refused(&|e| e.thrusters.period_s = 0.0).starts_with("thrusters.period_s"));
    assert!(refused(&|e| e.sensors.velocity.delay_s = -1.0).starts_with("sensors.velocity"));
    let stuck = JointStuck { joint: 3, time_s: 0.0 };
    assert!(refused(&|e| e.faults.joint_stuck = Some(stuck)).contains("no such joint"));
}

#[test]
fn times_of_faults_are_drawn_evenly() {
    let mut errors = base();
    errors.faults.drawn_within_s = Some(600.0);
    let time = |run: u64| {
        let faults = Dispersion { errors: errors.clone(), seed: 5, run }.faults();
        let lost = faults.thruster_lost.unwrap();
        assert_eq!(lost.axis, 1);
        assert_eq!(lost.time_s, faults.target_rate.unwrap().time_s);
        lost.time_s
    };
    let mut times: Vec<f64> = (0..2000).map(time).collect();
    assert_eq!(times[7], time(7));
    times.sort_by(f64::total_cmp);
    // Kolmogorov's distance from the even distribution: 1.63 / sqrt(n) is passed once in a hundred.
    let far = times.iter().enumerate().map(|(i, t)| (t / 600.0 - i as f64 / 2000.0).abs());
    assert!(far.fold(0.0, f64::max) < 1.63 / 2000.0_f64.sqrt());
}

/// Ten and a hundred times the typical errors are followed to the end; what moves as no spacecraft does is given up.
#[test]
fn a_world_ends_whatever_its_errors() {
    let ended = |errors: Errors| {
        let dispersion = Dispersion { errors, seed: 5, run: 0 };
        let mut world = World::new(&common::setup(common::servicer()), &dispersion)?;
        let torques = JointCommand::Torque([1e-3, -5e-4, 1e-4]);
        let command = Command { joints: torques, ..Command::default() };
        for step in 1..=1000 {
            world.advance(0.1 * f64::from(step), &command)?;
        }
        Ok::<_, WorldError>(world.steps())
    };
    for class in Class::ALL {
        let (taken, refused) = ended(Errors::typical().scaled(class, 10.0)).unwrap();
        assert!(taken + refused < 4000, "{class:?}: {taken}, {refused}");
        ended(Errors::typical().scaled(class, 100.0)).unwrap();
        for factor in [1e3, 1e6, 1e12, 1e300] {
            // That it comes back is what is asked.
            drop(ended(Errors::typical().scaled(class, factor)));
        }
    }
    let stiff = ended(Errors::typical().scaled(Class::Torques, 1e6)).unwrap_err().to_string();
    assert!(stiff.ends_with("it takes too many steps"), "{stiff}");
}
