#![doc = include_str!("../README.md")]
//!
//! Data goes down this list, imports go up it:
//!
//! - [`nominal`]: the truth's world as the planner believes it to be;
//! - [`navigation`]: from what sensors tell to what guidance is told;
//! - [`judge`]: what a flight comes to, and what it violates on the way;
//! - [`flight`]: one flight, from a plan to the port;
//! - [`open_loop`]: a plan's forces and torques as they stand, for other simulators to fly the same;
//! - [`options`], [`errors_file`]: how to fly, and what is wrong with the world, as files say it;
//! - [`history`], [`pilot`]: a flight over time; flights of arms of any number of joints;
//! - [`ways_out`]: what becomes of an approach that must end at a node;
//! - [`row`], [`statistics`]: flights as rows, and what many of them say;
//! - [`keep`], [`until`]: which histories are kept, and when enough has been flown;
//! - [`flights_file`], [`run`], [`results`]: what is flown, its single runs, and what came of them;
//! - [`report`]: flights as one page;
//! - [`campaign`]: many flights over several threads, resumable;
//! - [`parts`]: the same in parts, for many machines.
#![forbid(unsafe_code)]

pub mod campaign;
pub mod errors_file;
pub mod flight;
pub mod flights_file;
pub mod history;
pub mod judge;
pub mod keep;
pub mod navigation;
pub mod nominal;
pub mod open_loop;
pub mod options;
pub mod parts;
pub mod pilot;
pub mod report;
pub mod results;
pub mod row;
pub mod run;
pub mod statistics;
pub mod until;
pub mod ways_out;
