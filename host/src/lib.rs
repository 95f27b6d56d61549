//! The bench around `remora-core`: what runs on a desktop, not in flight.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`error`]: one line an error: file, field, reason;
//! - [`method`]: how a plan is made, by the names that files and command line use;
//! - [`formats`]: scenario sets, missions, plans, tables of results; how they are read, validated
//!   and written whole or not at all;
//! - [`backend`]: Clarabel behind the core's solver trait, and solvers that are watched;
//! - [`kkt`]: optimality of a subproblem's solution, whoever solved it;
//! - [`threads`]: a second thread for one plan;
//! - [`vehicle`]: what follows from a mission's numbers, and whether it can end;
//! - [`draw`]: random scenarios, the same for a seed everywhere;
//! - [`learned`]: learned models, from files or built in;
//! - [`planning`]: from a scenario to a plan file, the only module that calls the core's planner;
//! - [`export`]: the subproblems of a plan as files for other solvers;
//! - [`perturbation`]: disturbed plans as starts, to measure what a warm start is worth;
//! - [`checking`]: plan files against the core's independent verifier;
//! - [`allocations`]: how often the program asks for memory;
//! - [`provenance`]: what a report was made by, of what and on what;
//! - [`progress`]: who watches long work;
//! - [`campaign`]: many scenarios over several threads, resumable, with statistics;
//! - [`envelope`]: where the planner works: maps over tumble rate, distance and horizon;
//! - [`dataset`]: trajectories to train on, from a seed, in shards;
//! - [`quantise`]: models from single precision to bytes;
//! - [`portfolio`]: two starts at once, the first plan wins;
//! - [`profile`]: how long plans take on pinned cores, phase by phase;
//! - [`reproduce`]: the paper's tables for learned starts;
//! - [`inject`]: bits flipped in what the planner works on, and what becomes of its plans; the only
//!   other module that calls the core's planner;
//! - `training`, with the feature of that name: networks for the learned warm start;
//! - [`statistics`]: estimates with their confidence intervals;
//! - [`report`]: tables for the terminal, pages with plots;
//! - [`audit`]: memory, time, robustness and requirements for a review board;
//! - [`cli`]: the command line, which only parses and prints. Every command is a library call:
//!   [`planning::PlanJob`], [`campaign::Campaign`], [`checking::Check`], [`draw::draw`],
//!   [`export::ExportJob`], [`dataset::Recipe`], [`quantise::quantise`], [`profile::Profiler`].
#![forbid(unsafe_code)]

pub mod allocations;
pub mod audit;
pub mod backend;
pub mod campaign;
pub mod checking;
pub mod cli;
pub mod dataset;
pub mod draw;
pub mod envelope;
pub mod error;
pub mod export;
mod fingerprint;
pub mod formats;
pub mod inject;
mod journal;
pub mod kkt;
pub mod learned;
pub mod method;
pub mod perturbation;
pub mod planning;
mod pool;
pub mod portfolio;
pub mod profile;
pub mod progress;
pub mod provenance;
pub mod quantise;
pub mod report;
pub mod reproduce;
pub mod statistics;
pub mod threads;
#[cfg(feature = "training")]
pub mod training;
pub mod vehicle;
