//! A campaign that is made in parts.

use super::scenarios::Scenarios;
use super::work::{Kept, Work};
use super::write::{nodes_file, write_nodes};
use super::{COMMAND, KEY, PartHeader, TOLERANCES};
use crate::campaign;
use crate::error::{Error, FieldError};
use crate::formats::{
    Column, NamedScenario, PlanGrid, Program, Row, Status, TableOrigin, checksum_of_mission,
    columns, node_columns, node_numbers, residual_limits,
};
use crate::journal::Journal;
use crate::part::Part;
use crate::planning::Planner;
use crate::request::PlanRequest;
use std::path::{Path, PathBuf};

/// A campaign that is made in parts.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scenarios.
    pub scenarios: Scenarios,
    /// How to plan.
    pub request: PlanRequest,
    /// Whether to make a table of nodes too.
    pub nodes: bool,
    /// Arguments of the program by which the same job is made again.
    pub command: Vec<String>,
}

impl Work for Job {
    type Worker = Planner;
    type Header = PartHeader;
    type Kept = Kept;
    const COUNTED: &'static str = "scenarios";

    fn count(&self) -> u64 {
        self.scenarios.count()
    }

    fn header(&self, part: Part) -> PartHeader {
        let scenarios = self.scenarios.fingerprint();
        let campaign = campaign::CampaignHeader::of(&self.request, scenarios);
        let (count, seed) = (self.scenarios.count(), self.scenarios.seed());
        let format = String::new();
        PartHeader::new(part, PartHeader { format, part, count, seed, nodes: self.nodes, campaign })
    }

    fn entries(&self) -> Vec<(&'static str, String)> {
        let origin = TableOrigin {
            method: self.request.method,
            seed: self.scenarios.seed(),
            mission_checksum: checksum_of_mission(&self.request.mission),
            program: Program::this(),
        };
        let mut entries = origin.table_entries();
        entries.push((COMMAND, serde_json::json!(self.command).to_string()));
        let limits = residual_limits(&self.request.mission.tolerances);
        entries.push((TOLERANCES, serde_json::json!(limits).to_string()));
        entries
    }

    /// Plans one scenario; one that is refused has a row and no plan.
    fn run(&self, planner: &mut Planner, index: u64) -> Result<Kept, Error> {
        let scenario = self.scenarios.get(index, &self.request.mission)?;
        if let Some(refusal) = self.request.refusal(&scenario)? {
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
        row.check(&self.request.mission.tolerances)?;
        self.check_nodes(kept)
    }

    /// Drops the nodes, which the table of nodes holds.
    fn lasting(kept: Kept) -> Kept {
        Kept { nodes: Vec::new(), ..kept }
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
            true => write_nodes(
                &nodes_file(table),
                self.request.mission.joints(),
                of_both,
                journal,
                places,
            ),
            false => Ok(()),
        }
    }
}

impl Job {
    pub(super) fn columns_of(&self, row: &Row) -> Vec<Column> {
        columns(row, &self.request.method)
    }

    /// Refuses nodes that are not those of the row's plan: one for each of its grid, with a number in each column.
    fn check_nodes(&self, kept: &Kept) -> Result<(), FieldError> {
        let Kept { index, row, nodes } = kept;
        let wrong = |field: String, reason| Err(FieldError::new(field, reason));
        let mut expected = 0;
        if self.nodes && !row.is_refused() {
            let scenario = self.scenarios.get(*index, &self.request.mission);
            let scenario = scenario.map_err(|error| FieldError::new("index", error.to_string()))?;
            expected = PlanGrid::of(&self.request.mission, &scenario.scenario()).nodes;
        }
        if nodes.len() != expected {
            return wrong("nodes".into(), format!("are {} of {expected}", nodes.len()));
        }
        let width = 1 + node_columns(self.request.mission.joints()).len();
        for (i, node) in nodes.iter().enumerate() {
            if node.len() != width {
                let reason = format!("has {} numbers of {width}", node.len());
                return wrong(format!("nodes[{i}]"), reason);
            }
            let certain = if row.is_verified() { width } else { 1 };
            if node.iter().take(certain).any(Option::is_none) {
                return wrong(format!("nodes[{i}]"), "holds what is no number".into());
            }
        }
        Ok(())
    }

    fn planned(&self, planner: &mut Planner, index: u64, scenario: &NamedScenario) -> Kept {
        let planned = planner.plan(&self.request, scenario);
        let number = |x: f64| x.is_finite().then_some(x);
        let nodes = match self.nodes {
            true => node_numbers(&planned.file),
            false => Vec::new(),
        };
        let nodes = nodes.into_iter().map(|row| row.into_iter().map(number).collect()).collect();
        Kept { index, row: planned.row(), nodes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::on_large_stack;
    use crate::method::{Integrator, Method};
    use remora_core::advanced::model::Refusal;

    /// A journal's row with other nodes than the job's is refused.
    // Verifies REM-CMP-001.
    #[test]
    fn forged_nodes_are_refused() {
        let method = Method { integrator: Integrator::Euler, ..Method::default() };
        let job = Job {
            scenarios: Scenarios::Drawn { seed: 3, count: 1 },
            request: PlanRequest { method, ..PlanRequest::default() },
            nodes: true,
            command: Vec::new(),
        };
        let kept = on_large_stack(|| job.run(&mut Planner::new(), 0)).unwrap().unwrap();
        let part: Part = "1/1".parse().unwrap();
        let refused = |job: &Job, change: &dyn Fn(&mut Kept)| {
            let mut kept = kept.clone();
            change(&mut kept);
            job.check(part, &kept).map_err(|error| error.field).err().unwrap_or_default()
        };
        assert_eq!((kept.nodes.len(), refused(&job, &|_| ())), (60, String::new()));
        type Change<'a> = &'a dyn Fn(&mut Kept);
        let changes: [(Change<'_>, &str); 6] = [
            (&|kept| kept.nodes.clear(), "nodes"),
            (&|kept| kept.nodes = vec![vec![Some(1.0)]], "nodes"),
            (&|kept| kept.nodes.truncate(59), "nodes"),
            (&|kept| kept.nodes[7] = vec![Some(1.0); 500], "nodes[7]"),
            (&|kept| kept.nodes[59][4] = None, "nodes[59]"),
            (&|kept| kept.nodes[0].truncate(9), "nodes[0]"),
        ];
        for (change, field) in changes {
            assert_eq!(refused(&job, change), field);
        }
        let scenario = job.scenarios.get(0, &job.request.mission).unwrap();
        let gone = Row::refused(&scenario, &Refusal::KeepOut { distance: 1.0, limit: 2.0 });
        assert_eq!(refused(&job, &|kept| kept.row = gone.clone()), "nodes");
        let without = Job { nodes: false, ..job.clone() };
        assert_eq!(refused(&without, &|_| ()), "nodes");
        assert_eq!(refused(&without, &|kept| kept.nodes.clear()), "");
        // A plan that cannot be flown may have values at its nodes that are not finite.
        let failed = |kept: &mut Kept| {
            kept.row.verdict = crate::formats::Verdict::NotFlyable;
            kept.nodes[59][4] = None;
        };
        assert_eq!(refused(&job, &failed), "");
    }
}
