//! The static memory of a plan, part by part.

use super::{EmbeddedSolver, Workspace};
use crate::model::TargetState;
use crate::scp::{Iterates, Residuals};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory,
    size::{NG, NU, NX},
};
use nalgebra::SVector;
use remora_nn as nn;
use remora_qp::{Qp, Solution};

/// Memory for the learned models that come with the planner: three blocks, width 96, a token a node.
pub type NetworkMemory = nn::Memory<3, 96, NODES>;

/// A part of the memory that a plan with a learned start needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its name, in snake case.
    pub name: &'static str,
    /// Its size.
    pub bytes: usize,
}

/// All of it: [`Workspace`], [`EmbeddedSolver`] and [`NetworkMemory`].
pub const TOTAL_BYTES: usize = Workspace::BYTES + EmbeddedSolver::BYTES + NetworkMemory::BYTES;

/// Parts of that memory; their sizes add up to [`TOTAL_BYTES`] on any target.
///
/// - `world`: the target's tumble at the nodes;
/// - `stage_1`, `stage_2`: four trajectories and the log of each stage;
/// - `subproblem`: the quadratic program, its solution and its correction's;
/// - `loop_scratch`: residuals, and what second-order corrections put aside;
/// - `embedded_solver`: iterate, factored Newton system, directions;
/// - `kv_cache`, `network_scratch`: the network's keys and values, and what one node's tokens need;
/// - `padding`: what alignment costs between the workspace's fields.
pub const fn parts() -> [Part; 9] {
    let world = size_of::<[TargetState; NODES]>();
    let stage_1 = size_of::<Iterates<TranslationTrajectory<NODES>>>();
    let stage_2 = size_of::<Iterates<ReorientationTrajectory<NODES, LINKS>>>();
    let subproblem =
        size_of::<Qp<NODES, NX, NU, NG>>() + 2 * size_of::<Solution<NODES, NX, NU, NG>>();
    let loop_scratch = 3 * size_of::<Residuals<NODES, NX, NG>>()
        + size_of::<[SVector<f64, NX>; NODES]>()
        + size_of::<[SVector<f64, NG>; NODES]>();
    let named = world + stage_1 + stage_2 + subproblem + loop_scratch;
    let (cache, network) = (NetworkMemory::CACHE_BYTES, NetworkMemory::BYTES);
    [
        Part { name: "world", bytes: world },
        Part { name: "stage_1", bytes: stage_1 },
        Part { name: "stage_2", bytes: stage_2 },
        Part { name: "subproblem", bytes: subproblem },
        Part { name: "loop_scratch", bytes: loop_scratch },
        Part { name: "embedded_solver", bytes: EmbeddedSolver::BYTES },
        Part { name: "kv_cache", bytes: cache },
        Part { name: "network_scratch", bytes: network - cache },
        Part { name: "padding", bytes: Workspace::BYTES - named },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes of fields, from the fields themselves.
    fn size<T>(_: &T) -> usize {
        size_of::<T>()
    }

    fn bytes(name: &str) -> usize {
        parts().iter().find(|part| part.name == name).map(|part| part.bytes).unwrap()
    }

    #[test]
    fn the_parts_are_all_of_the_memory() {
        let sum: usize = parts().iter().map(|part| part.bytes).sum();
        assert_eq!(sum, TOTAL_BYTES);
        // Four fields, each aligned to at most eight bytes.
        assert!(bytes("padding") < 4 * 8, "{}", bytes("padding"));
    }

    #[test]
    fn the_parts_are_the_workspaces_fields() {
        static BLANK: Workspace = Workspace::new();
        let w = &BLANK;
        assert_eq!(bytes("world"), size(&w.target));
        assert_eq!(bytes("stage_1"), size(&w.translation));
        assert_eq!(bytes("stage_2"), size(&w.reorientation));
        assert_eq!(bytes("subproblem") + bytes("loop_scratch"), size(&w.scratch));
        assert_eq!(bytes("subproblem"), size(&w.scratch.qp) + 2 * size(&w.scratch.step));
    }

    /// Workspace and solver of seven joints; the network is for three.
    #[test]
    fn seven_joints_fit_into_two_and_a_half_mebibytes() {
        let bytes = crate::plan::ArmPlanner::<7, 20, 10>::BYTES;
        assert!(bytes <= 5 << 19, "{bytes}");
    }

    #[test]
    fn the_cache_has_the_documented_size() {
        assert_eq!(bytes("kv_cache"), 3 * NODES * (2 * 96 + 64));
        assert_eq!(bytes("network_scratch"), 180 * 96 + 20 * NODES);
    }

    #[test]
    fn names_are_unique_words() {
        for (i, part) in parts().iter().enumerate() {
            assert!(part.name.bytes().all(|c| c.is_ascii_lowercase() || b"_12".contains(&c)));
            assert!(parts().iter().skip(i + 1).all(|other| other.name != part.name));
        }
    }
}
