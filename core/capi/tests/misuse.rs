//! What a caller in C can get wrong: each mistake has a status of its own, and leaves memory as it was.
#![allow(unsafe_code, reason = "calls what C calls")]

mod caller;

use caller::{Caller, sized};
use remora_capi::*;
use std::ffi::{CStr, c_void};
use std::sync::OnceLock;

/// That a call answers this and changes nothing.
#[track_caller]
fn is_refused(
    mut caller: Caller,
    with: RemoraStatus,
    call: impl FnOnce(&mut Caller) -> RemoraStatus,
) {
    let before = caller.everything();
    assert_eq!(call(&mut caller), with);
    assert!(caller.everything() == before, "{with:?}: memory was written");
}

/// A caller that is made once for all tests: what an interpreter is busy with for minutes.
struct Once(OnceLock<Caller>);
// SAFETY: its pointers are null, and nobody writes to it.
unsafe impl Sync for Once {}

impl Once {
    const fn new() -> Self {
        Self(OnceLock::new())
    }

    fn get(&self, make: impl FnOnce() -> Caller) -> Caller {
        self.0.get_or_init(make).clone()
    }
}

/// One with a plan to fly, of Stage 1's path and the first guess of Stage 2: whoever reads it does not mind.
fn planned() -> Caller {
    static PLANNED: Once = Once::new();
    PLANNED.get(|| Caller::planned_little(4, RemoraIntegrator::Rk4, 1e5))
}

/// One who flies it.
fn flying() -> Caller {
    static FLYING: Once = Once::new();
    FLYING.get(|| {
        let mut caller = planned();
        caller.takes_off();
        caller
    })
}

// Verifies REM-DOR-003.
#[test]
fn a_null_pointer_is_refused() {
    let null = RemoraStatus::Null;
    // SAFETY: NULL is looked at.
    unsafe {
        let nothing = std::ptr::null_mut::<c_void>();
        let bytes = REMORA_WORKSPACE_BYTES;
        is_refused(Caller::new(), null, |c| remora_open(nothing, bytes, REMORA_ABI, &c.mission));
        is_refused(Caller::new(), null, |c| {
            remora_open(c.workspace.pointer(), bytes, REMORA_ABI, std::ptr::null())
        });
        is_refused(Caller::open(), null, |c| {
            let workspace = c.workspace.pointer();
            remora_plan(workspace, std::ptr::null(), &c.options, &mut c.report)
        });
        is_refused(Caller::open(), null, |c| {
            let workspace = c.workspace.pointer();
            remora_plan(workspace, &c.scenario, std::ptr::null(), &mut c.report)
        });
        is_refused(Caller::open(), null, |c| {
            let workspace = c.workspace.pointer();
            remora_plan(workspace, &c.scenario, &c.options, std::ptr::null_mut())
        });
        is_refused(Caller::open(), null, |c| {
            remora_self_test(c.workspace.pointer(), 0, std::ptr::null_mut())
        });
        is_refused(planned(), null, |c| {
            remora_node(c.workspace.pointer(), 0, std::ptr::null_mut())
        });
        is_refused(flying(), null, |c| {
            remora_guide(c.flight.pointer(), std::ptr::null(), std::ptr::null(), &mut c.command)
        });
    }
    // A length without a model.
    is_refused(Caller::open(), null, |c| {
        c.options.model_bytes = 10;
        c.plans()
    });
}

#[test]
fn a_foreign_interface_is_refused() {
    is_refused(Caller::new(), RemoraStatus::ForeignAbi, |c| c.opens(REMORA_ABI + 1));
    is_refused(Caller::new(), RemoraStatus::ForeignAbi, |c| {
        let nothing = std::ptr::null_mut();
        // SAFETY: nothing is given.
        unsafe {
            remora_defaults(0, &mut c.mission, std::ptr::null_mut(), std::ptr::null_mut(), nothing)
        }
    });
}

