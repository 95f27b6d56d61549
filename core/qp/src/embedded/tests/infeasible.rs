//! Certificates of programs that a pencil solves.

use super::super::infeasible::is_proved;
use super::super::riccati::Interval;
use super::super::variables::StageVariables;
use crate::Qp;

type Program = Qp<3, 1, 1, 0>;

/// `x+ = 2 x + u + 1` from `x = 1`, so `x = 1, 3, 7` and what `|u| <= most` adds: up to `3 most` at the end, which
/// lies within `end`.
fn program(most: f64, end: (f64, f64)) -> Program {
    let mut qp = Program { defect_penalty: f64::INFINITY, ..Program::ZERO };
    for stage in &mut qp.stages {
        (stage.a[0], stage.b[0], stage.c[0]) = (2.0, 1.0, 1.0);
        (stage.lower_u[0], stage.upper_u[0]) = (-most, most);
        (stage.lower_x[0], stage.upper_x[0]) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    (qp.stages[0].lower_x[0], qp.stages[0].upper_x[0]) = (1.0, 1.0);
    (qp.stages[2].lower_x[0], qp.stages[2].upper_x[0]) = end;
    qp
}

/// Whether multipliers of the two intervals prove it.
fn proved(qp: &Program, multipliers: [f64; 2]) -> bool {
    let mut variables = [StageVariables::<1, 1, 0>::ZERO; 3];
    let mut intervals = [Interval::<1, 1>::ZERO; 3];
    for k in 0..3 {
        intervals[k].pack(&qp.stages[k]);
        // The last stage has no interval after it.
        variables[k].dynamics.value[0] = if k < 2 { multipliers[k] } else { 0.0 };
    }
    is_proved(qp, &variables, &intervals)
}

/// Twice the first equation and the second add up to `7 + 2 u_1 + u_2 - x_3 = 0`.
const UP: [f64; 2] = [20.0, 10.0];
const DOWN: [f64; 2] = [-20.0, -10.0];

#[test]
fn an_end_out_of_reach_is_proved_so() {
    let infinite = f64::INFINITY;
    assert!(proved(&program(1.0, (-9.0, 3.9)), UP));
    assert!(!proved(&program(1.0, (-9.0, 3.9)), DOWN));
    assert!(proved(&program(1.0, (10.1, 12.0)), DOWN));
    assert!(!proved(&program(1.0, (10.1, 12.0)), UP));
    // One bound is enough.
    assert!(proved(&program(1.0, (-infinite, 3.9)), UP));
    assert!(proved(&program(1.0, (10.1, infinite)), DOWN));
    assert!(!proved(&program(1.0, (10.1, infinite)), UP));
    assert!(!proved(&program(1.0, (-infinite, infinite)), UP));
}

#[test]
fn what_can_be_reached_is_never_proved_out_of_reach() {
    for end in [4.0, 7.0, 10.0] {
        for multipliers in [UP, DOWN, [10.0, 10.0], [-3.0, 5.0]] {
            assert!(!proved(&program(1.0, (end, end)), multipliers), "{end} {multipliers:?}");
        }
    }
    // A control without bounds reaches everything.
    assert!(!proved(&program(f64::INFINITY, (-9.0, 3.9)), UP));
    // By less than rounding, it is not proved.
    assert!(!proved(&program(1.0, (-9.0, 4.0 - 1e-9)), UP));
    assert!(proved(&program(1.0, (-9.0, 4.0 - 1e-6)), UP));
}

#[test]
fn each_term_counts() {
    // Other multipliers leave the state between with a coefficient, and it has no bounds.
    assert!(!proved(&program(1.0, (-9.0, 3.9)), [20.0, 11.0]));
    let mut between = program(1.0, (-9.0, 3.9));
    (between.stages[1].lower_x[0], between.stages[1].upper_x[0]) = (-100.0, 100.0);
    // Two thousandths of it make up for two tenths at most.
    assert!(proved(&between, [20.0, 10.0 + 1e-4]));
    assert!(!proved(&between, [20.0, 10.5]));
    // Where the first state is not known, nothing is.
    let mut anywhere = program(1.0, (-9.0, 3.9));
    anywhere.stages[0].upper_x[0] = 2.0;
    assert!(proved(&anywhere, UP));
    anywhere.stages[0].lower_x[0] = 0.9;
    assert!(!proved(&anywhere, UP));
}

#[test]
fn slack_and_small_multipliers_prove_nothing() {
    let mut soft = program(1.0, (-9.0, 3.9));
    assert!(proved(&soft, [2.0, 1.0]));
    assert!(!proved(&soft, [1.0, 0.5]));
    assert!(!proved(&soft, [f64::NAN, f64::NAN]));
    soft.defect_penalty = 1e9;
    assert!(!proved(&soft, UP));
}

/// Stages left out are no part of the certificate.
#[test]
fn of_two_stages_out_of_three() {
    let mut qp = program(1.0, (-9.0, 3.9));
    (qp.stages[1].lower_x[0], qp.stages[1].upper_x[0]) = (4.5, 5.0);
    qp.unused = 1;
    assert!(proved(&qp, [-5.0, 0.0]));
    assert!(!proved(&qp, [5.0, 0.0]));
    qp.stages[1].lower_x[0] = 3.5;
    assert!(!proved(&qp, [-5.0, 0.0]));
}
