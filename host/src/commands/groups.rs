//! Commands that have commands of their own.

use super::{Output, dataset, errors, import, quantise, show};
use clap::Subcommand;
use remora_host::error::Error;

/// Show a mission, import one for a robot arm, print errors of the world.
#[derive(Debug, clap::Args)]
#[command(after_help = OF_MISSION, arg_required_else_help = false)]
pub(super) struct MissionArgs {
    #[command(subcommand)]
    command: Mission,
}

#[derive(Debug, Subcommand)]
enum Mission {
    Show(show::Args),
    Import(Box<import::Args>),
    Errors(errors::Args),
}

const OF_MISSION: &str = "\
Examples:
  remora mission show light.mission.toml
  remora mission import arm.urdf --explain
  remora mission errors typical > mine.errors.toml";

impl MissionArgs {
    pub(super) fn run(self) -> Result<Output, Error> {
        match self.command {
            Mission::Show(args) => args.run(),
            Mission::Import(args) => args.run(),
            Mission::Errors(args) => args.run(),
        }
    }
}

/// Make datasets for a learned warm start, and the network that flies of a trained one.
#[derive(Debug, clap::Args)]
#[command(after_help = OF_LEARNING, arg_required_else_help = false)]
pub(super) struct LearnArgs {
    #[command(subcommand)]
    command: Learn,
}

#[derive(Debug, Subcommand)]
enum Learn {
    Dataset(dataset::Args),
    Quantise(quantise::Args),
}

const OF_LEARNING: &str = "\
Examples:
  remora learn dataset --count 1200 --seed 2000 --out data/rk4-1k
  remora learn quantise small.f32.model small.model";

impl LearnArgs {
    pub(super) fn run(self) -> Result<Output, Error> {
        match self.command {
            Learn::Dataset(args) => args.run(),
            Learn::Quantise(args) => args.run(),
        }
    }
}
