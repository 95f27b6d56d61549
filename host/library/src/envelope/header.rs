//! The journal of a map: a line a cell whose scenarios were planned.

use super::{Cell, Envelope};
use crate::fingerprint::{self, fingerprint};
use crate::journal::{Fact, Heading, first_difference};
use crate::method::Integrator;
use crate::request::PlanRequest;
use crate::settings::settings_text;
use serde::{Deserialize, Serialize};

/// Name of the journal in the map's directory.
pub(super) const JOURNAL: &str = "journal.jsonl";

/// A map's journal.
pub(super) type Journal = crate::journal::Journal<Cell>;

/// The journal's first line: all that the cells depend on, but for the axes: a map may grow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvelopeHeader {
    format: String,
    version: String,
    program: String,
    integrator: Integrator,
    count: u64,
    seed: u64,
    settings: String,
    vehicles: String,
}

impl EnvelopeHeader {
    pub(super) fn new(envelope: &Envelope) -> Self {
        let PlanRequest { method, guess, .. } = &envelope.request;
        let vehicles: Vec<_> =
            envelope.vehicles.iter().map(|vehicle| (&vehicle.name, vehicle.mission())).collect();
        Self {
            format: Self::FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: fingerprint::program(),
            integrator: method.integrator,
            count: envelope.count,
            seed: envelope.seed,
            settings: fingerprint(&(settings_text(method), guess.model())),
            vehicles: fingerprint(&vehicles),
        }
    }
}

impl Heading for EnvelopeHeader {
    const FORMAT: &'static str = "remora-envelope-journal/1";
    const WORK: &'static str = "map";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let facts = |of: &Self| -> [Fact; 7] {
            [
                ("version", of.version.clone(), ""),
                ("program", of.program.clone(), "another build of this program"),
                ("integrator", of.integrator.to_string(), ""),
                ("count", of.count.to_string(), ""),
                ("seed", of.seed.to_string(), ""),
                ("settings", of.settings.clone(), "other planner settings"),
                ("vehicles", of.vehicles.clone(), "other vehicles"),
            ]
        };
        first_difference(facts(self), facts(begun)).map(|(field, what)| {
            let reason = format!("this map was begun with {what}; choose another --out");
            (field, format!("{reason} to start anew"))
        })
    }
}
