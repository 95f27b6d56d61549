//! Random feasible programs of several sizes against the optimality conditions.

use super::common::kkt::Kkt;
use super::common::programs::{Recipe, cold, embedded, random};
use remora_qp::QpStatus;

fn are_optimal<const N: usize, const NX: usize, const NU: usize, const NG: usize>(seeds: u64) {
    let mut reduced = 0;
    for seed in 0..seeds {
        // Few and many bounds, flat and curved, near and far, in turn.
        let of = |divisor: u64, values: [f64; 3]| values[(seed / divisor % 3) as usize];
        let recipe = Recipe {
            seed,
            soft: seed % 2 == 0,
            open: of(2, [0.0, 0.2, 0.5]),
            curvature: of(3, [0.01, 0.3, 3.0]),
            width: of(5, [0.03, 0.5, 5.0]),
            slope: of(7, [0.3, 1.0, 5.0]),
        };
        let qp = random::<N, NX, NU, NG>(&recipe);
        let answer = cold(&mut *embedded(), &qp);
        let kkt = Kkt::of(&qp, &answer.point);
        assert!(answer.outcome.status.is_usable(), "{recipe:?} {kkt:?}");
        reduced += u32::from(answer.outcome.status != QpStatus::Solved);
        assert!(kkt.worst() <= 1e-8, "{recipe:?} {kkt:?}");
    }
    // Rounding may end it where little is left to do.
    assert!(reduced <= 1, "{reduced}");
}

#[test]
fn of_two_stages() {
    are_optimal::<2, 1, 1, 1>(200);
}

#[test]
fn of_a_few_stages() {
    are_optimal::<6, 3, 2, 1>(100);
    are_optimal::<5, 4, 1, 0>(100);
    are_optimal::<8, 2, 3, 2>(100);
}

#[test]
fn of_a_planner_s_size() {
    are_optimal::<20, 9, 3, 1>(6);
    are_optimal::<20, 12, 6, 1>(6);
}
