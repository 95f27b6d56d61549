//! Plans flown in the truth: what arrives at the port, and what the loop must not depend on.

use crate::common;

use common::{FlightCase, planned};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::Mission;
use remora_core::nalgebra::{Vector3, Vector4};
use remora_core::prelude::{Valid, Validate};
use remora_flight::flight::{
    Controller, Ending, Flight, FlightOutcome, JointControl, Moment, Settings,
};
use remora_flight::history::{self, Sample};
use remora_flight::nominal::{self, Surroundings};
use remora_host::engine::DefaultArmEngine;
use remora_truth::{Class, Dispersion, Errors, JointStuck, ThrusterLost, World};

fn mission() -> Valid<Mission<3>> {
    Mission::<3>::default().validated().unwrap()
}

fn fly(planned: &FlightCase, settings: &Settings, errors: &Errors, run: u64) -> FlightOutcome {
    let mission = mission();
    let (scenario, plan) = planned;
    let flight = Flight { mission: &mission, scenario, plan, settings };
    let dispersion = Dispersion { errors: errors.clone(), seed: 3, run };
    flight.fly(&dispersion, &mut DefaultArmEngine::default(), &mut |_| ()).unwrap()
}

/// The truth begins where the scenario says, seen in its own RTN frame.
#[test]
fn the_truth_begins_where_the_scenario_says() {
    let mission = mission();
    for (scenario, plan) in planned(&mission, 2) {
        let setup = nominal::setup(&mission, &scenario, &Surroundings::default());
        let dispersion = Dispersion { errors: Errors::none(), seed: 0, run: 0 };
        let world = World::new(&setup, &dispersion).unwrap();
        let (view, frame) = (world.view(), world.rtn());
        let spin = Vector3::new(0.0, 0.0, frame.rate);
        let position = frame.axes.tr_mul(&view.center);
        assert!((position - scenario.position).norm() < 1e-9);
        let velocity = frame.axes.tr_mul(&view.center_velocity) - spin.cross(&position);
        assert!((velocity - scenario.velocity).norm() < 1e-12);
        let first = &plan.nominal.reorientation.states[0];
        let axes = quaternion::rotation_matrix(&Vector4::from(view.attitude));
        let planned = frame.axes * quaternion::rotation_matrix(&first.attitude);
        assert!((axes - planned).norm() < 1e-9);
        assert!((frame.axes.tr_mul(&view.bus_rate) - spin - first.rate).norm() < 1e-12);
        let target = quaternion::rotation_matrix(&Vector4::from(view.target.attitude));
        let planned = frame.axes * quaternion::rotation_matrix(&scenario.target_attitude);
        assert!((target - planned).norm() < 1e-9);
        // At perigee the orbit turns faster than at the mean motion.
        let e = mission.orbit.eccentricity;
        let faster = (1.0 - e * e).sqrt() / (1.0 - e).powi(2);
        assert!((frame.rate / mission.mean_motion() - faster).abs() < 1e-12);
    }
}

// Verifies REM-FLY-003.
#[test]
fn without_errors_the_end_effector_is_at_the_port() {
    let settings = Settings::default();
    for planned in planned(&mission(), 5) {
        let flown = fly(&planned, &settings, &Errors::none(), 0);
        println!("{:?} {:?}", flown.arrival, flown.tracking);
        assert_eq!((flown.ending, flown.violations().len()), (Ending::Captured, 0));
        assert!(flown.arrival.miss_m <= 3e-4 && flown.arrival.angle_rad <= 0.02_f64.to_radians());
    }
}

// Verifies REM-FLY-003.
#[test]
fn each_class_of_typical_errors_alone_ends_near_the_port() {
    let settings = Settings::default();
    let planned = planned(&mission(), 2);
    for class in Class::ALL {
        let errors = Errors::typical().only(class);
        for (run, planned) in planned.iter().enumerate() {
            let flown = fly(planned, &settings, &errors, run as u64);
            println!("{class:?} {:?}", flown.arrival);
            assert_eq!((flown.ending, flown.violations().len()), (Ending::Captured, 0));
        }
    }
}

#[test]
fn all_typical_errors_end_in_captures_by_torque_and_by_servo() {
    let planned = planned(&mission(), 2);
    for joints in [JointControl::Torque, JointControl::Servo] {
        let settings = Settings { joints, ..Settings::default() };
        for (run, planned) in planned.iter().enumerate() {
            let flown = fly(planned, &settings, &Errors::typical(), run as u64);
            println!("{joints:?} {:?} {:?}", flown.arrival, flown.room);
            assert_eq!((flown.ending, flown.violations().len()), (Ending::Captured, 0));
            assert!(flown.room.joint_rate <= 1.2);
        }
    }
}

#[test]
fn a_wrong_tumble_is_refined_in_flight_and_planned_again() {
    let mut errors = Errors::typical();
    errors.tumble.rate = 0.1;
    errors.tumble.rate_direction_rad = 10.0_f64.to_radians();
    let settings = Settings { controller: Controller::Replan, ..Settings::default() };
    for (run, planned) in planned(&mission(), 2).iter().enumerate() {
        let flown = fly(planned, &settings, &errors, run as u64);
        println!("{:?} {:?} {:?}", flown.arrival, flown.replans, flown.room);
        assert_eq!(flown.ending, Ending::Captured);
        assert!(flown.replans[0] >= 5);
    }
}

