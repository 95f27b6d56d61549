//! State that the SCP solver keeps between iterations, shown to its QP solver for fault injection.

use super::solve::{Feasible, ScpSolver};
use super::{Iterates, Outcome, Problem, Scratch};
use core::marker::PhantomData;
use remora_qp::QpSolver;
use remora_qp::kept::{Kept, Part, nth};

impl<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    ScpSolver<'_, P, S, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    /// Shows the solver what is kept. No code where the solver does not look.
    #[inline]
    pub(super) fn show(&mut self) {
        let Self { solver, w, z, outcome, radius, penalty_parameter, best, .. } = self;
        let problem = PhantomData::<P>;
        solver.show(&mut All { w, z, outcome, radius, penalty_parameter, best, problem });
    }
}

struct All<
    'a,
    P: Problem<N, NX, NU, NG>,
    const N: usize,
    const NX: usize,
    const NU: usize,
    const NG: usize,
> {
    w: &'a mut Scratch<N, NX, NU, NG>,
    z: &'a mut Iterates<P::Trajectory>,
    outcome: &'a mut Outcome,
    radius: &'a mut f64,
    penalty_parameter: &'a mut f64,
    best: &'a mut Option<Feasible>,
    problem: PhantomData<P>,
}

impl<P, const N: usize, const NX: usize, const NU: usize, const NG: usize> Kept
    for All<'_, P, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
{
    fn number(&mut self, part: Part, node: usize, element: usize) -> Option<&mut f64> {
        match part {
            Part::Iterate => P::number(&mut self.z.trajectory, node, element),
            Part::Best => P::number(&mut self.z.best, node, element),
            Part::Residuals => {
                let residuals = &mut self.w.residuals;
                let defect = residuals.defect.get_mut(node)?.as_mut_slice();
                nth([defect, residuals.path.get_mut(node)?.as_mut_slice()], element)
            }
            Part::Multipliers => {
                let step = &mut self.w.step;
                let numbers = [
                    step.defect_multiplier.get_mut(node)?.as_mut_slice(),
                    step.bound_multiplier_x.get_mut(node)?.as_mut_slice(),
                    step.bound_multiplier_u.get_mut(node)?.as_mut_slice(),
                    step.path_multiplier.get_mut(node)?.as_mut_slice(),
                ];
                nth(numbers, element)
            }
            Part::Scalars => match element {
                0 => Some(self.radius),
                1 => Some(self.penalty_parameter),
                2 => Some(&mut self.outcome.violation),
                3 => Some(&mut self.w.residuals.cost),
                4 => self.best.as_mut().map(|best| &mut best.cost),
                5 => self.best.as_mut().map(|best| &mut best.violation),
                _ => None,
            },
            Part::Path => None,
        }
    }
}
