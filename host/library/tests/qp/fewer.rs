//! Programs of fewer stages than the storage has room for.

use super::programs::{Recipe, bits, cases, cold, embedded, random, recipes};
use nalgebra::SVector;
use proptest::prelude::*;
use remora_core::advanced::qp::{EmbeddedQp, Qp, QpSolver, QpStage, Solution};
use remora_core::advanced::time::Deadline;
use remora_host::backend::ClarabelQp;
use remora_host::kkt::{Kkt, objective};

const FEW: usize = 7;
const ROOM: usize = 12;
const NX: usize = 4;
const NU: usize = 2;

type LargeQp = Qp<ROOM, NX, NU, 1>;

/// A stage that nothing can be computed from.
fn unreadable() -> QpStage<NX, NU, 1> {
    let mut stage = QpStage::<NX, NU, 1>::ZERO;
    stage.hessian_xx.fill(f64::NAN);
    stage.hessian_ux.fill(f64::NAN);
    stage.hessian_uu.fill(f64::NAN);
    stage.a.fill(f64::NAN);
    stage.b.fill(f64::NAN);
    stage.path_jacobian.fill(f64::NAN);
    stage.path_offset.fill(f64::NAN);
    for vector in [&mut stage.gradient_x, &mut stage.c, &mut stage.lower_x, &mut stage.upper_x] {
        vector.fill(f64::NAN);
    }
    for vector in [&mut stage.gradient_u, &mut stage.lower_u, &mut stage.upper_u] {
        vector.fill(f64::NAN);
    }
    stage
}

/// The program in larger storage, whose last stages are full of what must not be read.
fn roomy(qp: &Qp<FEW, NX, NU, 1>) -> Box<LargeQp> {
    let mut roomy = Box::new(LargeQp::ZERO);
    for stage in &mut roomy.stages {
        *stage = unreadable();
    }
    roomy.stages[..FEW].copy_from_slice(&qp.stages);
    roomy.unused = ROOM - FEW;
    (roomy.constant, roomy.defect_penalty, roomy.path_penalty) =
        (qp.constant, qp.defect_penalty, qp.path_penalty);
    roomy
}

/// The point's stages that are the program's; all others must be zero.
fn first(point: &Solution<ROOM, NX, NU, 1>) -> Box<Solution<FEW, NX, NU, 1>> {
    let mut rest = point.clone();
    let mut few = Box::new(Solution::<FEW, NX, NU, 1>::ZERO);
    few.x.copy_from_slice(&point.x[..FEW]);
    few.u.copy_from_slice(&point.u[..FEW]);
    few.defect_multiplier.copy_from_slice(&point.defect_multiplier[..FEW]);
    few.bound_multiplier_x.copy_from_slice(&point.bound_multiplier_x[..FEW]);
    few.bound_multiplier_u.copy_from_slice(&point.bound_multiplier_u[..FEW]);
    few.path_multiplier.copy_from_slice(&point.path_multiplier[..FEW]);
    rest.x[..FEW].fill(SVector::zeros());
    rest.u[..FEW].fill(SVector::zeros());
    rest.defect_multiplier[..FEW].fill(SVector::zeros());
    rest.bound_multiplier_x[..FEW].fill(SVector::zeros());
    rest.bound_multiplier_u[..FEW].fill(SVector::zeros());
    rest.path_multiplier[..FEW].fill(SVector::zeros());
    let none = Solution::<ROOM, NX, NU, 1>::ZERO;
    assert_eq!(bits(&rest), bits(&none), "beyond the stages of the program");
    few
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn room_that_is_not_used_changes_no_bit(recipe in recipes()) {
        let qp = random::<FEW, NX, NU, 1>(&recipe);
        let roomy = roomy(&qp);
        let mut small: Box<EmbeddedQp<FEW, NX, NU, 1>> = embedded();
        let mut large: Box<EmbeddedQp<ROOM, NX, NU, 1>> = embedded();
        // What a longer program left is not read either.
        cold(&mut *large, &random::<ROOM, NX, NU, 1>(&recipe));
        let (a, b) = (cold(&mut *small, &qp), cold(&mut *large, &roomy));
        prop_assert_eq!(a.outcome, b.outcome);
        prop_assert_eq!(bits(&a.point), bits(&first(&b.point)));
        let (mut again, mut roomy_again) = (a.point.clone(), b.point.clone());
        let outcome = small.solve_again(&qp, &mut again, &Deadline::never());
        let roomy_outcome = large.solve_again(&roomy, &mut roomy_again, &Deadline::never());
        prop_assert_eq!(outcome, roomy_outcome);
        prop_assert_eq!(bits(&again), bits(&first(&roomy_again)));
        for k in 0..ROOM {
            prop_assert_eq!(large.gain(k), small.gain(k), "gain {}", k);
        }
        prop_assert_eq!(Kkt::of(&roomy, &b.point), Kkt::of(&qp, &a.point));
        prop_assert_eq!(objective(&roomy, &b.point), objective(&qp, &a.point));
    }
}

#[test]
fn clarabel_takes_programs_of_changing_length() {
    let recipe = Recipe { soft: true, ..Recipe::PLAIN };
    let qp = random::<FEW, NX, NU, 1>(&recipe);
    let full = random::<ROOM, NX, NU, 1>(&recipe);
    let mut clarabel = ClarabelQp::default();
    for program in [&roomy(&qp), &full, &roomy(&qp)] {
        let mut point = Box::new(Solution::ZERO);
        let outcome = clarabel.solve(program, &mut point, &Deadline::never());
        assert!(outcome.status.is_usable(), "{outcome:?}");
        let ours = cold(&mut *embedded::<ROOM, NX, NU, 1>(), program);
        let (f, g) = (objective(program, &point), objective(program, &ours.point));
        assert!((f - g).abs() <= 1e-6 * (1.0 + g.abs()), "{f} {g}");
    }
}
