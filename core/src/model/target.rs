//! The tumbling target: geometry, port, and rotation.

use super::fields::section;
#[cfg(feature = "serde")]
use super::forms;
use super::{Integrator, Switch};
use crate::math::quaternion;
use nalgebra::{Matrix3, Vector3, Vector4};
use remora_qp::dense::count;

section! {
    /// The dead satellite, in its own body frame at its centre of mass.
    #[cfg_attr(feature = "serde", serde(default))]
    Target in "target" {
        /// Whether the gravity gradient turns it; free of torques otherwise, as in the paper.
        gravity_gradient: Switch = Switch::Auto, Code(3);
        /// Half edge lengths of its box [m].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        half_extents_m: Vector3<f64> = Vector3::new(0.4, 0.4, 0.2), Positive;
        /// Principal moments of inertia [kg m^2].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        inertia_kg_m2: Vector3<f64> = Vector3::new(2.5, 3.0, 2.0), Moments;
        /// Mass [kg].
        mass_kg: f64 = 50.0, Positive;
        /// Docking port position `p_d` [m].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        port_position_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.2), Finite;
        /// Outward unit normal of the port `n_d`.
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        port_normal: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0), Unit;
    }
}

/// Attitude and rate of the target at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetState {
    /// Attitude, body to RTN, `(x, y, z, w)`.
    pub attitude: Vector4<f64>,
    /// Angular velocity relative to RTN, resolved in RTN [rad/s].
    pub rate: Vector3<f64>,
}

impl TargetState {
    /// Placeholder for storage that is filled later.
    pub const ZERO: Self =
        Self { attitude: quaternion::IDENTITY, rate: Vector3::new(0.0, 0.0, 0.0) };

    /// Placeholder with all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self =
        Self { attitude: Vector4::new(0.0, 0.0, 0.0, 0.0), rate: Vector3::new(0.0, 0.0, 0.0) };
}

/// Bound of the tumble's attitude error over the whole horizon, for the choice of substeps [rad].
const ATTITUDE_ERROR: f64 = 1e-9;

/// RK4's attitude error is `W T (20 + W T) (W h)^4` over this at most: see [`Target::substeps`].
const ERROR_DIVISOR: f64 = 20_000.0;

/// Fewest RK4 substeps a node for the tumble: its error at the rates of section 8 is below 1e-12.
const LEAST_SUBSTEPS: usize = 10;

/// Most RK4 substeps a node for the tumble: enough for a target that turns by
/// 4 rad a node on 60 nodes.
pub const MAX_TUMBLE_SUBSTEPS: usize = 1000;

impl Target {
    /// Fills `nodes` with the tumble at `t = 0, dt, 2 dt, ...` (section 2), with the gravity
    /// gradient where that is in force under `integrator`.
    ///
    /// `attitude` is the initial attitude (body to RTN), `rate` the initial angular velocity
    /// relative to RTN in **body** axes [rad/s], `n` the orbit's mean motion [rad/s].
    /// Cost: 40 evaluations of Euler's equations a node for a slow target, at most 4000.
    pub fn tumble(
        &self,
        integrator: Integrator,
        n: f64,
        attitude: &Vector4<f64>,
        rate: &Vector3<f64>,
        dt: f64,
        nodes: &mut [TargetState],
    ) {
        let has_gradient = self.gravity_gradient.is_on(integrator);
        let mut q = *attitude;
        let orbit_rate = |q: &Vector4<f64>| {
            quaternion::rotation_matrix(q).transpose() * Vector3::new(0.0, 0.0, n)
        };
        // The integration runs in the inertial rate in body axes, which the attitude disturbs by the
        // gravity gradient alone.
        let mut w = rate + orbit_rate(&q);
        let fastest = self.fastest(integrator, n, attitude, rate);
        let substeps = Self::substeps(fastest, dt, nodes.len());
        let h = dt / substeps as f64;
        for node in nodes {
            let relative = quaternion::rotation_matrix(&q) * w - Vector3::new(0.0, 0.0, n);
            *node = TargetState { attitude: q, rate: relative };
            // Bound: attitude_substeps.
            for _ in 0..substeps {
                (q, w) = self.rk4_step(has_gradient, n, &q, &w, h);
            }
        }
    }

