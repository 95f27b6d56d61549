//! A host may let the processor trap divisions by zero, invalid operations and overflow: nothing that flies traps.
//!
//! Each test runs another one of this program, in a process of its own in which traps are enabled.
#![cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu", not(miri)))]
#![allow(unsafe_code, reason = "calls what C calls, and writes over structures as memory")]

mod caller;
mod common;
mod trapping;

use caller::{Caller, sized};
use common::{golden, public_scenarios, root};
use remora_capi::*;
use remora_core::prelude::*;
use std::hint::black_box;
use std::process::Command as Program;
use trapping::{run, run_test};

/// Shows that traps are enabled: otherwise the tests below would find nothing.
#[test]
fn traps_are_enabled_where_they_are_asked_for() {
    let mut program = Program::new(std::env::current_exe().unwrap());
    let program = program.args(["--exact", "trapping_division", "--ignored"]);
    let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(program)));
    let message = *found.unwrap_err().downcast::<String>().unwrap();
    assert!(message.contains("traps:") && message.contains("trapping_division"), "{message}");
}

#[test]
#[ignore = "traps"]
fn trapping_division() {
    assert!((black_box(1.0) / black_box(0.0f64)).is_infinite());
}

/// Stage 1 finds no path with so little force; Stage 2 cannot follow one that begins so far away.
#[test]
fn a_host_that_traps_plans_what_cannot_be_flown() {
    run_test("plans_what_cannot_be_flown");
}

#[test]
#[ignore = "runs with traps"]
fn plans_what_cannot_be_flown() {
    let strong = Mission::default();
    let mut weak = Mission::default();
    weak.servicer.force_limit_n = Vector3::repeat(0.02);
    let mut planner = Box::new(Planner::new());
    for (mission, distance) in [(weak, 12.0), (strong, 300.0)] {
        let mission = mission.validated().unwrap();
        let position = Vector3::new(0.6, 0.64, -0.48) * distance;
        let target_rate = Vector3::new(0.6, 0.0, -0.8) * 0.01;
        let scenario = Scenario { target_rate, position, ..Scenario::default() };
        let scenario = scenario.validated().unwrap();
        for integrator in [Integrator::RK4, Integrator::Euler] {
            let options = Options::builder().integrator(integrator).build().unwrap();
            let plan = planner.plan(&mission, &scenario, &options).unwrap();
            let stages = [&plan.report().translation, &plan.report().reorientation];
            let fails = stages.iter().any(|stage| stage.outcome.status == Status::Infeasible);
            assert!(fails && !plan.is_verified(), "{distance} m, {integrator}");
        }
    }
}

/// Integrators, modes, guesses.
#[test]
fn a_host_that_traps_plans_from_every_guess() {
    run_test("plans_from_every_guess");
}

#[test]
#[ignore = "runs with traps"]
fn plans_from_every_guess() {
    let mission = Mission::default().validated().unwrap();
    let mut planner = Box::new(Planner::new());
    let models = ["euler", "rk4"]
        .map(|name| std::fs::read(root().join(format!("fixtures/models/{name}.model"))).unwrap());
    let golden = golden();
    for (i, (id, x)) in public_scenarios().into_iter().enumerate().step_by(5) {
        let scenario = Scenario {
            target_attitude: Vector4::from_column_slice(&x[..4]),
            target_rate: Vector3::from_column_slice(&x[4..7]),
            position: Vector3::from_column_slice(&x[7..10]),
            velocity: Vector3::from_column_slice(&x[10..]),
            ..Scenario::default()
        };
        let scenario = scenario.validated().unwrap();
        let substeps = [4, 8, 16][i / 5 % 3];
        for (k, integrator) in [Integrator::Euler, Integrator::Rk4 { substeps }].iter().enumerate()
        {
            let model = Model::open(&models[k]).unwrap();
            let mut memory = Box::new(NetworkMemory::new());
            let policy = NetworkPolicy::new(Network::new(&model, &mut *memory).unwrap()).unwrap();
            let learned = InitialGuess::Learned { policy: &policy, seed: 0 };
            for (column, mode, guess) in [
                (0, Mode::Optimal, InitialGuess::Heuristic),
                (3, Mode::Feasible, learned),
                (1, Mode::Optimal, learned),
            ] {
                let options = Options::builder().mode(mode).integrator(*integrator);
                let options = options.initial_guess(guess).build().unwrap();
                let plan = planner.plan(&mission, &scenario, &options).unwrap();
                assert!(plan.is_verified(), "{id}");
                // The golden plans have four substeps.
                if k == 0 || substeps == 4 {
                    let sum = format!("{:016x}", plan.record().output);
                    assert_eq!(sum, golden[i][4 * k + column], "{id}");
                }
            }
            // A plan as the guess of the next.
            let given = *planner.reorientation();
            let options = Options::builder().integrator(*integrator);
            let options = options.initial_guess(InitialGuess::User(&given)).build().unwrap();
            assert!(planner.plan(&mission, &scenario, &options).unwrap().is_verified(), "{id}");
        }
    }
}

