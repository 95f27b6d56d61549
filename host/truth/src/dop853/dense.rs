use super::State;
use super::coefficients::{DENSE, Row};

/// The solution within one step, a polynomial of degree seven.
#[derive(Clone, Debug)]
pub struct Segment<S> {
    /// Where the step begins [s].
    pub start: f64,
    /// Where it ends [s].
    pub end: f64,
    before: S,
    /// Hairer's `rcont2..8`.
    terms: [S; 7],
}

/// Weights of the first three terms, over (step, slope before, slope after).
const CHORD: Row = &[(0, 1.0)];
const LEFT: Row = &[(1, 1.0), (0, -1.0)];
const RIGHT: Row = &[(0, 2.0), (1, -1.0), (2, -1.0)];

impl<S: State> Segment<S> {
    pub(super) fn new(start: f64, end: f64, before: &S, after: &S, slopes: &[S; 16]) -> Self {
        let step = end - start;
        let chord = after.moved(-1.0, &[(0, 1.0)], core::slice::from_ref(before));
        let scaled =
            |stage| S::ZERO.moved(step, &[(0, 1.0)], core::slice::from_ref(&slopes[stage]));
        let ends = [chord, scaled(0), scaled(12)];
        let mut terms = [S::ZERO; 7];
        for (term, row) in terms.iter_mut().zip([CHORD, LEFT, RIGHT]) {
            *term = S::ZERO.moved(1.0, row, &ends);
        }
        for (term, row) in terms[3..].iter_mut().zip(DENSE) {
            *term = S::ZERO.moved(step, row, slopes);
        }
        Self { start, end, before: *before, terms }
    }

    /// The polynomial's weights at a time [s].
    fn weights(&self, time: f64) -> [f64; 7] {
        let x = (time - self.start) / (self.end - self.start);
        let mut weights = [x; 7];
        for i in 1..7 {
            weights[i] = weights[i - 1] * if i % 2 == 1 { 1.0 - x } else { x };
        }
        weights
    }

    /// The state at a time [s] within the step.
    pub fn at(&self, time: f64) -> S {
        let weights = self.weights(time);
        let rows = core::array::from_fn::<_, 7, _>(|i| (i, weights[i]));
        rows.iter().fold(self.before, |sum, &(i, weight)| {
            sum.moved(weight, &[(0, 1.0)], core::slice::from_ref(&self.terms[i]))
        })
    }
}

impl<const N: usize> Segment<[f64; N]> {
    /// `K` components from the `first` on at a time [s] within the step.
    #[inline]
    pub fn part<const K: usize>(&self, first: usize, time: f64) -> [f64; K] {
        let weights = self.weights(time);
        let mut sum = [0.0; K];
        for (weight, term) in weights.iter().zip(&self.terms) {
            for i in 0..K {
                sum[i] += weight * term[first + i];
            }
        }
        for i in 0..K {
            sum[i] += self.before[first + i];
        }
        sum
    }
}
