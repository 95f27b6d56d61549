#![doc = include_str!("../README.md")]
//!
//! Data goes down this list, imports go up it:
//!
//! - [`input`]: what a plan was made from;
//! - [`numbers`]: that as numbers in the order of `remora.h`, for doors that read no JSON;
//! - [`door`]: the doors and their names;
//! - [`programs`]: programs behind doors: found or built, run, their checksum read;
//! - [`replay`]: one plan behind several doors.
#![forbid(unsafe_code)]

pub mod door;
pub mod input;
pub mod numbers;
pub mod programs;
pub mod replay;
