//! Programs that are not numbers: never a success, never without end.

use super::common::kkt::Kkt;
use super::common::programs::{Recipe, bits, cold, embedded, next, random};
use super::common::unsound::{N, NG, NU, NX, mistaken, the_last_interval_is_ignored};
use remora_qp::QpStatus;

// Verifies REM-QP-002.
#[test]
fn what_is_not_a_number_is_not_solved() {
    let mistaken = mistaken(&mut *embedded::<N, NX, NU, NG>());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

#[test]
fn the_last_nodes_control_is_ignored() {
    the_last_interval_is_ignored(&mut *embedded());
}

#[test]
fn a_solver_recovers_from_a_program_that_is_none() {
    let good = random::<N, NX, NU, NG>(&Recipe::PLAIN);
    let mut solver = embedded();
    let expected = cold(&mut *solver, &good);
    let mut bad = good.clone();
    bad.stages[1].a[0] = f64::NAN;
    let failed = next(&mut *solver, &bad, &expected);
    assert!(!failed.outcome.status.is_usable());
    // Whatever it left behind is what the loop hands over next, without a reset.
    let again = next(&mut *solver, &good, &failed);
    assert_eq!(again.outcome, expected.outcome);
    assert_eq!(again.outcome.status, QpStatus::Solved);
    assert_eq!(bits(&again.point), bits(&expected.point));
    assert!(Kkt::of(&good, &again.point).worst() <= 1e-8);
    let after = cold(&mut *solver, &good);
    assert_eq!(bits(&after.point), bits(&expected.point));
}

#[test]
fn what_the_point_holds_on_entry_changes_no_bit() {
    let good = random::<N, NX, NU, NG>(&Recipe::PLAIN);
    let mut solver = embedded();
    let expected = cold(&mut *solver, &good);
    assert_eq!(expected.outcome.status, QpStatus::Solved);
    assert!(Kkt::of(&good, &expected.point).worst() <= 1e-8);
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
        for field in 0..6 {
            let mut start = expected.clone();
            let point = &mut *start.point;
            match field {
                0 => point.x[1][0] = value,
                1 => point.u[1][0] = value,
                2 => point.defect_multiplier[2][1] = value,
                3 => point.bound_multiplier_x[3][1] = value,
                4 => point.bound_multiplier_u[2][1] = value,
                _ => point.path_multiplier[2][1] = value,
            }
            let answer = next(&mut *solver, &good, &start);
            assert_eq!(answer.outcome, expected.outcome, "{value} in field {field}");
            assert_eq!(bits(&answer.point), bits(&expected.point), "{value} in field {field}");
        }
    }
}
