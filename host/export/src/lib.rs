#![doc = include_str!("../README.md")]
//!
//! Data goes down this list, imports go up it:
//!
//! - [`epoch`]: when a plan begins, and times after it as text;
//! - [`chief`]: the target's orbit, which turns RTN into inertial axes;
//! - [`motion`]: a plan over time, from its nodes and its own dynamics between them;
//! - [`inertial`]: that motion in inertial axes;
//! - [`ccsds`]: ephemerides of orbit and attitude as text;
//! - [`scene`]: bodies and frames as Foxglove has them;
//! - [`recording`]: all of a motion as one MCAP file;
//! - [`job`]: a plan's file to the files that are asked for.
#![forbid(unsafe_code)]

pub mod ccsds;
pub mod chief;
pub mod epoch;
pub mod inertial;
pub mod job;
pub mod motion;
pub mod recording;
pub mod scene;
