//! Header of a part: all that its rows depend on, and which of the parts it is.

use crate::campaign;
use crate::journal::Heading;
use crate::part::Part;
use serde::{Deserialize, Serialize};

/// Where a part's table holds it, as JSON.
pub const KEY: &str = "remora.part";

const FORMAT: &str = "remora-part/1";

/// All that the rows of a part depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartHeader {
    /// Format of part and journal.
    pub format: String,
    /// Its number, and that of all parts.
    pub part: Part,
    /// Number of scenarios of all parts.
    pub count: u64,
    /// Seed of their draw, where they were drawn.
    pub seed: Option<u64>,
    /// Whether there is a table of nodes.
    pub nodes: bool,
    /// Program, method, settings, mission and scenarios.
    pub campaign: campaign::CampaignHeader,
}

impl PartHeader {
    pub(super) fn new(part: Part, of: Self) -> Self {
        Self { format: FORMAT.into(), part, ..of }
    }

    /// The first difference from another part of the same campaign.
    pub fn differs_from(&self, other: &Self) -> Option<(&'static str, String)> {
        if self.format != other.format {
            return Some(("format", format!("is {:?}, not {:?}", self.format, other.format)));
        }
        if self.count != other.count {
            return Some(("count", format!("{} scenarios, not {}", self.count, other.count)));
        }
        if self.seed != other.seed {
            let of = |one: &Self| {
                one.seed.map_or("scenarios of a file".into(), |seed| format!("seed {seed}"))
            };
            return Some(("seed", format!("{}, not {}", of(self), of(other))));
        }
        if self.nodes != other.nodes {
            return Some(("nodes", "with and without --write nodes".into()));
        }
        let found = self.campaign.difference(&other.campaign);
        found.map(|(field, _)| (field, another(field)))
    }
}

/// Words for a field that differs.
fn another(field: &str) -> String {
    match field {
        "settings" => "another --model, another --deadline or other planner settings".into(),
        "program" => "another build of this program".into(),
        "scenarios" => "other scenarios".into(),
        _ => format!("another {field}"),
    }
}

impl Heading for PartHeader {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "program that makes the same part";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let differs = self.differs_from(begun).map(|(field, _)| field);
        let field = differs.or((self.part != begun.part).then_some("part"))?;
        let what = another(field);
        let reason = format!("this part was begun with {what}; choose another --out to start anew");
        Some((field, reason))
    }
}
