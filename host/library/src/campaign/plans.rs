//! The plans that a campaign has written.

use super::{SCENARIOS, plan_name};
use crate::error::Error;
use crate::formats::{Limit, ScenarioSet, json, read_text};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// How many plans there must be, as the campaign's summary says.
#[derive(Deserialize)]
struct Counts {
    scenarios: usize,
    refused: usize,
}

/// Plan files of a campaign that has ended, from its folder, in the order of its scenarios. Scenarios that
/// were refused have none.
///
/// # Errors
/// A campaign that has not ended; plans that are not there.
pub fn plans_of(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let scenarios = ScenarioSet::read(&folder.join(SCENARIOS))?.scenarios;
    let file = folder.join("summary.json");
    let text = read_text(&file, Limit::DOCUMENT)?;
    let counts: Counts = json::parse_value(text.as_bytes())
        .map_err(|error: crate::error::FieldError| error.at(&file))?;
    let name = |id: &str| Path::new("plans").join(plan_name(id));
    let plans: Vec<PathBuf> = scenarios
        .iter()
        .map(|scenario| name(&scenario.id))
        .filter(|plan| folder.join(plan).is_file())
        .collect();
    let expected = counts.scenarios.saturating_sub(counts.refused);
    match plans.len() == expected {
        true => Ok(plans),
        false => {
            let reason = format!(
                "holds {} plans of {expected}: `remora campaign --write plans` makes them",
                plans.len()
            );
            Err(Error::input(&folder.join("plans"), "", reason))
        }
    }
}
