//! State that an SCP solver keeps from one QP to the next, for tools that inject faults.

/// A part of the state that an SCP solver keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// The trajectory that the next QP is made at.
    Iterate,
    /// The best feasible trajectory, where it is another.
    Best,
    /// Residuals of the iterate.
    Residuals,
    /// Multipliers of the last QP.
    Multipliers,
    /// Radius, weights and what else is one number each.
    Scalars,
    /// A stage's result that the next stage goes by.
    Path,
}

/// Access to the state that an SCP solver keeps, number by number.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_counted_through_all_vectors() {
        let (mut first, mut second) = ([1.0, 2.0], [3.0]);
        for (element, expected) in [(0, Some(1.0)), (1, Some(2.0)), (2, Some(3.0)), (3, None)] {
            let found = nth([&mut first[..], &mut second[..]], element).copied();
            assert_eq!(found, expected);
        }
        *nth([&mut first[..], &mut second[..]], 2).unwrap() = 9.0;
        assert_eq!(second, [9.0]);
    }
}
