//! The journal of an injection: what it is, then a line a finished case.

use super::{Injector, Record};
use remora_host::fingerprint::{fingerprint, program};
use remora_host::journal::{self, Heading};
use serde::{Deserialize, Serialize};

const FORMAT: &str = "remora-inject-journal/2";

/// The journal.
pub(super) type Journal = journal::Journal<Line>;

/// A finished case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Line {
    /// Its record.
    pub record: Record,
    /// Whether a plan without a fault was made after it.
    pub leak_checked: bool,
}

/// All that the cases depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    format: String,
    program: String,
    seed: u64,
    integrator: String,
    /// Fingerprint of the scenarios.
    scenarios: String,
    /// Fingerprint of the mission.
    mission: String,
}

impl Header {
    /// The header of an injection. Sites and number of cases are not in it: a case is the same in any.
    pub fn new(injector: &Injector) -> Self {
        Self {
            format: FORMAT.into(),
            program: program(),
            seed: injector.seed,
            integrator: injector.integrator.to_string(),
            scenarios: fingerprint(&injector.scenarios),
            mission: fingerprint(&injector.mission),
        }
    }
}

impl Heading for Header {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "injection";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let checks = [
            ("program", self.program != begun.program, "another build of this program"),
            ("seed", self.seed != begun.seed, "another seed"),
            ("integrator", self.integrator != begun.integrator, "another integrator"),
            ("scenarios", self.scenarios != begun.scenarios, "other scenarios"),
            ("mission", self.mission != begun.mission, "another mission"),
        ];
        let found = checks.into_iter().find(|(_, differs, _)| *differs);
        found.map(|(field, _, what)| {
            (field, format!("this injection was begun with {what}; choose another --out"))
        })
    }
}
