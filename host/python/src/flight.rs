//! Plans flown in the truth.

use crate::argument::Argument;
use crate::arrays;
use crate::plan::Plan;
use crate::raised::{argument, raised};
use crate::request;
use crate::waiting::{Caller, waited};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use remora_flight::errors_file;
use remora_flight::flight::{Controller, JointControl};
use remora_flight::flights_file::MAX_RUNS;
use remora_flight::history::{self, Sample};
use remora_flight::options::Options;
use remora_flight::pilot::{Pilot, Sortie};
use remora_flight::row::FlightRow;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::pool;
use remora_truth::{Dispersion, Errors};
use remora_web::FlightTrack;
use std::path::{Path, PathBuf};

/// One flight: how it ended, and a row a second of what happened.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Flight {
    run: u64,
    /// Checksum of the plan that was flown.
    pub(crate) of: u64,
    flown: FlightRow,
    /// Drawn errors, by name.
    drawn: Vec<(String, f64)>,
    samples: Vec<Sample>,
}

impl Flight {
    /// All its values, in postcard, which keeps every bit.
    fn bytes(&self) -> PyResult<Vec<u8>> {
        let Self { run, of, flown, drawn, samples } = self;
        postcard::to_extend(&(run, of, flown, drawn, samples), Vec::new())
            .map_err(|error| argument("flight", error))
    }

    /// Track of the flight, for a page.
    pub(crate) fn shown(&self) -> FlightTrack {
        history::shown(self.run, &self.samples)
    }

    fn column<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Sample) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.samples.iter().map(of).collect::<Vec<_>>())
    }

    fn rows<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Sample) -> Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.samples.iter().map(of).collect::<Vec<_>>())
    }
}

#[pymethods]
impl Flight {
    /// Number of the run: errors are drawn from the seed and this.
    #[getter]
    fn run(&self) -> u64 {
        self.run
    }

    /// "captured", "missed", "collided" or "aborted".
    #[getter]
    fn ending(&self) -> &'static str {
        self.flown.ending.name()
    }

    /// Whether the end effector is at the port, as capture demands.
    #[getter]
    fn is_captured(&self) -> bool {
        self.ending() == "captured"
    }

    /// When it ended [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.flown.time_s
    }

    /// Distance of the end effector from the port at the end [m].
    #[getter]
    fn miss_m(&self) -> f64 {
        self.flown.arrival.miss_m
    }

    /// Position of the end effector from the port at the end, target's axes [m].
    #[getter]
    fn miss_target_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.flown.arrival.miss_target_m)
    }

    /// Angle between the approach axis and the port's at the end [rad].
    #[getter]
    fn angle_rad(&self) -> f64 {
        self.flown.arrival.angle_rad
    }

    /// Speed of the end effector relative to the port at the end [m/s].
    #[getter]
    fn speed_m_s(&self) -> f64 {
        self.flown.arrival.speed_m_s
    }

    /// Limits that were passed, by name.
    #[getter]
    fn violations(&self) -> Vec<String> {
        self.flown.violations.clone()
    }

    /// How near it came to limits, by name: the room left, or the share of the limit.
    #[getter]
    fn room<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::plain(py, &self.flown.room)
    }

    /// Plans made in flight, and how many of them were verified.
    #[getter]
    fn replans(&self) -> (u32, u32) {
        self.flown.replans.into()
    }

    /// Impulse of the commanded force [N s].
    #[getter]
    fn impulse_n_s(&self) -> f64 {
        self.flown.impulse_n_s
    }

    /// Quantities that were drawn, read back from the truth.
    #[getter]
    fn drawn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        arrays::dict(py, self.drawn.iter().map(|(name, value)| (name.as_str(), *value)))
    }

    /// Times of the rows [s].
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |sample| sample.time_s)
    }

    /// End effector from the port, target's axes [m].
    #[getter]
    fn tip<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| sample.tip_target_m.to_vec())
    }

    /// Joint angles [rad].
    #[getter]
    fn joint_angle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| sample.joints[0].clone())
    }

    /// Joint rates [rad/s].
    #[getter]
    fn joint_rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| sample.joints[1].clone())
    }

    /// Commanded force, RTN [N].
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| sample.force_n.to_vec())
    }

    /// Commanded torques of bus (its axes) and joints [N m].
    #[getter]
    fn torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| [&sample.bus_torque_n_m[..], &sample.joints[2]].concat())
    }

    /// Tracking errors: position [m], attitude [rad], the joint farthest off [rad].
    #[getter]
    fn tracking<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |sample| sample.tracking.to_vec())
    }

    fn __repr__(&self) -> String {
        format!("<remora.Flight {}: {}, miss {:.4} m>", self.run, self.ending(), self.miss_m())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("remora.notebook")?.call_method1("flight", (slf,))
    }

    fn __eq__(&self, other: &Self) -> PyResult<bool> {
        Ok(self.bytes()? == other.bytes()?)
    }

    fn __hash__(&self) -> u64 {
        self.of ^ self.run.rotate_left(32) ^ self.miss_m().to_bits()
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (Py<PyBytes>,))> {
        let read = py.get_type::<Self>().getattr("_of_bytes")?.unbind();
        Ok((read, (PyBytes::new(py, &self.bytes()?).unbind(),)))
    }

    /// The flight of a pickle.
    #[staticmethod]
    fn _of_bytes(bytes: &[u8]) -> PyResult<Self> {
        let read = postcard::from_bytes(bytes).map_err(|error| argument("flight", error))?;
        let (run, of, flown, drawn, samples) = read;
        Ok(Self { run, of, flown, drawn, samples })
    }
}

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
