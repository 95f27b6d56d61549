//! Programs that are not numbers: never a success, never without end.

use super::kkt::Kkt;
use super::programs::{Recipe, bits, cold, random};
use remora_qp::{Qp, QpSolver, QpStatus};

pub const N: usize = 5;
pub const NX: usize = 3;
pub const NU: usize = 2;
pub const NG: usize = 2;
pub type Program = Qp<N, NX, NU, NG>;
/// A field: its name, how many numbers it has at a node, and one of them.
pub type Field = (&'static str, usize, fn(&mut Program, usize, usize) -> &mut f64);

pub const AT_NODES: &[Field] = &[
    ("hessian_xx", NX * NX, |qp, k, i| &mut qp.stages[k].hessian_xx[i]),
    ("gradient_x", NX, |qp, k, i| &mut qp.stages[k].gradient_x[i]),
    ("lower_x", NX, |qp, k, i| &mut qp.stages[k].lower_x[i]),
    ("upper_x", NX, |qp, k, i| &mut qp.stages[k].upper_x[i]),
    ("path_jacobian", NG * NX, |qp, k, i| &mut qp.stages[k].path_jacobian[i]),
    ("path_offset", NG, |qp, k, i| &mut qp.stages[k].path_offset[i]),
];

pub const AT_INTERVALS: &[Field] = &[
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
pub fn mistaken<S: QpSolver<N, NX, NU, NG>>(solver: &mut S) -> Vec<String> {
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

/// At the last node nothing about controls and dynamics counts.
pub fn the_last_interval_is_ignored<S: QpSolver<N, NX, NU, NG>>(solver: &mut S) {
    let good = random::<N, NX, NU, NG>(&Recipe::PLAIN);
    let mut other = good.clone();
    for (_, count, field) in AT_INTERVALS {
        (0..*count).for_each(|i| *field(&mut other, N - 1, i) = f64::NAN);
    }
    let (expected, found) = (cold(solver, &good), cold(solver, &other));
    assert_eq!(found.outcome, expected.outcome);
    assert_eq!(bits(&found.point), bits(&expected.point));
}
