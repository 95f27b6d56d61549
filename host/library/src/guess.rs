//! Initial guesses of Stage 2, for an engine of any size.

use crate::formats::{MAX_JOINTS, Motion};
use crate::learned::Learned;
use remora_core::advanced::planner::Nominal;

/// Initial guess of Stage 2. The heuristic replaces one that is worse.
#[derive(Clone, Copy)]
pub enum Guess<'a> {
    /// The heuristic.
    Heuristic,
    /// The rollout of a learned model.
    Model(&'a Learned),
    /// A motion of the caller's.
    Given(&'a Motion),
    /// The rest of a nominal plan, from this time after its first node [s].
    Left(&'a Nominal<MAX_JOINTS>, f64),
}

impl<'a> From<Option<&'a Learned>> for Guess<'a> {
    /// The model's rollout; the heuristic where there is no model.
    fn from(model: Option<&'a Learned>) -> Self {
        model.map_or(Self::Heuristic, Self::Model)
    }
}

impl<'a> Guess<'a> {
    /// The model, where it is one.
    pub fn model(&self) -> Option<&'a Learned> {
        match self {
            Self::Model(model) => Some(model),
            _ => None,
        }
    }
}
