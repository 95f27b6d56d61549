extern crate std;

use self::std::string::ToString;
use super::*;
use crate::model::{Switch, principal_inertia};
use nalgebra::Vector4;

const RK4: Integrator = Integrator::Rk4 { substeps: 8 };

/// In front of the port, at rest.
fn scenario() -> Scenario {
    Scenario {
        target_attitude: quaternion::IDENTITY,
        target_rate: Vector3::new(5e-4, -3e-4, 2e-4),
        position: Vector3::new(0.3, -0.2, 5.2),
        ..Scenario::default()
    }
}

fn refused(change: impl Fn(&mut Mission<3>, &mut Scenario)) -> Refusal {
    let (mut mission, mut scenario) = (Mission::default(), scenario());
    change(&mut mission, &mut scenario);
    mission.validate().unwrap();
    mission.check::<60>(&scenario, RK4).unwrap_err()
}

#[test]
fn what_can_be_planned_passes() {
    for integrator in [RK4, Integrator::Euler] {
        Mission::default().check::<60>(&scenario(), integrator).unwrap();
    }
}

#[test]
fn an_orbit_that_is_no_circle_is_refused_with_the_error_that_it_makes() {
    let refusal = refused(|mission, _| {
        (mission.orbit.semi_major_axis_m, mission.orbit.eccentricity) = (2.4e7, 0.6);
    });
    assert_eq!((refusal.name(), refusal.code()), ("eccentricity", 20));
    assert!(refusal.is_invalid_input());
    let Refusal::Eccentricity { error, limit, .. } = refusal else { panic!("{refusal}") };
    // 1.117 of the distance, and the way from 5.2 m to the keep-out zone.
    assert!((5.8..5.85).contains(&error) && (3.3..3.4).contains(&limit), "{refusal}");
    let said = refusal.to_string();
    assert!(said.starts_with("eccentricity: orbit.eccentricity is 0.6: "), "{said}");
    for e in [0.0, 1e-3, 0.01, 0.03] {
        let mut mission = Mission::default();
        mission.orbit.eccentricity = e;
        mission.check::<60>(&scenario(), RK4).unwrap();
    }
}

#[test]
fn input_that_is_none_is_refused_as_such() {
    let nan = refused(|_, s| s.velocity.y = f64::NAN);
    assert_eq!((nan.name(), nan.code()), ("not_finite", 1));
    assert_eq!(
        nan.to_string(),
        "not_finite: the scenario's velocity is not finite, or beyond 1e30"
    );
    let long = refused(|_, s| s.target_attitude *= 1.0 + 2e-6);
    assert_eq!(long.name(), "attitude");
    assert_eq!(refused(|_, s| s.target_attitude = Vector4::zeros()).name(), "attitude");
    let centre = refused(|_, s| s.position = Vector3::zeros());
    assert_eq!(centre.name(), "position");
    let coarse = refused(|m, _| m.approach.duration_s = 1e5);
    assert_eq!(coarse.name(), "node_interval");
    let early = refused(|m, _| m.approach.preset_s = 1190.0);
    assert_eq!(early.name(), "preset_lead");
    let short = refused(|_, s| s.duration = Some(0.5));
    assert_eq!(short.to_string(), "duration: 0.5 s is no time to capture: from 1 s to 1e6 s");
    let bus = refused(|_, s| s.start.bus_attitude = Some(Vector4::new(0.0, 0.0, 0.0, 2.0)));
    assert_eq!(bus.name(), "attitude");
    assert_eq!(refused(|_, s| s.start.joint_rate[1] = f64::INFINITY).name(), "not_finite");
    for refusal in [nan, long, centre, coarse, early, short, bus] {
        assert!(refusal.is_invalid_input(), "{refusal}");
    }
    let mut close = scenario();
    close.target_attitude *= 1.0 + 0.9e-6;
    Mission::default().check::<60>(&close, RK4).unwrap();
}

// Verifies REM-PLN-014.
#[test]
fn what_is_impossible_is_named_with_its_numbers() {
    let told = |change: &dyn Fn(&mut Mission<3>, &mut Scenario), text: &str| {
        let refusal = refused(change);
        assert!(!refusal.is_invalid_input(), "{refusal}");
        assert!(refusal.to_string().contains(text), "{refusal}\nnot {text}");
        assert_eq!(refusal.to_string().lines().count(), 1);
    };
    told(&|_, s| s.position = Vector3::new(0.0, 0.0, 2.0), "keep_out: the start is 1.800 m from");
    told(&|_, s| s.position = Vector3::new(0.0, 0.0, 0.1), "keep_out: the start is -0.100 m");
    told(
        &|m, _| m.target.port_position_m.x = 4.0,
        "field_of_view: at the start the port is 39.8 deg",
    );
    // Behind the line of sight, where a start that follows it turns on the spot.
    told(&|m, _| m.target.port_position_m.z = 9.0, "field_of_view: at the start the port is 17");
    told(
        &|m, _| m.servicer.joint_rate_limit_rad_s.fill(5e-4),
        "joint_rate: joint 2 has to turn 50.3 deg",
    );
    told(&|m, _| m.servicer.joint_rate_limit_rad_s.fill(5e-4), "lengthen the horizon to 2");
    told(&|m, _| m.servicer.boresight = Vector3::x(), "capture_view: in the capture configuration");
    told(&|_, s| s.target_rate.x = 0.052, "tumble: the target turns 60.");
    told(&|_, s| s.target_rate.x = 0.052, "at most 30.0 deg can be followed: shorten the");
    told(
        &|m, _| m.servicer.force_limit_n.fill(1e-4),
        "force: to be in front of the port in time takes",
    );
    told(&|_, s| s.velocity.y = 10.0, "force: ");
    told(&|m, _| m.servicer.arm_base_m.z = -1.1, "clearance: in the capture configuration");
}

