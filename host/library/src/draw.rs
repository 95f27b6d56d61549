//! Drawing scenarios as the problem definition says: uniform, independent, and free of violations
//! at the start.
//!
//! Scenario `i` of seed `s` is a function of `(s, i)` and of the mission's geometry alone: each has
//! a ChaCha8 stream of its own, and only additions, multiplications and square roots make numbers
//! of its bits. A shorter set is the beginning of a longer one, on every machine.

use crate::formats::{Mission, NamedScenario, ScenarioSet, ServicerStart, TargetStart};
use crate::method::Integrator;
use nalgebra::{Vector3, Vector4};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use remora_core::advanced::math::{Scalar, quaternion};
use remora_core::advanced::model::{TargetState, initial_bus_attitude, signed_distance_to_box};
use remora_core::advanced::stages::{NODES, heuristic};

/// Most scenarios a set.
pub const MAX_COUNT: u64 = 1_000_000;

/// Draws after which a mission is taken to allow no start at all.
const MAX_DRAWS: usize = 100_000;

/// Scenarios `0..count` of a seed, called `s{seed}-{index}`.
///
/// `None` where the mission's geometry lets no start pass.
pub fn draw(count: u64, seed: u64, mission: &Mission) -> Option<ScenarioSet> {
    (0..count)
        .map(|index| draw_one(seed, index, mission))
        .collect::<Option<_>>()
        .map(ScenarioSet::new)
}

/// Scenario `index` of a seed, called `s{seed}-{index}`.
///
/// `None` where the mission's geometry lets no start pass.
pub fn draw_one(seed: u64, index: u64, mission: &Mission) -> Option<NamedScenario> {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    let mut stream = ChaCha8Rng::from_seed(key);
    stream.set_stream(index);
    let mut numbers = Uniform(stream);
    (0..MAX_DRAWS).find_map(|_| {
        let candidate = candidate(&mut numbers, id(seed, index), mission);
        starts_well(&candidate, mission).then_some(candidate)
    })
}

/// The scenario of a mission if none is named. It is the first of twenty of seed 1 that is not refused before
/// planning, or the very first if all are refused.
///
/// `None` where the mission's geometry lets no start pass.
pub fn first(mission: &Mission, integrator: Integrator) -> Option<NamedScenario> {
    const TRIED: u64 = 20;
    let first = draw_one(1, 0, mission)?;
    let can_be_planned =
        |drawn: &NamedScenario| mission.check::<NODES>(&drawn.scenario(), integrator).is_ok();
    if can_be_planned(&first) {
        return Some(first);
    }
    let mut others = (1..TRIED).map_while(|index| draw_one(1, index, mission));
    Some(others.find(can_be_planned).unwrap_or(first))
}

/// Id of scenario `index` of a seed.
pub fn id(seed: u64, index: u64) -> String {
    format!("s{seed}-{index:03}")
}

/// Numbers uniform in an interval.
struct Uniform(ChaCha8Rng);

impl Uniform {
    /// Uniform in `[-half, half)`, from 53 bits.
    fn within(&mut self, half: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        half * (2.0 * unit - 1.0)
    }

    fn vector(&mut self, half: [f64; 3]) -> Vector3<f64> {
        Vector3::from(half.map(|half| self.within(half)))
    }

    /// Uniform on the unit sphere: a point in the unit ball, projected outwards.
    fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = self.vector([1.0; 3]);
            let norm = v.norm();
            if norm > 0.1 && norm <= 1.0 {
                return v / norm;
            }
        }
    }

    /// Uniform on SO(3): a point in the unit ball of four dimensions, projected outwards.
    fn attitude(&mut self) -> Vector4<f64> {
        loop {
            let q = Vector4::from([1.0; 4].map(|half| self.within(half)));
            let norm = quaternion::norm(&q);
            if norm > 0.1 && norm <= 1.0 {
                return quaternion::normalized(&q);
            }
        }
    }
}

fn candidate(numbers: &mut Uniform, id: String, mission: &Mission) -> NamedScenario {
    let from = &mission.scenarios;
    let attitude = numbers.attitude();
    let rate = match from.rate_norm_rad_s {
        Some(norm) => numbers.direction() * norm,
        None => numbers.vector([from.rate_rad_s; 3]),
    };
    let normal = quaternion::rotation_matrix(&attitude) * mission.target.port_normal;
    let position = normal * from.standoff_m + numbers.vector(from.offset_m.into());
    let velocity = numbers.vector([from.velocity_m_s; 3]);
    NamedScenario {
        id,
        target: TargetStart { attitude: attitude.into(), rate: rate.into() },
        servicer: ServicerStart {
            position: position.into(),
            velocity: velocity.into(),
            ..ServicerStart::default()
        },
        duration_s: None,
        nodes: None,
    }
}

