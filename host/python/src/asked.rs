//! How plans are asked for: the arguments that planning, campaigns and comparisons share.

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
pub(crate) struct Asked {
    pub(crate) mission: Mission,
    pub(crate) method: Method,
    pub(crate) start: Start,
}

impl Asked {
    /// What the arguments say; a guess that is not given is the built-in model.
    pub(crate) fn of(
        mission: Option<Mission>,
        integrator: &str,
        mode: &str,
        guess: Option<&Bound<'_, PyAny>>,
        deadline_s: Option<f64>,
    ) -> PyResult<Self> {
        let integrator = self::integrator(integrator)?;
        let Some(mode) = Mode::of_name(mode) else {
            let reason = format!("{mode:?} is neither \"optimal\" nor \"feasible\"");
            return Err(argument("mode", reason));
        };
        let deadline = deadline_s.map(Deadline::try_from).transpose();
        let deadline = deadline.map_err(|error| argument("deadline_s", error))?;
        let start = match guess {
            Some(guess) => start(guess, integrator)?,
            None => Start::Model(built_in(integrator)),
        };
        let warm_start = start.warm_start();
        let method =
            Method { mode, warm_start, qp: Qp::Embedded, integrator, deadline, sharp: false };
        Ok(Self { mission: Mission::or_default(mission)?, method, start })
    }
}

/// The built-in model of an integrator, looked at once.
pub(crate) fn built_in(integrator: Integrator) -> Arc<Learned> {
    static MODELS: [OnceLock<Arc<Learned>>; 2] = [OnceLock::new(), OnceLock::new()];
    let model = &MODELS[usize::from(integrator.is_flown())];
    model.get_or_init(|| Arc::new(Learned::built_in(integrator))).clone()
}

/// The integrator of a name.
pub(crate) fn integrator(name: &str) -> PyResult<Integrator> {
    name.parse().map_err(|error| argument("integrator", format!("{name:?}: {error}")))
}

/// A number of threads; what is not given is the machine's cores.
pub(crate) fn jobs(jobs: Option<usize>) -> PyResult<NonZeroUsize> {
    match jobs {
        None => Ok(std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)),
        Some(jobs) => NonZeroUsize::new(jobs).ok_or_else(|| argument("jobs", "must be positive")),
    }
}

/// What may be given as a guess.
const EXPECTED: &str = "is neither \"model\", \"heuristic\", a Model, a Plan, (Plan, seconds), an array of torques \
                        nor a function of a Scene";

/// What Stage 2 is to start from.
pub(crate) fn start(given: &Bound<'_, PyAny>, integrator: Integrator) -> PyResult<Start> {
    if let Ok(name) = given.extract::<String>() {
        return match name.as_str() {
            "heuristic" => Ok(Start::Heuristic),
            "model" => Ok(Start::Model(built_in(integrator))),
            _ => Err(argument("initial_guess", format!("{name:?} {EXPECTED}"))),
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
            return Err(argument("initial_guess", reason));
        }
        return Ok(Start::Left(Arc::new(plan.get().nominal()), elapsed));
    }
    if given.is_callable() {
        return Ok(Start::Function(Arc::new(given.clone().unbind())));
    }
    let shape = given.getattr("shape").and_then(|shape| shape.extract::<(usize, usize)>());
    match shape {
        // Whether it is the arm's is looked at where the plan is made.
        Ok(shape) => arrays::numbers("initial_guess", given, shape).map(Start::Torques),
        Err(_) => Err(argument("initial_guess", format!("{} {EXPECTED}", given.get_type()))),
    }
}
