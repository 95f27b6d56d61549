//! Bounds of every loop whose length depends on data, in one table.
//!
//! All other loops of this crate run over arrays whose size is part of their type. Each loop of
//! the table carries a comment `Bound: NAME` in its source; a test of the crate compares the two.
//! All tries of a stage share one budget of iterations. A bound is what ends a loop where nothing else does; the deadline
//! ([`Options::deadline_s`](crate::planner::PlanSettings)) ends the long ones long before.

use crate::dynamics::TRACKING_ITERATIONS;
use crate::guidance::{MAX_DRIFT_STEPS, MAX_ESCAPE_STEPS, MAX_REFERENCE_STEPS};
use crate::model::{MAX_ECCENTRICITY_STEPS, MAX_TUMBLE_SUBSTEPS};
use crate::planner::{MAX_FORCE_TRIALS, MAX_TIGHTENINGS};
use crate::scp::{MAX_CORRECTIONS, MAX_ITERATIONS, MAX_SEARCHES, Settings};
use crate::stages::{MAX_DOUBLINGS, MAX_HALVINGS, MAX_PART_SUBSTEPS, MAX_TARGET_STEPS};
use remora_nn::{TILE, limit};
use remora_qp::dense::MAX_SWEEPS;
use remora_qp::{InteriorPointSettings, MAX_FACTORISATIONS, MAX_SOLVER_ITERATIONS, MAX_STARTS};

/// A loop whose length depends on data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopBound {
    /// Its name: the one in the comment beside the loop.
    pub name: &'static str,
    /// The file it stands in, below `core`.
    pub file: &'static str,
    /// Unit of the counts: one turn's work.
    pub turn: &'static str,
    /// Most turns with the default settings or the largest model that is accepted; none where the
    /// caller's argument is the bound.
    pub default: Option<u64>,
    /// Most turns whatever the (valid) settings; none where the caller's argument is the bound.
    pub most: Option<u64>,
    /// The constant, setting or argument that the bound comes from.
    pub from: &'static str,
    /// Conditions that end the loop earlier.
    pub ends: &'static str,
}

const NOTHING: &str = "-";

/// The defaults, whose numbers the table shows.
const LOOP: Settings = Settings::DEFAULT;
const SOLVER: InteriorPointSettings = InteriorPointSettings::DEFAULT;

/// The widest input of a matrix: the hidden layer of a block.
const LONGEST_ROW: usize = 4 * limit::WIDTH;