/// Whether neither keep-out nor pointing is violated at the start.
pub fn starts_well(scenario: &NamedScenario, mission: &Mission) -> bool {
    let start = scenario.scenario();
    let rotation = quaternion::rotation_matrix(&start.target_attitude);
    let local = rotation.transpose() * start.position;
    let clearance = signed_distance_to_box(&mission.target.half_extents_m, &local).value;

    let target = TargetState { attitude: start.target_attitude, rate: Vector3::zeros() };
    let sight = heuristic::line_of_sight(mission, &start.position, &target);
    let bus = quaternion::rotation_matrix(&initial_bus_attitude(&start.position));
    let seen = sight.dot(&(bus * mission.servicer.boresight));
    // The core's cosine has the same bits everywhere.
    let (_, cosine) = Scalar::sin_cos(mission.approach.field_of_view_half_angle_rad);
    clearance >= mission.grid(&start).keep_out(0) && seen >= cosine
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drawn(count: u64, seed: u64) -> Vec<NamedScenario> {
        draw(count, seed, &Mission::default()).unwrap().scenarios
    }

    #[test]
    fn a_shorter_set_is_the_beginning_of_a_longer_one() {
        let long = drawn(1003, 1);
        assert_eq!(drawn(10, 1)[..], long[..10]);
        assert_eq!(long[0].id, "s1-000");
        assert_eq!(long[1002].id, "s1-1002");
        assert_ne!(drawn(1, 2)[0].target, long[0].target);
    }

    /// The bits of one scenario against an independent implementation of ChaCha8 and of the draw,
    /// so that no change of a library can pass unseen.
    #[test]
    fn the_draw_never_changes() {
        let scenario = &drawn(8, 1)[7];
        let attitude =
            [-0.5295960066505896, -0.7991161412226238, 0.07581777552636323, -0.2742136529997122];
        let rate = [0.00025770250703380416, 0.0008641401727717535, -0.00043248201753155714];
        let velocity = [-0.0014654020035377879, 0.000395916306860592, -0.00397447309848463];
        assert_eq!(scenario.target.attitude, attitude);
        assert_eq!(scenario.target.rate, rate);
        assert_eq!(scenario.servicer.velocity, velocity);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_draw_is_within_its_bounds(seed: u64, index in 0..MAX_COUNT) {
            let mission = Mission::default();
            let scenario = draw_one(seed, index, &mission).unwrap();
            let start = scenario.scenario();
            let from = Mission::default().scenarios;
            prop_assert!(start.target_rate.amax() <= from.rate_rad_s);
            prop_assert!(start.velocity.amax() <= from.velocity_m_s);
            let normal = quaternion::rotation_matrix(&start.target_attitude) * Vector3::z();
            let offset = start.position - normal * from.standoff_m;
            for i in 0..3 {
                prop_assert!(offset[i].abs() <= from.offset_m[i] + 1e-12);
            }
            prop_assert!(starts_well(&scenario, &mission));
        }
    }

    /// Means and variances of 3000 draws against those of the uniform distributions, within five
    /// standard errors. The rotation matrix of a uniform attitude has entries of mean 0 and mean
    /// square 1/3 whatever the axis.
    #[test]
    fn draws_are_uniform() {
        let set = drawn(3000, 42);
        let from = Mission::default().scenarios;
        let n = set.len() as f64;
        let mean = |f: &dyn Fn(&NamedScenario) -> f64| set.iter().map(f).sum::<f64>() / n;
        for i in 0..3 {
            let rate = |s: &NamedScenario| s.target.rate[i] / from.rate_rad_s;
            assert!(mean(&rate).abs() < 5.0 * (1.0 / 3.0 / n).sqrt());
            assert!((mean(&|s| rate(s).powi(2)) - 1.0 / 3.0).abs() < 5.0 * (0.09 / n).sqrt());
            let velocity = |s: &NamedScenario| s.servicer.velocity[i] / from.velocity_m_s;
            assert!(mean(&velocity).abs() < 5.0 * (1.0 / 3.0 / n).sqrt());
            for j in 0..3 {
                let entry = |s: &NamedScenario| {
                    quaternion::rotation_matrix(&Vector4::from(s.target.attitude))[(i, j)]
                };
                assert!(mean(&entry).abs() < 5.0 * (1.0 / 3.0 / n).sqrt());
                let square = mean(&|s| entry(s).powi(2));
                assert!((square - 1.0 / 3.0).abs() < 5.0 * (0.09 / n).sqrt());
            }
        }
    }

    #[test]
    fn a_mission_without_any_start_is_told_from_a_rare_one() {
        let mut mission = Mission::default();
        mission.approach.keep_out_far_m = 50.0;
        assert_eq!(draw(1, 1, &mission), None);
    }
}
