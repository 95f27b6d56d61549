//! Sizes of what a network learns.

use crate::config::Model;
use remora_core::advanced::nn;

/// Shape of examples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Nodes of a trajectory; an action leads from each to the next.
    pub nodes: usize,
    /// Features of a node by group: previous action, which says how many numbers one has, time, target,
    /// centre of mass, state.
    pub groups: Vec<usize>,
    /// Numbers of a next state.
    pub states: usize,
    /// Nodes from one that a network sees to the next.
    pub stride: usize,
}

impl Shape {
    /// That of trajectories of an arm of so many joints, as a network sees them.
    pub fn of(model: &Model, nodes: usize, joints: usize) -> Self {
        let groups = model.encoding.groups(joints);
        Self { nodes, groups: groups.to_vec(), states: groups[4], stride: model.stride() }
    }

    /// Numbers of an action.
    pub fn action(&self) -> usize {
        self.groups.first().copied().unwrap_or_default()
    }

    /// Features of a node.
    pub fn features(&self) -> usize {
        self.groups.iter().sum()
    }

    /// Actions of a trajectory.
    pub fn steps(&self) -> usize {
        self.nodes - 1
    }

    /// Nodes of a trajectory that a network sees: all but the last, or the first of each chunk.
    pub fn seen(&self) -> usize {
        nn::seen(self.nodes, self.stride)
    }
}