/// The numbers of a structure behind its first word, which is its size and a flag.
fn numbers<T: Copy>(structure: &mut T) -> &mut [f64] {
    let words = size_of::<T>() / size_of::<f64>();
    // SAFETY: structures are numbers and aligned as these; all bits are some number.
    unsafe { std::slice::from_raw_parts_mut((&raw mut *structure).cast::<f64>().add(1), words - 1) }
}

/// Guides along whole plans, with gaps and jumps in the estimates, replans and aborts.
#[test]
fn a_host_that_traps_flies_replans_and_aborts() {
    run_test("flies_replans_and_aborts");
}

/// A way to fly: errors and gaps of estimates, times of replan and abort, limits of actuators.
struct Way {
    off: f64,
    outage: std::ops::Range<u32>,
    replan: u32,
    abort: u32,
    sees_port: bool,
    limit: Option<f64>,
}

/// Requests that remora_ask takes.
const ABORT: u32 = 2;

const STRAIGHT: Way = Way {
    off: 0.0,
    outage: 0..0,
    replan: u32::MAX,
    abort: u32::MAX,
    sees_port: false,
    limit: None,
};

impl Way {
    /// Turns the expected estimate of a time into that of navigation.
    fn estimate(&self, second: u32, estimate: &mut RemoraEstimate) {
        let wave = self.off * (f64::from(second % 7) - 3.0);
        if self.sees_port && second > 1000 {
            // SAFETY: the first word is the size and whether the port is seen.
            unsafe { (&raw mut *estimate).cast::<u32>().add(1).write(1) };
        }
        let numbers = numbers(estimate);
        // Behind the time: position, velocity, attitude, rate, angles and rates of the joints; the target's.
        let [velocity, rate, angle, target_rate] = [5, 13, 14, 24];
        numbers[velocity] += 0.01 * wave;
        numbers[rate] += 1e-3 * wave;
        numbers[angle] += 0.1 * wave;
        if self.outage.contains(&second) {
            let nothing = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300];
            numbers[target_rate] = nothing[second as usize % 4];
            numbers[target_rate + 1] = f64::NEG_INFINITY;
        }
    }

    fn limits(&self) -> Option<RemoraLimits> {
        let mut limits: RemoraLimits = sized(|s, size| s.size = size);
        let all = numbers(&mut limits);
        all.fill(self.limit?);
        all[1] = 0.0;
        Some(limits)
    }
}

#[test]
#[ignore = "runs with traps"]
fn flies_replans_and_aborts() {
    let planned = Caller::planned();
    for way in [
        STRAIGHT,
        Way { off: 1e-3, sees_port: true, outage: 500..520, ..STRAIGHT },
        Way { off: 1e-3, replan: 300, outage: 1150..1300, ..STRAIGHT },
        Way { abort: 40, limit: Some(0.0), ..STRAIGHT },
        Way { off: 1e-2, abort: 1100, outage: 1101..1103, ..STRAIGHT },
        Way { off: 5.0, sees_port: true, ..STRAIGHT },
        Way { off: -0.3, limit: Some(1e-3), ..STRAIGHT },
    ] {
        let mut c = planned.clone();
        c.takes_off();
        let limits = way.limits();
        for second in 0..1260 {
            let time = f64::from(second);
            // SAFETY: pointers are to memory of this test, here and below.
            let status = unsafe { remora_expected(c.flight.pointer(), time, &mut c.estimate) };
            assert_eq!(status, RemoraStatus::Ok);
            way.estimate(second, &mut c.estimate);
            assert_eq!(c.guides(limits.as_ref()), RemoraStatus::Ok);
            // Behind mode and reason.
            assert!(numbers(&mut c.command)[1..].iter().all(|number| number.is_finite()));
            if second == way.replan {
                assert_eq!(c.replans(20.0), RemoraStatus::Ok);
                assert_eq!(c.hands_over(time + 20.0), RemoraStatus::Ok);
            }
            if second == way.abort {
                let status = unsafe { remora_ask(c.flight.pointer(), ABORT) };
                assert_eq!(status, RemoraStatus::Ok);
            }
        }
    }
}