/// The table, from the outermost loop inwards.
pub const LOOPS: [LoopBound; 25] = [
    LoopBound {
        name: "trials of less force",
        file: "src/planner/run.rs",
        turn: "Stage 1 with less force, which the wheels can hold",
        default: Some(MAX_FORCE_TRIALS as u64),
        most: Some(MAX_FORCE_TRIALS as u64),
        from: "planner::MAX_FORCE_TRIALS",
        ends: "solved, no iterations left",
    },
    LoopBound {
        name: "tightenings",
        file: "src/planner/run.rs",
        turn: "plan again with wider margins, from the one there is",
        default: Some(MAX_TIGHTENINGS as u64),
        most: Some(MAX_TIGHTENINGS as u64),
        from: "planner::MAX_TIGHTENINGS",
        ends: "verified, no margin would help, no iterations left, deadline",
    },
    LoopBound {
        name: "iterations",
        file: "src/scp/solve.rs",
        turn: "iteration of a stage",
        default: Some(LOOP.max_iterations as u64),
        most: Some(MAX_ITERATIONS as u64),
        from: "scp::Settings::max_iterations, at most scp::MAX_ITERATIONS",
        ends: "converged, feasible where that is enough, radius too small, deadline",
    },
    LoopBound {
        name: "corrections",
        file: "src/scp/trial.rs",
        turn: "second-order correction an iteration, a subproblem each",
        default: Some(LOOP.max_corrections as u64),
        most: Some(MAX_CORRECTIONS as u64),
        from: "scp::Settings::max_corrections, at most scp::MAX_CORRECTIONS",
        ends: "good enough, no better than before, deadline",
    },
    LoopBound {
        name: "searches",
        file: "src/scp/trial.rs",
        turn: "trial of the line search an iteration",
        default: Some(MAX_SEARCHES as u64),
        most: Some(MAX_SEARCHES as u64),
        from: "scp::MAX_SEARCHES",
        ends: "decrease, deadline",
    },
    LoopBound {
        name: "starts",
        file: "qp/src/embedded/mod.rs",
        turn: "start of the solver a subproblem, the iterations of all counted together",
        default: Some(MAX_STARTS as u64),
        most: Some(MAX_STARTS as u64),
        from: "qp::MAX_STARTS",
        ends: "solved, no iterations left, deadline",
    },
    LoopBound {
        name: "solver_iterations",
        file: "qp/src/embedded/iteration.rs",
        turn: "interior-point iteration a subproblem, restarts counted",
        default: Some(SOLVER.max_iterations as u64),
        most: Some(MAX_SOLVER_ITERATIONS as u64),
        from: "qp::InteriorPointSettings, at most qp::MAX_SOLVER_ITERATIONS",
        ends: "solved, stalled, infeasible, not finite, deadline",
    },
    LoopBound {
        name: "factorisations",
        file: "qp/src/embedded/iteration.rs",
        turn: "factorisation of the Newton system an interior-point iteration",
        default: Some(MAX_FACTORISATIONS as u64),
        most: Some(MAX_FACTORISATIONS as u64),
        from: "qp::MAX_FACTORISATIONS",
        ends: "positive definite",
    },
    LoopBound {
        name: "sweeps",
        file: "qp/src/dense/eigen.rs",
        turn: "sweep of Jacobi rotations where curvature is projected, at most once a node",
        default: Some(MAX_SWEEPS as u64),
        most: Some(MAX_SWEEPS as u64),
        from: "qp::dense::MAX_SWEEPS",
        ends: "diagonal, or not finite",
    },
    LoopBound {
        name: "rate_tracking",
        file: "src/dynamics/inverse.rs",
        turn: "step of the dynamics an interval of a rollout with RK4",
        default: Some(TRACKING_ITERATIONS as u64),
        most: Some(TRACKING_ITERATIONS as u64),
        from: "dynamics::TRACKING_ITERATIONS",
        ends: "rates reached",
    },
    LoopBound {
        name: "substeps",
        file: "src/dynamics/step.rs",
        turn: "RK4 substep an interval",
        default: None,
        most: None,
        from: "dynamics::Integrator::Rk4::substeps, the caller's",
        ends: NOTHING,
    },
    LoopBound {
        name: "attitude_substeps",
        file: "src/model/target.rs",
        turn: "RK4 substep of the target's motion a node",
        default: Some(MAX_TUMBLE_SUBSTEPS as u64),
        most: Some(MAX_TUMBLE_SUBSTEPS as u64),
        from: "model::MAX_TUMBLE_SUBSTEPS",
        ends: "as many as its rate needs",
    },
    LoopBound {
        name: "target_steps",
        file: "src/stages/verifier/target.rs",
        turn: "step of the target's motion a tenth of an interval, in the verifier",
        default: Some(MAX_TARGET_STEPS as u64),
        most: Some(MAX_TARGET_STEPS as u64),
        from: "stages::verifier::MAX_TARGET_STEPS",
        ends: "there, not finite",
    },
    LoopBound {
        name: "doublings",
        file: "src/stages/verifier/reorientation.rs",
        turn: "integration of an interval by RK4, in the verifier, each of twice the substeps",
        default: Some(MAX_DOUBLINGS as u64),
        most: Some(MAX_DOUBLINGS as u64),
        from: "stages::verifier::MAX_DOUBLINGS",
        ends: "no different from the one before, not finite",
    },
    LoopBound {
        name: "verified_substeps",
        file: "src/stages/verifier/reorientation.rs",
        turn: "RK4 substep a tenth of an interval, in the verifier",
        default: Some(MAX_PART_SUBSTEPS as u64),
        most: Some(MAX_PART_SUBSTEPS as u64),
        from: "stages::verifier::MAX_PART_SUBSTEPS",
        ends: NOTHING,
    },
    LoopBound {
        name: "halvings",
        file: "src/stages/verifier/distance.rs",
        turn: "point of a segment whose distance to a box is looked at",
        default: Some(MAX_HALVINGS as u64),
        most: Some(MAX_HALVINGS as u64),
        from: "stages::verifier::MAX_HALVINGS",
        ends: "certified, further than another, not finite",
    },
    LoopBound {
        name: "layers",
        file: "nn/src/network.rs",
        turn: "block of the network a node; heads, width and tokens within it likewise",
        default: Some(limit::LAYERS as u64),
        most: Some(limit::LAYERS as u64),
        from: "nn::limit, checked when the model is opened",
        ends: NOTHING,
    },
    LoopBound {
        name: "columns",
        file: "nn/src/kernels/x86.rs",
        turn: "group of a row's columns in a matrix kernel; the processors' own take 16 or 32 a turn",
        default: Some(LONGEST_ROW as u64),
        most: Some(LONGEST_ROW as u64),
        from: "4 nn::limit::WIDTH, checked when the model is opened",
        ends: NOTHING,
    },
    LoopBound {
        name: "tile",
        file: "nn/src/kernels/x86.rs",
        turn: "row of a tile of a matrix product",
        default: Some(TILE as u64),
        most: Some(TILE as u64),
        from: "nn::TILE",
        ends: NOTHING,
    },
    LoopBound {
        name: "flow_steps",
        file: "nn/src/decoder.rs",
        turn: "step of the flow decoder a prediction",
        default: Some(limit::STEPS as u64),
        most: Some(u16::MAX as u64),
        from: "nn::limit::STEPS in a file, Network::set_flow_steps of the caller",
        ends: NOTHING,
    },
    LoopBound {
        name: "checked_bytes",
        file: "nn/src/crc.rs",
        turn: "byte of a model file",
        default: None,
        most: None,
        from: "the file's length, or the caller's slice of it",
        ends: NOTHING,
    },
    LoopBound {
        name: "steps of a reference's target",
        file: "src/model/target.rs",
        turn: "one RK4 step of the target's motion, as guidance goes on within an interval",
        default: Some(MAX_REFERENCE_STEPS as u64),
        most: Some(MAX_REFERENCE_STEPS as u64),
        from: "guidance::MAX_REFERENCE_STEPS",
        ends: NOTHING,
    },
    LoopBound {
        name: "steps of an escape",
        file: "src/guidance/safety.rs",
        turn: "one RK4 step of an abort from a node",
        default: Some(MAX_ESCAPE_STEPS as u64),
        most: Some(MAX_ESCAPE_STEPS as u64),
        from: "guidance::MAX_ESCAPE_STEPS",
        ends: "clear of the target",
    },
    LoopBound {
        name: "steps of a drift",
        file: "src/guidance/safety.rs",
        turn: "one step of a free drift from a node",
        default: Some(MAX_DRIFT_STEPS as u64),
        most: Some(MAX_DRIFT_STEPS as u64),
        from: "guidance::MAX_DRIFT_STEPS",
        ends: "one orbit",
    },
    LoopBound {
        name: "steps about an ellipse",
        file: "src/model/feasibility/eccentricity.rs",
        turn: "one RK4 step of free motion about an eccentric orbit, before planning",
        default: Some(MAX_ECCENTRICITY_STEPS as u64),
        most: Some(MAX_ECCENTRICITY_STEPS as u64),
        from: "model::MAX_ECCENTRICITY_STEPS",
        ends: "the end of the horizon",
    },
];

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{collections::BTreeMap, fs, path::Path, string::String, vec::Vec};

    /// Lines of the source of this crate and of those below it by file, without the modules of tests.
    fn source() -> BTreeMap<String, Vec<String>> {
        fn gather(folder: &Path, root: &Path, files: &mut BTreeMap<String, Vec<String>>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
                if path.is_dir() {
                    gather(&path, root, files);
                } else if !name.contains("tests")
                    && name.ends_with(".rs")
                    && name != "src/bounds.rs"
                {
                    let text = fs::read_to_string(&path).unwrap();
                    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
                    files.insert(name, code.lines().map(String::from).collect());
                }
            }
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut files = BTreeMap::new();
        for folder in ["qp/src", "nn/src", "src"] {
            gather(&root.join(folder), root, &mut files);
        }
        files
    }

    fn marks(line: &str) -> Option<&str> {
        let rest = line.trim().strip_prefix("// Bound: ")?;
        rest.split([',', '.']).next()
    }

    // Verifies REM-SCP-003.
    #[test]
    fn every_open_loop_names_its_bound() {
        for (file, lines) in source() {
            for (i, line) in lines.iter().enumerate() {
                let code = line.trim();
                if !(code.starts_with("while ") || code.starts_with("loop ")) {
                    continue;
                }
                let bound = i.checked_sub(1).and_then(|before| marks(&lines[before]));
                assert!(bound.is_some(), "core/{file}:{}: no `// Bound: NAME.` above", i + 1);
            }
        }
    }

    // Verifies REM-SCP-003.
    #[test]
    fn the_table_has_the_marks_of_the_source() {
        let files = source();
        for (file, lines) in &files {
            for name in lines.iter().filter_map(|line| marks(line)) {
                let known = name == "constant" || LOOPS.iter().any(|row| row.name == name);
                assert!(known, "core/{file}: Bound: {name} is not in the table");
            }
        }
        for row in &LOOPS {
            let lines = files.get(row.file).unwrap_or_else(|| panic!("no core/{}", row.file));
            let there = lines.iter().any(|line| marks(line) == Some(row.name));
            assert!(there, "core/{}: no Bound: {}", row.file, row.name);
            assert!(row.default <= row.most || row.most.is_none(), "{}", row.name);
        }
    }
}
