//! QPs whose last states and controls are padding.
//!
//! A planner solves QPs of several sizes with one solver's memory, the smaller ones padded with zeros. Products
//! with these zeros change no bit of a result, so the loops over columns leave them out: they are compiled for
//! the sizes of a translation besides the full ones.

use crate::QpStage;

/// The first `S` states and `C` controls. As an argument it says which sizes a function is compiled for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leading<const S: usize, const C: usize>;

/// Those of a translation: position, velocity and the force before; force.
pub(super) const TRANSLATION: Leading<9, 3> = Leading;

impl<const S: usize, const C: usize> Leading<S, C> {
    /// Whether no other state or control enters the dynamics or the cross cost of any stage but the last. NaN
    /// enters. Cost: a few comparisons where others do, else up to `N (NX + NU) (NX + NU)`.
    pub fn are_all_of<const NX: usize, const NU: usize, const NG: usize>(
        self,
        stages: &[QpStage<NX, NU, NG>],
    ) -> bool {
        let to_the_last = stages.len().saturating_sub(1);
        S <= NX && C <= NU && stages[..to_the_last].iter().all(|stage| self.are_all_in(stage))
    }

    /// Whether no other state or control enters the dynamics or the cross cost of one stage.
    fn are_all_in<const NX: usize, const NU: usize, const NG: usize>(
        self,
        stage: &QpStage<NX, NU, NG>,
    ) -> bool {
        let QpStage { a, b, hessian_ux, hessian_uu, .. } = stage;
        is_zero_beyond(&a.data.0, S, S)
            && is_zero_beyond(&b.data.0, S, C)
            && is_zero_beyond(&hessian_ux.data.0, C, S)
            && (C..NU).all(|i| (0..NU).all(|j| i == j || hessian_uu[(i, j)] == 0.0))
    }

    /// Those of `all` that belong to one of the states.
    #[inline(always)]
    pub fn states<T>(self, all: &[T]) -> &[T] {
        all.get(..S).unwrap_or(all)
    }

    /// Those of `all` that belong to one of the controls.
    #[inline(always)]
    pub fn controls<T>(self, all: &[T]) -> &[T] {
        all.get(..C).unwrap_or(all)
    }
}