#[test]
fn short_memory_is_refused() {
    is_refused(Caller::new(), RemoraStatus::ShortMemory, |c| {
        c.workspace.length -= 1;
        let status = c.opens(REMORA_ABI);
        c.workspace.length += 1;
        status
    });
    is_refused(Caller::new(), RemoraStatus::ShortMemory, |c| {
        let bytes = REMORA_FLIGHT_BYTES - 1;
        // SAFETY: there is more.
        unsafe { remora_fly(c.flight.pointer(), bytes, REMORA_ABI, &c.settings) }
    });
}

#[test]
fn misaligned_memory_is_refused() {
    for by in [1, 8, 32] {
        is_refused(Caller::new(), RemoraStatus::Misaligned, |c| {
            let memory = c.workspace.pointer().wrapping_byte_add(by);
            // SAFETY: there are 64 bytes more than are asked for.
            unsafe { remora_open(memory, REMORA_WORKSPACE_BYTES, REMORA_ABI, &c.mission) }
        });
    }
    is_refused(planned(), RemoraStatus::Misaligned, |c| {
        let node = (&raw mut c.node).wrapping_byte_add(1);
        // SAFETY: looked at before it is followed.
        unsafe { remora_node(c.workspace.pointer(), 0, node) }
    });
}

#[test]
fn memory_that_was_not_opened_is_refused() {
    is_refused(Caller::new(), RemoraStatus::NotOpen, Caller::plans);
    is_refused(Caller::new(), RemoraStatus::NotOpen, |c| c.copies_node(0));
}

#[test]
fn memory_of_another_kind_is_refused() {
    is_refused(planned(), RemoraStatus::NoFlight, |c| c.hands_over(0.0));
    is_refused(planned(), RemoraStatus::NoFlight, |c| c.guides(None));
    // A flight is no workspace, where there is memory enough for one.
    let mut caller = Caller::new();
    // SAFETY: a flight takes less than there is.
    let status = unsafe {
        remora_fly(caller.workspace.pointer(), REMORA_WORKSPACE_BYTES, REMORA_ABI, &caller.settings)
    };
    assert_eq!(status, RemoraStatus::Ok);
    is_refused(caller, RemoraStatus::NotOpen, |c| c.copies_node(0));
}

#[test]
fn results_within_the_workspace_are_refused() {
    is_refused(planned(), RemoraStatus::Overlap, |c| {
        let workspace = c.workspace.pointer();
        // Some zeros of the planner's, and a size that fits: only the place is wrong.
        let node = workspace.wrapping_byte_add(REMORA_WORKSPACE_BYTES / 2).cast::<RemoraNode>();
        // SAFETY: within memory of this; what stood there is put back.
        unsafe {
            let before = node.cast::<u32>().read();
            node.cast::<u32>().write(size_of::<RemoraNode>() as u32);
            let status = remora_node(workspace, 0, node);
            node.cast::<u32>().write(before);
            status
        }
    });
}

#[test]
fn a_structure_of_another_size_is_refused() {
    let other = RemoraStatus::StructSize;
    is_refused(Caller::new(), other, |c| {
        c.mission.size -= 8;
        c.opens(REMORA_ABI)
    });
    is_refused(Caller::open(), other, |c| {
        c.scenario.size = 0;
        c.plans()
    });
    is_refused(Caller::open(), other, |c| {
        c.options.size += 8;
        c.plans()
    });
    let mut caller = planned();
    caller.node.size -= 4;
    is_refused(caller, other, |c| c.copies_node(0));
    let mut caller = flying();
    caller.command.size = 4;
    is_refused(caller, other, |c| c.guides(None));
}

#[test]
fn what_is_not_finite_is_refused() {
    let nan = RemoraStatus::NotFinite;
    for change in [
        (|s| s.com_position_rtn_m[1] = f64::NAN) as fn(&mut RemoraScenario),
        |s| s.target_attitude_body_to_rtn[3] = f64::INFINITY,
        |s| s.duration_s = f64::NAN,
    ] {
        is_refused(Caller::open(), nan, |c| {
            change(&mut c.scenario);
            c.plans()
        });
    }
    is_refused(flying(), nan, |c| {
        c.estimate.bus_rate_rtn_rad_s[2] = f64::NAN;
        c.replans(10.0)
    });
}

