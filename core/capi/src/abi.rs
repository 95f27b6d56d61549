//! The numbers that both sides must agree on, and the status of a call.
#![allow(unsafe_code, reason = "symbols without Rust's decoration")]

use crate::codes::RemoraStatusCode;
use core::ffi::c_char;
use remora_core::advanced::stages::{LINKS, NODES};

/// Number of this interface. It grows with every change of a structure, a function or a meaning.
pub const REMORA_ABI: u32 = 3;
/// Bytes of a workspace: planner, solver, network, the mission and the last plan.
pub const REMORA_WORKSPACE_BYTES: usize = 1_058_816;
/// Bytes of a flight: guidance with the mission and the plan that it flies.
pub const REMORA_FLIGHT_BYTES: usize = 20_480;
/// Alignment of workspaces and flights in bytes; a power of two.
pub const REMORA_ALIGNMENT: usize = 64;
/// Joints of the arm.
pub const REMORA_JOINTS: usize = 3;
/// Most nodes of a plan.
pub const REMORA_NODES: usize = 60;

/// Checksum of the plan that remora_self_test makes with Euler.
pub const REMORA_SELF_TEST_EULER: u64 = 0x12a8_ed2d_0673_1f42;
/// Checksum of the plan that remora_self_test makes with RK4.
pub const REMORA_SELF_TEST_RK4: u64 = 0x5de9_f315_4be5_8439;

const _: () = assert!(REMORA_JOINTS == LINKS && REMORA_NODES == NODES);

/// Result of a call. Numbers never change their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraStatus {
    /// Done.
    Ok = 0,
    /// A pointer that must not be is NULL.
    Null = 1,
    /// The header that the caller was compiled with is of another interface than the archive.
    ForeignAbi = 2,
    /// Memory is shorter than the header says.
    ShortMemory = 3,
    /// Memory or a structure is not aligned.
    Misaligned = 4,
    /// The memory is no workspace: remora_open has not been called, or something wrote over it.
    NotOpen = 5,
    /// The memory is no flight: remora_fly has not been called, or something wrote over it.
    NoFlight = 6,
    /// The workspace or flight is in use: the call came from one of its own callbacks.
    Busy = 7,
    /// A structure's first member is not its size.
    StructSize = 8,
    /// A structure for results lies in the workspace or flight itself.
    Overlap = 9,
    /// The processor makes zeros of small numbers; plans would have other bits.
    FlushToZero = 10,
    /// The processor does not round to nearest; plans would have other bits.
    Rounding = 11,
    /// A number of the scenario or the estimate is not finite.
    NotFinite = 12,
    /// A number of the mission is out of its range.
    InvalidMission = 13,
    /// The scenario is none: an attitude that is no rotation, no distance, no time, too few nodes.
    InvalidScenario = 14,
    /// An option is out of its range, or there is a deadline without a clock.
    InvalidOption = 15,
    /// A number of guidance's settings or of the limits is out of its range.
    InvalidSetting = 16,
    /// A time is not finite, beyond 1e12 s, or negative where it must not be.
    InvalidTime = 17,
    /// No plan can end well; RemoraReport.refusal says why. The workspace holds no plan now.
    Refused = 18,
    /// The workspace holds no plan.
    NoPlan = 19,
    /// The plan has no such node.
    NoSuchNode = 20,
    /// The verifier did not find every constraint of the plan satisfied.
    NotFlyable = 21,
    /// The plan was made with Euler's step and says nothing between its nodes.
    EulerPlan = 22,
    /// The flight has no plan yet.
    NoFlightPlan = 23,
    /// The flight's plan was made for another mission than the workspace's.
    OtherMission = 24,
    /// Nothing of the flight's plan is left that could be planned again.
    NothingLeft = 25,
    /// The self-test's plan has other bits than it must have.
    WrongChecksum = 26,
    /// The step of guidance is not 0.05 to 5 s after the one before.
    StepTime = 27,
    /// An attitude of the estimate is not of unit length, or a flag is neither 0 nor 1.
    InvalidEstimate = 28,
}

/// The number of the archive's interface; to be compared with REMORA_ABI.
#[unsafe(no_mangle)]
pub extern "C" fn remora_abi() -> u32 {
    REMORA_ABI
}

/// Says in English what a status means. Never NULL, and never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn remora_strerror(status: RemoraStatusCode) -> *const c_char {
    let text = match status {
        0 => c"done",
        1 => c"a pointer is NULL",
        2 => c"header and archive are of different interfaces",
        3 => c"the memory is too short",
        4 => c"memory or a structure is not aligned",
        5 => c"the memory is no open workspace",
        6 => c"the memory is no flight",
        7 => c"called from a callback of the same workspace or flight",
        8 => c"a structure's first member is not its size",
        9 => c"a structure lies in the workspace or flight",
        10 => c"the processor flushes small numbers to zero",
        11 => c"the processor does not round to nearest",
        12 => c"a number is not finite",
        13 => c"a number of the mission is out of its range",
        14 => c"the scenario is none",
        15 => c"an option is out of its range",
        16 => c"a setting of guidance or a limit is out of its range",
        17 => c"a time is out of its range",
        18 => c"no plan can end well",
        19 => c"the workspace holds no plan",
        20 => c"the plan has no such node",
        21 => c"the plan is not flyable",
        22 => c"a plan made with Euler's step cannot be flown",
        23 => c"the flight has no plan",
        24 => c"the flight's plan is of another mission",
        25 => c"nothing is left to plan",
        26 => c"the self-test's plan has other bits",
        27 => c"the step of guidance is not 0.05 to 5 s after the one before",
        28 => {
            c"an attitude of the estimate is no rotation, a number is too large, or a flag is none"
        }
        _ => c"no status of this interface",
    };
    text.as_ptr()
}
