//! An approach after Stage 1, as a guess of Stage 2 sees it.

use crate::argument::Argument;
use crate::arrays;
use crate::mission::Mission;
use crate::raised::{Failure, argument, raised};
use crate::scenario::Scenario;
use crate::waiting::waited;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use remora_core::advanced::dynamics::{self, Control};
use remora_core::advanced::model::Grid;
use remora_core::advanced::stages::size;
use remora_core::advanced::warmstart::Encoding;
use remora_core::nalgebra::{Vector3, Vector4};
use remora_host::approach::Approach;
use remora_host::formats::{JointVector, MAX_JOINTS, NamedScenario, PlanInputs};
use remora_host::method::{Integrator, Method};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use std::path::Path;

/// State of bus and arm.
type State = dynamics::State<MAX_JOINTS>;

/// Numbers of a state in a row.
fn state_size(joints: usize) -> usize {
    7 + 2 * joints
}

/// A state as a row: attitude, joint angles, rate and joint rates.
fn row(state: &State, joints: usize) -> Vec<f64> {
    let own = |of: &JointVector| of.as_slice()[..joints].to_vec();
    let dynamics::State { attitude, joint_angle, rate, joint_rate } = state;
    let (angles, rates) = (own(joint_angle), own(joint_rate));
    [attitude.as_slice(), &angles, rate.as_slice(), &rates].concat()
}

/// A row's state.
fn state_of(row: &[f64], joints: usize) -> State {
    let (angles, rates) = (&row[4..4 + joints], &row[7 + joints..7 + 2 * joints]);
    let roomy = |of: &[f64]| JointVector::from_fn(|i, _| of.get(i).copied().unwrap_or(0.0));
    State {
        attitude: Vector4::from_column_slice(&row[..4]),
        joint_angle: roomy(angles),
        rate: Vector3::from_column_slice(&row[4 + joints..7 + joints]),
        joint_rate: roomy(rates),
    }
}

fn rows(vectors: &[Vector3<f64>]) -> Vec<[f64; 3]> {
    vectors.iter().map(|v| (*v).into()).collect()
}

/// The encoding of a name.
pub(crate) fn encoding(name: Argument<&str>) -> PyResult<Encoding> {
    match name.named("encoding")? {
        "body" => Ok(Encoding::Body),
        "paper" => Ok(Encoding::Paper),
        "servicer" => Ok(Encoding::Servicer),
        name => Err(argument("encoding", format!("{name:?} is none of body, paper, servicer"))),
    }
}

/// An approach after Stage 1: what a guess of Stage 2 is asked with.
///
/// A state is attitude (x y z w), joint angles, rate (RTN) and joint rates in a row, 7 + 2 J numbers.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Scene {
    approach: Approach,
    named: NamedScenario,
}

impl Scene {
    /// Of an approach.
    pub(crate) fn new(approach: Approach, named: NamedScenario) -> Self {
        Self { approach, named }
    }

    fn grid(&self) -> Grid {
        self.approach.mission.grid(&self.approach.scenario)
    }

    fn state(&self, state: Argument<Vec<f64>>) -> PyResult<State> {
        let (state, size) = (state.named("state")?, state_size(self.joints()));
        match state.len() == size && state.iter().all(|x| x.is_finite()) {
            true => Ok(state_of(&state, self.joints())),
            false => Err(argument("state", format!("expects {size} finite numbers"))),
        }
    }

    fn node(&self, node: Argument<usize>) -> PyResult<usize> {
        let (node, nodes) = (node.named("node")?, self.nodes());
        match node < nodes {
            true => Ok(node),
            false => Err(argument("node", format!("{node} is none of {nodes}"))),
        }
    }
}

#[pymethods]
impl Scene {
    /// Number of nodes.
    #[getter]
    fn nodes(&self) -> usize {
        self.approach.nodes()
    }

    /// Number of the arm's joints.
    #[getter]
    fn joints(&self) -> usize {
        self.approach.mission.joints()
    }

    /// Time from node to node [s].
    #[getter]
    fn dt_s(&self) -> f64 {
        self.grid().interval()
    }

    /// The node from which the joints have their capture angles.
    #[getter]
    fn preset_node(&self) -> usize {
        self.grid().preset_node()
    }

