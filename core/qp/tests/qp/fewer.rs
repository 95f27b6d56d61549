//! Programs of fewer stages than the storage has room for.

use super::common::kkt::{Kkt, objective};
use super::common::programs::{bits, cases, cold, embedded, random, recipes};
use super::common::room::roomy;
use proptest::prelude::*;
use remora_qp::nalgebra::SVector;
use remora_qp::time::Deadline;
use remora_qp::{EmbeddedQp, Qp, QpSolver, Solution};

const FEW: usize = 7;
const ROOM: usize = 12;
const NX: usize = 4;
const NU: usize = 2;

type LargeQp = Qp<ROOM, NX, NU, 1>;

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
        let roomy: Box<LargeQp> = roomy(&qp);
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
