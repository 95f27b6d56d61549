//! Plans called verified, held against plain integration far finer than the planner's or the
//! verifier's: the target by rotation matrices in inertial axes, 400 RK4 substeps a node; the path
//! likewise; bus and arm by RK4 with 40 substeps.
//!
//! `REMORA_FINE=50` plans so many scenarios of each mission, instead of two.

use nalgebra::{Matrix3, Rotation3, SVector, Vector3};
use remora_core::advanced::dynamics::{Integrator, Multibody};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Workspace, plan,
};
use remora_core::advanced::stages::{LINKS, Mode, NODES};
use remora_host::draw;
use remora_host::formats::{self, read_mission};
use std::path::Path;

const RK4: Integrator = Integrator::Rk4 { substeps: 4 };
const SUBSTEPS: usize = 400;

/// One RK4 step.
fn rk4<const D: usize>(
    x: &SVector<f64, D>,
    t: f64,
    h: f64,
    f: impl Fn(f64, &SVector<f64, D>) -> SVector<f64, D>,
) -> SVector<f64, D> {
    let a = f(t, x);
    let b = f(t + 0.5 * h, &(x + a * (0.5 * h)));
    let c = f(t + 0.5 * h, &(x + b * (0.5 * h)));
    let d = f(t + h, &(x + c * h));
    x + (a + (b + c) * 2.0 + d) * (h / 6.0)
}

/// Target attitude, body to RTN, at the last node. RTN coincides with the inertial axes at first
/// and turns about the third.
fn target_at_end(mission: &Mission<LINKS>, scenario: &Scenario) -> Matrix3<f64> {
    let (n, j) = (mission.mean_motion(), mission.target.inertia_kg_m2);
    let start = quaternion::rotation_matrix(&scenario.target_attitude);
    let rate = scenario.target_rate + start.transpose() * Vector3::new(0.0, 0.0, n);
    let mut x = SVector::<f64, 12>::zeros();
    x.rows_mut(0, 9).copy_from_slice(start.as_slice());
    x.rows_mut(9, 3).copy_from(&rate);
    let has_gradient = mission.target.gravity_gradient.is_on(RK4);
    let rates = |t: f64, x: &SVector<f64, 12>| {
        let r = Matrix3::from_column_slice(&x.as_slice()[..9]);
        let w = Vector3::new(x[9], x[10], x[11]);
        let mut torque = -w.cross(&j.component_mul(&w));
        if has_gradient {
            let radial = r.transpose() * Vector3::new((n * t).cos(), (n * t).sin(), 0.0);
            torque += radial.cross(&j.component_mul(&radial)) * (3.0 * n * n);
        }
        let mut out = SVector::<f64, 12>::zeros();
        out.rows_mut(0, 9).copy_from_slice((r * w.cross_matrix()).as_slice());
        out.rows_mut(9, 3).copy_from(&torque.component_div(&j));
        out
    };
    let (steps, duration) = (SUBSTEPS * (NODES - 1), mission.approach.duration_s);
    let h = duration / steps as f64;
    for i in 0..steps {
        x = rk4(&x, i as f64 * h, h, rates);
    }
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -n * duration);
    turn.matrix() * Matrix3::from_column_slice(&x.as_slice()[..9])
}

/// Centre of mass at the last node: Hill's equations with the plan's forces held.
fn path_at_end(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    force: &[Vector3<f64>],
) -> Vector3<f64> {
    let (n, mass) = (mission.mean_motion(), mission.servicer.total_mass());
    let mut x = SVector::<f64, 6>::zeros();
    x.rows_mut(0, 3).copy_from(&scenario.position);
    x.rows_mut(3, 3).copy_from(&scenario.velocity);
    let h = mission.grid(scenario).duration / ((NODES - 1) * SUBSTEPS) as f64;
    for f in &force[..NODES - 1] {
        let a = f / mass;
        for _ in 0..SUBSTEPS {
            x = rk4(&x, 0.0, h, |_, x| {
                SVector::from([
                    x[3],
                    x[4],
                    x[5],
                    3.0 * n * n * x[0] + 2.0 * n * x[4] + a.x,
                    -2.0 * n * x[3] + a.y,
                    -n * n * x[2] + a.z,
                ])
            });
        }
    }
    Vector3::new(x[0], x[1], x[2])
}

