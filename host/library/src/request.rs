//! Requests for plans: all that a plan depends on but the scenario.

use crate::error::Error;
use crate::formats::{MAX_JOINTS, Mission, Motion, NamedScenario};
use crate::learned::Learned;
use crate::method::{Method, WarmStart};
use crate::threads::Threads;
use remora_core::advanced::model::Refusal;
use remora_core::advanced::planner::Nominal;
use remora_core::advanced::stages::NODES;
use std::path::Path;
use std::sync::Arc;

/// Initial guess of Stage 2, for an arm of any size. The heuristic replaces one that is worse.
#[derive(Clone, Debug, Default)]
pub enum Guess {
    /// The heuristic.
    #[default]
    Heuristic,
    /// The rollout of a learned model.
    Model(Arc<Learned>),
    /// A motion of the caller's.
    Given(Arc<Motion>),
    /// The rest of a nominal plan, from this time after its first node [s].
    Left(Arc<Nominal<MAX_JOINTS>>, f64),
}

impl Guess {
    /// The model, where it is one.
    pub fn model(&self) -> Option<&Learned> {
        match self {
            Self::Model(model) => Some(model),
            _ => None,
        }
    }
}

impl From<Learned> for Guess {
    /// The model's rollout.
    fn from(model: Learned) -> Self {
        Self::Model(Arc::new(model))
    }
}

impl From<Option<Learned>> for Guess {
    /// The model's rollout; the heuristic where there is no model.
    fn from(model: Option<Learned>) -> Self {
        model.map_or(Self::Heuristic, Self::from)
    }
}

/// How plans are to be made. By default for the built-in mission, from the heuristic, on one thread.
#[derive(Clone, Debug, Default)]
pub struct PlanRequest {
    /// The mission; valid.
    pub mission: Mission,
    /// Mode, solver, integrator and deadline.
    pub method: Method,
    /// Initial guess of Stage 2.
    pub guess: Guess,
    /// How many threads work on a plan; the plan stays the same.
    pub threads: Threads,
    /// Whether planning holds constant data against checksums and verifies twice; the plan stays
    /// the same.
    pub is_scrubbed: bool,
}

impl PlanRequest {
    /// A request with the guess that the method asks for: the model in `file`, or the built-in one.
    ///
    /// # Errors
    /// A file that cannot be read, or that has no use.
    pub fn new(mission: Mission, method: Method, file: Option<&Path>) -> Result<Self, Error> {
        let guess = match (method.warm_start, file) {
            (WarmStart::Heuristic, None) => Guess::Heuristic,
            (WarmStart::Heuristic, Some(_)) => {
                let reason = "has no use with --warm-start heuristic";
                return Err(Error::argument("--model", reason));
            }
            (_, Some(file)) => Learned::read(file)?.into(),
            (_, None) => Learned::built_in(method.integrator).into(),
        };
        Ok(Self { mission, method, guess, ..Self::default() })
    }

    /// Reason why a scenario cannot be planned, as far as that is known before planning.
    ///
    /// # Errors
    /// A scenario that is no input at all, by its id.
    pub fn refusal(&self, scenario: &NamedScenario) -> Result<Option<Refusal>, Error> {
        let invalid = |reason| Error::Scenario { id: scenario.id.clone(), reason };
        scenario
            .check_joints(self.mission.joints())
            .map_err(|error| invalid(format!("{}: {}", error.field, error.reason)))?;
        match self.mission.check::<NODES>(&scenario.scenario(), self.method.integrator) {
            Ok(()) => Ok(None),
            Err(refusal) if refusal.is_invalid_input() => Err(invalid(refusal.to_string())),
            Err(refusal) => Ok(Some(refusal)),
        }
    }
}
