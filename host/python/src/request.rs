//! How plans are asked for: the arguments that planning, campaigns and comparisons share.

use crate::argument::Argument;
use crate::arrays;
use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::argument;
use crate::start::{Model, Start};
use pyo3::prelude::*;
use remora_host::choice::Choice;
use remora_host::learned::Learned;
use remora_host::method::{Deadline, Integrator, Method, Mode, Qp};
use std::num::NonZeroUsize;
use std::sync::{Arc, OnceLock};

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
            None => Start::Model(built_in(integrator)),
        };
        let warm_start = start.warm_start();
        let method =
            Method { mode, warm_start, qp: Qp::Embedded, integrator, deadline, sharp: false };
        Ok(Self { mission: Mission::or_default(mission)?, method, start })
    }

    /// A copy of the request with another guess, given under a name.
    pub(crate) fn started_from(&self, name: &str, guess: &Bound<'_, PyAny>) -> PyResult<Self> {
        let start = start(name, guess, self.method.integrator)?;
        let method = Method { warm_start: start.warm_start(), ..self.method };
        Ok(Self { mission: self.mission.clone(), method, start })
    }
}

/// The built-in model of an integrator, looked at once.
pub(crate) fn built_in(integrator: Integrator) -> Arc<Learned> {
    static MODELS: [OnceLock<Arc<Learned>>; 2] = [OnceLock::new(), OnceLock::new()];
    let model = &MODELS[usize::from(integrator.is_flown())];
    model.get_or_init(|| Arc::new(Learned::built_in(integrator))).clone()
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

/// Reason to refuse a guess of another kind.
const EXPECTED: &str = "is neither \"model\", \"heuristic\", a Model, a Plan, (Plan, seconds), an array of torques \
                        nor a function of a Scene";

/// Initial guess of Stage 2, given under a name.
pub(crate) fn start(
    name: &str,
    given: &Bound<'_, PyAny>,
    integrator: Integrator,
) -> PyResult<Start> {
    if let Ok(word) = given.extract::<String>() {
        return match word.as_str() {
            "heuristic" => Ok(Start::Heuristic),
            "model" => Ok(Start::Model(built_in(integrator))),
            _ => Err(argument(name, format!("{word:?} {EXPECTED}"))),
        };
    }
    if let Ok(model) = given.cast::<Model>() {
        return Ok(Start::Model(model.get().learned.clone()));
    }
    if let Ok(plan) = given.cast::<Plan>() {
        return Ok(Start::Left(Arc::new(plan.get().nominal()), 0.0));
    }
    if let Ok((plan, elapsed)) = given.extract::<(Bound<'_, Plan>, f64)>() {
        if !(elapsed >= 0.0 && elapsed.is_finite()) {
            let reason = format!("{elapsed} s have passed: must be finite and not negative");
            return Err(argument(name, reason));
        }
        return Ok(Start::Left(Arc::new(plan.get().nominal()), elapsed));
    }
    if given.is_callable() {
        return Ok(Start::Function(Arc::new(given.clone().unbind())));
    }
    let Ok(array) = arrays::array(given) else {
        return Err(argument(name, format!("{} {EXPECTED}", given.get_type())));
    };
    let shape = array.getattr("shape")?;
    match shape.extract::<(usize, usize)>() {
        // Whether it is the arm's is looked at where the plan is made.
        Ok(shape) => {
            let torques = arrays::numbers(name, &array, shape)?;
            Ok(Start::Torques { torques, shape })
        }
        Err(_) => {
            let reason = format!("has shape {shape}, expected a row of torques an interval");
            Err(argument(name, reason))
        }
    }
}
