//! Journal of a learning, kept between its interruptions: `learn.jsonl`.

use super::recipe::Sizes;
use remora_host::error::Error;
use remora_host::journal::{self, Heading};
use remora_host::method::Integrator;
use remora_host::progress::Progress;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

const FORMAT: &str = "remora-learn/1";

/// Name of the journal in the work directory.
pub(super) const FILE: &str = "learn.jsonl";

/// All that a learning was begun with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Begun {
    format: String,
    version: String,
    /// Fingerprint of the mission.
    pub mission: String,
    pub hours: f64,
    pub integrator: Integrator,
    pub seed: u64,
    /// Whether nothing was started from.
    pub anew: bool,
    /// Name of the model file.
    pub out: String,
}

impl Begun {
    pub fn new(
        mission: String,
        hours: f64,
        integrator: Integrator,
        seed: u64,
        anew: bool,
        out: String,
    ) -> Self {
        let version = env!("CARGO_PKG_VERSION").into();
        Self { format: FORMAT.into(), version, mission, hours, integrator, seed, anew, out }
    }
}

impl Heading for Begun {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "learning";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let named = |now: &dyn std::fmt::Display, then: &dyn std::fmt::Display| {
            format!("begun with {then}, not {now}")
        };
        let checks = [
            ("version", self.version != begun.version, named(&self.version, &begun.version)),
            ("mission", self.mission != begun.mission, "begun with another mission".into()),
            ("hours", self.hours != begun.hours, named(&self.hours, &begun.hours)),
            (
                "integrator",
                self.integrator != begun.integrator,
                named(&self.integrator, &begun.integrator),
            ),
            ("seed", self.seed != begun.seed, named(&self.seed, &begun.seed)),
            ("anew", self.anew != begun.anew, named(&self.anew, &begun.anew)),
            ("out", self.out != begun.out, named(&self.out, &begun.out)),
        ];
        let found = checks.into_iter().find(|(_, differs, _)| *differs);
        found.map(|(field, _, reason)| (field, reason))
    }
}

/// A line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Mark {
    /// Planning for the dataset took so long [s].
    Planned(f64),
    /// Numbers of scenarios to plan.
    Sized(Sizes),
    /// How long the training may take.
    Minutes(f64),
    /// The training is complete.
    Trained,
}

/// Where a learning stands, in a journal that no other program writes.
pub(super) struct State {
    journal: journal::Journal<Mark>,
    /// Time spent on the dataset [s].
    pub planned_s: f64,
    pub sizes: Option<Sizes>,
    pub minutes: Option<f64>,
    pub is_trained: bool,
}

impl State {
    /// Refuses the journal of another learning, without changing anything.
    pub fn look(work: &Path, begun: &Begun) -> Result<(), Error> {
        journal::Journal::<Mark>::look(&work.join(FILE), begun, &|_| Ok(()))
    }

    /// Goes on with the journal in a directory, or begins one.
    pub fn open(work: &Path, begun: &Begun) -> Result<Self, Error> {
        let (journal, marks) = journal::Journal::open(&work.join(FILE), begun, &|_| Ok(()))?;
        let mut state =
            Self { journal, planned_s: 0.0, sizes: None, minutes: None, is_trained: false };
        marks.into_iter().for_each(|mark| state.note(mark));
        Ok(state)
    }

    /// Keeps a mark.
    pub fn mark(&mut self, mark: Mark) -> Result<(), Error> {
        self.journal.append(&mark)?;
        self.note(mark);
        Ok(())
    }

    fn note(&mut self, mark: Mark) {
        match mark {
            Mark::Planned(seconds) => self.planned_s += seconds,
            Mark::Sized(sizes) => self.sizes = Some(sizes),
            Mark::Minutes(minutes) => self.minutes = Some(minutes),
            Mark::Trained => self.is_trained = true,
        }
    }
}

/// How often the time spent is kept: a kill loses no more.
const KEPT_EVERY: Duration = Duration::from_secs(1);

/// Counts the time of planning, and lets another watch.
pub(super) struct Clock<'a> {
    state: &'a mut State,
    watcher: &'a mut dyn Progress,
    since: Instant,
    failed: Option<Error>,
}

impl<'a> Clock<'a> {
    pub fn new(state: &'a mut State, watcher: &'a mut dyn Progress) -> Self {
        Self { state, watcher, since: Instant::now(), failed: None }
    }

    /// Keeps the time since it was last kept.
    pub fn keep(&mut self) -> Result<(), Error> {
        let seconds = self.since.elapsed().as_secs_f64();
        self.since = Instant::now();
        self.state.mark(Mark::Planned(seconds))?;
        self.failed.take().map_or(Ok(()), Err)
    }
}

impl Progress for Clock<'_> {
    fn begin(&mut self, total: usize, done: usize) {
        self.watcher.begin(total, done);
    }

    fn done(&mut self, is_solved: bool) {
        self.watcher.done(is_solved);
        if self.since.elapsed() >= KEPT_EVERY {
            self.failed = self.keep().err();
        }
    }

    fn end(&mut self) {
        self.watcher.end();
    }
}
