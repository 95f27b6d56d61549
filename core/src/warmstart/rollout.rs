//! The roll-out.

use super::{ACTION, Action, Encoding, MAX_FEATURES, Scene};
use crate::dynamics::Control;
use crate::stages::{LINKS, NODES, ReorientationTrajectory};
use remora_qp::Checksum;
use remora_qp::time::Deadline;

/// Most actions a policy gives at once.
pub const MAX_CHUNK: usize = 8;

/// Who says what to do at a node. It may remember what it has seen since [`Policy::begin`], in cells of
/// its own.
pub trait Policy {
    /// What its features are.
    fn encoding(&self) -> Encoding;

    /// What its actions are.
    fn action(&self) -> Action;

    /// Actions it gives at once, at most [`MAX_CHUNK`].
    fn chunk(&self) -> usize;

    /// How many of them are carried out before it is asked again.
    fn executed(&self) -> usize;

    /// Adds to `checksum` what tells this policy from others.
    fn identify(&self, checksum: &mut Checksum);

    /// Forgets everything; `seed` is for those that draw.
    fn begin(&self, seed: u64);

    /// Looks at the features of the next node and writes the actions for it and those after, node
    /// by node. False where it can't, or once `deadline` has passed.
    fn act(&self, features: &[f32], actions: &mut [f32], deadline: &Deadline<'_>) -> bool;

    /// Looks at the features of the next node, for which it has said before what to do. False
    /// where it can't.
    fn observe(&self, features: &[f32]) -> bool;
}

/// Rolls a policy's actions out from the initial state through the dynamics of Stage 2.
///
/// False where the policy gave up, the scene's deadline passed or a number is not finite; `out` is then of no use.
// An entry point: the stack below it has a bound of its own.
#[inline(never)]
pub fn rollout<P: Policy + ?Sized>(
    scene: &Scene<'_>,
    policy: &P,
    seed: u64,
    out: &mut ReorientationTrajectory<NODES, LINKS>,
) -> bool {
    let (encoding, action) = (policy.encoding(), policy.action());
    let chunk = policy.chunk().clamp(1, MAX_CHUNK);
    let executed = policy.executed().clamp(1, chunk);
    let mut features = [0.0; MAX_FEATURES];
    let mut actions = [[0.0; ACTION]; MAX_CHUNK];
    let mut previous = [0.0; ACTION];
    let mut held = Control::ZERO;
    policy.begin(seed);
    out.states[0] = scene.initial_state();
    for k in 0..NODES - 1 {
        let state = out.states[k];
        scene.features(encoding, k, &state, &previous, &mut features);
        let (Some(features), Some(answer)) =
            (features.get(..encoding.features()), actions.get_mut(..chunk))
        else {
            return false;
        };
        if scene.deadline.has_passed() {
            return false;
        }
        let looked = match k % executed {
            0 => policy.act(features, answer.as_flattened_mut(), &scene.deadline),
            _ => policy.observe(features),
        };
        if !looked {
            return false;
        }
        previous = actions[k % executed];
        let (control, next) = scene.apply(action, k, &state, &previous, &held);
        if !(control.is_finite() && next.is_finite()) {
            return false;
        }
        held = control;
        out.controls[k] = control;
        out.states[k + 1] = next;
    }
    out.controls[NODES - 1] = Control::ZERO;
    true
}