#[test]
fn numbers_out_of_range_are_refused() {
    is_refused(Caller::new(), RemoraStatus::InvalidMission, |c| {
        c.mission.bus_mass_kg = f64::NAN;
        c.opens(REMORA_ABI)
    });
    is_refused(Caller::open(), RemoraStatus::InvalidScenario, |c| {
        c.scenario.target_attitude_body_to_rtn = [0.0; 4];
        c.plans()
    });
    for change in [
        (|o| o.mode = 2) as fn(&mut RemoraOptions),
        |o| o.integrator = 7,
        |o| o.substeps = 3,
        |o| o.deadline_s = f64::NAN,
        // There is no clock.
        |o| o.deadline_s = 1.0,
    ] {
        is_refused(Caller::open(), RemoraStatus::InvalidOption, |c| {
            change(&mut c.options);
            c.plans()
        });
    }
    is_refused(Caller::new(), RemoraStatus::InvalidSetting, |c| {
        c.settings.com_bandwidth_rad_s = -1.0;
        c.flies()
    });
    is_refused(flying(), RemoraStatus::InvalidSetting, |c| {
        let mut limits: RemoraLimits = sized(|s, size| s.size = size);
        limits.max_bus_force_rtn_n[0] = f64::NAN;
        c.guides(Some(&limits))
    });
    is_refused(flying(), RemoraStatus::InvalidOption, |c| {
        // SAFETY: a flight of this.
        unsafe { remora_ask(c.flight.pointer(), 3) }
    });
}

#[test]
fn times_out_of_range_are_refused() {
    is_refused(flying(), RemoraStatus::InvalidTime, |c| c.hands_over(f64::NAN));
    // The plan in force begins then: which is meant could not be told.
    is_refused(flying(), RemoraStatus::InvalidTime, |c| c.hands_over(0.0));
    is_refused(flying(), RemoraStatus::InvalidTime, |c| c.replans(-1.0));
    is_refused(flying(), RemoraStatus::NothingLeft, |c| c.replans(1000.0));
}

/// Steps at 0.1 Hz and 100 Hz are refused; at a rate in between guidance goes on after each.
#[test]
fn guidance_at_a_rate_out_of_range_is_refused() {
    let mut caller = flying();
    let mut step = |time_s: f64| {
        caller.estimate.time_s = time_s;
        caller.guides(None)
    };
    let (fine, refused) = (RemoraStatus::Ok, RemoraStatus::StepTime);
    assert_eq!(step(300.0), fine);
    for time_s in [310.0, 320.0, 330.0] {
        assert_eq!(step(time_s), refused, "{time_s}");
    }
    assert_eq!((step(335.0), step(335.05)), (fine, fine));
    for time_s in [335.05, 335.06, 335.07] {
        assert_eq!(step(time_s), refused, "{time_s}");
    }
    assert_eq!(step(335.1), fine);
    // A clock that is set back is refused once.
    assert_eq!((step(300.0), step(301.0)), (refused, fine));
    assert_eq!(step(1e13), RemoraStatus::InvalidTime);
}

#[test]
fn what_is_not_there_is_refused() {
    is_refused(Caller::open(), RemoraStatus::NoPlan, |c| c.copies_node(0));
    let mut caller = Caller::open();
    assert_eq!(caller.flies(), RemoraStatus::Ok);
    is_refused(caller, RemoraStatus::NoPlan, |c| c.hands_over(0.0));
    is_refused(planned(), RemoraStatus::NoSuchNode, |c| c.copies_node(c.report.nodes));
    let mut caller = planned();
    assert_eq!(caller.flies(), RemoraStatus::Ok);
    is_refused(caller, RemoraStatus::NoFlightPlan, |c| c.guides(None));
}

