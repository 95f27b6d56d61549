//! Recipe of a learning: plans and trains as much as fits in its hours.

use crate::Config;
use crate::config::{Data, Model, Schedule, Training};
use crate::examples::Disturbance;
use remora_host::draw::MAX_COUNT;
use remora_learn::dataset::Split;
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// Shares of the hours: planning the dataset, training, the paired test.
pub const SHARES: [f64; 3] = [0.5, 0.4, 0.1];

/// Scenarios of a shard; the first tells how many can be planned.
pub const SHARD: NonZeroU32 = NonZeroU32::new(100).unwrap();

/// Fewest scenarios that are planned, however few the hours.
pub const LEAST_SCENARIOS: u64 = 200;

/// Fewest steps of training, however few the hours.
pub const LEAST_STEPS: u64 = 50;

/// Fewest and most scenarios of the paired test.
pub const TESTS: [u64; 2] = [20, 300];

/// The training ends early where each trajectory was met so often.
pub const PASSES: u64 = 100;

/// Fewest scenarios that are held out of the training to validate it.
const HELD_OUT: usize = 2;

/// Trajectories a step.
const BATCH: usize = 32;

/// How many scenarios are planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sizes {
    /// For the dataset.
    pub count: u64,
    /// For the paired test, from each start.
    pub tests: u64,
}

impl Sizes {
    /// Fits as many as the hours allow, where the first shard took so long [s].
    pub fn of(hours: f64, seed: u64, shard_s: f64) -> Self {
        let shard = u64::from(SHARD.get());
        let scenario_s = shard_s.max(1e-3) / shard as f64;
        let fit = |share: f64| (3600.0 * hours * share / scenario_s) as u64;
        let most = MAX_COUNT / shard * shard;
        let count = (fit(SHARES[0]) / shard * shard).clamp(least(seed), most);
        Self { count, tests: (fit(SHARES[2]) / 2).clamp(TESTS[0], TESTS[1]) }
    }
}

/// Whole shards that are enough to learn from, some of their scenarios held out.
fn least(seed: u64) -> u64 {
    let shard = u64::from(SHARD.get());
    let held_out = (0..).filter(|index| Split::of(seed, *index) == Split::Validation);
    let last = held_out.take(HELD_OUT).last().unwrap_or_default();
    (last / shard * shard + shard).max(LEAST_SCENARIOS)
}

/// Minutes that are left for training.
pub(super) fn minutes(hours: f64, planned_s: f64) -> f64 {
    let left = hours * (SHARES[0] + SHARES[1]) - planned_s / 3600.0;
    60.0 * left.max(1e-6)
}

/// The configuration of the training of a network, from a model or anew.
pub(super) fn config(
    data: PathBuf,
    model: Model,
    from: Option<&Path>,
    sizes: Sizes,
    seed: u64,
    minutes: f64,
) -> Config {
    Config {
        data: Data {
            path: data,
            count: None,
            extra: Vec::new(),
            disturbance: Disturbance { bus_rate_rad_s: 4e-4, joint_rate_rad_s: 1e-3 },
        },
        model,
        training: Training {
            batch: BATCH,
            accumulation: 1,
            learning_rate: if from.is_some() { 1e-3 } else { 4e-3 },
            warmup_steps: LEAST_STEPS,
            schedule: Schedule::Cosine,
            weight_decay: 0.01,
            clip_norm: 1.0,
            steps: (PASSES * sizes.count / BATCH as u64).max(LEAST_STEPS),
            minutes: Some(minutes),
            least_steps: Some(LEAST_STEPS),
            // TOML holds no larger integers.
            seed: seed & i64::MAX as u64,
            checkpoint_minutes: 1.0,
            validate_every: 500,
            validation_count: 200,
            state_loss: 0.0,
            rollout_count: Some(32),
            init_from: from.map(Path::to_path_buf),
            // A lighter vehicle's numbers are others, what is to be done with them is alike.
            own_statistics: from.is_some(),
            parent_learnt_from: None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::network;
    use remora_host::learned::Learned;
    use remora_host::method::Integrator;

    #[test]
    fn few_hours_are_enough_for_the_least() {
        assert_eq!(Sizes::of(1e-6, 1000, 5.0), Sizes { count: 300, tests: 20 });
        for seed in 0..200 {
            let count = least(seed);
            let held_out = |i: &u64| Split::of(seed, *i) == Split::Validation;
            assert!((0..count).filter(held_out).count() >= HELD_OUT, "{seed}");
            assert!(count >= LEAST_SCENARIOS && count.is_multiple_of(SHARD.get().into()));
        }
        let sizes = Sizes { count: 200, tests: 20 };
        let built_in = Learned::built_in(Integrator::Euler);
        let model = network(built_in.model().unwrap().header()).unwrap();
        let config = config("set".into(), model, None, sizes, u64::MAX, minutes(1e-9, 100.0));
        assert_eq!(Config::parse(&config.text()), Ok(config));
    }

    #[test]
    fn the_hours_are_shared() {
        // Ten scenarios a second: half an hour of them.
        assert_eq!(Sizes::of(1.0, 1, 10.0), Sizes { count: 18_000, tests: 300 });
        assert_eq!(Sizes::of(1e9, 1, 10.0).count, MAX_COUNT);
        assert!((minutes(1.0, 1800.0) - 24.0).abs() < 1e-9);
        assert!((SHARES.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}
