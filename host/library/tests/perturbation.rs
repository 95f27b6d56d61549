//! Disturbed plans as starts: what a learned warm start of a given quality would hand over.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use remora_core::advanced::dynamics::{Control, Multibody};
use remora_core::advanced::stages::{
    Formulation, LINKS, NODES, ReorientationTrajectory, TranslationTrajectory,
};

/// Factor on the errors of joint torques beside those of the bus: the outer joints are light, and
/// a few per cent of a torque would fling them away.
const JOINT_FACTOR: f64 = 0.02;

/// Terms of the cosine series of an error.
const TERMS: u32 = 4;

/// Changes the torques of `motion` by a smooth error of relative size `size` and rolls them out
/// from the initial state through the dynamics of Stage 2.
///
/// Each control's error is `size` times its root mean square over the plan times
/// `sum_j g_j cos(pi j t) / (1 + j)`, `j = 0..3`, `g_j` standard normal from `seed`, `t` from 0 to
/// 1 over the plan; joint torques a further factor 0.02. Limits are not enforced.
pub fn disturb(
    formulation: &Formulation<'_, LINKS>,
    path: &TranslationTrajectory<NODES>,
    motion: &mut ReorientationTrajectory<NODES, LINKS>,
    size: f64,
    seed: u64,
) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let grid = formulation.mission.grid(formulation.scenario);
    let steps = grid.last();
    let read = |u: &Control<LINKS>, c: usize| match c {
        0..3 => u.bus_torque[c],
        _ => u.joint_torque[c - 3],
    };
    for c in 0..3 + LINKS {
        let squares: f64 = motion.controls[..steps].iter().map(|u| read(u, c).powi(2)).sum();
        let factor = if c < 3 { 1.0 } else { JOINT_FACTOR };
        let amplitude = size * factor * (squares / steps as f64).sqrt();
        let weights: Vec<f64> = (0..TERMS).map(|_| normal(&mut random)).collect();
        for (k, control) in motion.controls[..steps].iter_mut().enumerate() {
            let t = k as f64 / (steps - 1) as f64;
            let term = |(j, g): (usize, &f64)| {
                g * (std::f64::consts::PI * j as f64 * t).cos() / (1.0 + j as f64)
            };
            let error = amplitude * weights.iter().enumerate().map(term).sum::<f64>();
            match c {
                0..3 => control.bus_torque[c] += error,
                _ => control.joint_torque[c - 3] += error,
            }
        }
    }
    let Formulation { mission, integrator, .. } = *formulation;
    let body = Multibody::new(mission);
    let dt = grid.interval();
    for k in 0..steps {
        let (state, control) = (&motion.states[k], &motion.controls[k]);
        motion.states[k + 1] = body.step(integrator, dt, state, control, &path.force[k]);
    }
}

/// A standard normal number (Box-Muller).
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (a, b) = (1.0 - uniform(random), uniform(random));
    (-2.0 * f64::ln(a)).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// Uniform in `[0, 1)`, from 53 bits.
pub fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
