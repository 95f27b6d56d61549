//! Remora's planner and guidance for programs in C and C++: `include/remora.h`, which is made of this crate,
//! and an archive without any other dependency than `memcpy`, `memmove` and `memset`.
//!
//! `docs/guides/c.md` tells how it is used. All memory is the caller's, whose layout no one but this crate knows;
//! results are copied out. What a caller can get wrong has a status of its own, and leaves memory as it was.
//!
//! ## Reading the code
//!
//! Data goes down this list, imports go up it:
//!
//! - `codes`: numbers of structures and functions by name;
//! - `abi`: the numbers that both sides must agree on, and the status of a call;
//! - `environment`: rounding and small numbers as the processor handles them now;
//! - `pointers`: structures of the caller, read and written after a look at each;
//! - `mission`, `scenario`, `report`, `flight`: those structures, and what they are in the core;
//! - `memory`: the caller's memory as a workspace or a flight;
//! - `planning`, `flying`: the functions.
//!
//! With the kernels of `remora-nn` and `remora-qp` this is the only crate with unsafe code: it follows pointers.
#![no_std]

mod abi;
mod codes;
mod environment;
mod flight;
mod flying;
mod memory;
mod mission;
mod planning;
mod pointers;
mod report;
mod scenario;

pub use abi::{
    REMORA_ABI, REMORA_ALIGNMENT, REMORA_FLIGHT_BYTES, REMORA_JOINTS, REMORA_NODES,
    REMORA_SELF_TEST_EULER, REMORA_SELF_TEST_RK4, REMORA_WORKSPACE_BYTES, RemoraStatus, remora_abi,
    remora_strerror,
};
pub use codes::*;
pub use flight::{RemoraCommand, RemoraEstimate, RemoraGuidance, RemoraLimits};
pub use flying::{remora_ask, remora_expected, remora_flight_plan, remora_fly, remora_guide};
pub use mission::{RemoraLink, RemoraMission};
pub use planning::{
    remora_defaults, remora_node, remora_open, remora_plan, remora_record, remora_replan,
    remora_self_test, remora_verify,
};
pub use report::{
    RemoraClosest, RemoraNode, RemoraRecord, RemoraReport, RemoraStage, RemoraVerification,
};
pub use scenario::{RemoraOptions, RemoraScenario};

/// Handler of panics, which never returns. A test shows that no code of the archive reaches it.
#[cfg(all(feature = "panic-handler", panic = "abort"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
