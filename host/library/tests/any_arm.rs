//! Servicers with limits of their own on every joint and axis, and with an arm that is mounted turned.

use nalgebra::{SVector, Vector3};
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::model::{Integrator, Mission, Scenario};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::stages::{LINKS, Mode, NODES};
use remora_core::prelude::Status;
use remora_host::formats::{MissionFile, ScenarioSet};
use remora_host::memory::on_heap;
use remora_host::planning::WallClock;

const RK4: Integrator = Integrator::Rk4 { substeps: 4 };

fn scenario(k: usize) -> Scenario {
    ScenarioSet::built_in().unwrap().scenarios[k].scenario().resized()
}

fn planned(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    integrator: Integrator,
) -> (Report, Box<Workspace>) {
    mission.validate().unwrap();
    let (mut workspace, mut solver) = (on_heap(Workspace::new), on_heap(EmbeddedSolver::new));
    let settings = PlanSettings::new(Mode::Optimal, integrator);
    let platform = Platform { clock: &WallClock::start(), executor: &Sequential };
    let options = Options::from_parts(settings, InitialGuess::Heuristic, platform);
    let report = plan(mission, scenario, &options, &mut *solver, &mut workspace);
    (report, workspace)
}

/// Limits that the default servicer's plan does not keep: of one axis or joint of each kind.
fn narrow() -> Mission<LINKS> {
    let mut mission = Mission::default();
    let s = &mut mission.servicer;
    // The second joint's stops do not hold zero, the first one's not even the other sign.
    s.min_joint_angle_rad = SVector::from([-0.80, 0.55, -0.80]);
    s.max_joint_angle_rad = SVector::from([-0.30, 1.57, 0.05]);
    s.joint_rate_limit_rad_s = SVector::from([5e-3, 1.2e-3, 4e-3]);
    s.joint_torque_limit_n_m = SVector::from([5e-3, 5e-3, 2e-5]);
    s.bus_torque_limit_n_m = Vector3::new(5e-3, 2e-4, 4e-3);
    s.force_limit_n = Vector3::new(0.012, 2.5, 1.0);
    mission
}

/// Whether a value is within plus and minus its limit, but for the verifier's tolerance.
fn within<const D: usize>(value: &SVector<f64, D>, limit: &SVector<f64, D>) -> bool {
    value.iter().zip(limit).all(|(value, limit)| value.abs() <= limit * (1.0 + 1e-6))
}

/// How many of the values of a plan are beyond what the narrow servicer allows, by kind.
fn beyond(workspace: &Workspace) -> [usize; 5] {
    let s = narrow().servicer;
    let (path, motion) = (workspace.translation(), workspace.reorientation());
    let mut count = [0; 5];
    for (state, control) in motion.states.iter().zip(&motion.controls).take(NODES - 1) {
        let stops = s.min_joint_angle_rad.iter().zip(&s.max_joint_angle_rad);
        let is_stopped = |(angle, (lower, upper)): (&f64, (&f64, &f64))| {
            (lower - 1e-6..=upper + 1e-6).contains(angle)
        };
        count[0] += usize::from(!state.joint_angle.iter().zip(stops).all(is_stopped));
        count[1] += usize::from(!within(&state.joint_rate, &s.joint_rate_limit_rad_s));
        count[2] += usize::from(!within(&control.joint_torque, &s.joint_torque_limit_n_m));
        count[3] += usize::from(!within(&control.bus_torque, &s.bus_torque_limit_n_m));
    }
    count[4] = path.force.iter().filter(|force| !within(*force, &s.force_limit_n)).count();
    count
}

// Verifies REM-PLN-018.
#[test]
fn limits_of_one_joint_or_axis_are_kept() {
    for integrator in [Integrator::Euler, RK4] {
        let scenario = scenario(0);
        let (_, free) = planned(&Mission::default(), &scenario, integrator);
        assert!(beyond(&free).iter().all(|count| *count > 0), "{:?}", beyond(&free));
        let (report, held) = planned(&narrow(), &scenario, integrator);
        assert!(report.is_verified(), "{:?} {:?}", report.status, report.residuals);
        assert_eq!(report.status, Status::Solved);
        assert_eq!(beyond(&held), [0; 5]);
    }
}

/// The default arm, given in axes that are a quarter turn about the bus's +z off the bus's own: what was
/// along +x is along -y there, and what was along +y along +x.
const TURNED: &str = "[servicer]
arm_base_rotation = [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]
LINKS";

/// The default link of this length, in those axes.
fn turned_link(length: f64) -> String {
    let link = Mission::default().servicer.links[if length < 0.5 { 2 } else { 0 }];
    let [across, along] = [link.inertia_kg_m2[(0, 0)], link.inertia_kg_m2[(2, 2)]];
    format!(
        "[[servicer.links]]
tip_m = [0.0, 0.0, {length}]
center_of_mass_m = [0.0, 0.0, {}]
mass_kg = 10.0
inertia_kg_m2 = [{across}, {across}, {along}, 0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
",
        0.5 * length
    )
}

// Verifies REM-PLN-018.
#[test]
fn an_arm_given_in_turned_axes_is_the_same_arm() {
    let links: String = [0.75, 0.75, 0.30].map(turned_link).concat();
    let text = TURNED.replace("LINKS", &links);
    let mut turned = MissionFile::parse(&text).unwrap().mission().unwrap().sized::<LINKS>();
    let default = Mission::default();
    for (ours, other) in turned.servicer.links.iter().zip(&default.servicer.links) {
        assert!((ours.axis - other.axis).norm() < 1e-15, "{}", ours.axis);
        assert!((ours.inertia_kg_m2 - other.inertia_kg_m2).norm() < 1e-15);
        assert_eq!((ours.tip_m, ours.center_of_mass_m), (other.tip_m, other.center_of_mass_m));
    }
    // Rounding of the axes makes the radii others than the published ones.
    turned.approach = default.approach;
    for integrator in [Integrator::Euler, RK4] {
        let [a, b] = [&default, &turned].map(|m| planned(m, &scenario(1), integrator).0);
        assert!(a.is_verified() && b.is_verified());
        let costs = [a.reorientation.cost, b.reorientation.cost];
        assert!((costs[1] / costs[0] - 1.0).abs() < 1e-6, "{costs:?}");
        assert!((b.translation.cost / a.translation.cost - 1.0).abs() < 1e-6);
    }
}

/// Rotors that are as heavy to turn as the arm itself, and a bus and links whose axes are no principal
/// ones.
// Verifies REM-PLN-018.
#[test]
fn an_arm_with_rotors_and_a_skew_bus_is_planned() {
    let mut mission = Mission::default();
    let s = &mut mission.servicer;
    s.bus_inertia_kg_m2[(0, 1)] = 6.0;
    s.bus_inertia_kg_m2[(1, 0)] = 6.0;
    for link in &mut s.links {
        link.armature_kg_m2 = 3.0;
        link.inertia_kg_m2[(0, 2)] = 0.01;
        link.inertia_kg_m2[(2, 0)] = 0.01;
    }
    let (report, _) = planned(&mission, &scenario(2), RK4);
    assert_eq!((report.status, report.is_verified()), (Status::Solved, true));
    let (light, _) = planned(&Mission::default(), &scenario(2), RK4);
    assert!(report.reorientation.cost > 1.2 * light.reorientation.cost);
}
