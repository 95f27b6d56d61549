//! The Python package `remora`, compiled part: what the library does, with arrays and exceptions. The rest
//! of the package, its stubs and its tests stand beside it in `python` and `tests`.
//!
//! Data goes down this list, imports go up it:
//!
//! - `raised`: errors as exceptions;
//! - `argument`: arguments, refused by their names;
//! - `waiting`: long work, which Ctrl-C interrupts;
//! - `arrays`: rows as arrays, which own their memory;
//! - `urdf`, `mission`, `scenario`: what is planned for;
//! - `scene`: an approach as a guess sees it;
//! - `bench`: planners at work;
//! - `start`: the initial guess of Stage 2, learned or the caller's own;
//! - `flight`: flights of plans in the truth;
//! - `plan`, `made`: plans, and their sources;
//! - `request`: requests for plans, and planning one after the other;
//! - `many`, `compare`: plans on several threads, and guesses against each other;
//! - `subproblem`: the programs of a plan for other solvers;
//! - `flying`: plans flown in the truth;
//! - `episodes`: approaches flown by policies, many at once.
//!
//! Long work runs without the interpreter's lock, on a thread with a stack of its own, so that
//! every function may be called on any thread.
#![forbid(unsafe_code)]

mod argument;
mod arrays;
mod bench;
mod compare;
mod episodes;
mod flight;
mod flying;
mod made;
mod many;
mod mission;
mod plan;
mod raised;
mod request;
mod scenario;
mod scene;
mod start;
mod subproblem;
mod urdf;
mod waiting;

/// The compiled part of the package `remora`.
#[pyo3::pymodule]
mod _remora {
    #[pymodule_export]
    use super::{
        compare::compare_guesses,
        episodes::Episodes,
        flight::Flight,
        flying::fly,
        many::{Rows, plan_many},
        mission::Mission,
        plan::Plan,
        raised::Refused,
        request::plan,
        scenario::{Scenario, draw, scenarios},
        scene::Scene,
        start::Model,
        subproblem::{Subproblem, subproblem},
    };

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        remora_host::notes::show_by(|note| eprintln!("remora: note: {note}"));
        // Loading numpy's interface with the first array panics on Ctrl-C: load it here.
        drop(numpy::PyArray1::<f64>::from_slice(module.py(), &[]));
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
