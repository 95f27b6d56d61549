//! What planner and verifier share, derived a second time here: the keep-out radius at a node, the
//! node of the preset, the mean motion, the total mass and the equations of relative motion.

use crate::model::{Mission, hcw_acceleration};
use nalgebra::Vector3;

/// The problem's sections 5 and 6, with nodes counted from 1 as there: the far radius as long as no
/// more than seven tenths of the horizon have passed, the near one after that.
#[test]
fn keep_out_and_preset_are_those_of_the_problem() {
    for nodes in [20, 41, 60, 61, 100] {
        let mut mission = Mission::<3>::default();
        mission.approach.nodes = nodes;
        let grid = mission.own_grid();
        for node in 1..=nodes {
            let passed_tenths = 10 * (node - 1);
            let is_far = passed_tenths <= 7 * (nodes - 1);
            let radius = if is_far { 1.85 } else { 1.46 };
            assert_eq!(is_far && nodes == 60, node <= 42 && nodes == 60);
            assert_eq!(grid.keep_out(node - 1), radius, "{node} of {nodes}");
        }
        // The last node that leaves 80 s of the 1200, and the arm a step.
        let at_least_80_s = |node: usize| 1200 * (nodes - node) >= 80 * (nodes - 1);
        let preset = (1..=nodes).rev().find(|node| at_least_80_s(*node)).unwrap();
        assert_eq!(grid.preset_node() + 1, preset, "{nodes}");
        assert!(nodes != 60 || preset == 56);
    }
}

/// Newton's gravity for two masses, in axes that turn with the orbit of one of them: ten metres apart
/// it is as good as linear.
#[test]
fn relative_motion_is_that_of_two_masses() {
    let mission = Mission::<3>::default();
    let (mu, a) = (mission.orbit.gravitational_parameter_m3_s2, mission.orbit.semi_major_axis_m);
    // Kepler's third law, from the period.
    let period = core::f64::consts::TAU * libm::pow(a, 1.5) / libm::sqrt(mu);
    let n = core::f64::consts::TAU / period;
    assert!((mission.mean_motion() / n - 1.0).abs() < 1e-14);
    let spin = Vector3::new(0.0, 0.0, n);
    let chief = Vector3::new(a, 0.0, 0.0);
    let gravity = |r: Vector3<f64>| r * (-mu / libm::pow(r.norm(), 3.0));
    // Differences of accelerations of 8 m/s^2 lose nine digits; to both sides, the quadratic part
    // cancels.
    let directions = [
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(0.0, 0.0, 1.0),
        Vector3::new(0.5, -0.7, 0.3),
    ];
    for direction in directions {
        let (position, velocity) = (direction * 10.0, direction.zxy() * 1e-2);
        let centrifugal = spin.cross(&spin.cross(&position));
        let differential = (gravity(chief + position) - gravity(chief - position)) / 2.0;
        let exact = differential - 2.0 * spin.cross(&velocity) - centrifugal;
        let linear = hcw_acceleration(n, &position, &velocity);
        // Rounding of the differences: 1e-15 of 8 m/s^2.
        assert!((exact - linear).norm() < 1e-14, "{exact} {linear}");
    }
}

#[test]
fn the_total_mass_is_that_of_all_bodies() {
    let servicer = Mission::<3>::default().servicer;
    let [one, two, three] = servicer.links.map(|link| link.mass_kg);
    let sum = one + two + three + servicer.bus_mass_kg;
    assert!((servicer.total_mass() - sum).abs() < 1e-12);
    assert!((sum - 530.0).abs() < 1e-9, "{sum}");
}