    /// The target `time` [s] after `state`, in so many steps of RK4.
    pub(crate) fn after(
        &self,
        has_gradient: bool,
        n: f64,
        state: &TargetState,
        time: f64,
        steps: usize,
    ) -> TargetState {
        let frame = Vector3::new(0.0, 0.0, n);
        let mut q = state.attitude;
        let mut w = quaternion::rotation_matrix(&q).tr_mul(&(state.rate + frame));
        // Bound: steps of a reference's target.
        for _ in 0..steps {
            (q, w) = self.rk4_step(has_gradient, n, &q, &w, time / steps as f64);
        }
        TargetState { attitude: q, rate: quaternion::rotation_matrix(&q) * w - frame }
    }

    /// Most that the rate relative to inertial space can ever be, for a target that begins with
    /// `attitude` and `rate` as in [`Target::tumble`] [rad/s].
    ///
    /// Without torques the energy `w . J w / 2` is kept. With the gravity gradient Jacobi's
    /// integral is: `w_r . J w_r + 3 n^2 e_R . J e_R - n^2 e_N . J e_N`, `w_r` relative to RTN, and
    /// neither of the last two terms can give more than lies between it and its least.
    pub fn fastest(
        &self,
        integrator: Integrator,
        n: f64,
        attitude: &Vector4<f64>,
        rate: &Vector3<f64>,
    ) -> f64 {
        let to_body = quaternion::rotation_matrix(attitude).transpose();
        let (radial, normal) = (to_body * Vector3::x(), to_body * Vector3::z());
        let twice = |v: &Vector3<f64>| v.dot(&self.inertia_kg_m2.component_mul(v));
        let (a, b, c) = (self.inertia_kg_m2.x, self.inertia_kg_m2.y, self.inertia_kg_m2.z);
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        if self.gravity_gradient.is_on(integrator) {
            let gained = 3.0 * (twice(&radial) - least) + (most - twice(&normal));
            libm::sqrt((twice(rate) + n * n * gained) / least) + n
        } else {
            libm::sqrt(twice(&(rate + normal * n)) / least)
        }
    }

    /// RK4 substeps a node that keep the attitude error over `nodes` intervals of `dt` below
    /// [`ATTITUDE_ERROR`], at a rate of up to `fastest`.
    ///
    /// In the angle `W t` as time the equations of motion have no scale of their own, so that a
    /// substep errs by a multiple of `(W h)^5` in attitude and in rate over `W`. The `T / h`
    /// substeps add up to a multiple of `W T (W h)^4` in both, and an error in rate of that size
    /// turns the attitude by `W T` times as much again. The first multiple is 1/1920 for a steady
    /// spin, here 1/1000; the second is measured (tests), here 1/20000. Not covered is a spin that
    /// begins within rounding of the unstable axis: nothing can tell which way it falls.
    fn substeps(fastest: f64, dt: f64, nodes: usize) -> usize {
        let turn = fastest * dt;
        let whole = turn * nodes as f64;
        let error = whole * (20.0 + whole) / (ERROR_DIVISOR * ATTITUDE_ERROR);
        // A conversion to an integer saturates, and makes nothing of NaN.
        let needed = count(libm::ceil(turn * libm::sqrt(libm::sqrt(error))));
        needed.clamp(LEAST_SUBSTEPS, MAX_TUMBLE_SUBSTEPS)
    }

    /// Angular acceleration relative to RTN, in RTN [rad/s^2].
    pub(crate) fn acceleration(
        &self,
        has_gradient: bool,
        n: f64,
        state: &TargetState,
    ) -> Vector3<f64> {
        let rotation = quaternion::rotation_matrix(&state.attitude);
        let inertial = state.rate + Vector3::new(0.0, 0.0, n);
        let turned = self.turned(has_gradient, n, &rotation, &rotation.tr_mul(&inertial));
        rotation * turned + state.rate.cross(&inertial)
    }

    /// Euler's equations: derivative of the inertial rate `w`, both in body axes.
    #[inline]
    fn turned(
        &self,
        has_gradient: bool,
        n: f64,
        rotation: &Matrix3<f64>,
        w: &Vector3<f64>,
    ) -> Vector3<f64> {
        let momentum = self.inertia_kg_m2.component_mul(w);
        let mut turned = -w.cross(&momentum).component_div(&self.inertia_kg_m2);
        if has_gradient {
            let radial = rotation.transpose() * Vector3::x();
            let torque = radial.cross(&self.inertia_kg_m2.component_mul(&radial)) * (3.0 * n * n);
            turned += torque.component_div(&self.inertia_kg_m2);
        }
        turned
    }

