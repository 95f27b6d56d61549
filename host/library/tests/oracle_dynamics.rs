//! The dynamics against an independent oracle (Pinocchio, cross-checked with CasADi): see
//! `fixtures/oracle/README.md`.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{
    Control, Integrator, Multibody, State, SystemState, articulated,
};
use remora_core::advanced::model::Mission;
use serde::Deserialize;

#[derive(Deserialize)]
struct Oracle {
    header: Header,
    states: Vec<Case>,
}

#[derive(Deserialize)]
struct Header {
    n: f64,
    dt: f64,
}

#[derive(Deserialize)]
struct Case {
    r: [f64; 3],
    q: [f64; 4],
    alpha: [f64; 3],
    v: [f64; 3],
    w: [f64; 3],
    alpha_dot: [f64; 3],
    f: [f64; 3],
    tau_0: [f64; 3],
    tau_m: [f64; 3],
    out: Out,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Out {
    bus_accel: [f64; 3],
    com_accel: [f64; 3],
    w_dot: [f64; 3],
    alpha_ddot: [f64; 3],
    com: [f64; 3],
    com_vel: [f64; 3],
    ee: [f64; 3],
    ee_R: Vec<f64>,
    euler: Successor,
    accel_jacobian: Vec<f64>,
    rk4_m1: Successor,
    rk4_m4: Successor,
}

#[derive(Deserialize)]
struct Successor {
    q: [f64; 4],
    alpha: [f64; 3],
    w: [f64; 3],
    alpha_dot: [f64; 3],
}

impl Case {
    fn state(&self) -> State<3> {
        State {
            attitude: Vector4::from(self.q),
            joint_angle: SVector::from(self.alpha),
            rate: Vector3::from(self.w),
            joint_rate: SVector::from(self.alpha_dot),
        }
    }

    fn control(&self) -> Control<3> {
        Control { bus_torque: Vector3::from(self.tau_0), joint_torque: SVector::from(self.tau_m) }
    }

    fn force(&self) -> Vector3<f64> {
        Vector3::from(self.f)
    }
}

fn oracle() -> (Oracle, Mission<3>) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/oracle/dynamics_public.json");
    let oracle: Oracle = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mission = Mission::default();
    assert!((mission.mean_motion() - oracle.header.n).abs() < 1e-18);
    assert_eq!(oracle.states.len(), 100);
    (oracle, mission)
}

/// Largest error relative to the largest magnitude of the reference.
fn relative(ours: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(ours.len(), reference.len());
    let scale = reference.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let error = ours.iter().zip(reference).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    error / scale
}

// Verifies REM-DYN-001.
#[test]
fn accelerations() {
    let (oracle, mission) = oracle();
    let body = Multibody::new(&mission);
    for case in &oracle.states {
        let state = SystemState {
            position: Vector3::from(case.r),
            velocity: Vector3::from(case.v),
            internal: case.state(),
        };
        let rates = body.system_rates(&state, &case.control(), &case.force());
        let out = &case.out;
        assert!(relative(rates.rate.as_slice(), &out.w_dot) < 1e-9);
        assert!(relative(rates.joint_rate.as_slice(), &out.alpha_ddot) < 1e-9);
        assert!(relative(rates.bus.as_slice(), &out.bus_accel) < 1e-9);
        assert!(relative(rates.center_of_mass.as_slice(), &out.com_accel) < 1e-9);

        let second = articulated::acceleration(
            &mission.servicer,
            mission.mean_motion(),
            &case.state(),
            &case.control(),
            &case.force(),
        );
        assert!(relative(second.bus.as_slice(), &out.w_dot) < 1e-9);
        assert!(relative(second.joint.as_slice(), &out.alpha_ddot) < 1e-9);
    }
}

#[test]
fn center_of_mass_and_end_effector() {
    let (oracle, mission) = oracle();
    let body = Multibody::new(&mission);
    for case in &oracle.states {
        let (offset, rate) = body.center_of_mass(&case.state());
        let com = Vector3::from(case.r) + offset;
        let velocity = Vector3::from(case.v) + rate;
        assert!((com - Vector3::from(case.out.com)).norm() < 1e-12);
        assert!((velocity - Vector3::from(case.out.com_vel)).norm() < 1e-14);
        let tip = body.end_effector(&case.state());
        assert!((com + tip.position - Vector3::from(case.out.ee)).norm() < 1e-12);
        assert!((tip.rotation - Matrix3::from_row_slice(&case.out.ee_R)).norm() < 1e-12);
    }
}

// Verifies REM-DYN-002.
#[test]
fn successors() {
    let (oracle, mission) = oracle();
    let body = Multibody::new(&mission);
    for case in &oracle.states {
        let out = &case.out;
        for (integrator, expected) in [
            (Integrator::Euler, &out.euler),
            (Integrator::Rk4 { substeps: 1 }, &out.rk4_m1),
            (Integrator::Rk4 { substeps: 4 }, &out.rk4_m4),
        ] {
            let dt = oracle.header.dt;
            let next = body.step(integrator, dt, &case.state(), &case.control(), &case.force());
            assert!(relative(next.attitude.as_slice(), &expected.q) < 1e-10);
            assert!(relative(next.joint_angle.as_slice(), &expected.alpha) < 1e-10);
            assert!(relative(next.rate.as_slice(), &expected.w) < 1e-10);
            assert!(relative(next.joint_rate.as_slice(), &expected.alpha_dot) < 1e-10);
        }
    }
}

// Verifies REM-DYN-003.
#[test]
fn acceleration_jacobian() {
    let (oracle, mission) = oracle();
    let body = Multibody::new(&mission);
    for case in &oracle.states {
        let (state, control, force) = (case.state(), case.control(), case.force());
        let (_, by) = body.acceleration_jacobian::<12, 6>(&state, &control, &force);
        let by_force = body.force_jacobian(&state, &control, &force);
        let mut ours = SMatrix::<f64, 6, 21>::zeros();
        ours.view_mut((0, 0), (3, 12)).copy_from(&by.bus_state);
        ours.view_mut((3, 0), (3, 12)).copy_from(&by.joint_state);
        ours.view_mut((0, 12), (3, 3)).copy_from(&by_force.bus);
        ours.view_mut((3, 12), (3, 3)).copy_from(&by_force.joint);
        ours.view_mut((0, 15), (3, 6)).copy_from(&by.bus_control);
        ours.view_mut((3, 15), (3, 6)).copy_from(&by.joint_control);
        let reference = SMatrix::<f64, 6, 21>::from_row_slice(&case.out.accel_jacobian);
        // Columns have different units: each against its own magnitude.
        for j in 0..21 {
            let column = |m: &SMatrix<f64, 6, 21>| m.column(j).into_owned();
            let error = relative(column(&ours).as_slice(), column(&reference).as_slice());
            assert!(error < 1e-8, "column {j}: {error:e}");
        }
    }
}
