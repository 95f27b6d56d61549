//! What a loop keeps from one program to the next, as tools reach it that inject faults.

/// A part of what a loop keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// The trajectory that the next program is made at.
    Iterate,
    /// The best feasible trajectory, where it is another.
    Best,
    /// Residuals of the iterate.
    Residuals,
    /// Multipliers of the last program.
    Multipliers,
    /// Radius, weights and what else is one number each.
    Scalars,
    /// A stage's result that the next stage goes by.
    Path,
}

/// What a loop keeps, number by number.
pub trait Kept {
    /// Number `element` of a part at a node; none where there is none.
    fn number(&mut self, part: Part, node: usize, element: usize) -> Option<&mut f64>;
}

/// Number `element` of vectors one after the other.
pub fn nth<'a>(
    vectors: impl IntoIterator<Item = &'a mut [f64]>,
    element: usize,
) -> Option<&'a mut f64> {
    vectors.into_iter().flatten().nth(element)
}
