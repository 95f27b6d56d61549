//! Convex subproblems: `*.qp.json`.

mod convert;

pub use convert::QpPlace;

use crate::error::{Error, FieldError};
use crate::formats::{Limit, check_id, json, read_text, write_atomically};
use crate::method::{Integrator, Mode};
use remora_core::advanced::qp::QpStatus;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The `format` of the subproblems this version reads and writes.
pub const FORMAT: &str = "remora-qp/1";

/// A matrix by rows.
pub type Rows = Vec<Vec<f64>>;
/// Bounds; `None` where there is none.
pub type Bounds = Vec<Option<f64>>;

/// A subproblem with its solver's answer, as in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a subproblem")]
pub struct QpFile {
    /// [`FORMAT`].
    pub format: String,
    /// Id of the scenario.
    pub scenario: String,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Solver of the plan's subproblems, this one's too. Any name.
    pub qp: String,
    /// 1 translation, 2 reorientation.
    pub stage: u64,
    /// Number of the stage's iteration, from 1.
    pub iteration: u64,
    /// Number of the iteration's second-order correction, from 1; 0 for the iteration's own.
    pub correction: u64,
    /// Sizes.
    pub size: QpSize,
    /// Constant part of the objective.
    pub constant: f64,
    /// Penalty parameter of the dynamics' slack, L1 norm; `None` where they are hard.
    pub defect_weight: Option<f64>,
    /// Penalty parameter of the soft rows' violation.
    pub row_weight: f64,
    /// Data of the states, one entry a node.
    pub nodes: Vec<QpNode>,
    /// Data of the controls and the dynamics, one entry less.
    pub intervals: Vec<QpInterval>,
    /// Answer of the plan's solver.
    pub solution: QpAnswer,
}

/// Sizes of a subproblem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with nodes, states, controls and rows")]
pub struct QpSize {
    /// Nodes.
    pub nodes: usize,
    /// States a node.
    pub states: usize,
    /// Controls an interval.
    pub controls: usize,
    /// Soft rows a node.
    pub rows: usize,
}

/// One node's state: its cost, its box, its soft rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a node's part of the program")]
pub struct QpNode {
    /// Hessian block, symmetric.
    pub hessian_xx: Rows,
    /// Linear cost.
    pub gradient_x: Vec<f64>,
    /// Least state.
    pub lower_x: Bounds,
    /// Largest state.
    pub upper_x: Bounds,
    /// `C`.
    pub row_x: Rows,
    /// `d`.
    pub row_offset: Vec<f64>,
}

/// One interval: its control's cost and box, and the dynamics to the next node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with an interval's part of the program")]
pub struct QpInterval {
    /// Cross block of the Hessian, a row a control.
    pub hessian_ux: Rows,
    /// Hessian block, symmetric.
    pub hessian_uu: Rows,
    /// Linear cost.
    pub gradient_u: Vec<f64>,
    /// Least control.
    pub lower_u: Bounds,
    /// Largest control.
    pub upper_u: Bounds,
    /// `A`.
    pub a: Rows,
    /// `B`.
    pub b: Rows,
    /// `c`.
    pub c: Vec<f64>,
}

/// Answer of a solver to a subproblem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a solver's answer")]
pub struct QpAnswer {
    /// How it ended.
    pub status: QpStatus,
    /// Interior-point iterations.
    pub iterations: u64,
    /// The solution; `None` where the status says that there is none.
    pub point: Option<QpPoint>,
}

/// A solution with its multipliers: a row a node, or a row an interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a solution")]
pub struct QpPoint {
    /// The whole objective, constant and penalties included.
    pub objective: f64,
    /// States, a row a node.
    pub x: Rows,
    /// Controls, a row an interval.
    pub u: Rows,
    /// Multipliers of the dynamics, a row an interval.
    pub defect_multiplier: Rows,
    /// Multipliers of the states' bounds, a row a node.
    pub bound_multiplier_x: Rows,
    /// Multipliers of the controls' bounds, a row an interval.
    pub bound_multiplier_u: Rows,
    /// Multipliers of the soft rows, a row a node.
    pub row_multiplier: Rows,
}

