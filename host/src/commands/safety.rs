//! `remora fly --safety`

use super::Output;
use super::flying::FlyingArgs;
use super::options::JsonArgs;
use super::progress::Bar;
use crate::report;
use remora_flight::pilot::Sortie;
use remora_flight::ways_out::WaysOut;
use remora_host::choice::choices;
use remora_host::error::Error;
use remora_host::formats::{PlanFile, Verdict};
use remora_truth::Dispersion;
use std::num::NonZeroUsize;
use std::path::Path;

choices! {
    /// How the ways out of an approach are found.
    pub(super) enum Safety {
        /// In the world that the plan knows.
        Planned = "planned",
        /// From each node in a world that it does not know, too.
        Flown = "flown",
    }
}

/// Request for the ways out of a plan: the abort that guidance flies, and a free drift of one orbit.
pub(super) struct Request<'a> {
    /// The plan's file.
    pub(super) plan: &'a Path,
    /// How they are found.
    pub(super) safety: Safety,
    /// Errors of the world in which they are flown.
    pub(super) errors: Option<&'a Path>,
    /// Seed of their draw.
    pub(super) seed: Option<u64>,
    /// Worker threads.
    pub(super) jobs: NonZeroUsize,
    /// Whether the result is printed as data.
    pub(super) json: JsonArgs,
}

impl Request<'_> {
    pub(super) fn run(&self) -> Result<Output, Error> {
        let is_flown = self.safety == Safety::Flown;
        if !is_flown && self.errors.is_some() {
            return Err(Error::argument("--errors", "has no use without --safety flown"));
        }
        if !is_flown && self.seed.is_some() {
            return Err(Error::argument("--seed", "has no use without --safety flown"));
        }
        let file = self.plan;
        let plan = PlanFile::read(file)?;
        if plan.verdict == Some(Verdict::NotFlyable) {
            let reason = "is not flyable: there is no approach to leave";
            return Err(Error::input(file, "verdict", reason));
        }
        let errors = FlyingArgs::errors(self.errors, plan.inputs.mission.joints())?;
        let sortie = Sortie::of(file, &plan)?;
        let mut ways = WaysOut::planned(&plan.scenario, &sortie);
        if is_flown {
            let dispersion = Dispersion { errors, seed: self.seed.unwrap_or(0), run: 0 };
            ways.fly(&sortie, &dispersion, self.jobs, &mut Bar::named("fly"))?;
        }
        let report = report::safety_report(&ways);
        Output::new(report, ways.all_escape()).or_json(self.json.json, &ways)
    }
}
