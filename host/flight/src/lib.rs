#![doc = include_str!("../README.md")]
//!
//! Data goes down this list, imports go up it:
//!
//! - [`nominal`]: the truth's world as the planner believes it to be;
//! - [`navigation`]: from what sensors tell to what guidance is told;
//! - [`judge`]: what a flight comes to, and what it violates on the way;
//! - [`flight`]: one flight, from a plan to the port;
#![forbid(unsafe_code)]

pub mod flight;
pub mod judge;
pub mod navigation;
pub mod nominal;
