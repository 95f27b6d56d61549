//! The file that says what is flown, and the header of its journal.

use crate::errors_file;
use crate::options::Options;
use remora_host::error::{Error, FieldError};
use remora_host::fingerprint::{self, fingerprint};
use remora_host::formats::{Limit, MAX_JOINTS, PLANNED_JOINTS, json, read_text};
use remora_host::journal::Heading;
use remora_host::part::Part;
use remora_truth::{Dispersion, Errors};
use serde::{Deserialize, Serialize};
use std::path::{Component, Path, PathBuf};

/// Name of what says all that a run depends on.
pub const FLIGHTS: &str = "flights.json";

const FORMAT: &str = "remora-flights/1";

/// Most runs of each plan.
pub const MAX_RUNS: u64 = 1_000_000;

/// Description of flights: all that a run depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightsFile {
    /// Format of the file.
    pub format: String,
    /// Plan files in their order, from the folder of the flights.
    pub plans: Vec<PathBuf>,
    /// Runs of each plan.
    pub runs: u64,
    /// Seed of the errors' draw.
    pub seed: u64,
    /// Joints of the arm.
    pub joints: usize,
    /// How plans are flown.
    pub options: Options,
    /// Errors of the world.
    pub errors: Errors,
}

impl FlightsFile {
    /// Describes flights in the present form.
    pub fn new(
        plans: Vec<PathBuf>,
        (runs, seed): (u64, u64),
        joints: usize,
        options: Options,
        errors: Errors,
    ) -> Self {
        Self { format: FORMAT.into(), plans, runs, seed, joints, options, errors }
    }

    /// Reads a folder's.
    ///
    /// # Errors
    /// The file with the field that is wrong.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let file = folder.join(FLIGHTS);
        Self::parse(&read_text(&file, Limit::DOCUMENT)?).map_err(|error| error.at(&file))
    }

    /// Parses a file's text.
    ///
    /// # Errors
    /// The field that is wrong.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let asked: Self = json::parse(text, FORMAT)?;
        asked.check().map(|()| asked)
    }

    /// Refuses what no command asks for, and would never end.
    fn check(&self) -> Result<(), FieldError> {
        if !(1..=MAX_RUNS).contains(&self.runs) {
            return Err(FieldError::new("runs", format!("must be from 1 to {MAX_RUNS}")));
        }
        if !(1..=MAX_JOINTS).contains(&self.joints) {
            return Err(FieldError::new("joints", PLANNED_JOINTS));
        }
        for (i, plan) in self.plans.iter().enumerate() {
            if !is_within(plan) {
                let reason = format!("{:?} is no file in the folder of the flights", plan);
                return Err(FieldError::new(format!("plans[{i}]"), reason));
            }
        }
        let within = |section: &'static str| {
            move |error: FieldError| {
                FieldError::new(format!("{section}.{}", error.field), error.reason)
            }
        };
        self.options.check().map_err(within("options"))?;
        errors_file::check(&self.errors, self.joints).map_err(within("errors"))
    }

    /// Draw of a run.
    pub fn dispersion(&self, run: u64) -> Dispersion {
        Dispersion { errors: self.errors.clone(), seed: self.seed, run }
    }

    pub(crate) fn count(&self) -> u64 {
        self.runs.saturating_mul(self.plans.len() as u64)
    }
}

/// Whether a path leads to what is below the folder that it starts from.
fn is_within(path: &Path) -> bool {
    let mut parts = path.components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Header of the journal of flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlightsHeader {
    format: String,
    version: String,
    program: String,
    flights: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part: Option<Part>,
}

impl FlightsHeader {
    /// Header of all flights.
    pub(crate) fn new(asked: &FlightsFile) -> Self {
        Self {
            format: Self::FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: fingerprint::program(),
            flights: fingerprint(asked),
            part: None,
        }
    }

    /// Header of a part of the flights.
    pub(crate) fn of_part(asked: &FlightsFile, part: Part) -> Self {
        Self { part: Some(part), ..Self::new(asked) }
    }

    /// Why it is not that of `part` of these flights, by the program of the `first`; none where it is.
    pub(crate) fn mismatch(&self, first: &Self, part: Part, flights: &str) -> Option<&'static str> {
        match () {
            () if self.part != Some(part) => Some("says that it is another part"),
            () if self.flights != flights => Some("is of other flights than flights.json"),
            () if (&self.version, &self.program) != (&first.version, &first.program) => {
                Some("was flown by another build of the program than the first part")
            }
            () => None,
        }
    }
}

impl Heading for FlightsHeader {
    const FORMAT: &'static str = "remora-flights-journal/1";
    const WORK: &'static str = "series of flights";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let checks = [
            ("version", self.version != begun.version, "another version of this program"),
            ("program", self.program != begun.program, "another build of this program"),
            ("flights", self.flights != begun.flights, "other plans, errors, options or runs"),
            ("part", self.part != begun.part, "another part"),
        ];
        checks.into_iter().find(|(_, differs, _)| *differs).map(|(field, _, what)| {
            (field, format!("these flights were begun with {what}; choose another --out"))
        })
    }
}
