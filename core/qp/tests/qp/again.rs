//! Second-order corrections, and the gains that a solution leaves: the same answers, and hardly ever more work.

use super::common::kkt::{Kkt, distance, objective};
use super::common::programs::{Answer, Recipe, cases, cold, embedded, random, recipes};
use proptest::prelude::*;
use remora_qp::time::Deadline;
use remora_qp::{EmbeddedQp, Qp, QpSolver, QpStatus};

const N: usize = 12;
const NX: usize = 4;
const NU: usize = 2;
type Program = Qp<N, NX, NU, 1>;
type Found = Answer<N, NX, NU, 1>;
type Solver = EmbeddedQp<N, NX, NU, 1>;

/// Most iterations of a correction, for those of a cold start: one that leads nowhere is given up
/// after 15.
fn allowed(cold: u32) -> u32 {
    cold + 15
}

fn same(qp: &Program, found: &Found, expected: &Found) -> Result<(), TestCaseError> {
    let (a, b) = (Kkt::of(qp, &found.point), Kkt::of(qp, &expected.point));
    prop_assert_eq!(found.outcome.status, QpStatus::Solved, "{:?} {:?}", found.outcome, a);
    prop_assert!(a.worst() <= 1e-8, "{:?}", a);
    let (f, g) = (objective(qp, &found.point), objective(qp, &expected.point));
    prop_assert!((f - g).abs() <= 1e-8 * (1.0 + g.abs()), "{} {}", f, g);
    let apart = distance(&found.point, &expected.point);
    prop_assert!(apart <= 1e-6, "{:e} with {:?} {:?}", apart, a, b);
    Ok(())
}

/// The same program with other `c`, offsets and gradients.
fn corrected(qp: &Program, recipe: &Recipe, share: f64) -> Box<Program> {
    let other = random::<N, NX, NU, 1>(&Recipe { seed: recipe.seed ^ 1, ..*recipe });
    let mut changed = Box::new(qp.clone());
    for (stage, other) in changed.stages.iter_mut().zip(&other.stages) {
        stage.gradient_x += share * other.gradient_x;
        stage.gradient_u += share * other.gradient_u;
        stage.path_offset += share * other.path_offset;
        if qp.defect_penalty.is_finite() {
            stage.c += share * other.c;
        }
    }
    changed
}

fn corrections_hold(recipe: &Recipe, share: f64) -> Result<(), TestCaseError> {
    let qp = random::<N, NX, NU, 1>(recipe);
    let changed = corrected(&qp, recipe, share);
    let expected = cold(&mut *embedded(), &changed);
    let mut solver: Box<Solver> = embedded();
    let mut answer = cold(&mut *solver, &qp);
    // The loop hands over a point of its own, which knows nothing.
    *answer.point = remora_qp::Solution::ZERO;
    for _ in 0..2 {
        answer.outcome = solver.solve_again(&changed, &mut answer.point, &Deadline::never());
        same(&changed, &answer, &expected)?;
        let most = allowed(expected.outcome.iterations);
        prop_assert!(answer.outcome.iterations <= most, "{:?} {}", answer.outcome, most);
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn small_corrections_equal_a_fresh_solve(recipe in recipes()) {
        corrections_hold(&recipe, 1e-3)?;
    }

    #[test]
    fn large_corrections_equal_a_fresh_solve(recipe in recipes()) {
        corrections_hold(&recipe, 0.5)?;
    }
}

/// The program without limits, with the first state moved by `by`.
fn unlimited(by: f64) -> Box<Program> {
    let mut qp = random::<N, NX, NU, 1>(&Recipe { open: 1.0, ..Recipe::HARD });
    for stage in &mut qp.stages {
        stage.path_offset.fill(-1e6);
    }
    let first = &mut qp.stages[0];
    for bound in [&mut first.lower_x, &mut first.upper_x] {
        for (i, value) in bound.iter_mut().enumerate() {
            *value += by * (1.0 - 0.4 * i as f64);
        }
    }
    qp
}

/// Where no limit is near, the optimal control is an affine function of the state: the gains of one
/// solution say by how much the controls of a disturbed program differ.
#[test]
fn gains_say_what_a_disturbed_start_does() {
    let mut solver: Box<Solver> = embedded();
    let moved = cold(&mut *embedded::<N, NX, NU, 1>(), &unlimited(0.1));
    let found = cold(&mut *solver, &unlimited(0.0));
    for (answer, by) in [(&moved, 0.1), (&found, 0.0)] {
        assert_eq!(answer.outcome.status, QpStatus::Solved);
        assert!(Kkt::of(&unlimited(by), &answer.point).worst() <= 1e-8);
    }
    let mut largest = 0.0f64;
    for k in 0..N - 1 {
        let (dx, du) = (moved.point.x[k] - found.point.x[k], moved.point.u[k] - found.point.u[k]);
        let said = solver.gain(k).unwrap() * dx;
        assert!((said - du).norm() <= 1e-6 * (1.0 + du.norm()), "{k}: {said} {du}");
        largest = largest.max(du.norm());
    }
    assert!(largest > 1e-2, "{largest}: nothing was disturbed");
    assert!(solver.gain(N - 1).is_none());
}
