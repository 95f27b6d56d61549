//! Arms of one to seven joints, planar and spatial, by the program's two engines; and the roll of the end
//! effector about the approach.

use nalgebra::{Rotation3, SVector, Unit, Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{self, CaptureSearch, Link, Roll, Servicer};
use remora_core::advanced::stages::NODES;
use remora_core::prelude::{ArmPlanner, InitialGuess, Options, Validate};
use remora_host::formats::{
    MAX_JOINTS, Mission, MissionFile, NamedScenario, PLANNED_JOINTS, PlanFile, ScenarioSet,
    Verdict, read_mission,
};
use remora_host::memory::{on_heap, on_large_stack};
use remora_host::method::{Integrator, Method};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use std::collections::BTreeSet;

const RK4: Integrator = Integrator::Rk4 { substeps: 4 };

fn scenario(k: usize) -> NamedScenario {
    ScenarioSet::built_in().unwrap().scenarios[k].clone()
}

fn request(mission: &Mission, integrator: Integrator) -> PlanRequest {
    let method = Method { integrator, ..Method::default() };
    PlanRequest { mission: *mission, method, ..PlanRequest::default() }
}

/// The default mission with another arm, which ends in the configuration that is found for it.
fn with_arm<const NL: usize>(links: [Link; NL], start: [f64; NL]) -> model::Mission<NL> {
    let base = model::Mission::default();
    let s = base.servicer;
    let start = SVector::from(start);
    let mut servicer = Servicer {
        bus_mass_kg: s.bus_mass_kg,
        bus_inertia_kg_m2: s.bus_inertia_kg_m2,
        bus_half_extents_m: s.bus_half_extents_m,
        boresight: s.boresight,
        arm_base_m: Vector3::new(0.0, 0.0, 0.5),
        links,
        min_joint_angle_rad: SVector::repeat(-2.8),
        max_joint_angle_rad: SVector::repeat(2.8),
        joint_rate_limit_rad_s: SVector::repeat(5e-3),
        initial_joint_angle_rad: start,
        capture_joint_angle_rad: start,
        force_limit_n: s.force_limit_n,
        bus_torque_limit_n_m: s.bus_torque_limit_n_m,
        joint_torque_limit_n_m: SVector::repeat(5e-3),
    };
    let search = CaptureSearch {
        axis: Vector3::z(),
        max_off_boresight: 0.1 * base.approach.field_of_view_half_angle_rad,
        clearance: 0.05,
        stop_margin: 0.02,
    };
    servicer.capture_joint_angle_rad = servicer.capture_configuration(&search, &start).unwrap();
    let mission = base.with_servicer(servicer);
    mission.validate().unwrap();
    mission
}

fn link(length: f64, mass: f64, axis: Vector3<f64>) -> Link {
    Link { axis, ..Link::cylinder(length, mass, 0.05) }
}

/// A shoulder that pans, then elbows about +y.
fn four() -> model::Mission<4> {
    let (y, z) = (Vector3::y(), Vector3::z());
    let links = [link(0.2, 5.0, z), link(0.6, 9.0, y), link(0.6, 9.0, y), link(0.4, 7.0, y)];
    with_arm(links, [0.4, -0.6, 1.2, -0.4])
}

/// Plans some scenarios; every plan is verified, and reads back as what it is.
fn plans(mission: &Mission) {
    let joints = mission.joints();
    let all = || {
        let mut planner = Planner::new();
        for (k, integrator) in [(0, Integrator::Euler), (7, Integrator::Euler), (3, RK4)] {
            let planned = planner.plan(&request(mission, integrator), &scenario(k));
            let file = planned.file;
            assert_ne!(
                file.verdict,
                Some(Verdict::NotFlyable),
                "{joints} {k}: {:?}",
                planned.reason
            );
            assert_eq!(
                (file.stage2.joint_angle[0].len(), file.stage2.joint_rate[9].len()),
                (joints, joints)
            );
            let read = PlanFile::parse(&serde_json::to_string(&file).unwrap()).unwrap();
            assert_eq!(read, file);
            let (path, motion) = (file.stage1.trajectory(), file.stage2.trajectory());
            let sum = mission.output_checksum(NODES, &path, &motion);
            assert_eq!(planned.evidence.output, format!("{sum:016x}"));
        }
    };
    on_large_stack(all).unwrap();
}

// Verifies REM-PLN-018.
#[test]
fn arms_of_one_to_seven_joints_are_planned() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/arms");
    let mut planned = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let mission = read_mission(Some(&path)).unwrap();
        planned.insert(mission.joints());
        plans(&mission);
    }
    assert_eq!(planned, BTreeSet::from([1, 2, 3, 4, 6, 7]));
}

