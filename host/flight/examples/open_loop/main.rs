//! Plans' forces and torques flown as they stand in the truth, for other simulators to fly the same.
//!
//! ```text
//! cargo run --release -p remora-flight --example open_loop -- FOLDER PLAN.plan.json...
//! ```
//!
//! writes `FOLDER/PLAN.open-loop.json` for each plan: vehicle, start, what acts when, and where the tip was
//! at the nodes, in each of the worlds of `Case`. The keys are told in `file`; `ci/cross_flight.py` reads
//! them.

mod file;

use file::{Case, OpenLoopFile};
use remora_host::error::Error;
use remora_host::formats::{PlanFile, json, make_directory, write_atomically};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let Some((folder, plans)) = arguments.split_first().filter(|(_, plans)| !plans.is_empty())
    else {
        eprintln!("usage: open_loop FOLDER PLAN.plan.json...");
        return ExitCode::from(2);
    };
    let all = || {
        make_directory(folder)?;
        plans.iter().try_for_each(|plan| fly(folder, plan))
    };
    match all() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn fly(folder: &Path, file: &Path) -> Result<(), Error> {
    let plan = PlanFile::read(file)?;
    let flown = OpenLoopFile::fly(file, &plan, &Case::ALL)?;
    let out = folder.join(format!("{}.open-loop.json", plan.scenario));
    let text = json::to_text(&flown)
        .map_err(|error| Error::Output { file: out.clone(), reason: error.to_string() })?;
    write_atomically(&out, text.as_bytes())?;
    println!("{}", out.display());
    Ok(())
}
