//! The program itself, run as a user runs it.

mod arrays;
mod audit;
mod bench;
mod campaign;
mod check;
mod dataset;
mod draw;
mod envelope;
mod export;
mod fly;
mod foreign;
mod hostile;
mod import;
mod inject;
mod kinds;
#[cfg(feature = "training")]
mod learn;
mod mission;
mod missions;
mod moving;
mod numbers;
mod parts;
mod plan;
mod profile;
mod qp_export;
mod quantise;
mod refusals;
mod replay;
mod reproduce;
mod units;
mod view;
mod warm_start;
