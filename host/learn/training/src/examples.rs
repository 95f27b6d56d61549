//! Examples for a network to learn from, made of planned trajectories.
//!
//! A trajectory of the data is the best of all from where it begins, but a rollout leaves it, and
//! a network that has only seen trajectories without a fault does not know how to come back. So an
//! example may be *disturbed*: it follows the trajectory as a rollout with random errors in its
//! rates would, and its actions lead back.

use crate::random::{normal, uniform};
use nalgebra::{SVector, Vector3};
use rand_chacha::ChaCha8Rng;
use remora_core::advanced::dynamics::{Acceleration, Control, Integrator, State};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::TargetState;
use remora_core::advanced::stages::{NODES, TranslationTrajectory, size};
use remora_core::advanced::warmstart::{Action, Encoding, MAX_FEATURES, Scene};
use remora_host::formats::{JointVector, MAX_JOINTS, Mission, Motion, Scenario};
use remora_host::padded::own_features;
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

/// Recipe of examples.
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
pub(super) struct Recorded {
    pub(super) scenario: Scenario,
    pub(super) path: TranslationTrajectory<NODES>,
    pub(super) target: [TargetState; NODES],
    pub(super) motion: Motion,
}

impl Recorded {
    pub(super) fn new(trajectory: &Trajectory) -> Self {
        let vector = |v: &[f32; 3]| Vector3::from(v.map(f64::from));
        let joints =
            |row: &[f32]| JointVector::from_fn(|i, _| row.get(i).copied().map_or(0.0, f64::from));
        let attitude = |q: &[f32; 4]| quaternion::normalized(&q.map(f64::from).into());
        let mut recorded = Self {
            // All that a scene takes from it: where it began, at rest.
            scenario: Scenario { position: vector(&trajectory.position[0]), ..Scenario::default() },
            path: TranslationTrajectory::ZERO,
            target: [TargetState { attitude: quaternion::IDENTITY, rate: Vector3::zeros() }; NODES],
            motion: Motion::ZERO,
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
struct Drift {
    bus: Part<3>,
    joint: Part<MAX_JOINTS>,
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

    /// Adds an error of this standard deviation to each of the first `count` rates.
    fn disturb(&mut self, count: usize, deviation: f64, random: &mut ChaCha8Rng) {
        let rates = self.rates.iter_mut().take(count);
        rates.for_each(|rate| *rate += deviation * normal(random));
    }
}

impl Drift {
    fn none() -> Self {
        Self { bus: Part::none(), joint: Part::none() }
    }

    /// The drift an interval later: its rates decay and take the pose back.
    fn next(&self, integrator: Integrator, dt: f64) -> Self {
        Self { bus: self.bus.next(integrator, dt), joint: self.joint.next(integrator, dt) }
    }

    /// `state` displaced by this drift.
    fn applied(&self, state: &State<MAX_JOINTS>) -> State<MAX_JOINTS> {
        State {
            attitude: quaternion::product(&quaternion::exp(&self.bus.pose), &state.attitude),
            joint_angle: state.joint_angle + self.joint.pose,
            rate: state.rate + self.bus.rates,
            joint_rate: state.joint_rate + self.joint.rates,
        }
    }
}

/// A scene as a network sees it, without joints that are not there.
struct View<'a> {
    scene: Scene<'a, MAX_JOINTS>,
    encoding: Encoding,
    joints: usize,
}

impl View<'_> {
    /// The features of node `k` in `state`, reached by the action `previous`.
    fn features(&self, k: usize, state: &State<MAX_JOINTS>, previous: &[f32]) -> Vec<f32> {
        let mut features = [0.0; MAX_FEATURES];
        self.scene.features(self.encoding, k, state, previous, &mut features);
        let mut own = vec![0.0; self.encoding.features(self.joints)];
        own_features(self.encoding, self.joints, MAX_JOINTS, &features, &mut own);
        own
    }

    /// Torques that lead from `state` at node `k` to `goal` at the next, by the mean acceleration.
    fn torques(
        &self,
        k: usize,
        state: &State<MAX_JOINTS>,
        goal: &State<MAX_JOINTS>,
    ) -> Control<MAX_JOINTS> {
        let Scene { body, translation, dt, .. } = &self.scene;
        let mean = Acceleration {
            bus: (goal.rate - state.rate) / *dt,
            joint: (goal.joint_rate - state.joint_rate) / *dt,
        };
        body.torques(state, &translation.force[k], &mean)
    }
}

/// The example of a trajectory; `random` disturbs it.
pub fn example(
    mission: &Mission,
    trajectory: &Trajectory,
    recipe: &Recipe,
    random: &mut ChaCha8Rng,
) -> Example {
    let &Recipe { encoding, action, integrator, disturbance, stride } = recipe;
    let Recorded { scenario, path, target, motion } = &Recorded::new(trajectory);
    let (joints, scene) =
        (mission.joints(), Scene::new(mission, scenario, path, target, integrator));
    let view = View { scene, encoding, joints };
    let (controls, state_size) = (size::controls(joints), encoding.groups(joints)[4]);
    let mut out = Example {
        features: Vec::with_capacity((NODES - 1) * encoding.features(joints)),
        actions: Vec::with_capacity((NODES - 1) * controls),
        next: Vec::with_capacity((NODES - 1) * state_size),
    };
    let share = uniform(random).powi(2);
    let Disturbance { bus_rate_rad_s, joint_rate_rad_s } = disturbance;
    let [bus, joint] = [bus_rate_rad_s, joint_rate_rad_s].map(|deviation| share * deviation);
    let is_disturbed = bus.max(joint) > 0.0;
    let mut drift = Drift::none();
    let mut previous = Vec::new();
    for k in 0..NODES - 1 {
        let (best, then) = (&motion.states[k], &motion.states[k + 1]);
        let state = drift.applied(best);
        let is_seen = k % stride == 0;
        if is_seen {
            out.features.extend(view.features(k, &state, &previous));
        }

        // The actions lead to `goal`; errors on top of them lead to `reached`.
        let mut next = drift.next(integrator, view.scene.dt);
        pin(&view.scene, k + 1, &mut next);
        let goal = next.applied(then);
        let control = match (action, is_disturbed) {
            (Action::Torque, true) => view.torques(k, &state, &goal),
            _ => motion.controls[k],
        };
        let done: Vec<f32> = action.of(&state, &control, &goal).take(controls).collect();
        out.actions.extend(&done);
        // An error is seen at once: what is predicted before it does not know of it.
        if is_disturbed && (k + 1) % stride == 0 {
            next.bus.disturb(3, bus, random);
            next.joint.disturb(joints, joint, random);
            pin(&view.scene, k + 1, &mut next);
        }
        let reached = next.applied(then);
        previous = action.of(&state, &control, &reached).take(controls).collect();
        if is_seen {
            let seen = view.features(k + 1, &goal, &done);
            out.next.extend(&seen[seen.len() - state_size..]);
        }
        drift = next;
    }
    out
}

/// Clears the errors of rates that constraints fix.
fn pin(scene: &Scene<'_, MAX_JOINTS>, k: usize, drift: &mut Drift) {
    if k >= scene.preset {
        drift.joint.rates.fill(0.0);
    }
    if k + 1 >= NODES {
        drift.bus.rates.fill(0.0);
        drift.joint.rates.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use remora_learn::dataset::Dataset;
    use std::path::Path;

    fn own(state: &State<MAX_JOINTS>) -> State<3> {
        State {
            attitude: state.attitude,
            joint_angle: state.joint_angle.fixed_rows::<3>(0).into_owned(),
            rate: state.rate,
            joint_rate: state.joint_rate.fixed_rows::<3>(0).into_owned(),
        }
    }

    /// Features and actions are those that the arm's own size would give, bit by bit.
    #[test]
    fn examples_are_those_of_the_arms_own_size() {
        let set = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fixtures/datasets/euler");
        let (mission, integrator) = (Mission::default(), Integrator::Euler);
        let arm = mission.sized::<3>();
        for trajectory in Dataset::open(&set, 3).unwrap().read(Some(5)).unwrap() {
            let Recorded { scenario, path, target, motion } = Recorded::new(&trajectory);
            let scenario = scenario.resized();
            let scene = Scene::new(&arm, &scenario, &path, &target, integrator);
            for encoding in [Encoding::Paper, Encoding::Body, Encoding::Servicer] {
                let (action, disturbance) = (Action::Rate, Disturbance::default());
                let recipe = Recipe { encoding, action, integrator, disturbance, stride: 1 };
                let random = &mut Random::new(1, 0, 0);
                let found = example(&mission, &trajectory, &recipe, random.stream());
                let (width, states) = (encoding.features(3), encoding.groups(3)[4]);
                assert_eq!(found.features.len(), (NODES - 1) * width);
                assert_eq!(found.actions.len(), (NODES - 1) * 6);
                assert_eq!(found.next.len(), (NODES - 1) * states);
                let mut row = vec![0.0; width];
                for k in 0..NODES {
                    let action = &found.actions[6 * k.saturating_sub(1)..][..6];
                    scene.features(encoding, k, &own(&motion.states[k]), action, &mut row);
                    if k + 1 < NODES {
                        assert_eq!(found.features[k * width..][..width], row);
                    }
                    if k > 0 {
                        assert_eq!(found.next[(k - 1) * states..][..states], row[width - states..]);
                    }
                }
            }
        }
    }
}
