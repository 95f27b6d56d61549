//! Programs without limits against one linear system, and the gains against its derivative.

use super::common::kkt::distance;
use super::common::programs::{Recipe, cold, embedded, random};
use super::reference::{Dense, point};
use remora_qp::{Qp, QpSolver, QpStatus};

/// A program whose only limits are the first state, and the last as far as one control reaches.
fn unlimited<const N: usize, const NX: usize, const NU: usize>(seed: u64) -> Box<Qp<N, NX, NU, 0>> {
    random(&Recipe { seed, open: 1.0, ..Recipe::HARD })
}

fn agrees<const N: usize, const NX: usize, const NU: usize>() {
    for seed in 0..20 {
        let qp = unlimited::<N, NX, NU>(seed);
        let answer = cold(&mut *embedded(), &qp);
        assert_eq!(answer.outcome.status, QpStatus::Solved, "{seed}");
        // Newton's method solves linear equations in one step; another one may remove rounding.
        assert!((1..=2).contains(&answer.outcome.iterations), "{seed}: {:?}", answer.outcome);
        let exact = point(&Dense::of(&qp).equations());
        let apart = distance(&answer.point, &exact);
        assert!(apart <= 1e-9, "{seed}: {apart:e}");
    }
}

#[test]
fn without_limits_one_linear_system_has_the_answer() {
    agrees::<2, 1, 1>();
    agrees::<5, 3, 2>();
    agrees::<7, 4, 1>();
    agrees::<4, 2, 4>();
    agrees::<4, 12, 6>();
    agrees::<3, 13, 5>();
}

/// The control follows the state linearly: gains say how much.
#[test]
fn gains_are_the_derivative_of_the_control_by_the_state() {
    const N: usize = 6;
    for seed in 0..5 {
        let qp = unlimited::<N, 3, 2>(seed);
        let mut solver = embedded();
        assert!(solver.gain(0).is_none());
        cold(&mut *solver, &qp);
        let from = point::<N, 3, 2, 0>(&Dense::of(&qp).equations());
        for i in 0..3 {
            let mut moved = qp.clone();
            let first = &mut moved.stages[0];
            first.lower_x[i] += 1.0;
            first.upper_x[i] += 1.0;
            let to = point::<N, 3, 2, 0>(&Dense::of(&moved).equations());
            for k in 0..N - 1 {
                let (dx, du) = (to.x[k] - from.x[k], to.u[k] - from.u[k]);
                // The last control alone steers what is fixed at the end: barriers of 1e8 stand for that.
                let error = (solver.gain(k).unwrap() * dx - du).norm();
                assert!(error <= 1e-6 * (1.0 + du.norm()), "{seed} {i} {k}: {error:e}");
            }
        }
        assert!(solver.gain(N - 1).is_none() && solver.gain(N).is_none());
        solver.reset();
        assert!(solver.gain(0).is_none());
    }
}
