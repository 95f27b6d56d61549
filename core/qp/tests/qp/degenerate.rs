//! Programs at the edge: without interior, with everything active, without curvature, without a
//! solution.

use super::common::edge::{N, NU, NX, SOLVABLE, UNSOLVABLE, flaws, made, mistaken};
use super::common::programs::{cold, embedded};
use remora_qp::QpStatus;

#[test]
fn programs_without_interior_or_curvature_are_solved() {
    let flaws = flaws(&mut *embedded::<N, NX, NU, 1>(), 1e-8);
    assert!(flaws.is_empty(), "{} of {}\n{}", flaws.len(), SOLVABLE.len(), flaws.join("\n"));
}

// Verifies REM-QP-002.
#[test]
fn programs_without_a_solution_are_no_success() {
    let mistaken = mistaken(&mut *embedded::<N, NX, NU, 1>());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

#[test]
fn infeasible_programs_are_named_within_forty_iterations() {
    for (case, expected) in UNSOLVABLE {
        let outcome = cold(&mut *embedded::<N, NX, NU, 1>(), &made(case)).outcome;
        println!("{}: {outcome:?}", case.0);
        assert!(
            *expected != Some(QpStatus::Infeasible) || outcome.iterations <= 40,
            "{}: {outcome:?}",
            case.0
        );
    }
}
