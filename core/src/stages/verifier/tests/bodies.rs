//! Clearances: bodies that touch, and the way of the end effector to the port.

use super::super::clearance::Bodies;
use super::super::{Clearances, Verification};
use super::{FLOWN, FREE, posed, rolled_out, scenario, verified};
use crate::dynamics::Control;
use crate::model::{Mission, Switch};
use nalgebra::{SVector, Vector3};

/// The servicer aligned with RTN with its bus at `bus`, its arm at `angles`, for a second.
fn placed(bus: [f64; 3], angles: [f64; 3], clearance: Switch) -> Verification {
    let mut mission = Mission::default();
    mission.approach.duration_s = 1.0;
    mission.approach.clearance = clearance;
    let joint_angle = SVector::from(angles);
    let (center, _) = mission.servicer.center_of_mass_and_end_effector(&joint_angle);
    let start = scenario(Vector3::from(bus) + center, Vector3::zeros());
    let plan = rolled_out::<2>(&mission, FLOWN, &start, posed(angles), Control::ZERO);
    verified(&mission, FLOWN, &start, &plan)
}

fn close(a: f64, b: f64) -> bool {
    // It drifts a little.
    (a - b).abs() < 2e-4
}

#[test]
fn distances_of_a_servicer_that_stands_off() {
    let found = placed([0.0, 0.0, -3.0], [0.0; 3], Switch::On);
    let Clearances { arm, bus, own } = found.clearances;
    // Bus from -3.5 to -2.5; the arm's tip at -3 + 0.116 + 1.8, far from the port on the other side.
    assert!(close(bus.distance, 2.3) && bus.body == 0, "{bus:?}");
    assert!(close(arm.distance, -0.2 + 1.084 - 0.05) && arm.body == 3, "{arm:?}");
    // The second link begins 0.866 above the bus's centre.
    assert!(close(own.distance, 0.316) && own.body == 2, "{own:?}");
    assert_eq!(found.residuals.clearance, 0.0);
}

#[test]
fn a_link_through_the_target_is_seen() {
    for (switch, judged) in [(Switch::On, true), (Switch::Off, false)] {
        let found = placed([0.0, 0.0, -1.5], [0.0; 3], switch);
        let Clearances { arm, bus, own } = found.clearances;
        // Links 2 and 3 pass the target's middle plane.
        assert!(close(arm.distance, -0.25) && arm.body >= 2, "{arm:?}");
        assert!(bus.distance > 0.0 && own.distance > 0.0);
        assert_eq!(found.residuals.clearance, if judged { -arm.distance } else { 0.0 });
        assert!((0.0..=1.0).contains(&arm.time_s));
    }
}

#[test]
fn a_bus_in_the_target_and_an_arm_in_the_bus_are_seen() {
    let found = placed([0.0, 0.0, -0.6], [0.0; 3], Switch::On);
    assert!(close(found.clearances.bus.distance, -0.1), "{:?}", found.clearances);
    let found = placed([0.0, 0.0, -4.0], [0.0, 3.0, 0.0], Switch::On);
    let own = found.clearances.own;
    assert!(own.distance < -0.2 && own.body >= 2, "{own:?}");
    assert_eq!(found.residuals.clearance, -own.distance);
}

/// The paper's problem has no clearances, but they are told.
#[test]
fn they_are_told_where_they_are_not_judged() {
    let mut mission = Mission::default();
    mission.approach.duration_s = 20.0;
    let start = scenario(Vector3::new(0.0, 0.0, -1.5), Vector3::zeros());
    let plan = rolled_out::<2>(&mission, FREE, &start, posed([0.0; 3]), Control::ZERO);
    let found = verified(&mission, FREE, &start, &plan);
    assert!(found.clearances.arm.distance < 0.0);
    assert_eq!(found.residuals.clearance, 0.0);
}

/// Between the nodes the bus flies through the target.
// Verifies REM-PLN-013.
#[test]
fn bodies_are_looked_at_between_the_nodes() {
    let mut mission = Mission::default();
    mission.approach.duration_s = 20.0;
    let start = scenario(Vector3::new(-3.2, 0.0, 0.0), Vector3::new(0.4, 0.0, 0.0));
    let plan = rolled_out::<2>(&mission, FLOWN, &start, posed([0.0; 3]), Control::ZERO);
    let Clearances { bus, .. } = verified(&mission, FLOWN, &start, &plan).clearances;
    assert!(bus.distance < -0.1 && bus.time_s == 8.0, "{bus:?}");
}

// Verifies REM-PLN-013.
#[test]
fn the_end_effector_comes_to_the_port_by_the_corridor_only() {
    let mut mission = Mission::default();
    mission.corridor.half_angle_rad = core::f64::consts::FRAC_PI_4;
    mission.corridor.mouth_radius_m = 0.05;
    let bodies = Bodies::new(&mission);
    let at = |x: f64, z: f64| bodies.end_effector(&Vector3::new(x, 0.0, z), 0.05);
    let (tolerance, root) = (1e-3, 0.5_f64.sqrt());
    // At the port; below it; on its way, where the height counts near and the free distance far.
    assert!((at(0.0, 0.2) - tolerance).abs() < 1e-12);
    assert!((at(0.0, 0.2 - 5e-3) + 4e-3).abs() < 1e-12);
    assert!((at(0.0, 0.3) - 0.101).abs() < 1e-12);
    // At 45 degrees: beside the mouth near the face, within the cone higher up.
    assert!((at(0.06, 0.2) + 0.01 * root).abs() < 1e-12);
    assert!((at(0.06, 0.23) - 0.02 * root).abs() < 1e-12);
    assert!((at(0.3, 0.23) + 0.02).abs() < 1e-12);
    // Free of the target it may be where it likes, on the other side too.
    assert!((at(1.4, 0.0) - 0.95).abs() < 1e-12);
    assert!((at(0.0, -0.5) - 0.25).abs() < 1e-12);
    assert!(at(f64::NAN, 0.3).is_nan() && at(0.0, f64::NAN).is_nan());
}
