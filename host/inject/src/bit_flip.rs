//! How bits of the planner's data are flipped.

use nalgebra::SMatrix;
use remora_core::advanced::planner::Solver;
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::qp::{Qp, QpOutcome, QpSolver, Solution};
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory, size};
use remora_core::advanced::time::Deadline;

const NX: usize = size::NX;
const NU: usize = size::NU;
const NG: usize = size::NG;

/// A subproblem of the planner.
pub(super) type Program = Qp<NODES, NX, NU, NG>;
type Answer = Solution<NODES, NX, NU, NG>;

/// What a subproblem has at each node, with how many numbers; then what it has once.
pub const PROGRAM_FIELDS: [(&str, usize); 17] = [
    ("hessian_xx", NX * NX),
    ("hessian_ux", NU * NX),
    ("hessian_uu", NU * NU),
    ("gradient_x", NX),
    ("gradient_u", NU),
    ("a", NX * NX),
    ("b", NX * NU),
    ("c", NX),
    ("lower_x", NX),
    ("upper_x", NX),
    ("lower_u", NU),
    ("upper_u", NU),
    ("row_x", NG * NX),
    ("row_offset", NG),
    ("constant", 1),
    ("defect_weight", 1),
    ("row_weight", 1),
];

/// What its solution has at each node.
pub const SOLUTION_FIELDS: [(&str, usize); 6] = [
    ("x", NX),
    ("u", NU),
    ("defect_multiplier", NX),
    ("bound_multiplier_x", NX),
    ("bound_multiplier_u", NU),
    ("row_multiplier", NG),
];

/// What a start of Stage 2 has at each node.
pub const START_FIELDS: [(&str, usize); 6] = [
    ("attitude", 4),
    ("joint_angle", LINKS),
    ("rate", 3),
    ("joint_rate", LINKS),
    ("bus_torque", 3),
    ("joint_torque", LINKS),
];

fn of_program(qp: &mut Program, field: usize, node: usize) -> Option<&mut [f64]> {
    let stage = qp.stages.get_mut(node)?;
    Some(match field {
        0 => stage.hessian_xx.as_mut_slice(),
        1 => stage.hessian_ux.as_mut_slice(),
        2 => stage.hessian_uu.as_mut_slice(),
        3 => stage.gradient_x.as_mut_slice(),
        4 => stage.gradient_u.as_mut_slice(),
        5 => stage.a.as_mut_slice(),
        6 => stage.b.as_mut_slice(),
        7 => stage.c.as_mut_slice(),
        8 => stage.lower_x.as_mut_slice(),
        9 => stage.upper_x.as_mut_slice(),
        10 => stage.lower_u.as_mut_slice(),
        11 => stage.upper_u.as_mut_slice(),
        12 => stage.path_jacobian.as_mut_slice(),
        13 => stage.path_offset.as_mut_slice(),
        14 => std::slice::from_mut(&mut qp.constant),
        15 => std::slice::from_mut(&mut qp.defect_penalty),
        16 => std::slice::from_mut(&mut qp.path_penalty),
        _ => return None,
    })
}

fn of_solution(solution: &mut Answer, field: usize, node: usize) -> Option<&mut [f64]> {
    Some(match field {
        0 => solution.x.get_mut(node)?.as_mut_slice(),
        1 => solution.u.get_mut(node)?.as_mut_slice(),
        2 => solution.defect_multiplier.get_mut(node)?.as_mut_slice(),
        3 => solution.bound_multiplier_x.get_mut(node)?.as_mut_slice(),
        4 => solution.bound_multiplier_u.get_mut(node)?.as_mut_slice(),
        5 => solution.path_multiplier.get_mut(node)?.as_mut_slice(),
        _ => return None,
    })
}

/// Flips a bit of a start of Stage 2; whether there is such a number.
pub(super) fn flip_start(
    start: &mut ReorientationTrajectory<NODES, LINKS>,
    (field, node, element, bit): (usize, usize, usize, u32),
) -> bool {
    let (Some(state), Some(control)) = (start.states.get_mut(node), start.controls.get_mut(node))
    else {
        return false;
    };
    let numbers = match field {
        0 => state.attitude.as_mut_slice(),
        1 => state.joint_angle.as_mut_slice(),
        2 => state.rate.as_mut_slice(),
        3 => state.joint_rate.as_mut_slice(),
        4 => control.bus_torque.as_mut_slice(),
        _ => control.joint_torque.as_mut_slice(),
    };
    flip(Some(numbers), element, bit)
}

fn flip(numbers: Option<&mut [f64]>, element: usize, bit: u32) -> bool {
    let Some(number) = numbers.and_then(|numbers| numbers.get_mut(element)) else { return false };
    *number = f64::from_bits(number.to_bits() ^ (1 << (bit % 64)));
    true
}

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

/// What became of the program that was hit.
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
    bit_flip: Option<QpBitFlip>,
    /// Programs so far.
    pub calls: u32,
    stage: u32,
    solves: usize,
    /// What became of it, once it was hit.
    pub met: Option<Met>,
}

impl<'a> FaultySolver<'a> {
    pub fn new(
        solver: &'a mut dyn Solver,
        copy: &'a mut Program,
        bit_flip: Option<QpBitFlip>,
    ) -> Self {
        Self { solver, copy, bit_flip, calls: 0, stage: 0, solves: 0, met: None }
    }

    fn call(
        &mut self,
        qp: &Program,
        solution: &mut Answer,
        solve: Option<usize>,
        mut with: impl FnMut(&mut dyn Solver, &Program, &mut Answer) -> QpOutcome,
    ) -> QpOutcome {
        let bit_flip = self.bit_flip.filter(|bit_flip| bit_flip.call == self.calls);
        self.calls += 1;
        let Some(s) = bit_flip else { return with(self.solver, qp, solution) };
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables of names and sizes are those of the data.
    #[test]
    fn every_field_has_as_many_numbers_as_the_tables_say() {
        let (mut qp, mut solution) = (Box::new(Program::ZERO), Box::new(Answer::ZERO));
        for (field, (name, count)) in PROGRAM_FIELDS.iter().enumerate() {
            let numbers = of_program(&mut qp, field, NODES - 1).unwrap();
            assert_eq!(numbers.len(), *count, "{name}");
            assert!(flip(Some(numbers), count - 1, 63));
            assert!(!flip(of_program(&mut qp, field, NODES), 0, 0), "{name}");
            assert!(!flip(of_program(&mut qp, field, 0), *count, 0), "{name}");
        }
        assert!(of_program(&mut qp, PROGRAM_FIELDS.len(), 0).is_none());
        for (field, (name, count)) in SOLUTION_FIELDS.iter().enumerate() {
            assert_eq!(of_solution(&mut solution, field, 0).unwrap().len(), *count, "{name}");
        }
        let mut start = ReorientationTrajectory::ZERO;
        for (field, (name, count)) in START_FIELDS.iter().enumerate() {
            assert!(flip_start(&mut start, (field, 3, count - 1, 5)), "{name}");
            assert!(!flip_start(&mut start, (field, 3, *count, 5)), "{name}");
        }
        assert!(!flip_start(&mut start, (0, NODES, 0, 0)));
    }
}
