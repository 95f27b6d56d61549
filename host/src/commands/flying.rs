//! What `fly` and `campaign --fly` share: how plans are flown, and what is said of it.

use super::options::choice;
use super::progress::Bar;
use remora_core::advanced::model::Orbit;
use remora_flight::campaign::Flights;
use remora_flight::errors_file;
use remora_flight::flight::{Controller, Ending, JointControl};
use remora_flight::flights_file::{FlightsFile, MAX_RUNS};
use remora_flight::keep::Keep;
use remora_flight::options::{Options, RATES_HZ};
use remora_flight::parts;
use remora_flight::results::Results;
use remora_flight::row::Row;
use remora_flight::until::Until;
use remora_host::error::Error;
use remora_host::method::Integrator;
use remora_host::part::Part;
use remora_host::parts::PartSummary;
use remora_truth::Errors;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Runs of each plan.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct RunsArgs {
    /// Runs of each plan, each with a draw of errors of its own
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_RUNS))]
    pub(super) runs: u64,
}

/// How plans are flown.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Flights")]
pub(super) struct FlyingArgs {
    /// Who flies
    #[arg(long, value_parser = choice::<Controller>(), default_value = "track")]
    controller: Controller,
    /// Age of a plan at which another is made, with --controller replan
    #[arg(long, value_name = "SECONDS", default_value_t = 100.0, value_parser = positive)]
    replan_every: f64,
    /// How joints are driven
    #[arg(long, value_parser = choice::<JointControl>(), default_value = "torque")]
    joints: JointControl,
    /// Steps of guidance a second, from 0.2 to 20
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = rate)]
    guidance_rate: f64,
    /// Time before capture from which the wrist camera is used; 0: never
    #[arg(long, value_name = "SECONDS", default_value_t = 150.0, value_parser = not_negative)]
    camera: f64,
    /// Let the Earth's oblateness act (J2)
    #[arg(long)]
    j2: bool,
    /// Fly without any gravity
    #[arg(long, conflicts_with = "j2")]
    no_gravity: bool,
    /// Stop when a share is shown: 'miss_m<=0.02 p>=0.9973 conf>=0.95'
    #[arg(long, value_name = "CONDITION", conflicts_with = "part")]
    until: Option<Until>,
    /// Give histories a row a step of guidance, not a row a second
    #[arg(long)]
    history: bool,
    /// Runs whose histories are kept: all, failures, worst=N, sample=N, with commas
    #[arg(long, value_name = "WHICH", default_value = "failures,worst=3")]
    keep: Keep,
}

fn number(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| "is no number".to_string())
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x > 0.0 { Ok(x) } else { Err("must be positive".into()) })
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x >= 0.0 { Ok(x) } else { Err("must not be negative".into()) })
}

fn rate(text: &str) -> Result<f64, String> {
    let within = |x: f64| RATES_HZ.contains(&x).then_some(x);
    number(text).and_then(|x| within(x).ok_or_else(|| "must lie between 0.2 and 20".into()))
}

/// Plans to be flown, and where.
pub(super) struct Ready {
    /// Folder of the results, which holds the plans.
    pub(super) out: PathBuf,
    /// Plan files, from the folder.
    pub(super) plans: Vec<PathBuf>,
    /// Joints of the arm.
    pub(super) joints: usize,
    /// Integrator of plans that are made in flight.
    pub(super) integrator: Integrator,
    /// Runs of each plan, and the seed of their errors.
    pub(super) runs: (u64, u64),
    /// Worker threads.
    pub(super) jobs: NonZeroUsize,
}

impl FlyingArgs {
    /// Errors of a file or of a name, or none.
    pub(super) fn errors(file: Option<&Path>, joints: usize) -> Result<Errors, Error> {
        errors_file::chosen(file, joints)
    }

    /// Flies the plans; says whether all is as it should be.
    pub(super) fn fly(&self, ready: Ready, errors: Errors) -> Result<(Results, bool), Error> {
        let results = self.flights(ready, errors).fly(&mut Bar::named("fly"))?;
        let captured =
            |row: &Row| row.flown.as_ref().is_some_and(|flown| flown.ending == Ending::Captured);
        let shown = self.until.is_none_or(|until| until.is_shown(&results.rows));
        let all = self.until.is_some() || results.rows.iter().all(captured);
        Ok((results, shown && all))
    }

    /// Flies a part of the runs.
    pub(super) fn fly_part(
        &self,
        ready: Ready,
        errors: Errors,
        part: Part,
    ) -> Result<PartSummary, Error> {
        parts::fly(&self.flights(ready, errors), part, &mut Bar::named("part"))
    }

    /// Refuses effects that the body of a mission's orbit does not have.
    pub(super) fn check_orbit(&self, orbit: &Orbit) -> Result<(), Error> {
        let options = Options { j2: self.j2, ..Options::default() };
        options.check_orbit(orbit).map_err(|error| Error::argument("--j2", error.reason))
    }

    fn flights(&self, ready: Ready, errors: Errors) -> Flights {
        let options = Options {
            rate_hz: self.guidance_rate,
            controller: self.controller,
            joints: self.joints,
            camera_s: self.camera,
            replan_every_s: self.replan_every,
            j2: self.j2,
            gravity: !self.no_gravity,
            integrator: ready.integrator,
            every_step: self.history,
        };
        Flights {
            asked: FlightsFile::new(ready.plans, ready.runs, ready.joints, options, errors),
            jobs: ready.jobs,
            keep: self.keep,
            until: self.until,
            out: ready.out,
        }
    }
}
