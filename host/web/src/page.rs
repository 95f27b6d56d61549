//! Plans and flights as one page that loads nothing.

use crate::flown::FlightTrack;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use remora_core::advanced::stages::LINKS;
use remora_files::error::FieldError;
use remora_files::formats::{PlanFile, Program};
use remora_files::method::Integrator;
use remora_files::models::built_in;
use serde::Serialize;
use std::collections::BTreeMap;

/// The page without anything to show; `ci/web.sh` builds it of `source/`.
const TEMPLATE: &str = include_str!("../page.html");

/// Format that the page accepts as its data, and by which other programs know a page of this one.
const FORMAT: &str = "remora-page/1";

/// Text that stands in every page made here, and in no other file.
pub const MARK: &str = "id=\"remora-data\">{\"format\":\"remora-page/";

/// Places in the template.
const DATA: &str = "id=\"remora-data\">null<";
const MODELS: &str = "id=\"remora-models\">{}<";

/// A plan with flights of it.
#[derive(Clone, Debug)]
pub struct Shown<'a> {
    /// The plan.
    pub plan: &'a PlanFile,
    /// Flights of it.
    pub flights: Vec<FlightTrack>,
}

/// A plan that no page can be made of.
#[derive(Clone, Debug, PartialEq)]
pub struct PageError {
    /// Index of the plan.
    pub plan: usize,
    /// Fault of the plan.
    pub error: FieldError,
}

/// Data of the page.
#[derive(Serialize)]
struct Data<'a> {
    format: &'static str,
    program: Program,
    plans: Vec<Entry<'a>>,
    flights: Vec<Of<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    file: &'a PlanFile,
    /// Checksum of mission and scenario, where the page can plan: its planner must find the same.
    input: Option<String>,
}

/// A flight of the plan of that number.
#[derive(Serialize)]
struct Of<'a> {
    plan: usize,
    #[serde(flatten)]
    flown: &'a FlightTrack,
}

/// The page of some plans with their flights, and with the learned models that these plans' integrators
/// start from. A page of one plan takes 1.1 MB, a flight 0.2 MB more.
///
/// # Errors
/// A plan whose inputs are not sound.
pub fn page(shown: &[Shown<'_>]) -> Result<String, PageError> {
    let mut data =
        Data { format: FORMAT, program: Program::this(), plans: Vec::new(), flights: Vec::new() };
    let mut models = BTreeMap::new();
    for (number, Shown { plan, flights }) in shown.iter().enumerate() {
        let input = input(plan).map_err(|error| PageError { plan: number, error })?;
        data.plans.push(Entry { file: plan, input });
        data.flights.extend(flights.iter().map(|flown| Of { plan: number, flown }));
        let name = match plan.integrator {
            Integrator::Euler => "euler",
            Integrator::Rk4 { .. } => "rk4",
        };
        let file = built_in(plan.integrator);
        models.entry(name).or_insert_with(|| BASE64_STANDARD.encode(file));
    }
    let failed = |error| PageError { plan: 0, error };
    let data = script(DATA, &data).map_err(failed)?;
    let models = script(MODELS, &models).map_err(failed)?;
    Ok(TEMPLATE.replacen(DATA, &data, 1).replacen(MODELS, &models, 1))
}

/// The checksum of what a plan was made for, where its arm is one that the page plans for.
fn input(plan: &PlanFile) -> Result<Option<String>, FieldError> {
    if plan.inputs.mission.joints() != LINKS {
        return Ok(None);
    }
    let made_for = plan.inputs.read(&plan.scenario)?;
    Ok(Some(format!("{:016x}", made_for.mission.input_checksum(&made_for.scenario))))
}

/// A place of the template with a value in it. Nothing within a script may look like its end.
fn script(place: &str, value: &impl Serialize) -> Result<String, FieldError> {
    let text = serde_json::to_string(value)
        .map_err(|error| FieldError::new("", error.to_string()))?
        .replace('<', "\\u003c");
    let begin = place.split_inclusive('>').next().unwrap_or_default();
    Ok(format!("{begin}{text}<"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn the_template_has_its_places_once_and_loads_nothing() {
        for place in [DATA, MODELS] {
            assert_eq!(TEMPLATE.matches(place).count(), 1, "{place}");
        }
        assert!(!TEMPLATE.contains(MARK));
        for word in ["<link rel=\"stylesheet", "<script src", "<img", "@import", "url("] {
            assert!(!TEMPLATE.contains(word), "{word}");
        }
    }

    #[test]
    fn what_is_put_into_a_script_does_not_end_it() {
        let text = script(DATA, &"</script><b>").unwrap();
        assert_eq!(text, "id=\"remora-data\">\"\\u003c/script>\\u003cb>\"<");
        let inside = &text[DATA.len() - "null<".len()..text.len() - 1];
        assert_eq!(serde_json::from_str::<Value>(inside).unwrap(), "</script><b>");
    }
}