/// A plan by a build of the arm's own size, and one by a build with room for more joints.
// Verifies REM-PLN-018.
#[test]
fn joints_that_are_not_there_change_no_plan() {
    let mission = four();
    let core = || {
        let mut own = on_heap(ArmPlanner::<4, 14, 7>::new);
        let options = Options::for_arm()
            .integrator(Integrator::Euler)
            .initial_guess(InitialGuess::Heuristic)
            .build()
            .unwrap();
        let (mission, scenario) =
            (mission.validated().unwrap(), scenario(2).scenario().resized::<4>());
        let plan = own.plan(&mission, &scenario.validated().unwrap(), &options).unwrap();
        assert!(plan.is_verified());
        let (report, motion) =
            (*plan.report(), *plan.nominal().reorientation.states.first().unwrap());
        (report.reorientation.cost, report.record.input, motion.joint_angle)
    };
    let host = Mission::from(&mission);
    let roomy = || Planner::new().plan(&request(&host, Integrator::Euler), &scenario(2));
    let (cost, input, _) = on_large_stack(core).unwrap();
    let planned = on_large_stack(roomy).unwrap();
    let roomy = planned.file.stage2.cost;
    assert!((roomy / cost - 1.0).abs() < 1e-2, "{roomy} {cost}");
    assert_eq!(planned.evidence.input, format!("{input:016x}"));
}

/// Angle between what the roll says are one direction, in the last node of a plan, by rotations of its
/// own [rad].
fn roll_error(mission: &Mission, plan: &PlanFile) -> f64 {
    let roll = mission.roll.unwrap_or(REFERENCE);
    let rotation = |q: &[f64; 4]| quaternion::rotation_matrix(&Vector4::from(*q));
    let last = plan.stage2.attitude.len() - 1;
    let target = rotation(&plan.target.attitude[last]);
    let mut axes = Rotation3::identity();
    for (link, angle) in mission.servicer.links.iter().zip(&plan.stage2.joint_angle[last]) {
        axes *= Rotation3::from_axis_angle(&Unit::new_normalize(link.axis), *angle);
    }
    let normal = target * mission.target.port_normal;
    let across = |v: Vector3<f64>| (v - normal * normal.dot(&v)).normalize();
    let end_effector = rotation(&plan.stage2.attitude[last]) * (axes * roll.end_effector);
    across(end_effector).angle(&across(target * roll.port))
}

/// Across the approach on both sides.
const REFERENCE: Roll =
    Roll { end_effector: Vector3::new(1.0, 0.0, 0.0), port: Vector3::new(0.6, 0.8, 0.0) };

/// The built-in mission with this roll.
fn rolled(roll: Roll) -> Mission {
    let mut mission = Mission::default();
    mission.roll = Some(roll);
    mission
}

// Verifies REM-PLN-018.
#[test]
fn a_roll_that_is_given_is_met() {
    let (free, mission) = (Mission::default(), rolled(REFERENCE));
    mission.validate().unwrap();
    let all = || {
        let mut planner = Planner::new();
        let mut turned = 0.0_f64;
        for (k, integrator) in
            [(0, Integrator::Euler), (1, Integrator::Euler), (2, Integrator::Euler), (4, RK4)]
        {
            let open = planner.plan(&request(&free, integrator), &scenario(k)).file;
            turned = turned.max(roll_error(&free, &open));
            let planned = planner.plan(&request(&mission, integrator), &scenario(k));
            assert_eq!(planned.file.verdict, Some(Verdict::Optimal), "{k}: {:?}", planned.reason);
            assert!(roll_error(&mission, &planned.file) < 1e-5);
        }
        // Left free the roll is another.
        assert!(turned > 0.3, "{turned}");
    };
    on_large_stack(all).unwrap();
}

/// The verifier sees a roll that is not met.
// Verifies REM-PLN-018.
#[test]
fn a_roll_that_is_missed_is_seen() {
    let free = Mission::default();
    let plan = || Planner::new().plan(&request(&free, Integrator::Euler), &scenario(0)).file;
    let plan = on_large_stack(plan).unwrap();
    let mission = rolled(REFERENCE);
    let found = remora_host::engine::verified(
        &mission,
        &scenario(0).scenario(),
        Integrator::Euler,
        &plan.stage1.trajectory(),
        &plan.stage2.trajectory(),
    );
    let error = roll_error(&mission, &plan);
    assert!((found.residuals.ee_angle - error).abs() < 1e-9, "{error}");
    assert!(error > 1e-3);
}

#[test]
fn a_roll_along_the_approach_is_refused() {
    let field = |roll: Roll| rolled(roll).validate().unwrap_err().field;
    let along = Vector3::z();
    assert_eq!(field(Roll { end_effector: along, ..REFERENCE }), "roll.end_effector");
    assert_eq!(field(Roll { port: along, ..REFERENCE }), "roll.port");
    assert_eq!(field(Roll { port: along * 2.0, ..REFERENCE }), "roll.port");
}

#[test]
fn another_number_of_joints_is_refused_by_name() {
    let mut file = MissionFile::of(&four().into());
    assert_eq!((file.joints(), file.mission().unwrap().joints()), (4, 4));
    for joints in [0, MAX_JOINTS + 1] {
        file.servicer.links.resize(joints, Link::default());
        let error = file.mission().unwrap_err();
        assert_eq!(error.field, "servicer.links");
        assert_eq!(error.reason, format!("has {joints} entries; {PLANNED_JOINTS}"));
    }
    let mut start = scenario(0);
    start.servicer.joint_angle_rad = Some(vec![0.0; 3]);
    let error = start.check_joints(4).unwrap_err();
    assert_eq!(error.field, "servicer.joint_angle_rad");
    assert_eq!(error.reason, "one number for each of the mission's 4 joints, not 3");
}
