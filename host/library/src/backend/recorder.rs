//! A solver that is watched.

use nalgebra::SMatrix;
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::qp::{Qp, QpOutcome, QpSolver, Solution};
use remora_core::advanced::time::Deadline;

/// One call of a solver: what it was asked and what it answered.
#[derive(Clone, Copy, Debug)]
pub struct Solve<'a, const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// The program.
    pub qp: &'a Qp<N, NX, NU, NG>,
    /// Where the solver left off; a solution where the status is usable.
    pub solution: &'a Solution<N, NX, NU, NG>,
    /// How it ended.
    pub outcome: QpOutcome,
    /// Whether it was a second-order correction.
    pub is_correction: bool,
    /// How often the solver had been reset since it was first watched: the stage of a plan, from 1.
    pub stage: usize,
}

/// Any solver, with a watcher that sees each call once it is done. The answers are the solver's
/// own, bit for bit.
pub struct Recorder<'a, S: ?Sized, F> {
    solver: &'a mut S,
    watch: F,
    stage: usize,
}

impl<'a, S: ?Sized, F> Recorder<'a, S, F> {
    /// `solver`, watched by `watch`.
    pub fn new(solver: &'a mut S, watch: F) -> Self {
        Self { solver, watch, stage: 0 }
    }
}

impl<S, F, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    QpSolver<N, NX, NU, NG> for Recorder<'_, S, F>
where
    S: QpSolver<N, NX, NU, NG> + ?Sized,
    F: FnMut(Solve<'_, N, NX, NU, NG>),
{
    fn reset(&mut self) {
        self.stage += 1;
        self.solver.reset();
    }

    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        let outcome = self.solver.solve(qp, solution, deadline);
        let stage = self.stage;
        (self.watch)(Solve { qp, solution, outcome, is_correction: false, stage });
        outcome
    }

    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        let outcome = self.solver.solve_again(qp, solution, deadline);
        let stage = self.stage;
        (self.watch)(Solve { qp, solution, outcome, is_correction: true, stage });
        outcome
    }

    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        self.solver.gain(k)
    }

    fn identify(&self, checksum: &mut Checksum) {
        self.solver.identify(checksum);
    }
}
