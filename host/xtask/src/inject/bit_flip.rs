//! A solver in whose data, and in whose loop's, one bit flips.

use super::case::LoopFault;
use super::fields::{Answer, NG, NU, NX, Program, flip, of_program, of_solution};
use nalgebra::SMatrix;
use remora_core::advanced::planner::Solver;
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::qp::kept::{Kept, Part};
use remora_core::advanced::qp::{QpOutcome, QpSolver};
use remora_core::advanced::stages::NODES;
use remora_core::advanced::time::Deadline;

/// A flipped bit of a program or of its solution.
#[derive(Clone, Copy, Debug)]
pub(super) struct QpBitFlip {
    pub solution: bool,
    pub call: u32,
    pub field: usize,
    pub node: usize,
    pub element: usize,
    pub bit: u32,
}

/// A flipped bit of what goes through a solver.
#[derive(Clone, Copy, Debug)]
pub(super) enum Strike {
    Program(QpBitFlip),
    Loop(LoopFault),
}

/// Solve of the subproblem that was hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Met {
    /// Whether the solver called its answer usable.
    pub usable: bool,
    /// How often the solver had been reset: the stage, from one.
    pub stage: u32,
    /// Which solve of the stage it was, from zero; none for a correction.
    pub solve: Option<usize>,
}

/// The embedded solver, with a bit flipped in what it is given or in what it gives back.
///
/// A program is changed in a copy: the loop's own is as it was, and so is the next one.
pub(super) struct FaultySolver<'a> {
    solver: &'a mut dyn Solver,
    copy: &'a mut Program,
    strike: Option<Strike>,
    /// Programs so far.
    pub calls: u32,
    /// Iterations of either stage's loop so far.
    pub iterations: [u32; 2],
    /// Whether Stage 1's path has been shown.
    has_path: bool,
    stage: u32,
    solves: usize,
    /// Whether Stage 1's first program was solved twice.
    pub tried_twice: bool,
    /// Whether a bit of what a loop keeps has flipped.
    pub is_struck: bool,
    /// Solve of the subproblem that was hit, once it was.
    pub met: Option<Met>,
}

impl<'a> FaultySolver<'a> {
    pub fn new(solver: &'a mut dyn Solver, copy: &'a mut Program, strike: Option<Strike>) -> Self {
        Self {
            solver,
            copy,
            strike,
            calls: 0,
            iterations: [0; 2],
            has_path: false,
            stage: 0,
            solves: 0,
            tried_twice: false,
            is_struck: false,
            met: None,
        }
    }

    fn call(
        &mut self,
        qp: &Program,
        solution: &mut Answer,
        solve: Option<usize>,
        mut with: impl FnMut(&mut dyn Solver, &Program, &mut Answer) -> QpOutcome,
    ) -> QpOutcome {
        let call = self.calls;
        self.calls += 1;
        let s = match self.strike {
            Some(Strike::Program(bit_flip)) if bit_flip.call == call => bit_flip,
            _ => return with(self.solver, qp, solution),
        };
        let outcome = if s.solution {
            let outcome = with(self.solver, qp, solution);
            flip(of_solution(solution, s.field, s.node), s.element, s.bit);
            outcome
        } else {
            self.copy.clone_from(qp);
            flip(of_program(self.copy, s.field, s.node), s.element, s.bit);
            with(self.solver, self.copy, solution)
        };
        let (usable, stage) = (outcome.status.is_usable(), self.stage);
        self.met = Some(Met { usable, stage, solve });
        outcome
    }
}

impl QpSolver<NODES, NX, NU, NG> for FaultySolver<'_> {
    fn reset(&mut self) {
        // A stage whose loop has not begun is tried again.
        if self.stage == 1 && self.solves == 1 {
            (self.tried_twice, self.stage) = (true, 0);
        }
        (self.stage, self.solves) = (self.stage + 1, 0);
        self.solver.reset();
    }

    fn solve(&mut self, qp: &Program, solution: &mut Answer, deadline: &Deadline) -> QpOutcome {
        let solve = Some(self.solves);
        self.solves += 1;
        self.call(qp, solution, solve, |solver, qp, solution| solver.solve(qp, solution, deadline))
    }

    fn solve_again(
        &mut self,
        qp: &Program,
        solution: &mut Answer,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.call(qp, solution, None, |solver, qp, solution| {
            solver.solve_again(qp, solution, deadline)
        })
    }

    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        self.solver.gain(k)
    }

    fn identify(&self, checksum: &mut Checksum) {
        self.solver.identify(checksum);
    }

    fn show(&mut self, kept: &mut dyn Kept) {
        let [first, second] = self.iterations;
        let is_path = kept.number(Part::Path, 0, 0).is_some();
        self.has_path |= is_path;
        if !is_path {
            self.iterations[usize::from(self.has_path)] += 1;
        }
        let Some(Strike::Loop(fault)) = self.strike else { return };
        let is_due = match fault.part {
            Part::Path => is_path,
            _ => !is_path && fault.moment == first + second,
        };
        if is_due && let Some(number) = kept.number(fault.part, fault.node, fault.flat()) {
            flip(Some(std::slice::from_mut(number)), 0, fault.bit);
            self.is_struck = true;
        }
    }
}
