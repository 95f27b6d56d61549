//! The journal of a profile: what is measured, then a line a measurement, in their order.

use super::Profiler;
use super::order::{Configuration, Job, Rounds};
use super::sample::Sample;
use remora_host::error::Error;
use remora_host::fingerprint::{fingerprint, program};
use remora_host::journal::{self, Heading};
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: &str = "remora-profile-journal/1";

/// All that a measurement depends on and the program knows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    format: String,
    program: String,
    processor: String,
    cores: Option<[usize; 2]>,
    is_counted: bool,
    rounds: Rounds,
    configurations: Vec<Configuration>,
    /// Fingerprint of the scenarios.
    scenarios: String,
    /// Fingerprint of the mission.
    mission: String,
}

impl Heading for Header {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "profile";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let checks = [
            ("program", self.program != begun.program, "another build of this program"),
            ("processor", self.processor != begun.processor, "another processor"),
            ("cores", self.cores != begun.cores, "other cores"),
            ("is_counted", self.is_counted != begun.is_counted, "another counter"),
            ("rounds", self.rounds != begun.rounds, "other rounds"),
            ("configurations", self.configurations != begun.configurations, "other configurations"),
            ("scenarios", self.scenarios != begun.scenarios, "other scenarios"),
            ("mission", self.mission != begun.mission, "another mission"),
        ];
        let found = checks.into_iter().find(|(_, differs, _)| *differs);
        found.map(|(field, _, what)| {
            (field, format!("this profile was begun with {what}; choose another --out"))
        })
    }
}

/// A profile's journal, where one is kept.
pub(super) struct Journal(Option<journal::Journal<Sample>>);

impl Journal {
    /// Opens the journal in `file`, and reads the measurements that are finished: the first of `jobs`.
    pub fn open(
        file: Option<&Path>,
        profiler: &Profiler,
        on: (&str, Option<[usize; 2]>, bool),
        jobs: &[Job],
    ) -> Result<(Self, Vec<Sample>), Error> {
        let Some(file) = file else { return Ok((Self(None), Vec::new())) };
        let (processor, cores, is_counted) = on;
        let header = Header {
            format: FORMAT.into(),
            program: program(),
            processor: processor.into(),
            cores,
            is_counted,
            rounds: profiler.rounds,
            configurations: profiler.configurations.clone(),
            scenarios: fingerprint(&profiler.scenarios),
            mission: fingerprint(&profiler.mission),
        };
        let (journal, lines) = journal::Journal::open(file, &header, &|_: &Sample| Ok(()))?;
        let odd = lines.iter().enumerate().find(|(i, line)| jobs.get(*i) != Some(&line.job));
        match odd {
            Some((i, _)) => {
                let reason = "is not the measurement that comes here";
                Err(Error::input(file, format!("line {}", i + 2), reason))
            }
            None => Ok((Self(Some(journal)), lines)),
        }
    }

    /// Adds a measurement.
    pub fn append(&mut self, sample: &Sample) -> Result<(), Error> {
        self.0.as_mut().map_or(Ok(()), |journal| journal.append(sample))
    }
}
