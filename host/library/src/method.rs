//! How a plan is made: mode, warm start, solver of the subproblems and integrator, by the names
//! they have in files and on the command line, and how long it may take.

use crate::choice::Choice;
use remora_core::advanced::dynamics;
use remora_core::advanced::stages;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What Stage 2 is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Minimise the cost.
    #[default]
    Optimal,
    /// Stop at the first feasible plan.
    Feasible,
}

/// What the second stage is to start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarmStart {
    /// A learned model where there is one for the integrator, otherwise the heuristic.
    Auto,
    /// The roll-out of a learned model; the heuristic where the roll-out is worse or of no use.
    Model,
    /// Track the docking port, move the joints linearly.
    #[default]
    Heuristic,
}

/// Who solves the convex subproblems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Qp {
    /// The core's own interior-point solver, the one that flies.
    #[default]
    Embedded,
    /// Clarabel, a sparse interior-point solver.
    Clarabel,
}

/// Discretisation of Stage 2: `euler`, `rk4` (eight substeps a node) or `rk4:M`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Integrator(dynamics::Integrator);

impl Integrator {
    /// One explicit Euler step a node.
    pub const EULER: Self = Self(dynamics::Integrator::Euler);
    /// RK4 with the default number of substeps.
    pub const RK4: Self = Self(dynamics::Integrator::RK4);
    /// Fewest substeps a node.
    pub const MIN_SUBSTEPS: usize = dynamics::Integrator::MIN_SUBSTEPS;
    /// Most substeps a node.
    pub const MAX_SUBSTEPS: usize = dynamics::Integrator::MAX_SUBSTEPS;

    /// The integrator as the core takes it.
    pub fn core(self) -> dynamics::Integrator {
        self.0
    }
}

impl Default for Integrator {
    fn default() -> Self {
        Self::RK4
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            dynamics::Integrator::Euler => f.write_str("euler"),
            _ if *self == Self::RK4 => f.write_str("rk4"),
            dynamics::Integrator::Rk4 { substeps } => write!(f, "rk4:{substeps}"),
        }
    }
}

impl FromStr for Integrator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let substeps = match text {
            "euler" => return Ok(Self::EULER),
            "rk4" => return Ok(Self::RK4),
            _ => text.strip_prefix("rk4:").and_then(|m| m.parse::<usize>().ok()),
        };
        match substeps {
            Some(substeps) if substeps < Self::MIN_SUBSTEPS => Err(format!(
                "rk4 needs at least {} substeps a node, not {substeps}",
                Self::MIN_SUBSTEPS
            )),
            Some(substeps) if substeps > Self::MAX_SUBSTEPS => {
                Err(format!("rk4 takes at most {} substeps a node", Self::MAX_SUBSTEPS))
            }
            Some(substeps) => Ok(Self(dynamics::Integrator::Rk4 { substeps })),
            None => Err("expected euler, rk4 or rk4:M with a number M of substeps".into()),
        }
    }
}

impl TryFrom<String> for Integrator {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Integrator> for String {
    fn from(integrator: Integrator) -> Self {
        integrator.to_string()
    }
}

impl Mode {
    /// The mode as the core takes it.
    pub fn core(self) -> stages::Mode {
        match self {
            Self::Optimal => stages::Mode::Optimal,
            Self::Feasible => stages::Mode::Feasible,
        }
    }

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Feasible => "feasible",
        }
    }
}

impl WarmStart {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Model => "model",
            Self::Heuristic => "heuristic",
        }
    }
}

impl Qp {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Embedded => "embedded",
            Self::Clarabel => "clarabel",
        }
    }
}

impl Choice for Mode {
    const ALL: &'static [Self] = &[Self::Optimal, Self::Feasible];

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Optimal => "Minimise the cost",
            Self::Feasible => "Stop at the first feasible plan",
        }
    }
}

impl Choice for WarmStart {
    const ALL: &'static [Self] = &[Self::Auto, Self::Model, Self::Heuristic];

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Auto => {
                "A learned model where there is one for the integrator, otherwise the heuristic"
            }
            Self::Model => {
                "The rollout of a learned model; the heuristic where the rollout is worse or of no use"
            }
            Self::Heuristic => "Track the docking port, move the joints linearly",
        }
    }
}

impl Choice for Qp {
    const ALL: &'static [Self] = &[Self::Embedded, Self::Clarabel];

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Embedded => "The core's own interior-point solver, the one that flies",
            Self::Clarabel => "Clarabel, a sparse interior-point solver",
        }
    }
}

/// Time that a whole plan may take: a positive and finite number of seconds.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Deadline(f64);

// It is never NaN.
impl Eq for Deadline {}

impl Deadline {
    /// The time [s].
    pub fn seconds(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Deadline {
    type Error = String;

    fn try_from(seconds: f64) -> Result<Self, String> {
        match seconds > 0.0 && seconds.is_finite() {
            true => Ok(Self(seconds)),
            false => Err("must be positive and finite".into()),
        }
    }
}

impl From<Deadline> for f64 {
    fn from(deadline: Deadline) -> Self {
        deadline.0
    }
}

impl FromStr for Deadline {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = text.parse::<f64>().map_err(|_| "expected a number of seconds")?;
        Self::try_from(seconds)
    }
}

/// How a plan is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Method {
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Start of Stage 2.
    pub warm_start: WarmStart,
    /// Solver of the subproblems.
    pub qp: Qp,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time for the whole plan; none is as long as it takes. With it, when a plan ends depends on
    /// the machine and its load.
    pub deadline: Option<Deadline>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrators_have_names() {
        for (text, shown) in
            [("euler", "euler"), ("rk4", "rk4"), ("rk4:8", "rk4"), ("rk4:4", "rk4:4")]
        {
            assert_eq!(text.parse::<Integrator>().unwrap().to_string(), shown);
        }
        for text in ["rk4:3", "rk4:0", "rk4:", "rk4:x", "rk4:-4", "rk4:5000", "RK4", "", "rk45"] {
            assert!(text.parse::<Integrator>().is_err(), "{text}");
        }
        assert!("rk4:3".parse::<Integrator>().unwrap_err().contains("at least 4"));
    }

    #[test]
    fn deadlines_are_positive_numbers() {
        for (text, seconds) in [("0.5", 0.5), ("1e-6", 1e-6), ("3", 3.0)] {
            assert_eq!(text.parse::<Deadline>().map(Deadline::seconds), Ok(seconds));
        }
        for text in ["0", "-0", "-1", "nan", "inf", "1e999", "1e-999"] {
            assert_eq!(text.parse::<Deadline>().unwrap_err(), "must be positive and finite");
        }
        for text in ["", "soon", "1s", "1,5", " 1"] {
            assert_eq!(text.parse::<Deadline>().unwrap_err(), "expected a number of seconds");
        }
    }

    #[test]
    fn names_are_those_of_the_files() {
        let json = |value: serde_json::Value| value.as_str().unwrap().to_string();
        for mode in [Mode::Optimal, Mode::Feasible] {
            assert_eq!(json(serde_json::to_value(mode).unwrap()), mode.name());
        }
        for start in [WarmStart::Auto, WarmStart::Model, WarmStart::Heuristic] {
            assert_eq!(json(serde_json::to_value(start).unwrap()), start.name());
        }
        for qp in [Qp::Embedded, Qp::Clarabel] {
            assert_eq!(json(serde_json::to_value(qp).unwrap()), qp.name());
        }
    }
}