impl QpFile {
    /// Parses and validates a subproblem.
    ///
    /// # Errors
    /// The first field found wrong: unknown format or field, numbers that are not, sizes that
    /// contradict each other, a Hessian that is not symmetric, weights that are none.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let file: Self = json::parse(text, FORMAT)?;
        file.validate()?;
        Ok(file)
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// The file with the error of [`QpFile::parse`].
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(&read_text(file, Limit::DOCUMENT)?).map_err(|error| error.at(file))
    }

    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// The file with the reason why it cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let text = json::to_text(self).map_err(|error| Error::output(file, &error.into()))?;
        write_atomically(file, text.as_bytes())
    }

    /// Name of the file of this subproblem, such as `stage2-003-correction-1.qp.json`.
    pub fn name(&self) -> String {
        let Self { stage, iteration, correction, .. } = self;
        match correction {
            0 => format!("stage{stage}-{iteration:03}.qp.json"),
            _ => format!("stage{stage}-{iteration:03}-correction-{correction}.qp.json"),
        }
    }

    /// Whether a file of this name is one that [`QpFile::name`] names.
    pub fn is_name(name: &str) -> bool {
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let Some(stem) = name.strip_suffix(".qp.json") else { return false };
        let Some(rest) = stem.strip_prefix("stage1-").or(stem.strip_prefix("stage2-")) else {
            return false;
        };
        match rest.split_once("-correction-") {
            Some((iteration, correction)) => digits(iteration) && digits(correction),
            None => digits(rest),
        }
    }

    /// Checks all that the types leave open. Call it before writing too: a number that is not finite
    /// would become a `null`, which means something else here.
    ///
    /// # Errors
    /// The first field found wrong.
    pub fn validate(&self) -> Result<(), FieldError> {
        check_id(&self.scenario, || "scenario".into())?;
        self.validate_head()?;
        let QpSize { nodes, states, controls, rows } = self.size;
        length("nodes", self.nodes.len(), nodes)?;
        length("intervals", self.intervals.len(), nodes - 1)?;
        for (k, node) in self.nodes.iter().enumerate() {
            let at = |field: &str| format!("nodes[{k}].{field}");
            symmetric(&at("hessian_xx"), &node.hessian_xx, states)?;
            vector(&at("gradient_x"), &node.gradient_x, states)?;
            bounds(&at("lower_x"), &node.lower_x, states)?;
            bounds(&at("upper_x"), &node.upper_x, states)?;
            matrix(&at("row_x"), &node.row_x, (rows, states))?;
            vector(&at("row_offset"), &node.row_offset, rows)?;
        }
        for (k, interval) in self.intervals.iter().enumerate() {
            let at = |field: &str| format!("intervals[{k}].{field}");
            matrix(&at("hessian_ux"), &interval.hessian_ux, (controls, states))?;
            symmetric(&at("hessian_uu"), &interval.hessian_uu, controls)?;
            vector(&at("gradient_u"), &interval.gradient_u, controls)?;
            bounds(&at("lower_u"), &interval.lower_u, controls)?;
            bounds(&at("upper_u"), &interval.upper_u, controls)?;
            matrix(&at("a"), &interval.a, (states, states))?;
            matrix(&at("b"), &interval.b, (states, controls))?;
            vector(&at("c"), &interval.c, states)?;
        }
        self.solution.point.as_ref().map_or(Ok(()), |point| self.validate_point(point))
    }

    fn validate_head(&self) -> Result<(), FieldError> {
        let check = |ok: bool, field: &str, reason: &str| match ok {
            true => Ok(()),
            false => Err(FieldError::new(field, reason)),
        };
        check((1..=2).contains(&self.stage), "stage", "must be 1 or 2")?;
        check(self.iteration >= 1, "iteration", "must be at least 1")?;
        check(self.size.nodes >= 2, "size.nodes", "must be at least 2")?;
        check(self.size.states >= 1, "size.states", "must be at least 1")?;
        check(self.constant.is_finite(), "constant", "must be finite")?;
        let weight = self.defect_weight.unwrap_or(1.0);
        check(weight > 0.0 && weight.is_finite(), "defect_weight", "must be positive or null")?;
        let weight = self.row_weight;
        check(weight >= 0.0 && weight.is_finite(), "row_weight", "must not be negative")
    }

    fn validate_point(&self, point: &QpPoint) -> Result<(), FieldError> {
        let QpSize { nodes, states, controls, rows } = self.size;
        let check = |field: &str, value: &Rows, shape: (usize, usize)| {
            matrix(&format!("solution.point.{field}"), value, shape)
        };
        check("x", &point.x, (nodes, states))?;
        check("u", &point.u, (nodes - 1, controls))?;
        check("defect_multiplier", &point.defect_multiplier, (nodes - 1, states))?;
        check("bound_multiplier_x", &point.bound_multiplier_x, (nodes, states))?;
        check("bound_multiplier_u", &point.bound_multiplier_u, (nodes - 1, controls))?;
        check("row_multiplier", &point.row_multiplier, (nodes, rows))?;
        match point.objective.is_finite() {
            true => Ok(()),
            false => Err(FieldError::new("solution.point.objective", "must be finite")),
        }
    }
}

fn length(field: &str, found: usize, expected: usize) -> Result<(), FieldError> {
    match found == expected {
        true => Ok(()),
        false => Err(FieldError::new(field, format!("has {found} entries, not {expected}"))),
    }
}

fn vector(field: &str, value: &[f64], expected: usize) -> Result<(), FieldError> {
    length(field, value.len(), expected)?;
    match value.iter().position(|number| !number.is_finite()) {
        Some(i) => Err(FieldError::new(format!("{field}[{i}]"), "must be finite")),
        None => Ok(()),
    }
}

fn bounds(field: &str, value: &Bounds, expected: usize) -> Result<(), FieldError> {
    let numbers: Vec<f64> = value.iter().map(|bound| bound.unwrap_or(0.0)).collect();
    vector(field, &numbers, expected)
}

fn matrix(field: &str, value: &Rows, shape: (usize, usize)) -> Result<(), FieldError> {
    length(field, value.len(), shape.0)?;
    let mut rows = value.iter().enumerate();
    rows.try_for_each(|(i, row)| vector(&format!("{field}[{i}]"), row, shape.1))
}

/// Rounding may part the two halves of a Hessian; more than that is a mistake.
const ASYMMETRY: f64 = 1e-9;

fn symmetric(field: &str, value: &Rows, size: usize) -> Result<(), FieldError> {
    matrix(field, value, (size, size))?;
    let largest = value.iter().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    for i in 0..size {
        for j in 0..i {
            if (value[i][j] - value[j][i]).abs() > ASYMMETRY * largest {
                return Err(FieldError::new(format!("{field}[{i}][{j}]"), "is not symmetric"));
            }
        }
    }
    Ok(())
}
