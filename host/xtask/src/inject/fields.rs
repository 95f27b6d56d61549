//! Data that bits are flipped in: names and sizes of the planner's data, and the numbers themselves.

use remora_core::advanced::guidance::GuidancePart;
use remora_core::advanced::qp::{Qp, Solution};
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory, size};

pub(super) const NX: usize = size::NX;
pub(super) const NU: usize = size::NU;
pub(super) const NG: usize = size::NG;

/// A subproblem of the planner.
pub(super) type Program = Qp<NODES, NX, NU, NG>;
pub(super) type Answer = Solution<NODES, NX, NU, NG>;

/// The name of data, and how many numbers they have.
pub type Field = (&'static str, usize);

/// Fields of a subproblem with their sizes: those of each node, then those it has once.
pub const PROGRAM_FIELDS: [Field; 18] = [
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
    ("complementarity", 1),
];

/// Fields of its solution at each node.
pub const SOLUTION_FIELDS: [Field; 6] = [
    ("x", NX),
    ("u", NU),
    ("defect_multiplier", NX),
    ("bound_multiplier_x", NX),
    ("bound_multiplier_u", NU),
    ("row_multiplier", NG),
];

/// Fields of Stage 2's initial guess at each node.
pub const START_FIELDS: [Field; 6] = [
    ("attitude", 4),
    ("joint_angle", LINKS),
    ("rate", 3),
    ("joint_rate", LINKS),
    ("bus_torque", 3),
    ("joint_torque", LINKS),
];

/// Fields of Stage 1's trajectory at each node.
pub const PATH_FIELDS: [Field; 3] = [("position", 3), ("velocity", 3), ("force", 3)];

/// Fields of a loop's residuals at each node.
pub const RESIDUAL_FIELDS: [Field; 2] = [("defect", NX), ("row", NG)];

/// Scalars that a loop keeps.
pub const SCALAR_FIELDS: [Field; 6] = [
    ("radius", 1),
    ("weight", 1),
    ("violation", 1),
    ("cost", 1),
    ("best_cost", 1),
    ("best_violation", 1),
];

/// Fields of guidance's state, in the order of [`GuidancePart::ALL`].
pub const GUIDANCE_FIELDS: [Field; GuidancePart::ALL.len()] = [
    ("feedback", 10),
    ("settings", 27),
    ("cursor", 18 + 3 * LINKS),
    ("integrals", 6 + LINKS),
    ("offset", 9),
    ("times", 4),
    ("commanded", 6 + LINKS),
    ("leaving", 6 + LINKS),
    ("jump", 7 + LINKS),
];

pub(super) fn of_program(qp: &mut Program, field: usize, node: usize) -> Option<&mut [f64]> {
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
        17 => std::slice::from_mut(&mut qp.complementarity),
        _ => return None,
    })
}

pub(super) fn of_solution(solution: &mut Answer, field: usize, node: usize) -> Option<&mut [f64]> {
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

pub(super) fn flip(numbers: Option<&mut [f64]>, element: usize, bit: u32) -> bool {
    let Some(number) = numbers.and_then(|numbers| numbers.get_mut(element)) else { return false };
    *number = f64::from_bits(number.to_bits() ^ (1 << (bit % 64)));
    true
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
