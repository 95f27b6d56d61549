//! Files that Remora's operator reads and writes, and how numbers are shown. Nothing here plans.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`error`]: one line an error: file, field, reason;
//! - [`notes`]: notes on inputs that were changed on reading;
//! - [`statistics`]: estimates with their confidence intervals;
//! - [`choice`]: choices by their names;
//! - [`report`]: tables, pages and plots: how numbers are shown;
//! - [`method`]: how a plan is made, by the names that files and command line use;
//! - [`models`]: the learned models that are built in, as files;
//! - [`formats`]: scenario sets, missions, plans, tables of results; how they are read, validated
//!   and written whole or not at all.
#![forbid(unsafe_code)]

pub mod choice;
pub mod error;
pub mod formats;
pub mod method;
pub mod models;
pub mod notes;
pub mod report;
pub mod statistics;
