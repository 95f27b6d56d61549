//! Stage 1's path between the stages, shown to the solver for fault injection.

use crate::stages::{NODES, TranslationTrajectory};
use remora_qp::kept::{Kept, Part};

/// The path.
pub(super) struct Path<'a>(pub &'a mut TranslationTrajectory<NODES>);

impl Kept for Path<'_> {
    fn number(&mut self, part: Part, node: usize, element: usize) -> Option<&mut f64> {
        (part == Part::Path).then(|| self.0.number(node, element)).flatten()
    }
}
