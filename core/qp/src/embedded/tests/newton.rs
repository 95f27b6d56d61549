//! Directions of the Riccati recursion against the linear equations that they solve.

extern crate std;

use super::super::leading::Leading;
use super::super::riccati::{Dynamics, direction, factorise};
use super::super::*;
use super::{Numbers, program};
use nalgebra::{SMatrix, SVector};
use std::boxed::Box;

const N: usize = 5;

/// Largest residual of the Newton system over all its equations.
fn residual<const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    variables: &[StageVariables<NX, NU, NG>],
    dynamics: Dynamics,
    rhs: &[StageVector<NX, NU, NG>],
    step: &[StageVector<NX, NU, NG>],
) -> f64 {
    let mut worst = 0.0f64;
    let mut add = |values: &[f64]| values.iter().for_each(|v| worst = worst.max(v.abs()));
    let mut before = SVector::<f64, NX>::zeros();
    for (k, (stage, vars)) in qp.stages.iter().zip(variables).enumerate() {
        let [dx, lambda] = [step[k].x, step[k].dynamics].map(SVector::from);
        let (du, nu) = (SVector::from(step[k].u), SVector::from(step[k].path));
        let free_x = SVector::from(vars.free_x.factors());
        let free_u = SVector::from(vars.free_u.factors());
        let mut of_x = stage.hessian_xx * dx + SVector::from(rhs[k].x) - before;
        of_x += SVector::from(vars.x.scaling()).component_mul(&dx);
        of_x += stage.path_jacobian.tr_mul(&nu);
        let of_rows = stage.path_jacobian * dx + SVector::from(rhs[k].path);
        add((of_rows - SVector::from(vars.path.scaling()).component_mul(&nu)).as_slice());
        if k + 1 < N {
            of_x += stage.hessian_ux.tr_mul(&du) + stage.a.tr_mul(&lambda);
            let mut of_u = stage.hessian_uu * du + stage.hessian_ux * dx;
            of_u += SVector::from(rhs[k].u) + stage.b.tr_mul(&lambda);
            of_u += SVector::from(vars.u.scaling()).component_mul(&du);
            add(of_u.component_mul(&free_u).as_slice());
            // Controls that are fixed take no step.
            add((du - du.component_mul(&free_u)).as_slice());
            let next = SVector::<f64, NX>::from(step[k + 1].x);
            let mut of_dynamics =
                stage.a * dx + stage.b * du + SVector::from(rhs[k].dynamics) - next;
            let scaling = vars.dynamics.scaling();
            for i in 0..NX {
                let is_rigid = dynamics.are_rigid && variables[k + 1].free_x.factors()[i] == 1.0;
                let own = if dynamics.are_rigid { 0.0 } else { scaling[i] };
                let regularisation = if is_rigid { 0.0 } else { own + dynamics.regularisation };
                of_dynamics[i] -= regularisation * lambda[i];
            }
            add(of_dynamics.as_slice());
        }
        add(of_x.component_mul(&free_x).as_slice());
        add((dx - dx.component_mul(&free_x)).as_slice());
        before = lambda;
    }
    worst
}

fn solves<const NX: usize, const NU: usize, const NG: usize>(seed: u64, elastic: bool) {
    let mut numbers = Numbers(seed);
    let qp = program::<N, NX, NU, NG>(&mut numbers, 5.0);
    let mut solver = Box::new(EmbeddedQp::<N, NX, NU, NG>::new());
    solver.start(&qp).unwrap();
    solver.initialise(&qp, InitialPoint { mu: 0.1, elastic }).unwrap();
    let mut rhs = solver.step;
    for (k, vector) in rhs.iter_mut().enumerate() {
        vector.x = numbers.matrix::<NX, 1>(1.0).data.0[0];
        vector.path = numbers.matrix::<NG, 1>(1.0).data.0[0];
        if k + 1 < N {
            vector.u = numbers.matrix::<NU, 1>(1.0).data.0[0];
            vector.dynamics = numbers.matrix::<NX, 1>(1.0).data.0[0];
        }
    }
    let EmbeddedQp { variables, intervals, initial, .. } = &mut *solver;
    let dynamics = Dynamics { are_rigid: !elastic, regularisation: 1e-6 };
    let leading = Leading::<NX, NU>;
    factorise(&qp.stages, variables, leading, dynamics, intervals, initial).unwrap();
    let mut step = rhs;
    direction(&qp.stages, variables, leading, intervals, initial, &mut step);
    let worst = residual(&qp, variables, dynamics, &rhs, &step);
    // Variables fixed at the end have multipliers of a million.
    assert!(worst < 1e-8, "{seed}, elastic {elastic}: {worst:e}");
    // The feedback gain is the derivative of the first step by a change of the first state.
    let gain = SMatrix::<f64, NU, NX>::from_fn(|i, j| intervals[0].gain[i][j]);
    assert!(gain.iter().all(|v| v.is_finite()) && gain.amax() > 1e-3);
}

#[test]
fn directions_solve_the_newton_system() {
    for seed in 0..10 {
        for elastic in [true, false] {
            solves::<3, 2, 1>(seed, elastic);
            solves::<4, 1, 2>(seed, elastic);
            solves::<2, 4, 0>(seed, elastic);
        }
    }
}

/// A block that is indefinite is reported wherever it stands.
#[test]
fn a_system_that_is_not_definite_is_refused() {
    let factored = |k: usize, of_u: bool| {
        let mut qp = program::<N, 3, 2, 1>(&mut Numbers(1), 5.0);
        let stage = &mut qp.stages[k];
        match of_u {
            true => stage.hessian_uu = SMatrix::from_diagonal_element(-1e4),
            false => stage.hessian_xx = SMatrix::from_diagonal_element(-1e9),
        }
        let mut solver = Box::new(EmbeddedQp::<N, 3, 2, 1>::new());
        solver.start(&qp).unwrap();
        let EmbeddedQp { variables, intervals, initial, .. } = &mut *solver;
        let dynamics = Dynamics { are_rigid: false, regularisation: 1e-8 };
        factorise(&qp.stages, variables, Leading::<3, 2>, dynamics, intervals, initial)
    };
    for k in 0..N - 1 {
        assert!(factored(k, true).is_err(), "{k}");
    }
    for k in 1..N {
        assert!(factored(k, false).is_err(), "{k}");
    }
    // All states of the first stage are fixed.
    assert!(factored(0, false).is_ok() && factored(N - 1, true).is_ok());
}
