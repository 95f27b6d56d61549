//! The datasets that are checked in: real plans, read as a training reads them.

use remora_core::advanced::stages::NODES;
use remora_host::draw::draw_one;
use remora_host::fingerprint::fingerprint;
use remora_host::formats::Mission;
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use remora_learn::dataset::{Dataset, Split, Trajectory};
use std::path::{Path, PathBuf};

/// Name, trajectories, integrator.
const SETS: [(&str, usize, &str); 2] = [("euler", 200, "euler"), ("rk4", 100, "rk4:4")];

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/datasets").join(name)
}

fn read(name: &str) -> (Dataset, Vec<Trajectory>) {
    let dataset = Dataset::open(&folder(name), 3).unwrap();
    let all = dataset.read(None).unwrap();
    (dataset, all)
}

#[test]
fn they_are_whole_and_of_the_built_in_mission() {
    let mut bytes = 0;
    for (name, count, integrator) in SETS {
        let (dataset, all) = read(name);
        assert_eq!((dataset.len(), all.len()), (count, count));
        assert_eq!(dataset.manifest.integrator.to_string(), integrator);
        assert_eq!(dataset.manifest.mission, fingerprint(&Mission::default()));
        assert!(all.windows(2).all(|pair| pair[0].scenario < pair[1].scenario));
        for entry in std::fs::read_dir(folder(name)).unwrap() {
            bytes += entry.unwrap().metadata().unwrap().len();
        }
    }
    assert!(bytes < 3_000_000, "{bytes}");
}

/// What a plan of the mission keeps to, in the numbers that a network learns from.
#[test]
fn they_are_plans() {
    let mission = Mission::default();
    let servicer = &mission.servicer;
    for (name, ..) in SETS {
        for t in read(name).1 {
            let unit = |q: &[f32; 4]| (q.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-5;
            assert!(t.attitude.iter().chain(&t.target_attitude).all(unit));
            let last = NODES - 1;
            // At capture the bus turns with the target, and the arm is held.
            let turns = t.rate[last].iter().zip(&t.target_rate[last]);
            assert!(turns.into_iter().all(|(bus, target)| (bus - target).abs() < 1e-6));
            assert!(t.joint_rate[last].iter().all(|rate| rate.abs() < 1e-6));
            assert!(t.force[last] == [0.0; 3] && t.bus_torque[last] == [0.0; 3]);
            for k in 0..NODES {
                for i in 0..mission.joints() {
                    let (angle, torque) = (f64::from(t.joint_angle[k][i]), t.joint_torque[k][i]);
                    assert!(angle < servicer.max_joint_angle_rad[i] + 1e-3);
                    assert!(angle > servicer.min_joint_angle_rad[i] - 1e-3);
                    assert!(f64::from(torque.abs()) < servicer.joint_torque_limit_n_m[i] * 1.001);
                }
                for i in 0..3 {
                    assert!(f64::from(t.force[k][i].abs()) < servicer.force_limit_n[i] * 1.001);
                    let torque = f64::from(t.bus_torque[k][i].abs());
                    assert!(torque < servicer.bus_torque_limit_n_m[i] * 1.001);
                }
            }
            let held: Vec<f64> = t.joint_angle[last].iter().map(|x| f64::from(*x)).collect();
            let capture = servicer.capture_joint_angle_rad.as_slice();
            assert!(held.iter().zip(capture).all(|(a, b)| (a - b).abs() < 1e-5), "{held:?}");
        }
    }
}

/// Today's planner plans the first scenario of each as dearly as it was planned then, within a per cent.
#[test]
fn they_are_planned_again() {
    for (name, ..) in SETS {
        let (dataset, all) = read(name);
        let mission = Mission::default();
        let integrator: Integrator = dataset.manifest.integrator;
        let scenario = draw_one(dataset.manifest.seed, all[0].scenario, &mission).unwrap();
        let method = Method { integrator, ..Method::default() };
        let request = PlanRequest { method, ..PlanRequest::default() };
        let plan = || Planner::new().plan(&request, &scenario).file;
        let cost = on_large_stack(plan).unwrap().stage2.cost;
        assert!((cost / all[0].cost - 1.0).abs() < 0.01, "{name}: {cost} {}", all[0].cost);
    }
}

/// One in fifty is held out, and always the same.
#[test]
fn a_share_is_held_out() {
    let held = |name: &str| -> Vec<u64> {
        let (dataset, all) = read(name);
        let held = all.iter().filter(|t| dataset.split(t) == Split::Validation);
        held.map(|t| t.scenario).collect()
    };
    for (name, count, _) in SETS {
        let found = held(name);
        assert!((1..count / 20).contains(&found.len()), "{name}: {found:?}");
        assert_eq!(found, held(name));
    }
}
