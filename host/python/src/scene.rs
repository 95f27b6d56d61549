//! An approach after Stage 1, as a guess of Stage 2 sees it.

use crate::argument::Argument;
use crate::arrays;
use crate::mission::Mission;
use crate::raised::{Failure, argument, raised};
use crate::scenario::Scenario;
use crate::waiting::waited;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::model::{Grid, TargetState};
use remora_core::advanced::stages::{NODES, ReorientationTrajectory, TranslationTrajectory, size};
use remora_core::advanced::warmstart::{Action, Encoding, MAX_FEATURES};
use remora_core::nalgebra::{SVector, Vector3, Vector4};
use remora_host::approach::Approach;
use remora_host::formats::{NamedScenario, PlanInputs};
use remora_host::method::Integrator;
use remora_host::planning::Planner;
use remora_host::with_joints;
use std::path::Path;

/// An approach of any number of joints. States are attitude, joint angles, rate and joint rates in a row.
trait Seen: Send + Sync {
    fn joints(&self) -> usize;
    fn torque_limits(&self) -> Vec<f64>;
    fn initial_state(&self) -> Vec<f64>;
    fn step(&self, node: usize, state: &[f64], torques: &[f32]) -> Vec<f64>;
    fn roll_out(&self, torques: &[f32]) -> Vec<Vec<f64>>;
    fn features(&self, encoding: Encoding, node: usize, state: &[f64], held: &[f32]) -> Vec<f32>;
    fn miss(&self, state: &[f64]) -> f64;
    fn inputs(&self, named: &NamedScenario) -> PlanInputs;
    fn integrator(&self) -> Integrator;
}

/// Numbers of a state in a row.
fn state_size(joints: usize) -> usize {
    7 + 2 * joints
}

/// A state as a row.
fn row<const NL: usize>(state: &State<NL>) -> Vec<f64> {
    let State { attitude, joint_angle, rate, joint_rate } = state;
    let parts = attitude.iter().chain(joint_angle.iter()).chain(rate.iter());
    parts.chain(joint_rate.iter()).copied().collect()
}

/// A row's state.
fn state_of<const NL: usize>(row: &[f64]) -> State<NL> {
    State {
        attitude: Vector4::from_column_slice(&row[..4]),
        joint_angle: SVector::from_column_slice(&row[4..4 + NL]),
        rate: Vector3::from_column_slice(&row[4 + NL..7 + NL]),
        joint_rate: SVector::from_column_slice(&row[7 + NL..7 + 2 * NL]),
    }
}

impl<const NL: usize> Seen for Approach<NL> {
    fn joints(&self) -> usize {
        NL
    }

    fn torque_limits(&self) -> Vec<f64> {
        self.torque_limits().collect()
    }

    fn initial_state(&self) -> Vec<f64> {
        row(&self.scene().initial_state())
    }

    fn step(&self, node: usize, state: &[f64], torques: &[f32]) -> Vec<f64> {
        let state: State<NL> = state_of(state);
        row(&self.scene().apply(Action::Torque, node, &state, torques, &Control::ZERO).1)
    }

    fn roll_out(&self, torques: &[f32]) -> Vec<Vec<f64>> {
        let motion: ReorientationTrajectory<_, NL> = self.roll_out(torques);
        motion.states[..self.nodes()].iter().map(row).collect()
    }

    fn features(&self, encoding: Encoding, node: usize, state: &[f64], held: &[f32]) -> Vec<f32> {
        let mut features = [0.0; MAX_FEATURES];
        let state: State<NL> = state_of(state);
        self.scene().features(encoding, node, &state, held, &mut features);
        features[..encoding.features(NL)].to_vec()
    }

    fn miss(&self, state: &[f64]) -> f64 {
        let state: State<NL> = state_of(state);
        self.scene().miss(&state)
    }

    fn inputs(&self, named: &NamedScenario) -> PlanInputs {
        PlanInputs::new(&self.mission, named, self.integrator)
    }

    fn integrator(&self) -> Integrator {
        self.integrator
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
    grid: Grid,
    translation: TranslationTrajectory<NODES>,
    target: [TargetState; NODES],
    named: NamedScenario,
    seen: Box<dyn Seen>,
}

impl Scene {
    /// Of an approach.
    pub(crate) fn new<const NL: usize>(approach: Approach<NL>, named: NamedScenario) -> Self {
        let Approach { translation, target, .. } = approach;
        let grid = approach.mission.grid(&approach.scenario);
        Self { grid, translation, target, named, seen: Box::new(approach) }
    }

