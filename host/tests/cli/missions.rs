//! The mission files of `fixtures/missions`.

use super::bench::Bench;
use remora_core::nalgebra::SVector;
use remora_host::formats::{ScenarioSet, read_mission};
use std::path::{Path, PathBuf};

fn missions() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/missions");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 6);
    files
}

#[test]
fn each_lets_scenarios_be_drawn() {
    let bench = Bench::new();
    for file in missions() {
        let file = file.display();
        bench.solves(&format!("draw --count 20 --seed 1 --mission {file} --out a.scenarios.json"));
        let set = ScenarioSet::read(&bench.path("a.scenarios.json")).unwrap();
        assert_eq!(set.scenarios.len(), 20, "{file}");
        let mission = read_mission(Some(Path::new(&file.to_string()))).unwrap();
        let Some(norm) = mission.scenarios.rate_norm_rad_s else { continue };
        for scenario in &set.scenarios {
            let rate = scenario.scenario().target_rate.norm();
            assert!((rate - norm).abs() < 1e-12, "{file}: {rate} is not {norm}");
        }
    }
}

/// Far: the arm straight. Near: the arm at capture, where the centre of mass must end.
#[test]
fn keep_out_distances_fit_the_reach() {
    for file in missions() {
        let mission = read_mission(Some(&file)).unwrap();
        let (servicer, approach) = (&mission.servicer, &mission.approach);
        let (com, tip) = servicer.center_of_mass_and_end_effector(&SVector::zeros());
        let straight = (tip - com).norm();
        let file = file.display();
        assert!((approach.keep_out_far_m - straight).abs() < 2e-3, "{file}: far is {straight}");
        let capture = servicer.capture_geometry();
        let spare = capture.reach - approach.keep_out_near_m;
        assert!((-1e-4..2e-3).contains(&spare), "{file}: near is {}", capture.reach);
        // The end effector is ahead of the centre of mass: what the camera sees at capture.
        assert!(capture.direction.dot(&servicer.boresight) > 0.999, "{file}");
    }
}
