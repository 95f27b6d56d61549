//! Requests for plans: the arguments that planning, campaigns and comparisons share; and planning one.

use crate::argument::Argument;
use crate::bench::{Bench, with_planner};
use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::{Failure, argument};
use crate::scenario::Scenario;
use crate::start::Start;
use crate::waiting::waited;
use pyo3::prelude::*;
use remora_host::choice::Choice;
use remora_host::formats::NamedScenario;
use remora_host::method::{Deadline, Integrator, Method, Mode, Qp};
use remora_host::planning::PlanOutcome;
use remora_host::request::{self, Guess};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Mission, method and start of plans.
pub(crate) struct PlanRequest {
    pub(crate) mission: Mission,
    pub(crate) method: Method,
    pub(crate) start: Start,
}

impl PlanRequest {
    /// Request that the arguments make; a guess that is not given is the built-in model.
    pub(crate) fn of(
        mission: Option<Argument<Mission>>,
        (integrator, mode): (Argument<&str>, Argument<&str>),
        guess: Option<&Bound<'_, PyAny>>,
        deadline_s: Option<Argument<f64>>,
    ) -> PyResult<Self> {
        let mission = Argument::optional(mission, "mission")?;
        let integrator = self::integrator(integrator)?;
        let deadline_s = Argument::optional(deadline_s, "deadline_s")?;
        let mode = mode.named("mode")?;
        let Some(mode) = Mode::of_name(mode) else {
            let reason = format!("{mode:?} is neither \"optimal\" nor \"feasible\"");
            return Err(argument("mode", reason));
        };
        let deadline = deadline_s.map(Deadline::try_from).transpose();
        let deadline = deadline.map_err(|error| argument("deadline_s", error))?;
        let start = match guess {
            Some(guess) => start("initial_guess", guess, integrator)?,
            None => Start::built_in(integrator),
        };
        let warm_start = start.warm_start();
        let method =
            Method { mode, warm_start, qp: Qp::Embedded, integrator, deadline, sharp: false };
        Ok(Self { mission: Mission::or_default(mission)?, method, start })
    }

    /// The library's request, which a stopped clock ends; from the heuristic.
    pub(crate) fn stoppable(&self) -> request::PlanRequest {
        let deadline = self.method.deadline.or(Some(Deadline::FAR));
        let method = Method { deadline, ..self.method };
        request::PlanRequest { mission: *self.mission.judged(), method, ..Default::default() }
    }

    /// Plans a scenario; with the start that can be had again.
    pub(crate) fn plan(
        &self,
        bench: &mut Bench<'_>,
        scenario: &NamedScenario,
    ) -> Result<(PlanOutcome, Start), Failure> {
        let mut request = self.stoppable();
        bench.look(&request, scenario)?;
        let (guess, start) = self.start.guess(bench, &request, scenario)?;
        request.guess = guess;
        Ok((bench.planner.plan_by(&bench.caller.clock(), &request, scenario), start))
    }

    /// A copy of the request with another guess, given under a name.
    pub(crate) fn started_from(&self, name: &str, guess: &Bound<'_, PyAny>) -> PyResult<Self> {
        let start = start(name, guess, self.method.integrator)?;
        let method = Method { warm_start: start.warm_start(), ..self.method };
        Ok(Self { mission: self.mission.clone(), method, start })
    }
}

/// The integrator of a name.
pub(crate) fn integrator(name: Argument<&str>) -> PyResult<Integrator> {
    let name = name.named("integrator")?;
    name.parse().map_err(|error| argument("integrator", format!("{name:?}: {error}")))
}

/// A number of threads; what is not given is the machine's cores.
pub(crate) fn jobs(jobs: Option<Argument<usize>>) -> PyResult<NonZeroUsize> {
    match Argument::optional(jobs, "jobs")? {
        None => Ok(std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)),
        Some(jobs) => NonZeroUsize::new(jobs).ok_or_else(|| argument("jobs", "must be positive")),
    }
}

/// Initial guess of Stage 2, given under a name.
fn start(name: &str, given: &Bound<'_, PyAny>, integrator: Integrator) -> PyResult<Start> {
    let left = |plan: &Plan, elapsed| Start::Ready(Guess::Left(Arc::new(plan.nominal()), elapsed));
    if let Ok(plan) = given.cast::<Plan>() {
        return Ok(left(plan.get(), 0.0));
    }
    let Ok((plan, elapsed)) = given.extract::<(Bound<'_, Plan>, f64)>() else {
        return Start::of(name, given, integrator);
    };
    if !(elapsed >= 0.0 && elapsed.is_finite()) {
        let reason = format!("{elapsed} s have passed: must be finite and not negative");
        return Err(argument(name, reason));
    }
    Ok(left(plan.get(), elapsed))
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
