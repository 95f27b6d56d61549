//! Tiny programs against all active sets in turn.

use super::common::kkt::{Kkt, distance, objective};
use super::common::programs::{Recipe, cold, embedded, random};
use super::reference::{Dense, point, value};
use remora_qp::QpStatus;

/// Programs of `seeds`: how many of them have a solution.
fn agree<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    recipe: Recipe,
    seeds: u64,
) {
    for seed in 0..seeds {
        let qp = random::<N, NX, NU, NG>(&Recipe { seed, ..recipe });
        let exact = Dense::of(&qp).by_all_active_sets();
        let exact = exact.unwrap_or_else(|| panic!("{seed}: no active set is optimal"));
        let answer = cold(&mut *embedded(), &qp);
        assert_eq!(answer.outcome.status, QpStatus::Solved, "{seed}");
        let kkt = Kkt::of(&qp, &answer.point);
        assert!(kkt.worst() <= 1e-8, "{seed}: {kkt:?}");
        let apart = distance(&answer.point, &point(&exact));
        assert!(apart <= 1e-6, "{seed}: {apart:e}");
        let (ours, least) = (objective(&qp, &answer.point), value(&qp, &exact));
        assert!((ours - least).abs() <= 1e-9 * (1.0 + least.abs()), "{seed}: {ours} {least}");
    }
}

#[test]
fn soft_dynamics_and_rows() {
    let tight = Recipe { width: 0.3, slope: 3.0, ..Recipe::PLAIN };
    agree::<2, 2, 1, 1>(tight, 25);
    agree::<3, 1, 1, 0>(tight, 25);
    agree::<2, 1, 2, 2>(Recipe { open: 0.5, ..tight }, 25);
}

#[test]
fn hard_dynamics() {
    let tight = Recipe { width: 0.5, slope: 3.0, ..Recipe::HARD };
    agree::<3, 1, 2, 1>(tight, 15);
    agree::<3, 2, 1, 0>(tight, 25);
}