#[test]
fn a_host_that_traps_verifies_and_tests_itself() {
    run_test("verifies_and_tests_itself");
}

#[test]
#[ignore = "runs with traps"]
fn verifies_and_tests_itself() {
    let mut c = Caller::planned();
    let mut found: RemoraVerification = sized(|s, size| s.size = size);
    let mut sum = 0;
    // SAFETY: all pointers are to memory of this test.
    unsafe {
        let workspace = c.workspace.pointer();
        assert_eq!(remora_verify(workspace, &mut found), RemoraStatus::Ok);
        for integrator in [0, 1] {
            assert_eq!(remora_self_test(workspace, integrator, &mut sum), RemoraStatus::Ok);
        }
    }
    // Planning that is stopped at once, late, and by a deadline.
    for (asked, deadline) in [(0, f64::INFINITY), (30, f64::INFINITY), (u32::MAX, 20.0)] {
        let mut left = asked;
        c.options.context = (&raw mut left).cast();
        c.options.clock = Some(ticks);
        c.options.should_stop = Some(stops);
        // Behind mode, integrator and substeps.
        numbers(&mut c.options)[1] = deadline;
        assert_eq!(c.plans(), RemoraStatus::Ok);
        assert_eq!(c.report.is_verified, 0);
    }
}

/// A clock that goes on by a second with each look at it.
unsafe extern "C" fn ticks(_: *mut std::ffi::c_void) -> f64 {
    use std::sync::atomic::{AtomicU32, Ordering};
    static SECONDS: AtomicU32 = AtomicU32::new(0);
    f64::from(SECONDS.fetch_add(1, Ordering::Relaxed))
}

/// Stops after a number of calls.
unsafe extern "C" fn stops(context: *mut std::ffi::c_void) -> u32 {
    // SAFETY: the context is a number, which nothing else reads now.
    let left = unsafe { &mut *context.cast::<u32>() };
    *left = left.saturating_sub(1);
    u32::from(*left == 0)
}

/// Numbers that are NaN, infinite or too large to compute with.
const NONSENSE: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300];

/// Replaces each number of a structure, one at a time, by each of these.
fn with_nonsense<T: Copy>(structure: &T) -> impl Iterator<Item = T> {
    let whole = *structure;
    (0..size_of::<T>() / 8 - 1).flat_map(move |i| {
        NONSENSE.into_iter().filter_map(move |value| {
            let mut changed = whole;
            let number = &mut numbers(&mut changed)[i];
            // Two integers of 32 bits look like a number that is nearly zero.
            let is_number = !number.is_subnormal();
            *number = value;
            is_number.then_some(changed)
        })
    })
}

#[test]
fn a_host_that_traps_may_hand_over_nonsense() {
    run_test("nonsense_is_answered");
}

#[test]
#[ignore = "runs with traps"]
fn nonsense_is_answered() {
    let mut c = Caller::open();
    let sound = c.scenario;
    for scenario in with_nonsense(&sound) {
        c.scenario = scenario;
        c.plans();
    }
    c.scenario = sound;
    let sound = c.mission;
    for mission in with_nonsense(&sound) {
        c.mission = mission;
        if c.opens(REMORA_ABI) == RemoraStatus::Ok {
            c.plans();
        }
    }
    let flying = Caller::flying();
    let mut c = flying.clone();
    for settings in with_nonsense(&flying.settings) {
        c.settings = settings;
        if c.flies() == RemoraStatus::Ok && c.hands_over(0.0) == RemoraStatus::Ok {
            c.guides(None);
        }
    }
    let limits = Way { limit: Some(1e-3), ..STRAIGHT }.limits().unwrap();
    let mut c = flying.clone();
    for limits in with_nonsense(&limits) {
        c.guides(Some(&limits));
    }
    for estimate in with_nonsense(&flying.estimate) {
        let mut c = flying.clone();
        c.estimate = estimate;
        if c.guides(None) == RemoraStatus::Ok {
            assert!(numbers(&mut c.command)[1..].iter().all(|number| number.is_finite()));
        }
        c.replans(20.0);
    }
    let mut c = flying;
    // An attitude of no length.
    numbers(&mut c.estimate)[7..11].fill(0.0);
    c.guides(None);
    c.replans(20.0);
    for time in NONSENSE {
        c.replans(time);
        c.hands_over(time);
        // SAFETY: both pointers are to memory of this test.
        unsafe { remora_expected(c.flight.pointer(), time, &mut c.estimate) };
        c.guides(None);
    }
}