/// Misses of one plan over its mission's tolerances: dynamics, end effector.
fn misses(mission: &Mission<LINKS>, scenario: &Scenario, workspace: &Workspace) -> [f64; 2] {
    let (path, motion) = (workspace.translation(), workspace.reorientation());
    let dt = mission.grid(scenario).interval();
    let body = Multibody::new(mission);
    let fine = Integrator::Rk4 { substeps: 40 };
    let mut worst = 0.0;
    let mut count = |x: f64, scale: f64| {
        let miss = x.abs() / scale / mission.tolerances.dynamics;
        // What is not a number is worst of all.
        if !(miss <= worst) {
            worst = miss;
        }
    };
    for k in 0..NODES - 1 {
        let (state, control) = (&motion.states[k], &motion.controls[k]);
        let next = body.step(fine, dt, state, control, &path.force[k]);
        let planned = &motion.states[k + 1];
        let error = quaternion::product(&next.attitude, &quaternion::conjugate(&planned.attitude));
        let sign = error.w.signum();
        error.xyz().iter().for_each(|x| count(2.0 * sign * x, 1.0));
        (next.joint_angle - planned.joint_angle).iter().for_each(|x| count(*x, 1.0));
        (next.rate - planned.rate).iter().for_each(|x| count(*x, 1e-2));
        (next.joint_rate - planned.joint_rate).iter().for_each(|x| count(*x, 1e-2));
    }
    let last = &motion.states[NODES - 1];
    let (center, tip) = mission.servicer.center_of_mass_and_end_effector(&last.joint_angle);
    let bus = quaternion::rotation_matrix(&last.attitude);
    let tip = path_at_end(mission, scenario, &path.force) + bus * (tip - center);
    let port = target_at_end(mission, scenario) * mission.target.port_position_m;
    [worst, (tip - port).norm() / mission.tolerances.ee_position_m]
}

// Verifies REM-PLN-011.
#[test]
fn plans_called_verified_hold_under_finer_integration() {
    let count = std::env::var("REMORA_FINE").map_or(2, |text| text.parse().unwrap());
    let missions = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/missions");
    let shipped = |name| {
        let file = format!("{missions}/{name}");
        read_mission(Some(Path::new(&file))).unwrap().sized::<LINKS>()
    };
    let changed = |change: fn(&mut Mission<LINKS>)| {
        let mut mission = Mission::default();
        change(&mut mission);
        mission
    };
    let cases = [
        ("default", Mission::default()),
        ("1 deg/s", shipped("tumble-1.mission.toml")),
        ("5 deg/s", shipped("tumble-5.mission.toml")),
        ("strong", shipped("strong.mission.toml")),
        ("small", shipped("small.mission.toml")),
        ("tumble x 7", changed(|m| m.scenarios.rate_rad_s *= 7.0)),
        ("30 m", changed(|m| m.scenarios.standoff_m = 30.0)),
        ("5,000 s", changed(|m| m.approach.duration_s = 5e3)),
        ("20,000 s", changed(|m| m.approach.duration_s = 2e4)),
    ];
    let (mut workspace, mut solver) = (Box::new(Workspace::new()), Box::new(EmbeddedSolver::new()));
    let options = PlanSettings::new(Mode::Optimal, RK4);
    let mut all = 0;
    for (name, mission) in cases {
        mission.validate().unwrap();
        let (mut verified, mut worst) = (0, [0.0f64; 2]);
        let drawn = draw::draw(count, 1, &formats::Mission::from(&mission)).unwrap();
        for named in drawn.scenarios {
            let scenario = named.scenario().resized();
            let report = plan(
                &mission,
                &scenario,
                &Options::from_parts(options, InitialGuess::Heuristic, Platform::BARE),
                &mut *solver,
                &mut workspace,
            );
            if !report.record.is_verified {
                continue;
            }
            verified += 1;
            let found = misses(&mission, &scenario, &workspace);
            // The verifier's own error is a thousandth of its tolerances.
            assert!(found.iter().all(|miss| *miss <= 1.001), "{name}, {}: {found:?}", named.id);
            worst = [0, 1].map(|i| worst[i].max(found[i]));
        }
        println!("{name}: {verified} of {count} verified, worst over tolerance {worst:.3?}");
        all += verified;
    }
    assert!(all >= count, "{all} verified");
}
