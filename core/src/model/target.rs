//! The tumbling target: geometry, port, and torque-free rotation.

use super::Switch;
use crate::math::quaternion;
use nalgebra::{Vector3, Vector4};

/// The dead satellite, in its own body frame at its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Half edge lengths of its box [m].
    pub half_extents: Vector3<f64>,
    /// Principal moments of inertia [kg m^2].
    pub inertia: Vector3<f64>,
    /// Mass [kg].
    pub mass: f64,
    /// Docking port position `p_d` [m].
    pub port_position: Vector3<f64>,
    /// Outward unit normal of the port `n_d`.
    pub port_normal: Vector3<f64>,
    /// Whether the gravity gradient turns it; free of torques otherwise, as in the paper.
    pub gravity_gradient: Switch,
}

impl Default for Target {
    fn default() -> Self {
        Self {
            half_extents: Vector3::new(0.4, 0.4, 0.2),
            inertia: Vector3::new(2.5, 3.0, 2.0),
            mass: 50.0,
            port_position: Vector3::new(0.0, 0.0, 0.2),
            port_normal: Vector3::z(),
            gravity_gradient: Switch::Auto,
        }
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

    /// The same, all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self =
        Self { attitude: Vector4::new(0.0, 0.0, 0.0, 0.0), rate: Vector3::new(0.0, 0.0, 0.0) };
}

/// RK4 substeps a node for the tumble: its error over 20 minutes is then below 1e-12.
const SUBSTEPS: usize = 10;

impl Target {
    /// Fills `nodes` with the torque-free tumble at `t = 0, dt, 2 dt, ...` (section 2).
    ///
    /// `attitude` is the initial attitude (body to RTN), `rate` the initial angular velocity
    /// relative to RTN in **body** axes [rad/s], `n` the orbit's mean motion [rad/s].
    /// Cost: 40 evaluations of Euler's equations a node.
    pub fn tumble(
        &self,
        n: f64,
        attitude: &Vector4<f64>,
        rate: &Vector3<f64>,
        dt: f64,
        nodes: &mut [TargetState],
    ) {
        let mut q = *attitude;
        let orbit_rate = |q: &Vector4<f64>| {
            quaternion::rotation_matrix(q).transpose() * Vector3::new(0.0, 0.0, n)
        };
        // The integration runs in the inertial rate in body axes, which the attitude can't disturb.
        let mut w = rate + orbit_rate(&q);
        let h = dt / SUBSTEPS as f64;
        for node in nodes {
            let relative = quaternion::rotation_matrix(&q) * w - Vector3::new(0.0, 0.0, n);
            *node = TargetState { attitude: q, rate: relative };
            for _ in 0..SUBSTEPS {
                (q, w) = self.rk4_step(n, &q, &w, h);
            }
        }
    }

    fn rk4_step(
        &self,
        n: f64,
        q: &Vector4<f64>,
        w: &Vector3<f64>,
        h: f64,
    ) -> (Vector4<f64>, Vector3<f64>) {
        let rate = |q: &Vector4<f64>, w: &Vector3<f64>| {
            let relative = quaternion::rotation_matrix(q) * w - Vector3::new(0.0, 0.0, n);
            let momentum = self.inertia.component_mul(w);
            (quaternion::derivative(q, &relative), -w.cross(&momentum).component_div(&self.inertia))
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

    #[test]
    fn tumble_conserves_momentum_and_energy_in_inertial_space() {
        let (target, n, dt) = (Target::default(), Orbit::default().mean_motion(), 20.0);
        let attitude = quaternion::normalized(&Vector4::new(0.2, -0.5, 0.1, 0.7));
        let mut nodes = [TargetState::ZERO; 60];
        target.tumble(n, &attitude, &Vector3::new(9e-4, -7e-4, 5e-4), dt, &mut nodes);
        let integrals = |k: usize| {
            let r = quaternion::rotation_matrix(&nodes[k].attitude);
            let w = r.transpose() * (nodes[k].rate + Vector3::new(0.0, 0.0, n));
            let momentum = target.inertia.component_mul(&w);
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
        target.tumble(n, &quaternion::IDENTITY, &rest, 20.0, &mut nodes);
        let expected = quaternion::exp(&Vector3::new(0.0, 0.0, -20.0 * n));
        assert!(quaternion::difference(&nodes[1].attitude, &expected).norm() < 1e-13);
    }
}
