//! The program itself, run as a user runs it.

/// The program that a bench runs.
const PROGRAM: &str = env!("CARGO_BIN_EXE_remora");

mod arrays;
mod bench;
mod campaign;
mod check;
mod dataset;
mod draw;
mod envelope;
mod examples;
mod export;
mod fly;
mod foreign;
mod generate;
mod hostile;
mod import;
mod kinds;
mod mission;
mod missions;
mod moving;
mod numbers;
mod parts;
mod plan;
#[path = "../../library/tests/qp/polish/mod.rs"]
mod polish;
mod qp_export;
mod quantise;
mod refusals;
mod units;
mod view;
mod warm_start;
