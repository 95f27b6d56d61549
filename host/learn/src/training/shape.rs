//! Sizes of what a network learns.

/// Numbers of an action.
pub const ACTION: usize = remora_core::advanced::warmstart::ACTION;

/// What examples look like.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Nodes of a trajectory; an action leads from each to the next.
    pub nodes: usize,
    /// Features of a node by group: previous action, time, target, centre of mass, state.
    pub groups: Vec<usize>,
    /// Numbers of a next state.
    pub states: usize,
}

impl Shape {
    /// Features of a node.
    pub fn features(&self) -> usize {
        self.groups.iter().sum()
    }

    /// Actions of a trajectory.
    pub fn steps(&self) -> usize {
        self.nodes - 1
    }
}
