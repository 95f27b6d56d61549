//! Programs in storage that has room for more stages.

use remora_qp::{Qp, QpStage};

/// A stage that nothing can be computed from.
fn unreadable<const NX: usize, const NU: usize, const NG: usize>() -> QpStage<NX, NU, NG> {
    let mut stage = QpStage::<NX, NU, NG>::ZERO;
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
pub fn roomy<
    const FEW: usize,
    const ROOM: usize,
    const NX: usize,
    const NU: usize,
    const NG: usize,
>(
    qp: &Qp<FEW, NX, NU, NG>,
) -> Box<Qp<ROOM, NX, NU, NG>> {
    let mut roomy = Box::new(Qp::<ROOM, NX, NU, NG>::ZERO);
    for stage in &mut roomy.stages {
        *stage = unreadable();
    }
    roomy.stages[..FEW].copy_from_slice(&qp.stages);
    roomy.unused = ROOM - FEW;
    (roomy.constant, roomy.defect_penalty, roomy.path_penalty) =
        (qp.constant, qp.defect_penalty, qp.path_penalty);
    roomy
}