/// What a run comes to does not depend on what was flown before, and each run is another draw.
#[test]
fn a_run_is_the_same_whatever_was_flown_before() {
    let mission = mission();
    let planned = planned(&mission, 1);
    let settings = Settings { controller: Controller::Replan, ..Settings::default() };
    let first = fly(&planned[0], &settings, &Errors::typical(), 7);
    let (scenario, plan) = &planned[0];
    let flight = Flight { mission: &mission, scenario, plan, settings: &settings };
    let mut engine = DefaultArmEngine::default();
    let mut again = |run| {
        let dispersion = Dispersion { errors: Errors::typical(), seed: 3, run };
        flight.fly(&dispersion, &mut engine, &mut |_| ()).unwrap()
    };
    let other = again(8);
    assert_eq!(again(7), first);
    assert_ne!(other.arrival, first.arrival);
}

/// Where a thruster or a joint does not answer any more while there is room, the target is left clear.
// Verifies REM-FLY-004.
#[test]
fn an_approach_that_is_lost_in_time_is_left_clear() {
    let mut lost = Errors::typical();
    lost.faults.thruster_lost = Some(ThrusterLost { axis: 2, time_s: 100.0 });
    let mut stuck = Errors::typical();
    stuck.faults.joint_stuck = Some(JointStuck { joint: 1, time_s: 300.0 });
    for (run, planned) in planned(&mission(), 3).iter().enumerate() {
        for errors in [&lost, &stuck] {
            let flown = fly(planned, &Settings::default(), errors, run as u64);
            println!("{:?} {} s {:?}", flown.ending, flown.time_s, flown.room);
            assert_eq!(flown.ending, Ending::Aborted);
            assert!(flown.room.command <= 1.0 + 1e-9 && flown.time_s < 1800.0);
        }
    }
}

/// Where a thruster fails on the last way and the end effector would come beside the port, it leaves before the
/// wrist camera could tell, 25 s before capture.
// Verifies REM-FLY-004.
#[test]
fn what_would_come_beside_the_port_is_left_clear() {
    let planned = planned(&mission(), 32);
    for (run, axis) in [(24, 0), (31, 0), (24, 1)] {
        let mut errors = Errors::typical();
        errors.faults.thruster_lost = Some(ThrusterLost { axis, time_s: 1100.0 });
        let flown = fly(&planned[run as usize], &Settings::default(), &errors, run);
        println!("{:?} {} s {:?}", flown.ending, flown.time_s, flown.room);
        assert_eq!(flown.ending, Ending::Aborted);
        // An abort is watched for 600 s.
        assert!(flown.time_s < 1775.0 && flown.room.arm_m > 0.0, "{:?}", flown.room);
    }
}

/// What only watches changes nothing, and sees every step where that is asked for.
#[test]
fn every_step_can_be_watched() {
    let mission = mission();
    let planned = planned(&mission, 1);
    let (scenario, plan) = &planned[0];
    let watched = |every_step: bool| {
        let settings = Settings { every_step, rate_hz: 4.0, ..Settings::default() };
        let flight = Flight { mission: &mission, scenario, plan, settings: &settings };
        let dispersion = Dispersion { errors: Errors::none(), seed: 3, run: 0 };
        let mut times = Vec::new();
        let mut watch = |moment: &Moment<'_, 3>| times.push(moment.view.time);
        let flown = flight.fly(&dispersion, &mut DefaultArmEngine::default(), &mut watch).unwrap();
        (flown, times)
    };
    let ((seldom, seconds), (often, steps)) = (watched(false), watched(true));
    assert_eq!(seldom, often);
    assert!(steps.len() >= 4 * seconds.len() - 4, "{} {}", steps.len(), seconds.len());
    assert!(steps.windows(2).all(|pair| (pair[1] - pair[0] - 0.25).abs() < 1e-9));
    assert!(seconds.iter().all(|time| steps.contains(time)));
}

/// Bus and target of a history are where its end effector and port are, and a page gets them again.
#[test]
fn a_history_says_where_bodies_are_and_is_read_again() {
    let mission = mission();
    let (scenario, plan) = &planned(&mission, 1)[0];
    let settings = Settings { rate_hz: 1.0, ..Settings::default() };
    let flight = Flight { mission: &mission, scenario, plan, settings: &settings };
    let dispersion = Dispersion { errors: Errors::none(), seed: 3, run: 0 };
    let mut history = Vec::new();
    let mut watch = |moment: &Moment<'_, 3>| history.push(Sample::of(moment, 3));
    flight.fly(&dispersion, &mut DefaultArmEngine::default(), &mut watch).unwrap();
    assert!(history.len() > 1000);
    let axes = |attitude: [f64; 4]| quaternion::rotation_matrix(&Vector4::from(attitude));
    for sample in &history {
        let angles = Vector3::from_column_slice(&sample.joints[0]);
        let (_, tip) = mission.servicer.center_of_mass_and_end_effector(&angles);
        let tip = Vector3::from(sample.bus_m) + axes(sample.bus_attitude) * tip;
        let seen = axes(sample.target_attitude).tr_mul(&tip) - mission.target.port_position_m;
        let told = Vector3::from(sample.tip_target_m);
        assert!((seen - told).norm() < 1e-9, "{} s: {seen} {told}", sample.time_s);
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("7.parquet");
    history::write(&file, &history, (7, "a")).unwrap();
    let rows = file.with_extension("jsonl");
    assert_eq!(history::read(&rows).unwrap(), ("a".to_string(), history::shown(7, &history)));
    let error = history::read(&file).unwrap_err().to_string();
    assert!(error.contains("this is a Parquet table"), "{error}");
    let whole = std::fs::read_to_string(&rows).unwrap();
    std::fs::write(&rows, whole.replacen("\"mode\":", "\"mode\":1", 1)).unwrap();
    let error = history::read(&rows).unwrap_err().to_string();
    assert!(error.ends_with("7.jsonl: checksum: does not match the rows: the file is damaged"));
}