    fn rk4_step(
        &self,
        has_gradient: bool,
        n: f64,
        q: &Vector4<f64>,
        w: &Vector3<f64>,
        h: f64,
    ) -> (Vector4<f64>, Vector3<f64>) {
        let rate = |q: &Vector4<f64>, w: &Vector3<f64>| {
            let rotation = quaternion::rotation_matrix(q);
            let relative = rotation * w - Vector3::new(0.0, 0.0, n);
            (quaternion::derivative(q, &relative), self.turned(has_gradient, n, &rotation, w))
        };
        let (q1, w1) = rate(q, w);
        let (q2, w2) = rate(&(q + q1 * (0.5 * h)), &(w + w1 * (0.5 * h)));
        let (q3, w3) = rate(&(q + q2 * (0.5 * h)), &(w + w2 * (0.5 * h)));
        let (q4, w4) = rate(&(q + q3 * h), &(w + w3 * h));
        let q_next = q + (q1 + (q2 + q3) * 2.0 + q4) * (h / 6.0);
        let w_next = w + (w1 + (w2 + w3) * 2.0 + w4) * (h / 6.0);
        (quaternion::normalized(&q_next), w_next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Orbit;

    const FREE: Integrator = Integrator::Euler;
    const FLOWN: Integrator = Integrator::Rk4 { substeps: 8 };

    #[test]
    fn tumble_conserves_momentum_and_energy_in_inertial_space() {
        let (target, n, dt) = (Target::default(), Orbit::default().mean_motion(), 20.0);
        let attitude = quaternion::normalized(&Vector4::new(0.2, -0.5, 0.1, 0.7));
        let mut nodes = [TargetState::ZERO; 60];
        let rate = Vector3::new(9e-4, -7e-4, 5e-4);
        target.tumble(FREE, n, &attitude, &rate, dt, &mut nodes);
        let integrals = |k: usize| {
            let r = quaternion::rotation_matrix(&nodes[k].attitude);
            let w = r.transpose() * (nodes[k].rate + Vector3::new(0.0, 0.0, n));
            let momentum = target.inertia_kg_m2.component_mul(&w);
            // RTN itself turns by n t about +N relative to inertial space.
            let spin = quaternion::exp(&Vector3::new(0.0, 0.0, n * dt * k as f64));
            (quaternion::rotation_matrix(&spin) * r * momentum, w.dot(&momentum))
        };
        let (momentum, energy) = integrals(0);
        for k in 1..60 {
            let (m, e) = integrals(k);
            assert!((m - momentum).norm() < 1e-11 * momentum.norm(), "node {k}");
            assert!((e - energy).abs() < 1e-11 * energy, "node {k}");
        }
    }

    #[test]
    fn a_target_at_rest_in_inertial_space_stays_there() {
        let (target, n) = (Target::default(), Orbit::default().mean_motion());
        let mut nodes = [TargetState::ZERO; 2];
        let rest = Vector3::new(0.0, 0.0, -n);
        target.tumble(FREE, n, &quaternion::IDENTITY, &rest, 20.0, &mut nodes);
        let expected = quaternion::exp(&Vector3::new(0.0, 0.0, -20.0 * n));
        assert!(quaternion::difference(&nodes[1].attitude, &expected).norm() < 1e-13);
    }

    /// Values in +-1, the same every time.
    fn drawn() -> impl FnMut() -> f64 {
        let mut seed = 12_345_u64;
        move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn vector(draw: &mut impl FnMut() -> f64) -> Vector3<f64> {
        Vector3::new(draw(), draw(), draw())
    }

    fn attitude(draw: &mut impl FnMut() -> f64) -> Vector4<f64> {
        quaternion::normalized(&Vector4::new(draw(), draw(), draw(), draw()))
    }

    const BODIES: [[f64; 3]; 5] =
        [[2.5, 3.0, 2.0], [1.0, 1.0, 1.0], [1.0, 3.0, 3.5], [3.0, 0.3, 3.0], [2.0, 1.0, 2.9]];

    /// The error of a quarter of the substeps, against what the formula says of so many.
    // Verifies REM-PLN-015.
    #[test]
    fn substeps_keep_the_attitude_error() {
        let (n, mut draw) = (Orbit::default().mean_motion(), drawn());
        for round in 0..100 {
            let inertia = Vector3::from(BODIES[round % BODIES.len()]);
            let gravity_gradient = Switch::On;
            let target = Target { inertia_kg_m2: inertia, gravity_gradient, ..Target::default() };
            let (start, along) = (attitude(&mut draw), vector(&mut draw));
            let rate = along / along.norm() * libm::pow(10.0, -2.0 + draw());
            let (dt, nodes) = (10.0 + 9.0 * draw(), 60);
            let fastest = target.fastest(FREE, n, &start, &rate);
            let needed = Target::substeps(fastest, dt, nodes);
            assert!(needed < MAX_TUMBLE_SUBSTEPS);
            let few = (needed / 4).max(LEAST_SUBSTEPS);
            let end = |substeps: usize| {
                let orbit = Vector3::new(0.0, 0.0, n);
                let w = rate + quaternion::rotation_matrix(&start).transpose() * orbit;
                let h = dt / substeps as f64;
                let step = |(q, w), _| target.rk4_step(true, n, &q, &w, h);
                (0..nodes * substeps).fold((start, w), step).0
            };
            let error = quaternion::difference(&end(few), &end(4 * few)).norm();
            let whole = fastest * dt * nodes as f64;
            let step = fastest * dt / few as f64;
            let bound = whole * (20.0 + whole) / ERROR_DIVISOR * step * step * step * step;
            // Beside rounding.
            assert!(error < bound + 1e-12, "{error} {bound} {needed}");
        }
    }

    #[test]
    fn a_slow_target_takes_the_fewest_substeps_and_nonsense_takes_the_most() {
        let (target, n) = (Target::default(), Orbit::default().mean_motion());
        let mut draw = drawn();
        for _ in 0..100 {
            let (start, rate) = (attitude(&mut draw), vector(&mut draw) * 1e-3);
            let fastest = target.fastest(FLOWN, n, &start, &rate);
            assert_eq!(Target::substeps(fastest, 1200.0 / 59.0, 60), LEAST_SUBSTEPS);
        }
        assert_eq!(Target::substeps(f64::INFINITY, 20.0, 60), MAX_TUMBLE_SUBSTEPS);
        assert_eq!(Target::substeps(f64::NAN, 20.0, 60), LEAST_SUBSTEPS);
    }

    #[test]
    fn jacobis_integral_is_kept_and_nothing_turns_faster_than_it_lets() {
        let (n, dt, mut draw) = (Orbit::default().mean_motion(), 60.0, drawn());
        for round in 0..50 {
            let target = Target {
                inertia_kg_m2: Vector3::from(BODIES[round % BODIES.len()]),
                gravity_gradient: if round % 2 == 0 { Switch::On } else { Switch::Off },
                ..Target::default()
            };
            let (start, rate) = (attitude(&mut draw), vector(&mut draw) * 1e-3);
            let mut nodes = [TargetState::ZERO; 200];
            target.tumble(FREE, n, &start, &rate, dt, &mut nodes);
            let fastest = target.fastest(FREE, n, &start, &rate);
            let mut first = None;
            for node in &nodes {
                let inertial = node.rate + Vector3::new(0.0, 0.0, n);
                assert!(inertial.norm() <= fastest * (1.0 + 1e-9));
                let to_body = quaternion::rotation_matrix(&node.attitude).transpose();
                let twice = |v: Vector3<f64>| v.dot(&target.inertia_kg_m2.component_mul(&v));
                let (radial, normal) = (to_body * Vector3::x(), to_body * Vector3::z());
                let tides = 3.0 * twice(radial) - twice(normal);
                let kept = if target.gravity_gradient == Switch::On {
                    twice(to_body * node.rate) + n * n * tides
                } else {
                    twice(to_body * inertial)
                };
                let scale = target.inertia_kg_m2.max() * fastest * fastest;
                assert!((kept - *first.get_or_insert(kept)).abs() < 1e-10 * scale);
            }
        }
    }
}
