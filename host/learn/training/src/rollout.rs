//! Quality of a model where it is used: its rollouts through the dynamics.

use crate::examples::Recorded;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::nn::{Model, Network, ReferenceMemory};
use remora_core::advanced::stages::NODES;
use remora_core::advanced::warmstart::NetworkPolicy;
use remora_host::approach::Approach;
use remora_host::formats::{Mission, Motion};
use remora_host::memory::on_heap;
use remora_learn::dataset::Trajectory;
use serde::{Deserialize, Serialize};

/// End-effector position error of rollouts at the final time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RolloutError {
    /// Mean [m].
    pub mean_m: f64,
    /// 95th percentile [m].
    pub p95_m: f64,
    /// Mean distance of the controls from the plan's [N m].
    pub torque_n_m: f64,
    /// Rollouts that did not end, or not in numbers.
    pub failed: usize,
}

/// Memory for the largest network that is rolled out.
type Memory = ReferenceMemory<6, 384, 300>;

/// Rolls a model out on the scenarios of some trajectories, each with its mission. `None` where it cannot be opened or is
/// too large.
pub fn measure(
    model: &[u8],
    integrator: Integrator,
    trajectories: &[(&Mission, &Trajectory)],
) -> Option<RolloutError> {
    let model = Model::open(model).ok()?;
    let mut memory = on_heap(Memory::new);
    let network = Network::new(&model, &mut *memory).ok()?;
    let policy = NetworkPolicy::new(network).ok()?;
    let mut errors = Vec::new();
    let mut torque = 0.0;
    for (mission, trajectory) in trajectories {
        let Recorded { scenario, path, target, motion } = Recorded::new(trajectory);
        let approach = Approach::new(**mission, scenario, integrator, path, target);
        if let Some(found) = approach.policy_rollout(&policy, trajectory.scenario) {
            errors.push(approach.miss(&found.states[NODES - 1]));
            torque += distance(&found, &motion);
        }
    }
    let count = errors.len();
    errors.sort_by(f64::total_cmp);
    Some(RolloutError {
        mean_m: errors.iter().sum::<f64>() / count as f64,
        p95_m: errors.get(count * 95 / 100).copied().unwrap_or(f64::NAN),
        torque_n_m: torque / count as f64,
        failed: trajectories.len() - count,
    })
}

/// Root mean square distance of the controls [N m].
fn distance(a: &Motion, b: &Motion) -> f64 {
    let square = |k: usize| {
        let (a, b) = (&a.controls[k], &b.controls[k]);
        (a.bus_torque - b.bus_torque).norm_squared()
            + (a.joint_torque - b.joint_torque).norm_squared()
    };
    ((0..NODES - 1).map(square).sum::<f64>() / (NODES - 1) as f64).sqrt()
}
