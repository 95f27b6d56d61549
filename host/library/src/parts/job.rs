//! A campaign that is made in parts.

use super::scenarios::Scenarios;
use super::work::Work;
use super::write::{nodes_file, write_nodes};
use super::{COMMAND, Header, KEY};
use crate::campaign;
use crate::error::{Error, FieldError};
use crate::formats::{
    Column, NamedScenario, Program, Row, Status, TableOrigin, checksum_of_mission, columns,
    node_numbers,
};
use crate::journal::Journal;
use crate::learned::Learned;
use crate::method::Method;
use crate::part::Part;
use crate::planning::{self, Planner};
use remora_core::advanced::model::Mission;
use remora_core::advanced::stages::LINKS;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

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
pub struct Kept {
    /// Index of the scenario.
    index: u64,
    /// The row.
    pub(super) row: Row,
    /// What stands at each node, time first; none stands for what is no number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) nodes: Vec<Vec<Option<f64>>>,
}

impl<const NL: usize> Work for Job<NL> {
    type Worker = Planner;
    type Header = Header;
    type Kept = Kept;
    const COUNTED: &'static str = "scenarios";

    fn count(&self) -> u64 {
        self.scenarios.count()
    }

    fn header(&self, part: Part) -> Header {
        let scenarios = self.scenarios.fingerprint();
        let campaign =
            campaign::Header::of(&self.mission, &self.method, self.model.as_ref(), scenarios);
        let (count, seed) = (self.scenarios.count(), self.scenarios.seed());
        let format = String::new();
        Header::new(part, Header { format, part, count, seed, nodes: self.nodes, campaign })
    }

    fn entries(&self) -> Vec<(&'static str, String)> {
        let origin = TableOrigin {
            method: self.method,
            seed: self.scenarios.seed(),
            mission_checksum: checksum_of_mission(&self.mission),
            program: Program::this(),
        };
        let mut entries = origin.table_entries();
        entries.push((COMMAND, serde_json::json!(self.command).to_string()));
        entries
    }

    /// Plans one scenario; one that is refused has a row and no plan.
    fn run(&self, planner: &mut Planner, index: u64) -> Result<Kept, Error> {
        let scenario = self.scenarios.get(index, &self.mission)?;
        if let Some(refusal) = planning::refusal(&self.mission, &scenario, &self.method)? {
            return Ok(Kept { index, row: Row::refused(&scenario, &refusal), nodes: Vec::new() });
        }
        Ok(self.planned(planner, index, &scenario))
    }

    fn number(kept: &Kept) -> u64 {
        kept.index
    }

    fn is_well(kept: &Kept) -> bool {
        kept.row.status == Status::Solved
    }

    /// Refuses a row that is none of a part.
    fn check(&self, part: Part, kept: &Kept) -> Result<(), FieldError> {
        let Kept { index, row, .. } = kept;
        let is_ours = part.range(self.scenarios.count()).contains(index);
        let id = self.scenarios.id(*index).filter(|_| is_ours);
        if id.as_deref() != Some(&row.scenario) {
            let reason = format!("{:?} is no scenario of this part", row.scenario);
            return Err(FieldError::new("row.scenario", reason));
        }
        row.check(&self.mission.tolerances)
    }

    fn columns(&self, kept: &Kept) -> Vec<Column> {
        self.columns_of(&kept.row)
    }

    fn beside(&self, table: &Path) -> Vec<PathBuf> {
        self.nodes.then(|| nodes_file(table)).into_iter().collect()
    }

    fn write_beside(
        &self,
        table: &Path,
        entries: &[(&'static str, String)],
        journal: &Journal<Kept>,
        places: &[u64],
    ) -> Result<(), Error> {
        let of_both = entries.iter().filter(|(key, _)| [KEY, COMMAND].contains(key)).cloned();
        match self.nodes {
            true => write_nodes(&nodes_file(table), NL, of_both, journal, places),
            false => Ok(()),
        }
    }
}

impl<const NL: usize> Job<NL> {
    pub(super) fn columns_of(&self, row: &Row) -> Vec<Column> {
        columns(row, &self.method)
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
}
