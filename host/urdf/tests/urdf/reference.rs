//! Against Pinocchio, whose answers `ci/pinocchio_reference.py` writes.

use crate::scene::{MassMatrix, of_arm};
use crate::{GRIPPER, fixture, options};
use nalgebra::{Matrix3, Vector3};
use remora_urdf::{Arm, explain, import};
use serde_json::Value;
use std::path::Path;
use std::{env, fs};

const TOLERANCE: f64 = 1e-9;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

/// The matrix of joints that come after `before` other freedoms.
fn mass_matrix(value: &Value, before: usize) -> MassMatrix {
    let mut matrix = MassMatrix::zeros();
    for (i, row) in rows(value).iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            matrix[(before + i, before + j)] = *entry;
        }
    }
    matrix
}

/// Largest differences: position [m], rotation, mass matrices over their largest entry.
fn differences(arm: &Arm, reference: &Value) -> [f64; 4] {
    let names: Vec<&str> = arm.joints.iter().map(|joint| &joint.name[..]).collect();
    let expected = reference["joints"].as_array().unwrap();
    assert_eq!(names, expected.iter().map(|name| name.as_str().unwrap()).collect::<Vec<_>>());
    let mut worst = [0.0_f64; 4];
    for state in reference["states"].as_array().unwrap() {
        let scene = of_arm(arm, &numbers(&state["q"]));
        let (position, rotation) = scene.end_effector;
        let expected = Vector3::from_column_slice(&numbers(&state["position"]));
        worst[0] = worst[0].max((position - expected).norm());
        let axes = rows(&state["rotation"]);
        let expected = Matrix3::from_fn(|i, j| axes[i][j]);
        worst[1] = worst[1].max((rotation - expected).amax());
        for (i, (part, before)) in [("fixed_base", 6), ("free_base", 0)].into_iter().enumerate() {
            if let Some(part) = state.get(part) {
                let expected = mass_matrix(&part["mass_matrix"], before);
                let found = scene.mass_matrix(before == 0);
                worst[2 + i] = worst[2 + i].max((found - expected).amax() / expected.amax());
            }
        }
    }
    worst
}

/// Reads a URDF with flags and compares it with its reference.
fn compare(urdf: &Path, reference: &Path, flags: &str) -> [f64; 4] {
    let reference: Value = serde_json::from_str(&fs::read_to_string(reference).unwrap()).unwrap();
    let text = fs::read(urdf).unwrap();
    let arm = import("the URDF", &text, &options(flags)).unwrap_or_else(|error| panic!("{error}"));
    let worst = differences(&arm, &reference);
    assert!(
        worst.iter().all(|difference| *difference <= TOLERANCE),
        "{}: {worst:?}",
        urdf.display()
    );
    worst
}

#[test]
fn kinematics_and_mass_matrices_are_pinocchios() {
    for (name, flags) in [("planar", ""), ("spatial", "--end-effector tip"), ("gripper", GRIPPER)] {
        compare(
            &fixture(&format!("{name}.urdf")),
            &fixture(&format!("{name}.pinocchio.json")),
            flags,
        );
    }
}

/// The references hold accelerations: mass matrix and torques give those without rates.
#[test]
fn references_hold_what_the_dynamics_are_to_be_held_to() {
    for name in ["planar", "spatial", "gripper"] {
        let text = fs::read_to_string(fixture(&format!("{name}.pinocchio.json"))).unwrap();
        let reference: Value = serde_json::from_str(&text).unwrap();
        let states = reference["states"].as_array().unwrap();
        assert_eq!(states.len(), 20);
        for state in states {
            let joints = numbers(&state["q"]).len();
            assert_eq!(numbers(&state["fixed_base"]["acceleration"]).len(), joints);
            assert_eq!(state.get("free_base").is_some(), name != "planar");
            if let Some(free) = state.get("free_base") {
                assert_eq!(numbers(&free["acceleration"]).len(), 6 + joints);
                assert_eq!(numbers(&state["base"]["attitude"]).len(), 4);
            }
        }
    }
}

/// For `ci/import_real_arms.sh`: the files that the environment names.
#[test]
#[ignore = "needs REMORA_URDF, REMORA_URDF_REFERENCE and REMORA_URDF_FLAGS"]
fn a_file_of_the_environment_is_pinocchios() {
    let named = |name: &str| env::var(name).unwrap_or_else(|_| panic!("{name} is not set"));
    let (urdf, reference) = (named("REMORA_URDF"), named("REMORA_URDF_REFERENCE"));
    let flags = named("REMORA_URDF_FLAGS");
    println!("{}", explain(&urdf, &fs::read(&urdf).unwrap(), &options(&flags)));
    let worst = compare(Path::new(&urdf), Path::new(&reference), &flags);
    println!("largest differences: position, rotation, mass matrix fixed, free: {worst:?}");
}