/// Whether all entries beyond the first `rows` and `columns` are zero.
fn is_zero_beyond<const R: usize>(matrix: &[[f64; R]], rows: usize, columns: usize) -> bool {
    let is_zero = |all: &[f64]| all.iter().all(|entry| *entry == 0.0);
    let (inner, outer) = matrix.split_at(columns.min(matrix.len()));
    outer.iter().all(|column| is_zero(column))
        && inner.iter().all(|column| is_zero(&column[rows.min(R)..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedded::EmbeddedQp;
    use crate::fixed_cases;
    use crate::time::Deadline;
    use crate::{Qp, QpOutcome, QpSolver, QpStatus, Solution};
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    const N: usize = 8;
    const NG: usize = 2;
    type Own = Qp<N, 9, 3, NG>;
    type Padded = Qp<N, 12, 6, NG>;

    /// A QP with hard dynamics of the size of a translation, from numbers between -1 and 1.
    fn own(numbers: &[f64]) -> Own {
        let mut numbers = numbers.iter().copied().cycle();
        let mut next = |size: f64| size * numbers.next().unwrap();
        let mut qp = Own { defect_penalty: f64::INFINITY, path_penalty: 10.0, ..Own::ZERO };
        for (k, stage) in qp.stages.iter_mut().enumerate() {
            let root = SMatrix::<f64, 9, 9>::from_fn(|_, _| next(0.3));
            stage.hessian_xx = root * root.transpose();
            stage.hessian_uu = SMatrix::from_diagonal_element(1.0);
            stage.hessian_ux = SMatrix::from_fn(|_, _| next(0.01));
            stage.a = SMatrix::identity() + SMatrix::from_fn(|_, _| next(0.2));
            stage.b = SMatrix::from_fn(|_, _| next(1.0));
            stage.c = SVector::from_fn(|_, _| next(0.1));
            stage.gradient_x = SVector::from_fn(|_, _| next(1.0));
            stage.gradient_u = SVector::from_fn(|_, _| next(1.0));
            let most = if k == 0 { 0.0 } else { f64::INFINITY };
            (stage.lower_x, stage.upper_x) = (SVector::repeat(-most), SVector::repeat(most));
            (stage.lower_u, stage.upper_u) = (SVector::repeat(-0.5), SVector::repeat(0.5));
            stage.path_jacobian = SMatrix::from_fn(|_, _| next(1.0));
            stage.path_offset = SVector::from_fn(|_, _| next(0.2));
        }
        qp
    }

    /// Pads a QP with three states and controls of zeros: controls fixed, states at the first stage.
    fn padded(own: &Own) -> Padded {
        let mut qp = Padded {
            defect_penalty: own.defect_penalty,
            path_penalty: own.path_penalty,
            ..Padded::ZERO
        };
        for (to, from) in qp.stages.iter_mut().zip(&own.stages) {
            to.hessian_xx.fixed_view_mut::<9, 9>(0, 0).copy_from(&from.hessian_xx);
            to.hessian_ux.fixed_view_mut::<3, 9>(0, 0).copy_from(&from.hessian_ux);
            to.hessian_uu.fixed_view_mut::<3, 3>(0, 0).copy_from(&from.hessian_uu);
            to.a.fixed_view_mut::<9, 9>(0, 0).copy_from(&from.a);
            to.b.fixed_view_mut::<9, 3>(0, 0).copy_from(&from.b);
            to.path_jacobian.fixed_columns_mut::<9>(0).copy_from(&from.path_jacobian);
            to.path_offset = from.path_offset;
            to.c.fixed_rows_mut::<9>(0).copy_from(&from.c);
            to.gradient_x.fixed_rows_mut::<9>(0).copy_from(&from.gradient_x);
            to.gradient_u.fixed_rows_mut::<3>(0).copy_from(&from.gradient_u);
            (to.lower_x, to.upper_x) =
                (SVector::repeat(from.lower_x[0]), SVector::repeat(from.upper_x[0]));
            to.lower_u.fixed_rows_mut::<3>(0).copy_from(&from.lower_u);
            to.upper_u.fixed_rows_mut::<3>(0).copy_from(&from.upper_u);
        }
        qp
    }

    fn solved<const NX: usize, const NU: usize>(
        qp: &Qp<N, NX, NU, NG>,
        leading: bool,
    ) -> (QpOutcome, Solution<N, NX, NU, NG>) {
        let (mut solver, mut solution) = (EmbeddedQp::new(), Solution::ZERO);
        // Numbers that an earlier QP left must not matter.
        solver.fill(0.7);
        solver.reset();
        let outcome = solver.solve(qp, &mut solution, &Deadline::never());
        assert_eq!(solver.is_translation, leading);
        (outcome, solution)
    }

    /// Padding is what lies beyond a translation's sizes; an arm of its size or less has none.
    #[test]
    fn sizes_that_do_not_fit_are_not_padded() {
        let none: [QpStage<9, 3, 1>; 0] = [];
        assert!(TRANSLATION.are_all_of(&none));
        assert!(TRANSLATION.are_all_of(&[QpStage::<9, 3, 1>::ZERO; 2]));
        assert!(!TRANSLATION.are_all_of(&[QpStage::<8, 3, 1>::ZERO; 2]));
        assert!(!TRANSLATION.are_all_of(&[QpStage::<9, 2, 1>::ZERO; 2]));
        assert!(Leading::<2, 1>.are_all_of(&[QpStage::<3, 1, 1>::ZERO; 2]));
        let mut stages = [QpStage::<3, 2, 1>::ZERO; 2];
        stages[0].hessian_uu[(1, 1)] = 5.0;
        assert!(Leading::<2, 1>.are_all_of(&stages));
        stages[0].hessian_uu[(1, 0)] = 5.0;
        assert!(!Leading::<2, 1>.are_all_of(&stages));
    }

    #[test]
    fn leading_columns_are_the_first() {
        let all = [1, 2, 3, 4];
        assert_eq!(
            (Leading::<3, 2>.states(&all), Leading::<3, 2>.controls(&all)),
            (&all[..3], &all[..2])
        );
        // Of fewer than that there are all.
        assert_eq!(
            (Leading::<9, 5>.states(&all), Leading::<9, 5>.controls(&all)),
            (&all[..], &all[..])
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 40, ..fixed_cases() })]

        #[test]
        fn a_padded_qp_has_the_bits_of_its_own_size(
            numbers in proptest::collection::vec(-1.0..1.0f64, 509),
        ) {
            let own = own(&numbers);
            let (outcome, expected) = solved(&own, false);
            let has_two_sizes = cfg!(target_arch = "x86_64");
            let (padded_outcome, solution) = solved(&padded(&own), has_two_sizes);
            prop_assert_eq!(outcome.status, QpStatus::Solved);
            prop_assert_eq!(padded_outcome, outcome);
            for k in 0..N {
                prop_assert_eq!(solution.x[k].fixed_rows::<9>(0), expected.x[k]);
                prop_assert_eq!(solution.u[k].fixed_rows::<3>(0), expected.u[k]);
                let multipliers = solution.defect_multiplier[k].fixed_rows::<9>(0).into_owned();
                prop_assert_eq!(multipliers, expected.defect_multiplier[k]);
                prop_assert_eq!(solution.path_multiplier[k], expected.path_multiplier[k]);
                prop_assert_eq!(solution.x[k].fixed_rows::<3>(9), SVector::<f64, 3>::zeros());
            }
        }

        /// One number of the padding, NaN too, and nothing is padding any more; of the last stage, which has
        /// no dynamics, none counts.
        #[test]
        fn whatever_enters_is_seen(
            k in 0..N,
            (row, column) in (0usize..12, 0usize..12),
            value in prop_oneof![Just(f64::NAN), Just(1e-300), Just(-1.0)],
        ) {
            let sound = padded(&own(&[0.5, -0.25, 0.75]));
            prop_assert!(TRANSLATION.are_all_of(&sound.stages));
            let (is_state, is_control) = (row.max(column) >= 9, |u: usize, x: usize| u >= 3 || x >= 9);
            let seen = |change: &dyn Fn(&mut QpStage<12, 6, NG>)| {
                let mut qp = sound.clone();
                change(&mut qp.stages[k]);
                k + 1 < N && !TRANSLATION.are_all_of(&qp.stages)
            };
            let counts = k + 1 < N;
            prop_assert_eq!(seen(&|stage| stage.a[(row, column)] = value), counts && is_state);
            let (u, x) = (column % 6, row);
            prop_assert_eq!(seen(&|stage| stage.b[(x, u)] = value), counts && is_control(u, x));
            prop_assert_eq!(seen(&|stage| stage.hessian_ux[(u, x)] = value), counts && is_control(u, x));
            let (i, j) = (row % 6, column % 6);
            let is_cross = i != j && i.max(j) >= 3;
            let both = |stage: &mut QpStage<12, 6, NG>| {
                (stage.hessian_uu[(i, j)], stage.hessian_uu[(j, i)]) = (value, value);
            };
            prop_assert_eq!(seen(&both), counts && is_cross);
        }
    }
}
