//! Programs at the edge: without interior, with everything active, without curvature, without a
//! solution.

use super::kkt::{Kkt, objective};
use super::programs::{Answer, Recipe, cold, random};
use remora_qp::nalgebra::{SMatrix, SVector};
use remora_qp::{Qp, QpSolver, QpStage, QpStatus};

pub const N: usize = 6;
pub const NX: usize = 3;
pub const NU: usize = 2;
pub type Program = Qp<N, NX, NU, 1>;
type Node = QpStage<NX, NU, 1>;
/// A name, how the dynamics are, what is changed.
pub type Case = (&'static str, Recipe, fn(&mut Program));

const SOFT: Recipe = Recipe::PLAIN;
const HARD: Recipe = Recipe::HARD;

fn each(qp: &mut Program, change: impl FnMut(&mut Node)) {
    qp.stages.iter_mut().for_each(change);
}

/// All boxes of `width` around the middle of what they were.
fn narrow(qp: &mut Program, width: f64) {
    let middle = |lower: f64, upper: f64| match (lower.is_finite(), upper.is_finite()) {
        (true, true) => 0.5 * (lower + upper),
        (true, false) => lower + 0.5,
        (false, true) => upper - 0.5,
        (false, false) => 0.0,
    };
    each(qp, |stage| {
        let x = stage.lower_x.zip_map(&stage.upper_x, middle);
        let u = stage.lower_u.zip_map(&stage.upper_u, middle);
        (stage.lower_x, stage.upper_x) = (x, x.add_scalar(width));
        (stage.lower_u, stage.upper_u) = (u, u.add_scalar(width));
    });
}

fn no_curvature(stage: &mut Node) {
    stage.hessian_xx.fill(0.0);
    stage.hessian_ux.fill(0.0);
    stage.hessian_uu.fill(0.0);
}

fn unbounded(stage: &mut Node) {
    stage.lower_x.fill(f64::NEG_INFINITY);
    stage.upper_x.fill(f64::INFINITY);
    stage.lower_u.fill(f64::NEG_INFINITY);
    stage.upper_u.fill(f64::INFINITY);
}

/// Programs that have a solution.
pub const SOLVABLE: &[Case] = &[
    ("as drawn", SOFT, |_| ()),
    ("as drawn, hard", HARD, |_| ()),
    ("everything pinned", SOFT, |qp| narrow(qp, 0.0)),
    ("boxes of 1e-12", SOFT, |qp| narrow(qp, 1e-12)),
    ("boxes of 1e-9", SOFT, |qp| narrow(qp, 1e-9)),
    ("boxes of 1e-6", SOFT, |qp| narrow(qp, 1e-6)),
    ("all controls pinned", SOFT, |qp| {
        each(qp, |stage| {
            stage.upper_u = stage.lower_u.map(|v| if v.is_finite() { v } else { 0.0 })
        });
        each(qp, |stage| stage.lower_u = stage.upper_u);
    }),
    ("controls of 1e-9", SOFT, |qp| {
        each(qp, |stage| {
            stage.lower_u = stage.lower_u.map(|v| if v.is_finite() { v } else { 0.0 })
        });
        each(qp, |stage| stage.upper_u = stage.lower_u.add_scalar(1e-9));
    }),
    ("everything at a bound", SOFT, |qp| {
        each(qp, |stage| {
            stage.gradient_x *= 1e3;
            stage.gradient_u *= 1e3;
        });
    }),
    ("every row violated", SOFT, |qp| each(qp, |stage| stage.path_offset.fill(10.0))),
    ("every row violated, hard", HARD, |qp| each(qp, |stage| stage.path_offset.fill(10.0))),
    ("every row at its limit", HARD, |qp| {
        each(qp, |stage| stage.path_offset.fill(0.0));
        qp.path_penalty = 1e4;
    }),
    ("violated rows of zeros", SOFT, |qp| {
        each(qp, |stage| {
            stage.path_jacobian.fill(0.0);
            stage.path_offset.fill(1.0);
        });
    }),
    ("rows of zeros at their limit", SOFT, |qp| {
        each(qp, |stage| {
            stage.path_jacobian.fill(0.0);
            stage.path_offset.fill(0.0);
        });
    }),
    ("rows without weight", SOFT, |qp| qp.path_penalty = 0.0),
    ("a row that repeats a bound", SOFT, |qp| {
        each(qp, |stage| {
            stage.path_jacobian.fill(0.0);
            stage.path_jacobian[(0, 1)] = 1.0;
            stage.path_offset[0] =
                if stage.upper_x[1].is_finite() { -stage.upper_x[1] } else { -1.0 };
            stage.gradient_x[1] = -50.0;
        });
    }),
    ("no curvature at all", SOFT, |qp| each(qp, no_curvature)),
    ("no curvature at all, hard", Recipe { open: 0.0, ..HARD }, |qp| each(qp, no_curvature)),
    ("curvature of rank one", Recipe { curvature: 0.0, open: 0.0, ..SOFT }, |_| ()),
    ("curvature of rank one, hard", Recipe { curvature: 0.0, open: 0.0, ..HARD }, |_| ()),
    ("nothing to do", SOFT, |qp| {
        each(qp, |stage| {
            stage.gradient_x.fill(0.0);
            stage.gradient_u.fill(0.0);
            stage.c.fill(0.0);
            stage.lower_x.fill(-1.0);
            stage.upper_x.fill(1.0);
            stage.lower_u.fill(-1.0);
            stage.upper_u.fill(1.0);
            stage.path_offset.fill(-1.0);
        });
    }),
    ("no bounds at all", SOFT, |qp| each(qp, unbounded)),
    ("no bounds at all, hard", HARD, |qp| each(qp, unbounded)),
    ("dynamics out of reach", SOFT, |qp| each(qp, |stage| stage.c.fill(100.0))),
    ("controls without effect", SOFT, |qp| each(qp, |stage| stage.b.fill(0.0))),
    ("a state without past", SOFT, |qp| each(qp, |stage| stage.a.fill(0.0))),
    ("no dynamics", SOFT, |qp| {
        each(qp, |stage| {
            stage.a.fill(0.0);
            stage.b.fill(0.0);
            stage.c.fill(0.0);
        });
    }),
    ("slack almost free", SOFT, |qp| qp.defect_penalty = 1e-6),
    ("slack very dear", Recipe { soft: false, ..SOFT }, |qp| qp.defect_penalty = 1e6),
    ("rows very dear", HARD, |qp| qp.path_penalty = 1e6),
    ("small numbers", SOFT, |qp| {
        each(qp, |stage| {
            stage.hessian_xx *= 1e-4;
            stage.hessian_ux *= 1e-4;
            stage.hessian_uu *= 1e-4;
            stage.gradient_x *= 1e-4;
            stage.gradient_u *= 1e-4;
        });
    }),
    ("large numbers", SOFT, |qp| {
        each(qp, |stage| {
            stage.hessian_xx *= 1e3;
            stage.hessian_ux *= 1e3;
            stage.hessian_uu *= 1e3;
        });
    }),
    ("identical controls", SOFT, |qp| {
        each(qp, |stage| {
            let column = stage.b.column(0).into_owned();
            stage.b.set_column(1, &column);
            stage.hessian_uu = SMatrix::repeat(1.0);
            stage.hessian_ux.fill(0.0);
            stage.gradient_u.fill(0.1);
            stage.lower_u.fill(-1.0);
            stage.upper_u.fill(1.0);
        });
    }),
];

/// Programs that have none, with what must be said of them: nothing more than that it is no
/// success, or that there is no feasible point.
pub const UNSOLVABLE: &[(Case, Option<QpStatus>)] = &[
    (
        ("a state's box is empty", SOFT, |qp| {
            qp.stages[3].lower_x[1] = 0.5;
            qp.stages[3].upper_x[1] = 0.25;
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("a control's box is empty", SOFT, |qp| {
            qp.stages[2].lower_u[1] = 0.5;
            qp.stages[2].upper_u[1] = -0.5;
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("a box is empty by 1e-6", HARD, |qp| {
            qp.stages[2].lower_u[0] = 1e-6;
            qp.stages[2].upper_u[0] = 0.0;
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("the last box is empty", SOFT, |qp| {
            qp.stages[N - 1].lower_x[2] = 1.0;
            qp.stages[N - 1].upper_x[2] = -1.0;
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("hard dynamics out of reach", Recipe { open: 0.0, ..HARD }, |qp| {
            qp.stages[0].c.fill(100.0)
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("hard dynamics out of reach by little", Recipe { open: 0.0, ..HARD }, |qp| {
            qp.stages[4].c.fill(3.0)
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("an end that no control reaches", Recipe { open: 0.0, ..HARD }, |qp| {
            let far = 10.0 * qp.stages[N - 1].upper_x.amax();
            qp.stages[N - 1].lower_x = SVector::repeat(far);
            qp.stages[N - 1].upper_x = SVector::repeat(far);
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("controls at rest, states that must move", Recipe { open: 0.0, ..HARD }, |qp| {
            each(qp, |stage| {
                stage.lower_u.fill(0.0);
                stage.upper_u.fill(0.0);
                stage.c.fill(1.0);
            });
            qp.stages[0].lower_x.fill(0.0);
            qp.stages[0].upper_x.fill(0.0);
            qp.stages[1].lower_x.fill(-0.5);
            qp.stages[1].upper_x.fill(0.5);
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("a drift that leaves its box", Recipe { open: 0.0, ..HARD }, |qp| {
            each(qp, |stage| {
                stage.a = SMatrix::identity() * 2.0;
                stage.b *= 1e-3;
                stage.c.fill(0.0);
                stage.lower_x.fill(-1.0);
                stage.upper_x.fill(1.0);
                stage.lower_u.fill(-1.0);
                stage.upper_u.fill(1.0);
            });
            qp.stages[0].lower_x.fill(0.9);
            qp.stages[0].upper_x.fill(0.9);
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("pins that contradict each other", HARD, |qp| {
            each(qp, |stage| stage.b.fill(0.0));
            qp.stages[1].lower_x = SVector::repeat(5.0);
            qp.stages[1].upper_x = SVector::repeat(5.0);
        }),
        Some(QpStatus::Infeasible),
    ),
    (
        ("no end to the descent", Recipe { open: 0.0, ..SOFT }, |qp| {
            each(qp, |stage| {
                no_curvature(stage);
                stage.b.fill(0.0);
                stage.gradient_u.fill(1.0);
                stage.lower_u.fill(f64::NEG_INFINITY);
            });
        }),
        None,
    ),
    (
        ("no end to the descent, hard", HARD, |qp| {
            each(qp, |stage| {
                no_curvature(stage);
                unbounded(stage);
            });
        }),
        None,
    ),
];

pub fn made((_, recipe, change): &Case) -> Box<Program> {
    let mut qp = random::<N, NX, NU, 1>(recipe);
    change(&mut qp);
    qp
}

/// What is wrong with the answers to solvable programs, a line a program.
pub fn flaws<S: QpSolver<N, NX, NU, 1>>(solver: &mut S, tolerance: f64) -> Vec<String> {
    let mut flaws = Vec::new();
    for case in SOLVABLE {
        let qp = made(case);
        let Answer { point, outcome } = cold(solver, &qp);
        let mut kkt = Kkt::of(&qp, &point);
        // A gap is judged beside the objective: some of these have one of 1e4. A gradient is judged
        // beside the weights it balances: one has 1e6.
        kkt.complementarity /= 1.0 + objective(&qp, &point).abs();
        kkt.stationarity /= qp.path_penalty.max(1.0);
        // Two of them are singular to rounding where they are solved: reduced accuracy is what a
        // solver should then report, and the residuals must be as small as the others'.
        if !outcome.status.is_usable() || !(kkt.worst() <= tolerance) {
            flaws.push(format!("{}: {outcome:?} {kkt:?}", case.0));
        }
    }
    flaws
}

/// Programs without a solution that are not named as such, a line a program.
pub fn mistaken<S: QpSolver<N, NX, NU, 1>>(solver: &mut S) -> Vec<String> {
    let mut mistaken = Vec::new();
    for (case, expected) in UNSOLVABLE {
        let outcome = cold(solver, &made(case)).outcome;
        let ok = match expected {
            Some(status) => outcome.status == *status,
            None => !outcome.status.is_usable(),
        };
        if !ok {
            mistaken.push(format!("{}: {outcome:?}", case.0));
        }
    }
    mistaken
}
