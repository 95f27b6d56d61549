//! How `remora fly` flies plans.

use super::options::{WRITE, choice};
use super::progress::Bar;
use clap::builder::{PossibleValue, TypedValueParser};
use remora_core::advanced::model::Orbit;
use remora_flight::campaign::Flights;
use remora_flight::errors_file;
use remora_flight::flight::{Controller, Ending, JointControl};
use remora_flight::flights_file::FlightsFile;
use remora_flight::keep::Keep;
use remora_flight::options::{Options, RATES_HZ};
use remora_flight::parts;
use remora_flight::results::Results;
use remora_flight::row::Row;
use remora_flight::until::Until;
use remora_host::choice::{Choice, choices};
use remora_host::error::Error;
use remora_host::method::Integrator;
use remora_host::part::Part;
use remora_host::parts::PartSummary;
use remora_truth::Errors;
use std::ffi::OsStr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// How plans are flown.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Flights")]
pub(super) struct FlyingArgs {
    /// Controller; replan:SECONDS says at which age of a plan another is made, 100 otherwise
    #[arg(long, value_parser = Pilots, default_value = "track")]
    controller: (Controller, f64),
    /// How joints are driven
    #[arg(long, value_parser = choice::<JointControl>(), default_value = "torque")]
    joints: JointControl,
    /// Steps of guidance a second, from 0.2 to 20
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = rate)]
    guidance_rate: f64,
    /// Time before capture from which the wrist camera is used; 0: never
    #[arg(long, value_name = "SECONDS", default_value_t = 150.0, value_parser = not_negative)]
    camera: f64,
    /// Gravity of the world
    #[arg(long, value_parser = choice::<Gravity>(), default_value = "central")]
    gravity: Gravity,
    /// Stop when a share is shown: 'miss_m<=0.02 p>=0.9973 conf>=0.95'
    #[arg(long, value_name = "CONDITION", conflicts_with = "part")]
    until: Option<Until>,
    #[arg(long, value_name = "WHAT", value_delimiter = ',', help = WRITE)]
    #[arg(value_parser = choice::<FlightFile>())]
    write: Vec<FlightFile>,
    /// Runs whose histories are kept: all, failures, worst=N, sample=N, with commas
    #[arg(long, value_name = "WHICH", default_value = "failures,worst=3")]
    keep: Keep,
}

choices! {
    /// Gravity that acts in the world.
    enum Gravity {
        /// Gravity of a point mass.
        Central = "central",
        /// The Earth's oblateness acts too.
        Oblate = "j2",
        /// No gravity at all.
        None = "none",
    }
}

choices! {
    /// Files beside the results.
    enum FlightFile {
        /// Histories with a row a step of guidance, not a row a second.
        Steps = "steps",
    }
}

/// Parses a controller, and how often it plans again.
#[derive(Clone, Copy, Debug)]
struct Pilots;

/// Age of a plan at which another is made, unless told otherwise [s].
const REPLAN_EVERY_S: f64 = 100.0;

impl TypedValueParser for Pilots {
    type Value = (Controller, f64);

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<Self::Value, clap::Error> {
        let text = value.to_string_lossy();
        let (name, every) = match text.split_once(':') {
            Some((name, every)) if name == Controller::Replan.name() => (name, Some(every)),
            _ => (&*text, None),
        };
        let controller = choice::<Controller>().parse_ref(command, arg, OsStr::new(name))?;
        let every = every.map(|every| positive.parse_ref(command, arg, OsStr::new(every)));
        Ok((controller, every.transpose()?.unwrap_or(REPLAN_EVERY_S)))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let values = Controller::ALL.iter();
        Some(Box::new(values.map(|of| PossibleValue::new(of.name()).help(of.help()))))
    }
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
        let j2 = self.gravity == Gravity::Oblate;
        let options = Options { j2, ..Options::default() };
        options.check_orbit(orbit).map_err(|error| Error::argument("--gravity", error.reason))
    }

    fn flights(&self, ready: Ready, errors: Errors) -> Flights {
        let (controller, replan_every_s) = self.controller;
        let options = Options {
            rate_hz: self.guidance_rate,
            controller,
            joints: self.joints,
            camera_s: self.camera,
            replan_every_s,
            j2: self.gravity == Gravity::Oblate,
            gravity: self.gravity != Gravity::None,
            integrator: ready.integrator,
            every_step: self.write.contains(&FlightFile::Steps),
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
