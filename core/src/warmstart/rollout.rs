//! The rollout of a policy.

use super::{Action, Encoding, MAX_FEATURES, Scene};
use crate::dynamics::Control;
use crate::stages::{NODES, ReorientationTrajectory, size};
use core::num::NonZeroUsize;
use remora_qp::Checksum;
use remora_qp::time::Deadline;

/// Largest chunk: most actions a policy predicts at once.
pub const MAX_CHUNK: usize = 8;

/// Most numbers of all actions that a policy predicts at once.
const MAX_ACTIONS: usize = remora_nn::limit::ACTIONS;

/// A policy: predicts actions from the features of a node. It may keep state since [`Policy::begin`], by
/// interior mutability.
pub trait Policy {
    /// Encoding of its features.
    fn encoding(&self) -> Encoding;

    /// Meaning of its actions.
    fn action(&self) -> Action;

    /// Number of nodes of the plans it is for.
    fn nodes(&self) -> usize;

    /// Number of joints of the arms it is for.
    fn joints(&self) -> usize;

    /// How far the features of a rollout's first node are from those it has learnt from: the largest
    /// distance of one from its mean, in standard deviations.
    fn deviation(&self, features: &[f32]) -> f32;

    /// Number of actions it predicts at once, at most [`MAX_CHUNK`].
    fn chunk(&self) -> usize;

    /// Number of those that are executed before the next prediction.
    fn executed(&self) -> usize;

    /// Nodes from one that it sees to the next: between two predictions it sees all, unless it says otherwise.
    fn stride(&self) -> usize {
        1
    }

    /// Adds all that distinguishes this policy from others to `checksum`.
    fn identify(&self, checksum: &mut Checksum);

    /// Whether what it predicts from is as it was when it was checked; true for what is never checked.
    fn is_intact(&self) -> bool {
        true
    }

    /// Begins a rollout; `seed` is for policies that sample.
    fn begin(&self, seed: u64);

    /// Predicts the actions of the next node and those after from its features. Returns false where it
    /// cannot, or once `deadline` has passed.
    fn act(&self, features: &[f32], actions: &mut [f32], deadline: &Deadline<'_>) -> bool;

    /// Observes the features of the next node, whose action is already predicted. Returns false where
    /// it cannot.
    fn observe(&self, features: &[f32]) -> bool;
}

/// Farthest from what a policy has learnt from that an approach may begin, in standard deviations of a
/// feature. Of 600 approaches drawn for the shipped models' own mission the farthest is at 6.2; in half its
/// time one in ten is beyond 8.7, in three times its time half are beyond 9.6, and a target that turns at
/// 1 deg/s is at 25.
pub const MAX_DEVIATION: f32 = 8.0;

/// Whether an approach begins where a policy has learnt from others that do.
// Not inlined: its features are on the stack only while it runs.
#[inline(never)]
pub fn is_known<P: Policy + ?Sized, const NL: usize>(scene: &Scene<'_, NL>, policy: &P) -> bool {
    let mut features = [0.0; MAX_FEATURES];
    let encoding = policy.encoding();
    scene.features(encoding, 0, &scene.initial_state(), &[], &mut features);
    let Some(features) = features.get(..encoding.features(NL)) else { return false };
    policy.deviation(features) <= MAX_DEVIATION
}

/// Rolls a policy's actions out from the initial state through the dynamics of Stage 2.
///
/// Returns false where the policy failed, the scene's deadline passed or a number is not finite; `out` is
/// then invalid.
// Not inlined: an entry point with a stack bound of its own.
#[inline(never)]
pub fn rollout<P: Policy + ?Sized, const NL: usize>(
    scene: &Scene<'_, NL>,
    policy: &P,
    seed: u64,
    out: &mut ReorientationTrajectory<NODES, NL>,
) -> bool {
    let (encoding, action) = (policy.encoding(), policy.action());
    let chunk = policy.chunk().clamp(1, MAX_CHUNK);
    let executed = policy.executed().clamp(1, chunk);
    // Without a case of zero in the code below.
    let [executed, stride] = [executed, policy.stride()]
        .map(|nodes| NonZeroUsize::new(nodes).unwrap_or(NonZeroUsize::MIN));
    let mut features = [0.0; MAX_FEATURES];
    let size = size::controls(NL);
    let mut actions = [0.0; MAX_ACTIONS];
    // Offset of the action executed last.
    let mut at = 0;
    let mut held = Control::ZERO;
    policy.begin(seed);
    out.states[0] = scene.initial_state();
    let last = scene.last.min(NODES - 1);
    for k in 0..last {
        let state = out.states[k];
        if scene.deadline.has_passed() {
            return false;
        }
        if k % stride == 0 {
            let previous = actions.get(at..).unwrap_or_default();
            scene.features(encoding, k, &state, previous, &mut features);
            let (Some(features), Some(answer)) =
                (features.get(..encoding.features(NL)), actions.get_mut(..chunk * size))
            else {
                return false;
            };
            let looked = match k % executed {
                0 => policy.act(features, answer, &scene.deadline),
                _ => policy.observe(features),
            };
            if !looked {
                return false;
            }
        }
        at = k % executed * size;
        let numbers = actions.get(at..).unwrap_or_default();
        let (control, next) = scene.apply(action, k, &state, numbers, &held);
        if !(control.is_finite() && next.is_finite()) {
            return false;
        }
        held = control;
        out.controls[k] = control;
        out.states[k + 1] = next;
    }
    out.controls[last] = Control::ZERO;
    true
}
