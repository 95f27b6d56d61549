//! Tally of rows, one by one: it keeps eleven numbers a row, not the rows.

use super::summary::{NearestOf, Run, StageSummary, Statistics, Summary};
use crate::formats::{Row, StageRow, Status, Verdict};
use crate::method::Method;
use std::collections::BTreeMap;

/// Counts and numbers of the rows so far.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    rows: usize,
    refused: usize,
    fallbacks: usize,
    by_status: BTreeMap<Status, usize>,
    by_verdict: BTreeMap<Verdict, usize>,
    by_reason: BTreeMap<String, usize>,
    unsolved: Vec<String>,
    stages: [Stage; 2],
    inference_s: Vec<f64>,
    time_s: Vec<f64>,
    cpu_time_s: Vec<f64>,
    nearest: Option<NearestOf>,
}

/// One stage of the rows so far.
#[derive(Clone, Debug, Default)]
struct Stage {
    iterations: Vec<f64>,
    corrections: Vec<f64>,
    time_s: Vec<f64>,
    cost: Vec<f64>,
}

impl Stage {
    fn add(&mut self, stage: &StageRow, is_solved: bool) {
        self.iterations.push(stage.iterations as f64);
        self.corrections.push(stage.corrections as f64);
        self.time_s.push(stage.time_s);
        self.cost.extend(is_solved.then_some(stage.cost));
    }

    fn summary(self) -> StageSummary {
        StageSummary {
            iterations: Statistics::of(self.iterations),
            corrections: Statistics::of(self.corrections),
            time_s: Statistics::of(self.time_s),
            cost: Statistics::of(self.cost),
        }
    }
}

impl Tally {
    /// Counts a row.
    pub fn add(&mut self, row: &Row) {
        let is_solved = row.status == Status::Solved;
        self.rows += 1;
        *self.by_status.entry(row.status).or_insert(0) += 1;
        *self.by_verdict.entry(row.verdict).or_insert(0) += 1;
        if !row.reason.is_empty() {
            *self.by_reason.entry(row.reason.clone()).or_insert(0) += 1;
        }
        self.fallbacks += usize::from(row.warm_start == "fallback");
        self.unsolved.extend((!is_solved).then(|| row.scenario.clone()));
        if row.is_refused() {
            self.refused += 1;
            return;
        }
        for (tally, stage) in self.stages.iter_mut().zip([&row.stage1, &row.stage2]) {
            tally.add(stage, is_solved);
        }
        let is_nearer = |of: &NearestOf| row.nearest.at.distance < of.distance_m;
        if !row.nearest.pair.is_empty() && self.nearest.as_ref().is_none_or(is_nearer) {
            self.nearest = Some(NearestOf::of(row));
        }
        self.inference_s.push(row.inference_s);
        self.time_s.push(row.time_s);
        self.cpu_time_s.extend(Some(row.cpu_time_s).filter(|time_s| time_s.is_finite()));
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Statistics over the rows.
    pub fn summary(self, method: &Method, run: Run) -> Summary {
        let solved = self.by_status.get(&Status::Solved).copied().unwrap_or(0);
        let judged = |verdict| (verdict, self.by_verdict.get(&verdict).copied().unwrap_or(0));
        let [stage1, stage2] = self.stages.map(Stage::summary);
        Summary {
            format: "remora-summary/1",
            mode: method.mode,
            warm_start: method.warm_start,
            qp: method.qp,
            integrator: method.integrator,
            scenarios: self.rows,
            solved,
            success_rate: solved as f64 / self.rows.max(1) as f64,
            by_status: self.by_status,
            by_verdict: Verdict::ALL.map(judged).into(),
            by_reason: self.by_reason,
            refused: self.refused,
            stage1,
            stage2,
            inference_s: Statistics::of(self.inference_s),
            time_s: Statistics::of(self.time_s),
            cpu_time_s: Statistics::of(self.cpu_time_s),
            fallbacks: self.fallbacks,
            nearest: self.nearest,
            unsolved: self.unsolved,
            run,
        }
    }
}

impl Summary {
    /// The summary of a campaign's rows.
    pub fn of(rows: &[Row], method: &Method, run: Run) -> Self {
        let mut tally = Tally::default();
        rows.iter().for_each(|row| tally.add(row));
        tally.summary(method, run)
    }
}
