//! Starts after the first.

use super::super::*;
use crate::Validate;

const N: usize = 12;
type Program = Qp<N, 2, 1, 1>;

/// A double integrator with bounded control, led from `start` to rest at zero at a price.
fn program(start: f64) -> Program {
    let mut qp = Program { defect_penalty: 100.0, path_penalty: 100.0, ..Program::ZERO };
    for stage in &mut qp.stages {
        stage.hessian_xx = SMatrix::from_diagonal_element(1e-2);
        stage.hessian_uu = SMatrix::from_element(1.0);
        stage.a = SMatrix::from_row_slice(&[1.0, 1.0, 0.0, 1.0]);
        stage.b = SMatrix::from_row_slice(&[0.5, 1.0]);
        (stage.lower_x, stage.upper_x) = ([f64::NEG_INFINITY; 2].into(), [f64::INFINITY; 2].into());
        (stage.lower_u, stage.upper_u) = ([-0.1].into(), [0.1].into());
    }
    let (first, last) = (&mut qp.stages[0], [0.0, 0.0]);
    (first.lower_x, first.upper_x) = ([start, 0.0].into(), [start, 0.0].into());
    (qp.stages[N - 1].lower_x, qp.stages[N - 1].upper_x) = (last.into(), last.into());
    qp
}

/// What is asked for here no rounding allows: all starts are made, and the best one counts.
#[test]
fn restarts_make_no_solution_worse() {
    let mut solver = EmbeddedQp::<N, 2, 1, 1>::new();
    let impossible =
        InteriorPointSettings { tolerance: 1e-25, complementarity: 1e-25, ..solver.settings() };
    solver.configure(impossible.validated().unwrap());
    let mut first_kept = 0;
    for i in 1..40 {
        let qp = program(0.1 * f64::from(i));
        solver.start(&qp).unwrap();
        let first = solver.run(&qp, COLD_BUDGET, &Deadline::never());
        let (one, is_priced) =
            (solver.error(&qp), solver.multipliers_are_within(qp.defect_penalty));
        let (mut solution, mut of_first) = (Solution::ZERO, Solution::ZERO);
        solver.write(&mut of_first);
        let outcome = solver.solve(&qp, &mut solution, &Deadline::never());
        assert!(outcome.iterations > first.iterations, "{i}: no restart");
        if !(first.status.is_usable() && is_priced) {
            continue;
        }
        assert_eq!(outcome.status, QpStatus::ReducedAccuracy, "{i}");
        let is_last = solver.solved;
        assert!(is_last || solver.gain(0).is_none());
        assert!(!is_last || solver.error(&qp) < one, "{i}");
        first_kept += u32::from(!is_last && solution.x == of_first.x);
    }
    assert!(first_kept > 5, "{first_kept}");
}
