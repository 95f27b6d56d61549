//! From a planned trajectory to what a network is to learn of it.
//!
//! A trajectory of the data is the best of all from where it begins, but a roll-out leaves it, and
//! a network that has only seen trajectories without a fault does not know how to come back. So an
//! example may be *disturbed*: it follows the trajectory as a roll-out with random errors in its
//! rates would, and its actions lead back.

use nalgebra::{SVector, Vector3};
use rand_chacha::ChaCha8Rng;
use remora_core::advanced::dynamics::{Acceleration, Control, Integrator, State};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario, TargetState};
use remora_core::advanced::stages::{NODES, ReorientationTrajectory, TranslationTrajectory, size};
use remora_core::advanced::warmstart::{Action, Encoding, Scene};
use remora_host::perturbation::{normal, uniform};
use remora_learn::dataset::Trajectory;
use serde::{Deserialize, Serialize};

/// Share of an error of the rates that is still there a node later.
const PERSISTENCE: f64 = 0.5;
/// Share of an error of the pose that the next rates make up for in one interval.
const RECOVERY: f64 = 0.15;

/// Random errors of the rates at each node of a disturbed example: the largest standard
/// deviations [rad/s]. Each example has a share of them, the square of a uniform number, so that
/// most are nearly undisturbed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Of the bus, an axis.
    pub bus_rate_rad_s: f64,
    /// Of each joint.
    pub joint_rate_rad_s: f64,
}

/// What examples are made of.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// The features.
    pub encoding: Encoding,
    /// The actions.
    pub action: Action,
    /// Discretisation of the trajectories.
    pub integrator: Integrator,
    /// Errors to come back from.
    pub disturbance: Disturbance,
    /// Nodes from one that the network sees to the next.
    pub stride: usize,
}

/// A trajectory as a network sees it; rows of nodes one after the other, all raw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Example {
    /// Features of the nodes that are seen, `[seen][F]`: at the last there is nothing to do.
    pub features: Vec<f32>,
    /// Actions, `[N - 1][A]`.
    pub actions: Vec<f32>,
    /// The state group of the features of the node after each that is seen, `[seen][S]`.
    pub next: Vec<f32>,
}

/// A trajectory in the core's types.
pub(super) struct Recorded<const NL: usize> {
    pub(super) scenario: Scenario<NL>,
    pub(super) path: TranslationTrajectory<NODES>,
    pub(super) target: [TargetState; NODES],
    pub(super) motion: ReorientationTrajectory<NODES, NL>,
}

impl<const NL: usize> Recorded<NL> {
    pub(super) fn new(trajectory: &Trajectory<NL>) -> Self {
        let vector = |v: &[f32; 3]| Vector3::from(v.map(f64::from));
        let joints = |v: &[f32; NL]| SVector::from(v.map(f64::from));
        let attitude = |q: &[f32; 4]| quaternion::normalized(&q.map(f64::from).into());
        let mut recorded = Self {
            // All that a scene takes from it: where it began, at rest.
            scenario: Scenario { position: vector(&trajectory.position[0]), ..Scenario::default() },
            path: TranslationTrajectory::ZERO,
            target: [TargetState { attitude: quaternion::IDENTITY, rate: Vector3::zeros() }; NODES],
            motion: ReorientationTrajectory::ZERO,
        };
        for k in 0..NODES {
            recorded.path.position[k] = vector(&trajectory.position[k]);
            recorded.path.velocity[k] = vector(&trajectory.velocity[k]);
            recorded.path.force[k] = vector(&trajectory.force[k]);
            recorded.target[k] = TargetState {
                attitude: attitude(&trajectory.target_attitude[k]),
                rate: vector(&trajectory.target_rate[k]),
            };
            recorded.motion.states[k] = State {
                attitude: attitude(&trajectory.attitude[k]),
                joint_angle: joints(&trajectory.joint_angle[k]),
                rate: vector(&trajectory.rate[k]),
                joint_rate: joints(&trajectory.joint_rate[k]),
            };
            recorded.motion.controls[k] = Control {
                bus_torque: vector(&trajectory.bus_torque[k]),
                joint_torque: joints(&trajectory.joint_torque[k]),
            };
        }
        recorded
    }
}

/// How far a disturbed example has left its trajectory: turn of the bus (RTN) and bend of the
/// joints, and the same of the rates.
#[derive(Clone, Copy)]
struct Drift<const NL: usize> {
    bus: Part<3>,
    joint: Part<NL>,
}

/// The part of the bus, or of the joints.
#[derive(Clone, Copy)]
struct Part<const N: usize> {
    pose: SVector<f64, N>,
    rates: SVector<f64, N>,
}

impl<const N: usize> Part<N> {
    fn none() -> Self {
        Self { pose: SVector::zeros(), rates: SVector::zeros() }
    }

