//! Starts from what is known: the same answers, and hardly ever more work.

use super::programs::{Answer, Recipe, cases, cold, embedded, random, recipes, warm};
use proptest::prelude::*;
use remora_core::advanced::qp::{EmbeddedQp, Qp, QpSolver, QpStatus};
use remora_core::advanced::time::Deadline;
use remora_host::kkt::{Kkt, distance, objective};

const N: usize = 12;
const NX: usize = 4;
const NU: usize = 2;
type Program = Qp<N, NX, NU, 1>;
type Found = Answer<N, NX, NU, 1>;
type Solver = EmbeddedQp<N, NX, NU, 1>;

/// Most iterations of a warm start, for those of a cold one: one that leads nowhere is given up
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
    let activity = a.activity + b.activity;
    prop_assert!(apart <= 1e-6 + 10.0 * activity, "{:e} with {:?} {:?}", apart, a, b);
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

fn warm_starts_hold(recipe: &Recipe) -> Result<(), TestCaseError> {
    let qp = random::<N, NX, NU, 1>(recipe);
    let mut solver: Box<Solver> = embedded();
    let expected = cold(&mut *solver, &qp);
    let most = allowed(expected.outcome.iterations);

    let again = warm(&mut *solver, &qp, &expected);
    same(&qp, &again, &expected)?;
    prop_assert!(again.outcome.iterations <= most, "{} {}", again.outcome.iterations, most);

    // Multipliers of another program tell nothing, or something wrong.
    let other = cold(&mut *solver, &random(&Recipe { seed: recipe.seed ^ 7, ..*recipe }));
    let misled = warm(&mut *solver, &qp, &other);
    same(&qp, &misled, &expected)?;
    prop_assert!(misled.outcome.iterations <= most, "{} {}", misled.outcome.iterations, most);
    Ok(())
}

fn corrections_hold(recipe: &Recipe, share: f64) -> Result<(), TestCaseError> {
    let qp = random::<N, NX, NU, 1>(recipe);
    let changed = corrected(&qp, recipe, share);
    let expected = cold(&mut *embedded(), &changed);
    let mut solver: Box<Solver> = embedded();
    let mut answer = cold(&mut *solver, &qp);
    // The loop hands over a point of its own, which knows nothing.
    *answer.point = remora_core::advanced::qp::Solution::ZERO;
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
    fn warm_starts_give_the_same_answer(recipe in recipes()) {
        warm_starts_hold(&recipe)?;
    }

    #[test]
    fn small_corrections_equal_a_fresh_solve(recipe in recipes()) {
        corrections_hold(&recipe, 1e-3)?;
    }

    #[test]
    fn large_corrections_equal_a_fresh_solve(recipe in recipes()) {
        corrections_hold(&recipe, 0.5)?;
    }
}

/// The feedback gains of the last solve: finite, and one step of Newton's method from the optimum
/// stays there.
#[test]
fn gains_are_finite() {
    let qp = random::<N, NX, NU, 1>(&Recipe::PLAIN);
    let mut solver: Box<Solver> = embedded();
    cold(&mut *solver, &qp);
    for k in 0..N - 1 {
        assert!(solver.gain(k).unwrap().iter().all(|v| v.is_finite()), "{k}");
    }
}
