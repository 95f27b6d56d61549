//! Arms read from URDF files: dynamics against Pinocchio, and an arm that finds no angles at capture.

use nalgebra::{Matrix3, SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{Control, Multibody, State, articulated};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Link, Mission, Orbit, Servicer};
use remora_host::draw;
use remora_host::formats::{Limits, Verdict};
use remora_host::importing::{self, ImportedMission, Request};
use remora_host::memory::on_large_stack;
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use remora_urdf::{Arm, Options, import};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest difference, over the largest number it is a difference of.
const TOLERANCE: f64 = 1e-9;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/urdf").join(name)
}

fn vector<const N: usize>(value: &Value) -> SVector<f64, N> {
    let numbers: Vec<f64> =
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect();
    SVector::from_column_slice(&numbers)
}

/// The arm on the body that the file gives it, in the axes of that body's centre of mass.
fn servicer<const NL: usize>(arm: &Arm) -> Servicer<NL> {
    let bus = &arm.base.as_ref().unwrap().body;
    let joint = |i: usize| &arm.joints[i];
    Servicer {
        bus_mass_kg: bus.mass,
        bus_inertia_kg_m2: bus.inertia,
        bus_half_extents_m: Vector3::repeat(1.0),
        boresight: Vector3::z(),
        arm_base_m: arm.arm_base - bus.center_of_mass,
        links: std::array::from_fn(|i| Link {
            tip_m: joint(i).tip,
            center_of_mass_m: joint(i).body.center_of_mass,
            mass_kg: joint(i).body.mass,
            inertia_kg_m2: joint(i).body.inertia,
            axis: joint(i).axis,
            armature_kg_m2: joint(i).armature,
            radius_m: joint(i).capsule.radius,
            capsule_start_m: joint(i).capsule.start,
            capsule_end_m: joint(i).capsule.end - joint(i).tip,
        }),
        min_joint_angle_rad: SVector::from_fn(|i, _| joint(i).limits.lower),
        max_joint_angle_rad: SVector::from_fn(|i, _| joint(i).limits.upper),
        joint_rate_limit_rad_s: SVector::from_fn(|i, _| joint(i).limits.rate),
        initial_joint_angle_rad: SVector::zeros(),
        capture_joint_angle_rad: SVector::zeros(),
        force_limit_n: Vector3::repeat(1.0),
        bus_torque_limit_n_m: Vector3::repeat(1.0),
        joint_torque_limit_n_m: SVector::from_fn(|i, _| joint(i).limits.torque),
    }
}

/// A mission far from any planet, where RTN axes are inertial.
fn mission<const NL: usize>(servicer: Servicer<NL>) -> Mission<NL> {
    let orbit = Orbit { gravitational_parameter_m3_s2: 0.0, ..Orbit::default() };
    Mission { orbit, ..Mission::default().with_servicer(servicer) }
}

/// Compares end effector and accelerations of a free-flying arm in all states of its reference.
fn compare<const NL: usize>(name: &str, options: &Options) {
    let text = fs::read(fixture(&format!("{name}.urdf"))).unwrap();
    let arm = import(name, &text, options).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(arm.joints.len(), NL);
    let mission = mission::<NL>(servicer(&arm));
    let (servicer, body) = (&mission.servicer, Multibody::new(&mission));
    let reference = fs::read_to_string(fixture(&format!("{name}.pinocchio.json"))).unwrap();
    let reference: Value = serde_json::from_str(&reference).unwrap();
    let states = reference["states"].as_array().unwrap();
    assert!(states.len() >= 20);
    for known in states {
        let base = &known["base"];
        let attitude: Vector4<f64> = vector(&base["attitude"]);
        let turn = quaternion::rotation_matrix(&attitude);
        let state = State {
            attitude,
            joint_angle: vector(&known["q"]),
            rate: turn * vector::<3>(&base["angular_velocity"]),
            joint_rate: vector(&known["v"]),
        };
        // The reference's force acts at the base's origin, the planner's at its centre of mass.
        let center = arm.base.as_ref().unwrap().body.center_of_mass;
        let force: Vector3<f64> = vector(&base["force"]);
        let bus_torque = vector::<3>(&base["torque"]) - center.cross(&force);
        let control = Control { bus_torque, joint_torque: vector(&known["tau"]) };
        let force = turn * force;
        let expected: Vec<f64> = known["free_base"]["acceleration"]
            .as_array()
            .unwrap()
            .iter()
            .map(|number| number.as_f64().unwrap())
            .collect();
        let (angular, joints) = expected[3..].split_at(3);
        let expected_bus = turn * Vector3::from_column_slice(angular);
        let expected_joint = SVector::<f64, NL>::from_column_slice(joints);
        let scale = expected_bus.amax().max(expected_joint.amax()).max(1.0);
        let by_two = [
            body.acceleration(&state, &control, &force),
            articulated::acceleration(servicer, 0.0, &state, &control, &force),
        ];
        for found in by_two {
            let bus = (found.bus - expected_bus).amax();
            let joint = (found.joint - expected_joint).amax();
            assert!(bus.max(joint) <= TOLERANCE * scale, "{name}: {bus:e} {joint:e}");
        }
        // From the bus's centre of mass, and the reference's from its origin.
        let (_, tip) = servicer.center_of_mass_and_end_effector(&state.joint_angle);
        let miss = (tip + center - vector::<3>(&known["position"])).norm();
        assert!(miss <= TOLERANCE, "{name}: {miss:e}");
    }
}