    fn next(&self, integrator: Integrator, dt: f64) -> Self {
        let mut next = Self { rates: self.rates * PERSISTENCE, ..*self };
        let ahead = match integrator {
            Integrator::Euler => self.pose + self.rates * dt,
            Integrator::Rk4 { .. } => self.pose + (self.rates + next.rates) * (0.5 * dt),
        };
        next.rates -= ahead * (RECOVERY / dt);
        next.pose = ahead;
        next
    }

    /// Adds an error of this standard deviation to each rate.
    fn disturb(&mut self, deviation: f64, random: &mut ChaCha8Rng) {
        self.rates.iter_mut().for_each(|rate| *rate += deviation * normal(random));
    }
}

impl<const NL: usize> Drift<NL> {
    fn none() -> Self {
        Self { bus: Part::none(), joint: Part::none() }
    }

    /// The drift an interval later: its rates decay and take the pose back.
    fn next(&self, integrator: Integrator, dt: f64) -> Self {
        Self { bus: self.bus.next(integrator, dt), joint: self.joint.next(integrator, dt) }
    }

    /// `state` displaced by this drift.
    fn applied(&self, state: &State<NL>) -> State<NL> {
        State {
            attitude: quaternion::product(&quaternion::exp(&self.bus.pose), &state.attitude),
            joint_angle: state.joint_angle + self.joint.pose,
            rate: state.rate + self.bus.rates,
            joint_rate: state.joint_rate + self.joint.rates,
        }
    }
}

/// The example of a trajectory; `random` disturbs it.
pub fn example<const NL: usize>(
    mission: &Mission<NL>,
    trajectory: &Trajectory<NL>,
    recipe: &Recipe,
    random: &mut ChaCha8Rng,
) -> Example {
    let recorded = Recorded::new(trajectory);
    let scene = Scene::new(
        mission,
        &recorded.scenario,
        &recorded.path,
        &recorded.target,
        recipe.integrator,
    );
    let sizes = recipe.encoding.groups(NL);
    let (width, state_size) = (recipe.encoding.features(NL), sizes[4]);
    let mut out = Example {
        features: Vec::with_capacity((NODES - 1) * width),
        actions: Vec::with_capacity((NODES - 1) * size::controls(NL)),
        next: Vec::with_capacity((NODES - 1) * state_size),
    };
    let mut row = vec![0.0; width];
    let share = uniform(random).powi(2);
    let Disturbance { bus_rate_rad_s, joint_rate_rad_s } = recipe.disturbance;
    let [bus, joint] = [bus_rate_rad_s, joint_rate_rad_s].map(|deviation| share * deviation);
    let is_disturbed = bus.max(joint) > 0.0;
    let mut drift = Drift::none();
    let mut previous = Vec::new();
    for k in 0..NODES - 1 {
        let (best, then) = (&recorded.motion.states[k], &recorded.motion.states[k + 1]);
        let state = drift.applied(best);
        let is_seen = k % recipe.stride == 0;
        if is_seen {
            scene.features(recipe.encoding, k, &state, &previous, &mut row);
            out.features.extend(&row);
        }

        // The actions lead to `goal`; errors on top of them lead to `reached`.
        let mut next = drift.next(recipe.integrator, scene.dt);
        pin(&scene, k + 1, &mut next);
        let goal = next.applied(then);
        let control = match (recipe.action, is_disturbed) {
            (Action::Torque, true) => {
                let force = &recorded.path.force[k];
                let mean = Acceleration {
                    bus: (goal.rate - state.rate) / scene.dt,
                    joint: (goal.joint_rate - state.joint_rate) / scene.dt,
                };
                scene.body.torques(&state, force, &mean)
            }
            _ => recorded.motion.controls[k],
        };
        let action: Vec<f32> = recipe.action.of(&state, &control, &goal).collect();
        out.actions.extend(&action);
        // An error is seen at once: what is predicted before it does not know of it.
        if is_disturbed && (k + 1) % recipe.stride == 0 {
            next.bus.disturb(bus, random);
            next.joint.disturb(joint, random);
            pin(&scene, k + 1, &mut next);
        }
        let reached = next.applied(then);
        previous = recipe.action.of(&state, &control, &reached).collect();
        if is_seen {
            scene.features(recipe.encoding, k + 1, &goal, &action, &mut row);
            out.next.extend(&row[width - state_size..]);
        }
        drift = next;
    }
    out
}

/// What constraints pin has no error of its rates.
fn pin<const NL: usize>(scene: &Scene<'_, NL>, k: usize, drift: &mut Drift<NL>) {
    if k >= scene.preset {
        drift.joint.rates.fill(0.0);
    }
    if k + 1 >= NODES {
        drift.bus.rates.fill(0.0);
        drift.joint.rates.fill(0.0);
    }
}
