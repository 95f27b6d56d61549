//! Plans flown in the truth.

use crate::arrays;
use crate::asked;
use crate::plan::Plan;
use crate::raised::{argument, raised};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_flight::campaign::MAX_RUNS;
use remora_flight::errors_file;
use remora_flight::flight::{Controller, JointControl};
use remora_flight::history::{self, Sample};
use remora_flight::options::Options;
use remora_flight::pilot::{Pilot, Sortie};
use remora_flight::row::FlownRow;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::memory::on_large_stack;
use remora_host::{pool, with_joints};
use remora_truth::{Dispersion, Errors, Quantity};
use remora_web::Flown;
use std::path::{Path, PathBuf};

/// One flight: how it ended, and a row a second of what happened.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Flight {
    run: u64,
    /// Checksum of the plan that was flown.
    pub(crate) of: u64,
    flown: FlownRow,
    drawn: Vec<Quantity>,
    samples: Vec<Sample>,
}

impl Flight {
    /// As a page shows it.
    pub(crate) fn shown(&self) -> Flown {
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

    /// The same along the target's axes [m].
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

    /// What was drawn, read back from the truth.
    #[getter]
    fn drawn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        arrays::dict(py, self.drawn.iter().map(|drawn| (drawn.name.as_str(), drawn.value)))
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
}

/// Errors of a file, the typical ones, or none.
fn errors(given: Option<PathBuf>, joints: usize) -> Result<Errors, Error> {
    match given {
        None => Ok(Errors::none()),
        Some(name) if name.as_os_str() == "typical" => Ok(Errors::typical()),
        Some(file) => errors_file::read(&file, joints),
    }
}

fn sortie(plan: &Plan) -> PyResult<Sortie> {
    if !plan.file.integrator.is_flown() {
        let reason = "is euler: between its nodes the plan says nothing; plan with rk4";
        return Err(argument("plan", reason));
    }
    with_joints!(plan.mission.joints(), NL => {
        Sortie::of::<NL>(Path::new("plan"), &plan.file).map_err(raised)
    } else {
        Err(argument("plan", "no arm has so many joints"))
    })
}

/// Flies a plan in a world that it does not know; with `runs`, a list of flights with a draw of errors each.
#[pyfunction]
#[pyo3(signature = (plan, *, errors=None, seed=0, run=0, runs=None, controller="track", joints="torque",
                    j2=false, jobs=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, each of them optional")]
pub(crate) fn fly<'py>(
    py: Python<'py>,
    plan: &Plan,
    errors: Option<PathBuf>,
    seed: u64,
    run: u64,
    runs: Option<u64>,
    controller: &str,
    joints: &str,
    j2: bool,
    jobs: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let one_of =
        |name, given: &str, all: &str| argument(name, format!("{given:?} is none of {all}"));
    let controller = Controller::of_name(controller)
        .ok_or_else(|| one_of("controller", controller, "track, replan"))?;
    let joints =
        JointControl::of_name(joints).ok_or_else(|| one_of("joints", joints, "torque, servo"))?;
    let integrator = plan.file.integrator;
    let options = Options { controller, joints, j2, integrator, ..Options::default() };
    let errors = self::errors(errors, plan.mission.joints()).map_err(raised)?;
    let (sortie, of) = (sortie(plan)?, plan.output());
    let fly = |pilot: &mut Pilot, run: u64| {
        let dispersion = Dispersion { errors: errors.clone(), seed, run };
        let mut samples = Vec::new();
        let flown = pilot
            .fly(&sortie, &options.settings(), &dispersion, Some(&mut samples))
            .map_err(|error| Error::Thread { reason: format!("the world: {error}") })?;
        let row = FlownRow::from(&flown);
        Ok(Flight { run, of, flown: row, drawn: flown.drawn, samples })
    };
    let Some(runs) = runs else {
        let flown = py.detach(|| on_large_stack(|| fly(&mut Pilot::default(), run)));
        let flight = flown.and_then(|flown| flown).map_err(raised)?;
        return Ok(Bound::new(py, flight)?.into_any());
    };
    if runs > MAX_RUNS {
        return Err(argument("runs", format!("must be {MAX_RUNS} at most")));
    }
    let pending: Vec<u64> = (run..run.saturating_add(runs)).collect();
    let jobs = asked::jobs(jobs)?;
    let mut flights = Vec::new();
    let keep = |_, flight| {
        flights.push(flight);
        Ok(())
    };
    py.detach(|| pool::plan_all_with(jobs, &pending, |_| Pilot::default(), fly, keep))
        .map_err(raised)?;
    flights.sort_by_key(|flight| flight.run);
    flights.into_pyobject(py)
}
