//! A campaign that is made in parts.

use super::Header;
use super::scenarios::Scenarios;
use crate::campaign;
use crate::error::{Error, FieldError};
use crate::formats::{NamedScenario, Program, Row, TableOrigin, checksum_of_mission, node_numbers};
use crate::learned::Learned;
use crate::method::Method;
use crate::part::Part;
use crate::planning::{self, Planner};
use remora_core::advanced::model::Mission;
use remora_core::advanced::stages::LINKS;
use serde::{Deserialize, Serialize};

/// A campaign that is made in parts.
#[derive(Clone, Debug)]
pub struct Job<const NL: usize = LINKS> {
    /// The scenarios.
    pub scenarios: Scenarios,
    /// The mission; valid.
    pub mission: Mission<NL>,
    /// How to plan.
    pub method: Method,
    /// Model of a learned start; none is the heuristic.
    pub model: Option<Learned>,
    /// Whether to make a table of nodes too.
    pub nodes: bool,
    /// Arguments of the program by which the same job is made again.
    pub command: Vec<String>,
}

/// A plan as a part's journal keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kept {
    /// Index of the scenario.
    pub(super) index: u64,
    /// The row.
    pub(super) row: Row,
    /// What stands at each node, time first; none stands for what is no number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) nodes: Vec<Vec<Option<f64>>>,
}

impl<const NL: usize> Job<NL> {
    /// What a part says of itself.
    pub fn header(&self, part: Part) -> Header {
        let scenarios = self.scenarios.fingerprint();
        let campaign =
            campaign::Header::of(&self.mission, &self.method, self.model.as_ref(), scenarios);
        let (count, seed) = (self.scenarios.count(), self.scenarios.seed());
        let format = String::new();
        Header::new(part, Header { format, part, count, seed, nodes: self.nodes, campaign })
    }

    /// What its tables say of themselves.
    pub(super) fn origin(&self) -> TableOrigin {
        TableOrigin {
            method: self.method,
            seed: self.scenarios.seed(),
            mission_checksum: checksum_of_mission(&self.mission),
            program: Program::this(),
        }
    }

    /// Plans one scenario; one that is refused has a row and no plan.
    pub(super) fn plan(&self, planner: &mut Planner, index: u64) -> Result<Kept, Error> {
        let scenario = self.scenarios.get(index, &self.mission)?;
        if let Some(refusal) = planning::refusal(&self.mission, &scenario, &self.method)? {
            return Ok(Kept { index, row: Row::refused(&scenario, &refusal), nodes: Vec::new() });
        }
        Ok(self.planned(planner, index, &scenario))
    }

    fn planned(&self, planner: &mut Planner, index: u64, scenario: &NamedScenario) -> Kept {
        let planned = planner.plan(&self.mission, scenario, &self.method, self.model.as_ref());
        let number = |x: f64| x.is_finite().then_some(x);
        let nodes = match self.nodes {
            true => node_numbers(&planned.file),
            false => Vec::new(),
        };
        let nodes = nodes.into_iter().map(|row| row.into_iter().map(number).collect()).collect();
        Kept { index, row: planned.row(), nodes }
    }

    /// Refuses a row that is none of a part.
    pub(super) fn check(&self, part: Part, kept: &Kept) -> Result<(), FieldError> {
        let Kept { index, row, .. } = kept;
        let is_ours = part.range(self.scenarios.count()).contains(index);
        let id = self.scenarios.id(*index).filter(|_| is_ours);
        if id.as_deref() != Some(&row.scenario) {
            let reason = format!("{:?} is no scenario of this part", row.scenario);
            return Err(FieldError::new("row.scenario", reason));
        }
        row.check(&self.mission.tolerances)
    }
}