    fn state(&self, state: Argument<Vec<f64>>) -> PyResult<Vec<f64>> {
        let (state, size) = (state.named("state")?, state_size(self.seen.joints()));
        match state.len() == size && state.iter().all(|x| x.is_finite()) {
            true => Ok(state),
            false => Err(argument("state", format!("expects {size} finite numbers"))),
        }
    }

    fn node(&self, node: Argument<usize>) -> PyResult<usize> {
        let node = node.named("node")?;
        match node < self.grid.nodes {
            true => Ok(node),
            false => Err(argument("node", format!("{node} is none of {}", self.grid.nodes))),
        }
    }
}

#[pymethods]
impl Scene {
    /// Number of nodes.
    #[getter]
    fn nodes(&self) -> usize {
        self.grid.nodes
    }

    /// Number of the arm's joints.
    #[getter]
    fn joints(&self) -> usize {
        self.seen.joints()
    }

    /// Time from node to node [s].
    #[getter]
    fn dt_s(&self) -> f64 {
        self.grid.interval()
    }

    /// The node from which the joints have their capture angles.
    #[getter]
    fn preset_node(&self) -> usize {
        self.grid.preset_node()
    }

    /// The system's centre of mass at the nodes, RTN [m].
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.translation.position[..self.grid.nodes]))
    }

    /// Its velocity [m/s].
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.translation.velocity[..self.grid.nodes]))
    }

    /// Force over the intervals, RTN [N].
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &rows(&self.translation.force[..self.grid.last()]))
    }

    /// The target's attitude at the nodes, body to RTN, x y z w.
    #[getter]
    fn target_attitude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let nodes = self.target[..self.grid.nodes].iter();
        arrays::matrix(py, &nodes.map(|target| target.attitude.into()).collect::<Vec<[f64; 4]>>())
    }

    /// Its rate, RTN [rad/s].
    #[getter]
    fn target_rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let nodes = self.target[..self.grid.nodes].iter();
        arrays::matrix(py, &nodes.map(|target| target.rate.into()).collect::<Vec<[f64; 3]>>())
    }

    /// Largest torques: of the bus, then of the joints [N m].
    #[getter]
    fn torque_limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.seen.torque_limits())
    }

    /// Attitude, joint angles, rate and joint rates at the first node, in a row.
    #[getter]
    fn initial_state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.seen.initial_state())
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
        let controls = size::controls(self.seen.joints());
        if torques.len() != controls || !torques.iter().all(|x| x.is_finite()) {
            return Err(argument("torques", format!("expects {controls} finite numbers")));
        }
        Ok(arrays::vector(py, &self.seen.step(node, &state, &torques)))
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
        let Self { grid, seen, .. } = scene.get();
        let shape = (grid.nodes - 1, size::controls(seen.joints()));
        let torques = arrays::numbers("torques", torques, shape)?;
        let states = waited(py, move |_| Ok(scene.get().seen.roll_out(&torques)))?;
        arrays::matrix(py, &states)
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
        let features = self.seen.features(encoding, node, &state, &held);
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
        Ok(self.seen.miss(&self.state(state)?))
    }

    fn __repr__(&self) -> String {
        format!("<remora.Scene {} nodes, {} joints>", self.grid.nodes, self.seen.joints())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (Mission, Scenario, String))> {
        let read = py.get_type::<Self>().getattr("_of")?.unbind();
        let inputs = self.seen.inputs(&self.named);
        let mission = Mission::new(inputs.mission, Path::new("scene")).map_err(raised)?;
        let case = Scenario::from(self.named.clone());
        Ok((read, (mission, case, self.seen.integrator().to_string())))
    }

    /// The scene of a pickle: its Stage 1 is planned again, with the same bits.
    #[staticmethod]
    fn _of(py: Python<'_>, mission: Mission, case: Scenario, integrator: &str) -> PyResult<Self> {
        let wrong = |error| argument("integrator", error);
        let integrator: Integrator = integrator.parse().map_err(wrong)?;
        let named = case.named;
        waited(py, move |_| {
            with_joints!(mission.joints(), NL => {
                let mission = mission.of::<NL>()?;
                let refused = |refusal| Failure::Refused(named.id.clone(), refusal);
                let approach = Planner::default().approach(mission, &named, integrator);
                Ok(Self::new(approach.map_err(refused)?, named.clone()))
            } else {
                Err(argument("scene", "no arm has so many joints").into())
            })
        })
    }
}