    /// The system's centre of mass at the nodes, RTN [m].
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.approach.translation.position[..self.nodes()]))
    }

    /// Its velocity [m/s].
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.approach.translation.velocity[..self.nodes()]))
    }

    /// Force over the intervals, RTN [N].
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.approach.translation.force[..self.grid().last()]))
    }

    /// The target's attitude at the nodes, body to RTN, x y z w.
    #[getter]
    fn target_attitude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let nodes = self.approach.target[..self.nodes()].iter();
        arrays::matrix(py, &nodes.map(|target| target.attitude.into()).collect::<Vec<[f64; 4]>>())
    }

    /// Its rate, RTN [rad/s].
    #[getter]
    fn target_rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let nodes = self.approach.target[..self.nodes()].iter();
        arrays::matrix(py, &nodes.map(|target| target.rate.into()).collect::<Vec<[f64; 3]>>())
    }

    /// Largest torques: of the bus, then of the joints [N m].
    #[getter]
    fn torque_limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.approach.torque_limits().collect::<Vec<_>>())
    }

    /// Attitude, joint angles, rate and joint rates at the first node, in a row.
    #[getter]
    fn initial_state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &row(&self.approach.initial_state(), self.joints()))
    }

    /// The state at the next node.
    ///
    /// Parameters
    /// ----------
    /// node : from 0.
    /// state : the state at the node.
    /// torques : of bus and joints, held until the next node [N m].
    ///
    /// Returns
    /// -------
    /// The state.
    ///
    /// Raises
    /// ------
    /// ValueError : an argument of another size, or not finite.
    fn step<'py>(
        &self,
        py: Python<'py>,
        node: Argument<usize>,
        state: Argument<Vec<f64>>,
        torques: Argument<Vec<f32>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (node, state) = (self.node(node)?, self.state(state)?);
        let torques = torques.named("torques")?;
        let controls = size::controls(self.joints());
        if torques.len() != controls || !torques.iter().all(|x| x.is_finite()) {
            return Err(argument("torques", format!("expects {controls} finite numbers")));
        }
        let (_, next) = self.approach.step(node, &state, &torques, &Control::ZERO);
        Ok(arrays::vector(py, &row(&next, self.joints())))
    }

    /// The states at the nodes under given torques.
    ///
    /// Parameters
    /// ----------
    /// torques : a row an interval, of bus and joints [N m]; they are kept within their limits.
    ///
    /// Returns
    /// -------
    /// The states, a row a node.
    ///
    /// Raises
    /// ------
    /// ValueError : torques of another shape, or not finite.
    /// KeyboardInterrupt : Ctrl-C, within a second.
    fn rollout<'py>(
        slf: &Bound<'py, Self>,
        torques: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (py, scene) = (slf.py(), slf.clone().unbind());
        let (nodes, joints) = (slf.get().nodes(), slf.get().joints());
        let torques = arrays::numbers("torques", torques, (nodes - 1, size::controls(joints)))?;
        let motion = waited(py, move |_| Ok(scene.get().approach.roll_out(&torques)))?;
        let states = motion.states[..nodes].iter().map(|state| row(state, joints));
        arrays::matrix(py, &states.collect::<Vec<_>>())
    }

    /// Inputs of a network at a node.
    ///
    /// Parameters
    /// ----------
    /// node : from 0.
    /// state : the state at the node.
    /// held : the torques of the interval before.
    /// encoding : "body" and "servicer", as the built-in models see it, or "paper".
    ///
    /// Returns
    /// -------
    /// The features.
    ///
    /// Raises
    /// ------
    /// ValueError : an argument that makes no sense.
    #[pyo3(signature = (node, state, held=None, encoding=None),
           text_signature = "($self, node, state, held=(), encoding='body')")]
    fn features<'py>(
        &self,
        py: Python<'py>,
        node: Argument<usize>,
        state: Argument<Vec<f64>>,
        held: Option<Argument<Vec<f32>>>,
        encoding: Option<Argument<&str>>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (node, state) = (self.node(node)?, self.state(state)?);
        let held = Argument::or(held, "held", Vec::new())?;
        let encoding = encoding.map_or(Ok(Encoding::Body), self::encoding)?;
        let mut features = vec![0.0; encoding.features(self.joints())];
        self.approach.features(encoding, node, &state, &held, &mut features);
        Ok(PyArray1::from_slice(py, &features))
    }

    /// Distance of the end effector from the port, were this the state at the last node [m].
    ///
    /// Parameters
    /// ----------
    /// state : the state.
    ///
    /// Returns
    /// -------
    /// The distance.
    ///
    /// Raises
    /// ------
    /// ValueError : a state of another size, or not finite.
    fn miss(&self, state: Argument<Vec<f64>>) -> PyResult<f64> {
        Ok(self.approach.miss(&self.state(state)?))
    }

    fn __repr__(&self) -> String {
        format!("<remora.Scene {} nodes, {} joints>", self.nodes(), self.joints())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (Mission, Scenario, String))> {
        let read = py.get_type::<Self>().getattr("_of")?.unbind();
        let Approach { mission, integrator, .. } = &self.approach;
        let inputs = PlanInputs::new(mission, &self.named, *integrator);
        let mission = Mission::new(inputs.mission, Path::new("scene")).map_err(raised)?;
        let case = Scenario::from(self.named.clone());
        Ok((read, (mission, case, integrator.to_string())))
    }

    /// The scene of a pickle: its Stage 1 is planned again, with the same bits.
    #[staticmethod]
    fn _of(py: Python<'_>, mission: Mission, case: Scenario, integrator: &str) -> PyResult<Self> {
        let wrong = |error| argument("integrator", error);
        let integrator: Integrator = integrator.parse().map_err(wrong)?;
        let named = case.named;
        waited(py, move |_| {
            let refused = |refusal| Failure::Refused(named.id.clone(), refusal);
            let method = Method { integrator, ..Method::default() };
            let request = PlanRequest { mission: *mission.judged(), method, ..Default::default() };
            let approach = Planner::default().approach(&request, &named);
            Ok(Self::new(approach.map_err(refused)?, named))
        })
    }
}
