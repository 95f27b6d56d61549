//! Programs at the edge and broken ones: Clarabel's answers, and agreement with them.

use super::common::edge::{self, SOLVABLE, made};
use super::common::programs::{Recipe, cold, embedded, random};
use super::common::room::roomy;
use super::common::unsound;
use remora_core::advanced::qp::{QpSolver, Solution};
use remora_core::advanced::time::Deadline;
use remora_host::backend::ClarabelQp;
use remora_host::kkt::{Kkt, objective};

/// A list known to be solvable by two solvers. Clarabel has no name for a box narrower than
/// its accuracy and is not asked to solve those.
#[test]
fn clarabel_solves_them_too() {
    let flaws = edge::flaws(&mut ClarabelQp::default(), 1e-6);
    assert!(flaws.is_empty(), "{} of {}\n{}", flaws.len(), SOLVABLE.len(), flaws.join("\n"));
}

#[test]
fn objectives_agree_where_solutions_are_not_unique() {
    for case in SOLVABLE {
        let qp = made(case);
        let ours = cold(&mut *embedded(), &qp);
        let theirs = cold(&mut ClarabelQp::with_tolerance(1e-11), &qp);
        if Kkt::of(&qp, &theirs.point).worst() < 1e-8 {
            let (a, b) = (objective(&qp, &ours.point), objective(&qp, &theirs.point));
            assert!((a - b).abs() <= 1e-7 * (1.0 + b.abs()), "{}: {a} {b}", case.0);
        }
    }
}

#[test]
fn clarabel_finds_no_solution_either() {
    let mistaken = edge::mistaken(&mut ClarabelQp::default());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

#[test]
fn clarabel_solves_no_such_program_either() {
    let mistaken = unsound::mistaken(&mut ClarabelQp::default());
    assert!(mistaken.is_empty(), "{}", mistaken.join("\n"));
}

#[test]
fn clarabel_takes_programs_of_changing_length() {
    const ROOM: usize = 12;
    let recipe = Recipe { soft: true, ..Recipe::PLAIN };
    let qp = random::<7, 4, 2, 1>(&recipe);
    let full = random::<ROOM, 4, 2, 1>(&recipe);
    let mut clarabel = ClarabelQp::default();
    for program in [&roomy(&qp), &full, &roomy(&qp)] {
        let mut point = Box::new(Solution::ZERO);
        let outcome = clarabel.solve(program, &mut point, &Deadline::never());
        assert!(outcome.status.is_usable(), "{outcome:?}");
        let ours = cold(&mut *embedded::<ROOM, 4, 2, 1>(), program);
        let (f, g) = (objective(program, &point), objective(program, &ours.point));
        assert!((f - g).abs() <= 1e-6 * (1.0 + g.abs()), "{f} {g}");
    }
}

#[test]
fn clarabel_ignores_the_last_nodes_control() {
    unsound::the_last_interval_is_ignored(&mut ClarabelQp::default());
}
