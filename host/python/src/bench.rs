//! Planners at work, and the caller that waits for them.

use crate::raised::{Failure, look};
use crate::waiting::Caller;
use remora_host::approach::Approach;
use remora_host::formats::NamedScenario;
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
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

impl Bench<'_> {
    /// Refuses a scenario before planning, and goes on no longer than the caller waits.
    pub(crate) fn look(
        &self,
        request: &PlanRequest,
        scenario: &NamedScenario,
    ) -> Result<(), Failure> {
        self.caller.go_on()?;
        look(request.refusal(scenario), scenario)
    }

    /// Plans Stage 1 of a scenario.
    pub(crate) fn approach(
        &mut self,
        request: &PlanRequest,
        scenario: &NamedScenario,
    ) -> Result<Approach, Failure> {
        let refused = |refusal| Failure::Refused(scenario.id.clone(), refusal);
        self.planner.approach(request, scenario).map_err(refused)
    }
}
