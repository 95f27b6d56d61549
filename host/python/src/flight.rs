//! Flights of plans in the truth.

use crate::arrays;
use crate::raised::argument;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use remora_flight::history::{self, Sample};
use remora_flight::row::FlightRow;
use remora_web::FlightTrack;

/// One flight: how it ended, and a row a second of what happened.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Flight {
    pub(crate) run: u64,
    /// Checksum of the plan that was flown.
    pub(crate) of: u64,
    pub(crate) flown: FlightRow,
    /// Drawn errors, by name.
    pub(crate) drawn: Vec<(String, f64)>,
    pub(crate) samples: Vec<Sample>,
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
