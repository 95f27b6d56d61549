//! The embedded solver on subproblems in files, as `remora export --format qp` writes them.
//!
//! For each line of standard input, the path of a `*.qp.json`, it solves that program from nothing and
//! prints a line of JSON: time, iterations, status and solution. `ci/peers.py` runs it beside solvers that
//! others have published.
//!
//! ```sh
//! remora export --format qp --integrator euler --out programs
//! ls programs/stage2-*.qp.json | cargo run --release -p remora-host --example solve_qp
//! ```

use nalgebra::SVector;
use remora_core::advanced::qp::{EmbeddedQp, Qp, QpSolver, Solution};
use remora_core::advanced::stages::{NODES, size};
use remora_core::advanced::time::Deadline;
use remora_host::memory::{on_heap, on_large_stack};
use remora_host::qp_file::QpFile;
use serde_json::json;
use std::collections::HashMap;
use std::error::Error;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::time::Instant;

type Program = Qp<NODES, { size::NX }, { size::NU }, { size::NG }>;
type Point = Solution<NODES, { size::NX }, { size::NU }, { size::NG }>;
type Embedded = EmbeddedQp<NODES, { size::NX }, { size::NU }, { size::NG }>;

fn main() -> Result<(), Box<dyn Error>> {
    on_large_stack(|| answer_all().map_err(|error| error.to_string()))??;
    Ok(())
}

fn answer_all() -> Result<(), Box<dyn Error>> {
    let mut solver: Box<Embedded> = on_heap(EmbeddedQp::new);
    let mut point: Box<Point> = on_heap(|| Point::ZERO);
    let mut programs: HashMap<String, Box<Program>> = HashMap::new();
    let mut out = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        let line = line?;
        if !programs.contains_key(&line) {
            let file = QpFile::read(Path::new(&line))?;
            let program = file.program().map_err(|error| error.at(Path::new(&line)))?;
            programs.insert(line.clone(), program);
        }
        let program = &programs[&line];
        *point = Point::ZERO;
        let begun = Instant::now();
        let outcome = solver.solve(program, &mut point, &Deadline::never());
        let seconds = begun.elapsed().as_secs_f64();
        let (nodes, intervals) = (program.nodes(), program.nodes() - 1);
        let answer = json!({
            "seconds": seconds,
            "iterations": outcome.iterations,
            "status": outcome.status,
            "x": rows(&point.x[..nodes]),
            "u": rows(&point.u[..intervals]),
            "defect_multiplier": rows(&point.defect_multiplier[..intervals]),
            "bound_multiplier_x": rows(&point.bound_multiplier_x[..nodes]),
            "bound_multiplier_u": rows(&point.bound_multiplier_u[..intervals]),
            "row_multiplier": rows(&point.path_multiplier[..nodes]),
        });
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

/// A row a node.
fn rows<const W: usize>(vectors: &[SVector<f64, W>]) -> Vec<&[f64]> {
    vectors.iter().map(SVector::as_slice).collect()
}
