//! `remora fly --rerun`

use super::Output;
use super::options::JsonArgs;
use crate::report;
use remora_flight::run;
use remora_host::error::Error;
use std::path::Path;

/// Flies one run of a folder's flights again, with its history: the same bits.
pub(super) fn rerun(folder: &Path, number: u64, json: JsonArgs) -> Result<Output, Error> {
    let (row, history) = run::rerun(folder, number)?;
    Output::new(report::rerun_report(&row, &history), true).or_json(json.json, &row)
}
