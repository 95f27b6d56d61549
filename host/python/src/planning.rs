//! One plan.

use crate::asked::Asked;
use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::{Failure, look};
use crate::scenario::Scenario;
use crate::start::{self, Start};
use pyo3::prelude::*;
use remora_host::error::Error;
use remora_host::formats::NamedScenario;
use remora_host::memory::on_large_stack;
use remora_host::planning::{Planned, Planner, refusal};
use remora_host::with_joints;
use std::sync::Mutex;

/// Planners that wait for work, with the memory that they have.
static IDLE: Mutex<Vec<Planner>> = Mutex::new(Vec::new());

/// Runs `work` with a planner, on a thread with a stack that is large enough.
pub(crate) fn with_planner<T: Send>(
    work: impl FnOnce(&mut Planner) -> Result<T, Failure> + Send,
) -> Result<T, Failure> {
    let idle = || IDLE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    on_large_stack(|| {
        let waiting = idle().pop();
        let mut planner = waiting.unwrap_or_default();
        let done = work(&mut planner);
        idle().push(planner);
        done
    })?
}

impl Asked {
    /// Plans a scenario.
    pub(crate) fn plan(
        &self,
        planner: &mut Planner,
        scenario: &NamedScenario,
    ) -> Result<(Planned, Start), Failure> {
        with_joints!(self.mission.joints(), NL => {
            let mission = self.mission.of::<NL>()?;
            look(refusal(mission, scenario, &self.method), scenario)?;
            start::plan(planner, mission, scenario, &self.method, &self.start)
        } else {
            Err(Error::Thread { reason: "no arm has so many joints".into() }.into())
        })
    }
}

/// Plans one approach.
#[pyfunction]
#[pyo3(signature = (case, mission=None, *, integrator="rk4", mode="optimal", initial_guess=None,
                    deadline_s=None))]
pub(crate) fn plan(
    py: Python<'_>,
    case: Scenario,
    mission: Option<Mission>,
    integrator: &str,
    mode: &str,
    initial_guess: Option<&Bound<'_, PyAny>>,
    deadline_s: Option<f64>,
) -> PyResult<Plan> {
    let asked = Asked::of(mission, integrator, mode, initial_guess, deadline_s)?;
    let scenario = case.named;
    let (planned, start) = py.detach(|| with_planner(|planner| asked.plan(planner, &scenario)))?;
    Plan::made(asked.mission, scenario, planned, (asked.method, start))
}