#[test]
fn reach_is_refused_where_the_last_interval_cannot_close_the_gap() {
    let near = |keep_out: f64, force: f64| {
        let mut mission = Mission::default();
        mission.approach.keep_out_near_m = keep_out;
        mission.servicer.force_limit_n.fill(force);
        mission.check::<60>(&scenario(), RK4)
    };
    // Reach is 1.46 m.
    near(1.55, 2.5).unwrap();
    for refused in [near(1.55, 0.1), near(1.75, 2.5)] {
        assert!(matches!(refused, Err(Refusal::Reach { .. })), "{refused:?}");
    }
}

#[test]
fn bus_torque_is_refused_where_nothing_else_can_turn_the_bus() {
    let heavy = |m: &mut Mission<3>| {
        m.servicer.bus_mass_kg = 5000.0;
        m.servicer.bus_inertia_kg_m2 = principal_inertia(3000.0, 3000.0, 3000.0);
        m.servicer.force_limit_n.fill(1.0);
    };
    let refusal = refused(|m, s| {
        heavy(m);
        s.target_rate.z = 0.02;
    });
    let Refusal::BusTorque { needed, limit } = refusal else { panic!("{refusal}") };
    assert!(needed > limit && needed < 3000.0 * 0.0213 / 1200.0);
    let (mut mission, mut fast) = (Mission::default(), scenario());
    heavy(&mut mission);
    fast.target_rate.z = 0.02;
    mission.servicer.bus_torque_limit_n_m.fill(1.05 * needed);
    mission.check::<60>(&fast, RK4).unwrap();
}

#[test]
fn the_switches_decide_what_holds() {
    let mut mission = Mission::default();
    // 90 % of this rate is too little, all of it is not.
    let time = mission.time_to_preset(RK4, &mission.own_grid());
    mission.servicer.joint_rate_limit_rad_s.fill(1.05 * 0.877 / time);
    assert_eq!(mission.check_vehicle::<60>(RK4).unwrap_err().name(), "joint_rate");
    mission.approach.between_nodes = Switch::Off;
    mission.check_vehicle::<60>(RK4).unwrap();
    let mut mission = Mission::default();
    mission.servicer.arm_base_m.z = -1.1;
    assert_eq!(mission.check_vehicle::<60>(RK4).unwrap_err().name(), "clearance");
    mission.check_vehicle::<60>(Integrator::Euler).unwrap();
}

/// From rest to rest without an orbit, force is that of thrusting half the way and braking.
#[test]
fn the_least_force_is_that_of_bang_bang() {
    let mut mission = Mission::default();
    mission.orbit.semi_major_axis_m = 1e9;
    let start = Scenario { target_rate: Vector3::zeros(), ..scenario() };
    let needs = mission.needs::<60>(&start, RK4).unwrap();
    let way = start.position.z - 0.2 - mission.servicer.capture_geometry().reach;
    let expected = 4.0 * 530.0 * way / (1200.0 * 1200.0);
    assert!((needs.force / expected - 1.0).abs() < 0.01, "{} {expected}", needs.force);
}

#[test]
fn an_attitude_with_four_decimals_is_normalised_and_an_exact_one_keeps_its_bits() {
    let rounded = Vector4::new(0.1826, 0.3651, 0.5477, 0.7303);
    let start = Start { bus_attitude: Some(rounded), ..Default::default() };
    let given = Scenario { target_attitude: rounded, start, ..scenario() };
    let taken = given.validated().unwrap();
    for attitude in [taken.target_attitude, taken.start.bus_attitude.unwrap()] {
        assert!((quaternion::norm(&attitude) - 1.0).abs() < 1e-15);
        assert!((attitude - rounded).amax() < 1e-4);
    }
    let exact = Scenario { target_attitude: quaternion::IDENTITY * (1.0 + 0.9e-6), ..scenario() };
    assert_eq!(*exact.validated().unwrap(), exact);
    let long = Scenario { target_attitude: rounded * 1.002, ..scenario() };
    assert_eq!(long.validated().unwrap_err().name(), "attitude");
}

#[test]
fn directions_with_four_decimals_are_normalised() {
    let mut mission = Mission::<3>::default();
    mission.servicer.links[1].axis *= 0.9995;
    mission.target.port_normal *= 1.0005;
    let taken = mission.validated().unwrap();
    assert_eq!(*taken, Mission::default());
    mission.servicer.boresight *= 1.002;
    assert_eq!(mission.validated().unwrap_err().field, "servicer.boresight");
}
