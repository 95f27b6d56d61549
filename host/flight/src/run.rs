//! Single runs of a folder's flights: flown with their history, and shown.

use crate::flight::{Ending, FlightOutcome};
use crate::flights_file::{FLIGHTS, FlightsFile};
use crate::history::{self, Sample};
use crate::pilot::{Pilot, Sortie};
use crate::row::{FlightRow, Row};
use remora_host::error::Error;
use remora_host::formats::{PlanFile, Verdict, check_arm, make_directory, write_atomically};
use remora_truth::WorldError;
use remora_web::Shown;
use std::path::{Path, PathBuf};

/// Folder of the pages of single runs.
pub const PAGES: &str = "pages";

/// A plan of the flights: its file, its scenario's id, and what can be flown of it.
pub(crate) struct Plan {
    pub(crate) file: PathBuf,
    pub(crate) id: String,
    pub(crate) sortie: Option<Sortie>,
}

/// A plan file of flights in `folder`, all of arms of `joints` joints; one that is not flyable has nothing to fly.
pub(crate) fn planned(folder: &Path, file: &Path, joints: usize) -> Result<Plan, Error> {
    let file = folder.join(file);
    let plan = PlanFile::read(&file)?;
    let id = plan.scenario.clone();
    if plan.verdict == Some(Verdict::NotFlyable) {
        return Ok(Plan { file, id, sortie: None });
    }
    check_arm(plan.inputs.mission.joints(), joints).map_err(|error| {
        Error::input(&file, format!("inputs.mission.{}", error.field), error.reason)
    })?;
    let sortie = Sortie::of(&file, &plan)?;
    Ok(Plan { file, id, sortie: Some(sortie) })
}

/// Flies one run of a folder's flights again; its history goes to `history/RUN.jsonl` and `RUN.parquet`.
///
/// # Errors
/// A folder without flights; a run that it does not have; a plan that is gone or cannot be flown.
pub fn rerun(folder: &Path, run: u64) -> Result<(Row, PathBuf), Error> {
    let asked = FlightsFile::read(folder)?;
    let Some(file) = asked.plans.get((run / asked.runs.max(1)) as usize) else {
        let reason =
            format!("there is no run {run}: runs are 0 to {}", asked.count().saturating_sub(1));
        return Err(Error::input(&folder.join(FLIGHTS), "runs", reason));
    };
    let plan = planned(folder, file, asked.joints)?;
    let mut pilot = Pilot::default();
    let Some(sortie) = &plan.sortie else {
        return Err(Error::input(file, "verdict", "is not flyable: there was nothing to fly"));
    };
    make_directory(folder)?;
    let (history, _, flown) = keep_history(folder, &asked, (&plan.id, sortie), &mut pilot, run)
        .map_err(|error| of_folder(folder, error))?;
    let row = Row { run, scenario: plan.id, flown: Some(FlightRow::from(&flown)) };
    Ok((row, history))
}

/// Flies a run with its history, which goes to a file.
pub(crate) fn keep_history(
    folder: &Path,
    asked: &FlightsFile,
    (scenario, sortie): (&str, &Sortie),
    pilot: &mut Pilot,
    run: u64,
) -> Result<(PathBuf, Vec<Sample>, FlightOutcome), Error> {
    let mut samples = Vec::new();
    let (settings, dispersion) = (asked.options.settings(), asked.dispersion(run));
    let flown = pilot
        .fly(sortie, &settings, &dispersion, Some(&mut samples))
        .map_err(|error| wrong_world(run, &error))?;
    let folder = folder.join("history");
    make_directory(&folder)?;
    let file = folder.join(format!("{run}.parquet"));
    history::write(&file, &samples, (run, scenario))?;
    Ok((file, samples, flown))
}

/// Writes the page of one run beside its plan.
pub(crate) fn write_page(
    folder: &Path,
    plan: &Plan,
    run: u64,
    samples: &[Sample],
) -> Result<(), Error> {
    let file = PlanFile::read(&plan.file)?;
    let flights = vec![history::shown(run, samples)];
    let shown = Shown { plan: &file, flights };
    let text = remora_web::page(&[shown]).map_err(|failure| failure.error.at(&plan.file))?;
    let folder = folder.join(PAGES);
    make_directory(&folder)?;
    write_atomically(&folder.join(format!("{run}.html")), text.as_bytes())
}

pub(crate) fn is_captured(row: &Row) -> bool {
    row.flown.as_ref().is_some_and(|flown| flown.ending == Ending::Captured)
}

pub(crate) fn failed(file: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::Output { file: file.into(), reason: error.to_string() }
}

/// Error that blames `--errors` for a world that cannot be flown in.
pub(crate) fn wrong_world(run: u64, error: &WorldError) -> Error {
    let reason = format!("run {run}: the world cannot be flown in: {error}");
    Error::argument("--errors", reason)
}

/// Error that blames the folder's errors instead, where no argument gives them.
pub(crate) fn of_folder(folder: &Path, error: Error) -> Error {
    match error {
        Error::Argument { reason, .. } => Error::input(&folder.join(FLIGHTS), "errors", reason),
        other => other,
    }
}
