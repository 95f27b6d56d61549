//! Replays of one plan behind every door of Remora that this machine has: this program, C, Python, WebAssembly under
//! node, processors under QEMU. Each door but this program's is a program that prints one checksum.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`input`]: the inputs of a plan;
//! - [`numbers`]: those as numbers in the order of `remora.h`, for doors that read no JSON;
//! - [`door`]: the doors and their names;
//! - [`programs`]: programs behind doors: found or built, run, their checksum read;
//! - [`replay`]: one plan behind several doors;
//! - [`report`]: the table of the doors.

pub mod door;
pub mod input;
pub mod numbers;
pub mod programs;
pub mod replay;
pub mod report;
