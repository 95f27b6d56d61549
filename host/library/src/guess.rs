//! What Stage 2 starts from, for an engine of any size.

use crate::formats::{MAX_JOINTS, Motion};
use crate::learned::Learned;
use remora_core::advanced::planner::Nominal;

/// What Stage 2 is to start from. What is given is dropped for the heuristic where that is better.
#[derive(Clone, Copy)]
pub enum Guess<'a> {
    /// The heuristic.
    Heuristic,
    /// The rollout of a learned model.
    Model(&'a Learned),
    /// A motion of the caller's.
    Given(&'a Motion),
    /// What is left of a plan so many seconds after its first node.
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