// Verifies REM-PLN-021.
#[test]
fn imported_arms_move_as_pinocchio_says() {
    let tip = Options { end_effector: Some("tip".into()), ..Options::default() };
    compare::<6>("spatial", &tip);
    let mut gripper = Options { end_effector: Some("tool".into()), ..Options::default() };
    gripper.add_limit("forearm_pitch=-2,2,0.2,8").unwrap();
    gripper.add_hold("left=0.02").unwrap();
    gripper.add_hold("head_turn=0.7").unwrap();
    compare::<3>("gripper", &gripper);
}

fn imported(urdf: &str) -> Result<ImportedMission, String> {
    let request = Request::new("arm.urdf".into(), urdf.as_bytes().to_vec());
    importing::import(&request).map_err(|refusal| refusal.error(&request).to_string())
}

/// Joints that are strong and fast do not turn for nothing.
#[test]
fn joints_of_an_imported_arm_travel_no_more_than_they_must() {
    let text = fs::read(fixture("spatial.urdf")).unwrap();
    let mut request = Request::new("spatial.urdf".into(), text);
    request.options.end_effector = Some("tip".into());
    let joints = import("spatial.urdf", &request.urdf, &request.options).unwrap().joints;
    for joint in joints {
        request.options.add_limit(&format!("{}=-3.1,3.1,2,50", joint.name)).unwrap();
    }
    let made = importing::import(&request).map_err(|refusal| refusal.error(&request)).unwrap();
    let mut file = made.mission;
    (file.horizon.duration_s, file.scenarios.standoff_m) = (300.0, 15.0);
    (file.servicer.bus_mass_kg, file.servicer.bus_inertia_kg_m2) =
        (900.0, Matrix3::from_diagonal_element(250.0));
    (file.servicer.force_limit_n, file.servicer.bus_torque_limit_n_m) =
        (Limits::Same(20.0), Limits::Same(1.0));
    let mission = file.mission().unwrap();
    let scenario = draw::draw_one(1, 0, &mission).unwrap();
    let request = PlanRequest { mission, ..PlanRequest::default() };
    let plan = on_large_stack(|| Planner::new().plan(&request, &scenario)).unwrap();
    assert_eq!(plan.file.verdict, Some(Verdict::Optimal));
    let angles = &plan.file.stage2.joint_angle;
    for i in 0..6 {
        let travel: f64 = angles.windows(2).map(|pair| (pair[1][i] - pair[0][i]).abs()).sum();
        let net = (angles[59][i] - angles[0][i]).abs();
        // A tenth of a radian for joints that hardly move.
        assert!(travel <= 2.0 * net + 0.1, "joint {}: {travel} rad for {net}", i + 1);
    }
}

/// A tool too short for the links before it: the advice of the message works.
#[test]
fn an_arm_with_a_short_tool_is_told_which_link_is_in_the_way_and_which_tool_would_do() {
    let offset = fs::read_to_string(fixture("offset.urdf")).unwrap();
    let error = imported(&offset).unwrap_err();
    let after = |head: &str| -> f64 {
        let rest = error.split_once(head).unwrap_or_else(|| panic!("{head} in {error}")).1;
        rest.split_whitespace().next().unwrap().parse().unwrap()
    };
    let length = after("a longer tool would do: the end effector ");
    assert!(error.contains("m beyond joint `wrist_3` along its axis, not 0.080 m"), "{error}");
    assert!(length > 0.08 && length < 0.1, "{error}");
    let tool = offset.replace("xyz=\"0 0.08 0\"", &format!("xyz=\"0 {length} 0\""));
    assert!(tool != offset && imported(&tool).is_ok());
    assert!(error.contains("in the way: link `wrist_"), "{error}");
    let radius = after("; a capsule of radius ");
    assert!((0.03..0.055).contains(&radius), "{error}");
    // A cylinder is taken as a little more than it is.
    let thinner = format!("radius=\"{}\" length=\"0.12\"", radius - 1e-3);
    let thin = offset.replace("radius=\"0.055\" length=\"0.12\"", &thinner);
    assert!(thin != offset && imported(&thin).is_ok());
}
