//! How a plan is made: mode, warm start, solver of the subproblems and integrator, by the names
//! they have in files and on the command line, and how long it may take.

use crate::choice::{Choice, choices};
pub use remora_core::advanced::model::Integrator;
pub use remora_core::advanced::stages::Mode;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

choices! {
    /// Choice of the initial guess of Stage 2.
    #[derive(Default, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum WarmStart {
        /// A learned model where there is one for the integrator, otherwise the heuristic.
        Auto = "auto",
        /// The rollout of a learned model; the heuristic where the rollout is worse or of no use.
        Model = "model",
        /// Track the docking port, move the joints evenly, light ones late.
        Heuristic = "heuristic" default,
    }
}

choices! {
    /// Solver of the convex subproblems.
    #[derive(Default, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Qp {
        /// The core's own interior-point solver, the one that flies.
        Embedded = "embedded" default,
        /// Clarabel, a sparse interior-point solver.
        Clarabel = "clarabel",
    }
}

impl Choice for Mode {
    const ALL: &'static [Self] = &[Self::Optimal, Self::Feasible];

    fn name(self) -> &'static str {
        Mode::name(self)
    }

    fn help(self) -> &'static str {
        match self {
            Self::Optimal => "Minimise the cost",
            Self::Feasible => "Stop at the first feasible plan",
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
    /// A deadline that only a stopped clock reaches. Records of plans count it as none.
    pub const FAR: Self = Self(1e290);

    /// The time [s].
    pub const fn seconds(self) -> f64 {
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
    /// Initial guess of Stage 2.
    pub warm_start: WarmStart,
    /// Solver of the subproblems.
    pub qp: Qp,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time for the whole plan; none is as long as it takes. With it, when a plan ends depends on
    /// the machine and its load.
    pub deadline: Option<Deadline>,
    /// Whether Stage 2 converges to a far smaller cost tolerance than plans need: for plans to learn
    /// from.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub sharp: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

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