#[test]
fn a_plan_that_was_stopped_is_not_flown() {
    // Planning that was stopped at once leaves a plan, which the verifier rejects.
    unsafe extern "C" fn at_once(_: *mut c_void) -> u32 {
        1
    }
    let mut caller = Caller::asking_little(9, RemoraIntegrator::Rk4, 1.0);
    // Only the stop is why there is none; an interpreter is spared the plan.
    if !cfg!(miri) {
        assert_eq!(caller.plans(), RemoraStatus::Ok);
        assert_eq!(caller.report.is_verified, 1);
    }
    caller.options.should_stop = Some(at_once);
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    let not_flyable = RemoraVerdict::NotFlyable as u32;
    assert_eq!((caller.report.is_verified, caller.report.verdict), (0, not_flyable));
    assert_eq!(caller.flies(), RemoraStatus::Ok);
    is_refused(caller, RemoraStatus::NotFlyable, |c| c.hands_over(0.0));
}

#[test]
fn every_status_has_words_of_its_own() {
    let words = |status: u32| {
        // SAFETY: a text that ends.
        unsafe { CStr::from_ptr(remora_strerror(status)) }.to_str().unwrap().to_string()
    };
    let last = RemoraStatus::InvalidEstimate as u32;
    let all: std::collections::BTreeSet<String> = (0..=last + 1).map(words).collect();
    assert_eq!(all.len() as u32, last + 2);
    assert_eq!(words(last + 1), words(u32::MAX));
    assert_eq!(words(RemoraStatus::Misaligned as u32), "memory or a structure is not aligned");
    assert_eq!(remora_abi(), REMORA_ABI);
}

// Verifies REM-DOR-003.
#[test]
fn an_euler_plan_is_read_and_not_flown() {
    let mut caller = Caller::planned_little(8, RemoraIntegrator::Euler, 100.0);
    let (mut record, mut found): (RemoraRecord, RemoraVerification) =
        (sized(|s, size| s.size = size), sized(|s, size| s.size = size));
    let workspace = caller.workspace.pointer();
    // SAFETY: a workspace of this and places for the structures.
    unsafe {
        assert_eq!(remora_record(workspace, &mut record), RemoraStatus::Ok);
        assert_eq!(remora_verify(workspace, &mut found), RemoraStatus::Ok);
    }
    assert_eq!((found.is_verified, record.output), (1, caller.report.checksum));
    for index in 0..8 {
        assert_eq!(caller.copies_node(index), RemoraStatus::Ok);
    }
    assert_eq!(caller.node.time_s, 600.0);
    assert_eq!(caller.copies_node(8), RemoraStatus::NoSuchNode);
    assert_eq!(caller.flies(), RemoraStatus::Ok);
    is_refused(caller, RemoraStatus::EulerPlan, |c| c.hands_over(0.0));
}

/// What is planned again, too, of what is left of the way.
// Verifies REM-DOR-003.
#[test]
fn a_plan_is_flown_and_made_again() {
    let mut caller = flying();
    let limits: RemoraLimits = sized(|s, size| s.size = size);
    assert_eq!(caller.guides(None), RemoraStatus::Ok);
    assert_eq!(caller.command.mode, RemoraFlightMode::Track as u32);
    caller.expects(301.0);
    assert_eq!(caller.guides(Some(&limits)), RemoraStatus::Ok);
    caller.expects(300.0);
    assert_eq!(caller.replans(10.0), RemoraStatus::Ok);
    assert_eq!(caller.report.is_verified, 1);
    assert_eq!(caller.hands_over(310.0), RemoraStatus::Ok);
    caller.estimate.time_s = 302.0;
    assert_eq!(caller.guides(None), RemoraStatus::Ok);
    caller.estimate.time_s = 303.0;
    caller.estimate.bus_rate_rtn_rad_s[0] = f64::NAN;
    assert_eq!(caller.guides(None), RemoraStatus::Ok);
    assert_eq!(caller.command.mode, RemoraFlightMode::Degraded as u32);
    let abort = RemoraRequest::Abort as u32;
    // SAFETY: a flight of this.
    let status = unsafe { remora_ask(caller.flight.pointer(), abort) };
    assert_eq!(status, RemoraStatus::Ok);
}

