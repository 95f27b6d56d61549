//! One plan.

use crate::argument::Argument;
use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::{Failure, look};
use crate::request::PlanRequest;
use crate::scenario::Scenario;
use crate::start::{self, Start};
use crate::waiting::{Caller, waited};
use pyo3::prelude::*;
use remora_host::formats::NamedScenario;
use remora_host::method::{Deadline, Method};
use remora_host::planning::{PlanOutcome, Planner, refusal};
use std::sync::Mutex;

/// Planners that wait for work, with the memory that they have.
static IDLE: Mutex<Vec<Planner>> = Mutex::new(Vec::new());

/// A planner, and the caller that waits for it.
pub(crate) struct Bench<'a> {
    pub(crate) planner: &'a mut Planner,
    pub(crate) caller: &'a Caller,
}

/// Runs `work` with a planner; to be called on a thread with a stack that is large enough.
pub(crate) fn with_planner<T>(
    caller: &Caller,
    work: impl FnOnce(&mut Bench<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let idle = || IDLE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let waiting = idle().pop();
    let mut planner = waiting.unwrap_or_default();
    let done = work(&mut Bench { planner: &mut planner, caller });
    idle().push(planner);
    done
}

/// A method that a stopped clock ends.
pub(crate) fn stoppable(method: &Method) -> Method {
    Method { deadline: method.deadline.or(Some(Deadline::FAR)), ..*method }
}

impl PlanRequest {
    /// Plans a scenario.
    pub(crate) fn plan(
        &self,
        bench: &mut Bench<'_>,
        scenario: &NamedScenario,
    ) -> Result<(PlanOutcome, Start), Failure> {
        bench.caller.go_on()?;
        let mission = self.mission.judged();
        look(refusal(mission, scenario, &self.method), scenario)?;
        start::plan(bench, mission, scenario, &stoppable(&self.method), &self.start)
    }
}

/// Plans one approach, for `remora.plan`.
#[pyfunction]
#[pyo3(signature = (case, mission, *, integrator, mode, initial_guess, deadline_s))]
pub(crate) fn plan(
    py: Python<'_>,
    case: Argument<Scenario>,
    mission: Option<Argument<Mission>>,
    integrator: Argument<&str>,
    mode: Argument<&str>,
    initial_guess: Option<&Bound<'_, PyAny>>,
    deadline_s: Option<Argument<f64>>,
) -> PyResult<Plan> {
    let scenario = case.named("case")?.named;
    let asked = PlanRequest::of(mission, (integrator, mode), initial_guess, deadline_s)?;
    let (asked, scenario, planned, start) = waited(py, move |caller| {
        let (planned, start) = with_planner(caller, |bench| asked.plan(bench, &scenario))?;
        Ok((asked, scenario, planned, start))
    })?;
    Plan::made(asked.mission, scenario, planned, (asked.method, start))
}
