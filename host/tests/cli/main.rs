//! The program itself, run as a user runs it.

mod bench;
mod campaign;
mod check;
mod dataset;
mod draw;
mod foreign;
mod plan;
mod profile;
mod qp_export;
mod quantise;
mod refusals;
mod reproduce;
mod warm_start;