#[test]
fn a_flight_of_another_mission_is_refused() {
    let mut caller = flying();
    caller.mission.bus_mass_kg = 510.0;
    assert_eq!(caller.opens(REMORA_ABI), RemoraStatus::Ok);
    // What an interpreter makes sooner: the mission is looked at first.
    caller.options.integrator = RemoraIntegrator::Euler as u32;
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    assert_eq!(caller.report.is_verified, 1);
    caller.options.integrator = RemoraIntegrator::Rk4 as u32;
    is_refused(caller, RemoraStatus::OtherMission, |c| {
        assert_eq!(c.hands_over(5.0), RemoraStatus::OtherMission);
        c.replans(10.0)
    });
}

/// What a callback sees that plans in the workspace it is called from.
#[test]
fn a_call_from_a_callback_finds_the_workspace_busy() {
    struct Seen(*mut c_void, Vec<RemoraStatus>);
    unsafe extern "C" fn looks(context: *mut c_void) -> u32 {
        // SAFETY: the context is a `Seen`, which nobody else looks at now.
        let Seen(workspace, statuses) = unsafe { &mut *context.cast::<Seen>() };
        let mut node: RemoraNode = sized(|s, size| s.size = size);
        let mission = Caller::new().mission;
        // SAFETY: a workspace, looked at for its mark only, and structures of this.
        unsafe {
            statuses.push(remora_node(*workspace, 0, &mut node));
            let bytes = REMORA_WORKSPACE_BYTES;
            statuses.push(remora_open(*workspace, bytes, REMORA_ABI, &mission));
        }
        0
    }
    let plans = |mut caller: Caller, calls: usize| {
        let mut seen = Seen(caller.workspace.pointer(), Vec::new());
        caller.options.should_stop = Some(looks);
        caller.options.context = (&raw mut seen).cast();
        assert_eq!(caller.plans(), RemoraStatus::Ok);
        assert_eq!(caller.report.is_verified, 1);
        assert!(seen.1.len() > calls, "{}", seen.1.len());
        assert!(seen.1.iter().all(|status| *status == RemoraStatus::Busy));
        assert_eq!(caller.copies_node(0), RemoraStatus::Ok);
    };
    plans(Caller::asking_little(8, RemoraIntegrator::Euler, 100.0), 100);
    // On all nodes, which takes an interpreter hours.
    if !cfg!(miri) {
        plans(Caller::open(), 500);
    }
}

/// A processor that calculates otherwise, for as long as a call takes.
// Verifies REM-DOR-003.
#[test]
#[cfg(target_arch = "x86_64")]
#[cfg_attr(miri, ignore = "sets a control register by assembly")]
fn other_arithmetic_is_refused() {
    use std::arch::asm;
    let with = |bits: u32, call: &mut dyn FnMut() -> RemoraStatus| {
        let (usual, changed) = (0x1f80u32, 0x1f80 | bits);
        // SAFETY: loads a valid register, and the usual one again.
        unsafe {
            asm!("ldmxcsr [{}]", in(reg) &changed, options(nostack));
            let status = call();
            asm!("ldmxcsr [{}]", in(reg) &usual, options(nostack));
            status
        }
    };
    for (bits, status) in [
        (0x8000, RemoraStatus::FlushToZero),
        (0x0040, RemoraStatus::FlushToZero),
        (0x2000, RemoraStatus::Rounding),
        (0x4000, RemoraStatus::Rounding),
        (0x6000, RemoraStatus::Rounding),
    ] {
        is_refused(Caller::new(), status, |c| with(bits, &mut || c.opens(REMORA_ABI)));
        is_refused(Caller::open(), status, |c| with(bits, &mut || c.plans()));
        is_refused(flying(), status, |c| with(bits, &mut || c.guides(None)));
        is_refused(flying(), status, |c| with(bits, &mut || c.replans(10.0)));
    }
}
