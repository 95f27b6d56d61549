//! Random feasible programs of several sizes: optimality of the embedded solver's answers, and
//! agreement with Clarabel's.

use super::common::kkt::distance;
use super::common::programs::{Recipe, cases, cold, embedded, random, recipes};
use super::polish::polish;
use proptest::prelude::*;
use remora_core::advanced::qp::QpStatus;
use remora_host::backend::ClarabelQp;
use remora_host::kkt::{Kkt, objective};

/// Clarabel at the accuracy it is used with.
fn clarabel_is_optimal<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    recipe: &Recipe,
) -> Result<(), TestCaseError> {
    let qp = random::<N, NX, NU, NG>(recipe);
    let answer = cold(&mut ClarabelQp::default(), &qp);
    let kkt = Kkt::of(&qp, &answer.point);
    prop_assert_eq!(answer.outcome.status, QpStatus::Solved, "{:?}", kkt);
    // Its criteria are relative to the sizes of the numbers that occur.
    prop_assert!(kkt.worst() < 1e-6, "{:?}", kkt);
    Ok(())
}

/// The embedded solver: optimal, and the same as Clarabel's point made exact.
fn embedded_is_optimal<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    recipe: &Recipe,
) -> Result<(), TestCaseError> {
    let qp = random::<N, NX, NU, NG>(recipe);
    let ours = cold(&mut *embedded(), &qp);
    let kkt = Kkt::of(&qp, &ours.point);
    // Sixty nodes of random, unstable dynamics: about one in a hundred ends at reduced accuracy. It
    // must say so, and keep to what that means.
    if N >= 60 && ours.outcome.status == QpStatus::ReducedAccuracy {
        prop_assert!(kkt.stationarity.max(kkt.primal) <= 1e-6, "{:?}", kkt);
        return Ok(());
    }
    prop_assert_eq!(ours.outcome.status, QpStatus::Solved, "{:?} {:?}", ours.outcome, kkt);
    prop_assert!(kkt.worst() <= 1e-8, "{:?}", kkt);

    let theirs = cold(&mut ClarabelQp::with_tolerance(1e-12), &qp);
    let Some(exact) = polish(&qp, &theirs.point) else {
        return Err(TestCaseError::reject("no exact solution"));
    };
    let (a, b) = (objective(&qp, &ours.point), objective(&qp, &exact));
    prop_assert!((a - b).abs() <= 1e-8 * (1.0 + b.abs()), "{} {}", a, b);
    let apart = distance(&ours.point, &exact);
    prop_assert!(apart <= 1e-6, "{:e} with {:?}", apart, kkt);
    Ok(())
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn clarabel_solves_random_programs(recipe in recipes()) {
        clarabel_is_optimal::<2, 1, 1, 1>(&recipe)?;
        clarabel_is_optimal::<6, 3, 2, 1>(&recipe)?;
        clarabel_is_optimal::<5, 4, 1, 0>(&recipe)?;
        clarabel_is_optimal::<8, 2, 3, 2>(&recipe)?;
    }

    #[test]
    fn the_smallest_programs(recipe in recipes()) {
        embedded_is_optimal::<2, 1, 1, 1>(&recipe)?;
    }

    #[test]
    fn small_programs(recipe in recipes()) {
        embedded_is_optimal::<6, 3, 2, 1>(&recipe)?;
    }

    #[test]
    fn more_states_than_controls_reach_and_no_rows(recipe in recipes()) {
        embedded_is_optimal::<5, 4, 1, 0>(&recipe)?;
    }

    #[test]
    fn more_controls_than_states_and_several_rows(recipe in recipes()) {
        embedded_is_optimal::<8, 2, 3, 2>(&recipe)?;
    }
}

proptest! {
    #![proptest_config(cases(8))]

    #[test]
    fn the_size_of_stage_1(recipe in recipes()) {
        embedded_is_optimal::<60, 9, 3, 1>(&recipe)?;
    }

    #[test]
    fn the_size_of_stage_2(recipe in recipes()) {
        embedded_is_optimal::<60, 12, 6, 1>(&recipe)?;
    }

    #[test]
    fn four_links_and_a_longer_horizon(recipe in recipes()) {
        embedded_is_optimal::<90, 14, 7, 2>(&recipe)?;
    }
}
