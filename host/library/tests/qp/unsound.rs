//! Programs that are not numbers: never a success, never without end.

use super::programs::{Recipe, bits, cold, embedded, next, random};
use remora_core::advanced::qp::{Qp, QpSolver, QpStatus};
use remora_host::backend::ClarabelQp;
use remora_host::kkt::Kkt;

const N: usize = 5;
const NX: usize = 3;
const NU: usize = 2;
const NG: usize = 2;
type Program = Qp<N, NX, NU, NG>;
/// A field: its name, how many numbers it has at a node, and one of them.
type Field = (&'static str, usize, fn(&mut Program, usize, usize) -> &mut f64);

const AT_NODES: &[Field] = &[
    ("hessian_xx", NX * NX, |qp, k, i| &mut qp.stages[k].hessian_xx[i]),
    ("gradient_x", NX, |qp, k, i| &mut qp.stages[k].gradient_x[i]),
    ("lower_x", NX, |qp, k, i| &mut qp.stages[k].lower_x[i]),
    ("upper_x", NX, |qp, k, i| &mut qp.stages[k].upper_x[i]),
    ("path_jacobian", NG * NX, |qp, k, i| &mut qp.stages[k].path_jacobian[i]),
    ("path_offset", NG, |qp, k, i| &mut qp.stages[k].path_offset[i]),
];

const AT_INTERVALS: &[Field] = &[
    ("hessian_ux", NU * NX, |qp, k, i| &mut qp.stages[k].hessian_ux[i]),
    ("hessian_uu", NU * NU, |qp, k, i| &mut qp.stages[k].hessian_uu[i]),
    ("gradient_u", NU, |qp, k, i| &mut qp.stages[k].gradient_u[i]),
    ("lower_u", NU, |qp, k, i| &mut qp.stages[k].lower_u[i]),
    ("upper_u", NU, |qp, k, i| &mut qp.stages[k].upper_u[i]),
    ("a", NX * NX, |qp, k, i| &mut qp.stages[k].a[i]),
    ("b", NX * NU, |qp, k, i| &mut qp.stages[k].b[i]),
    ("c", NX, |qp, k, i| &mut qp.stages[k].c[i]),
];

const OF_THE_WHOLE: &[Field] = &[
    ("constant", 1, |qp, _, _| &mut qp.constant),
    ("defect_penalty", 1, |qp, _, _| &mut qp.defect_penalty),
    ("path_penalty", 1, |qp, _, _| &mut qp.path_penalty),
];

/// Every number of every field at the first, a middle and the last node that has it.
fn every_number() -> impl Iterator<Item = (&'static Field, usize, usize)> {
    let nodes: [(&[Field], &[usize]); 3] =
        [(AT_NODES, &[0, 2, N - 1]), (AT_INTERVALS, &[0, 2, N - 2]), (OF_THE_WHOLE, &[0])];
    nodes.into_iter().flat_map(|(fields, nodes)| {
        fields.iter().flat_map(move |field| {
            nodes.iter().flat_map(move |k| (0..field.1).map(move |i| (field, *k, i)))
        })
    })
}

/// Infinities that mean something: no bound, hard dynamics.
fn is_allowed(field: &str, value: f64) -> bool {
    match field {
        "lower_x" | "lower_u" => value == f64::NEG_INFINITY,
        "upper_x" | "upper_u" | "defect_penalty" => value == f64::INFINITY,
        _ => false,
    }
}

/// NaN and infinity in every number in turn: those that are taken for a success, and those that
/// mean something and are answered wrongly.
fn mistaken<S: QpSolver<N, NX, NU, NG>>(solver: &mut S) -> Vec<String> {
    let mut mistaken = Vec::new();
    for recipe in [Recipe { seed: 5, ..Recipe::PLAIN }, Recipe { seed: 5, ..Recipe::HARD }] {
        let good = random::<N, NX, NU, NG>(&recipe);
        assert_eq!(cold(solver, &good).outcome.status, QpStatus::Solved);
        for ((name, _, field), k, i) in every_number() {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut bad = good.clone();
                *field(&mut bad, k, i) = value;
                let answer = cold(solver, &bad);
                // What means something may still make another kind of program.
                let is_right =
                    is_allowed(name, value) && Kkt::of(&bad, &answer.point).worst() < 1e-6;
                if answer.outcome.status.is_usable() && !is_right {
                    let line = format!("{value} in {name}[{i}] of node {k}: {:?}", answer.outcome);
                    mistaken.push(line);
                }
            }
        }
    }
    mistaken
}

// Verifies REM-QP-002.
#[test]
fn what_is_not_a_number_is_not_solved() {
    let mistaken = mistaken(&mut *embedded::<N, NX, NU, NG>());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

#[test]
fn clarabel_solves_no_such_program_either() {
    let mistaken = mistaken(&mut ClarabelQp::default());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

/// At the last node nothing about controls and dynamics counts.
fn the_last_interval_is_ignored<S: QpSolver<N, NX, NU, NG>>(solver: &mut S) {
    let good = random::<N, NX, NU, NG>(&Recipe::PLAIN);
    let mut other = good.clone();
    for (_, count, field) in AT_INTERVALS {
        (0..*count).for_each(|i| *field(&mut other, N - 1, i) = f64::NAN);
    }
    let (expected, found) = (cold(solver, &good), cold(solver, &other));
    assert_eq!(found.outcome, expected.outcome);
    assert_eq!(bits(&found.point), bits(&expected.point));
}

#[test]
fn the_last_nodes_control_is_ignored() {
    the_last_interval_is_ignored(&mut *embedded());
    the_last_interval_is_ignored(&mut ClarabelQp::default());
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
