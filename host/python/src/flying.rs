//! Flying plans in the truth.

use crate::argument::Argument;
use crate::flight::Flight;
use crate::plan::Plan;
use crate::raised::{argument, raised};
use crate::request;
use crate::waiting::{Caller, waited};
use pyo3::prelude::*;
use remora_flight::errors_file;
use remora_flight::flight::{Controller, JointControl};
use remora_flight::flights_file::MAX_RUNS;
use remora_flight::options::Options;
use remora_flight::pilot::{Pilot, Sortie};
use remora_flight::row::FlightRow;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::pool;
use remora_truth::{Dispersion, Errors};
use std::path::{Path, PathBuf};

fn sortie(plan: &Plan) -> PyResult<Sortie> {
    if !plan.file.integrator.is_flown() {
        let reason = "is euler: between its nodes the plan says nothing; plan with rk4";
        return Err(argument("plan", reason));
    }
    Sortie::of(Path::new("plan"), &plan.file).map_err(raised)
}

/// Options of the runs of a plan.
struct FlightSetup {
    sortie: Sortie,
    /// Checksum of the plan.
    of: u64,
    options: Options,
    errors: Errors,
    seed: u64,
}

impl FlightSetup {
    fn fly(&self, caller: &Caller, pilot: &mut Pilot, run: u64) -> Result<Flight, Error> {
        let dispersion = Dispersion { errors: self.errors.clone(), seed: self.seed, run };
        let mut samples = Vec::new();
        let flown = pilot
            .fly(&self.sortie, &self.options.settings(), &dispersion, Some(&mut samples))
            .map_err(|error| Error::Thread { reason: format!("the world: {error}") })?;
        // The end of a stopped flight does not count.
        if caller.go_on().is_err() {
            return Err(Error::Thread { reason: "was stopped".into() });
        }
        let row = FlightRow::from(&flown);
        let drawn = flown.drawn.into_iter().map(|drawn| (drawn.name, drawn.value)).collect();
        Ok(Flight { run, of: self.of, flown: row, drawn, samples })
    }
}

/// Flies a plan, for `remora.fly`; with `runs`, a list of flights with a draw of errors each.
#[pyfunction]
#[pyo3(signature = (plan, *, errors, seed, run, runs, controller, joints, j2, jobs))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn fly<'py>(
    py: Python<'py>,
    plan: Argument<Py<Plan>>,
    errors: Option<Argument<PathBuf>>,
    seed: Argument<u64>,
    run: Argument<u64>,
    runs: Option<Argument<u64>>,
    controller: Argument<&str>,
    joints: Argument<&str>,
    j2: Argument<bool>,
    jobs: Option<Argument<usize>>,
) -> PyResult<Bound<'py, PyAny>> {
    let one_of =
        |name, given: &str, all: &str| argument(name, format!("{given:?} is none of {all}"));
    let plan = plan.named("plan")?;
    let (seed, run, j2) = (seed.named("seed")?, run.named("run")?, j2.named("j2")?);
    let (controller, joints) = (controller.named("controller")?, joints.named("joints")?);
    let controller = Controller::of_name(controller)
        .ok_or_else(|| one_of("controller", controller, "track, replan"))?;
    let joints =
        JointControl::of_name(joints).ok_or_else(|| one_of("joints", joints, "torque, servo"))?;
    let (runs, jobs) = (Argument::optional(runs, "runs")?, request::jobs(jobs)?);
    if runs.is_some_and(|runs| runs > MAX_RUNS) {
        return Err(argument("runs", format!("must be {MAX_RUNS} at most")));
    }
    let (errors, shared) = (Argument::optional(errors, "errors")?, plan);
    let plan = shared.get();
    let integrator = plan.file.integrator;
    let options = Options { controller, joints, j2, integrator, ..Options::default() };
    let errors = errors_file::chosen(errors.as_deref(), plan.mission.joints()).map_err(raised)?;
    let sortie = sortie(plan)?;
    sortie.check(&options).map_err(|error| argument("j2", error.reason))?;
    let flying = FlightSetup { sortie, of: plan.output(), options, errors, seed };
    let Some(runs) = runs else {
        let flight = waited(py, move |caller| {
            Ok(flying.fly(caller, &mut Pilot::stopped_by(caller.shared_clock()), run)?)
        })?;
        return Ok(Bound::new(py, flight)?.into_any());
    };
    let pending: Vec<u64> = (run..run.saturating_add(runs)).collect();
    let flights = waited(py, move |caller| {
        let mut flights = Vec::new();
        let keep = |_, flight| {
            flights.push(flight);
            Ok(())
        };
        let pilot = |_| Pilot::stopped_by(caller.shared_clock());
        let fly = |pilot: &mut Pilot, run| flying.fly(caller, pilot, run);
        pool::plan_all_with(jobs, &pending, pilot, fly, keep)?;
        flights.sort_by_key(|flight: &Flight| flight.run);
        Ok(flights)
    })?;
    flights.into_pyobject(py)
}
