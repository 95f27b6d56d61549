//! Typical magnitudes of an approach: what steps of the optimisation are divided by.

use super::fields::section;
use super::{Mission, moment_bounds};
use nalgebra::{SVector, Vector3};

section! {
    /// Typical magnitudes. They follow from time, travel and inertia, not from limits: a stronger
    /// servicer moves no faster for it, and its subproblems look the same. By default one each.
    Typical in "typical" {
        /// Position [m].
        length_m: f64 = 1.0, Positive;
        /// Velocity [m/s].
        velocity_m_s: f64 = 1.0, Positive;
        /// Force [N].
        force_n: f64 = 1.0, Positive;
        /// Attitude and joint angles [rad].
        angle_rad: f64 = 1.0, Positive;
        /// Bus rate [rad/s].
        rate_rad_s: f64 = 1.0, Positive;
        /// Joint rates [rad/s].
        joint_rate_rad_s: f64 = 1.0, Positive;
        /// Bus torque [N m].
        bus_torque_n_m: f64 = 1.0, Positive;
        /// Joint torques [N m].
        joint_torque_n_m: f64 = 1.0, Positive;
    }
}

/// Dimensionless factors, such that the problem definition's servicer has the magnitudes seen in
/// its plans (docs/concepts/problem.md, section 5): 1 cm/s, 0.02 N, 1e-3 and 5e-3 rad/s, 5e-4 N m.
mod factor {
    /// Of length over time.
    pub const VELOCITY: f64 = 12.0;
    /// Of mass times length over time squared.
    pub const FORCE: f64 = 54.34;
    /// Of one radian over time: bus and joints.
    pub const RATE: f64 = 1.2;
    pub const JOINT_RATE: f64 = 6.0;
    /// Of inertia over time squared: the system's about the bus, the straight arm's about its base.
    pub const BUS_TORQUE: f64 = 5.44;
    pub const JOINT_TORQUE: f64 = 16.9;
    /// Multiples of what is typical up to which limits measure the cost; those of the problem
    /// definition's servicer just do.
    pub const MOST_FORCE: f64 = 130.0;
    pub const MOST_TORQUE: f64 = 10.5;
}

/// Units of controls and joint rates in the cost [N, N m, rad/s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostUnits<const NL: usize> {
    /// Force, RTN axes.
    pub force: Vector3<f64>,
    /// Bus torque, body axes.
    pub bus_torque: Vector3<f64>,
    /// Joint torques.
    pub joint_torque: SVector<f64, NL>,
    /// Joint rates.
    pub joint_rate: SVector<f64, NL>,
}

impl<const NL: usize> Mission<NL> {
    /// Units of controls and joint rates in the cost. Those of controls are their limits, as in the paper,
    /// but at most a multiple of the typical magnitude. A limit that is never near is no measure: with it,
    /// a stronger actuator would be free to chatter. Those of joint rates are typical rates, at most their
    /// limits.
    // Not inlined: both stages ask once, before they begin.
    #[inline(never)]
    pub fn cost_units(&self) -> CostUnits<NL> {
        let (typical, servicer) = (self.typical(), &self.servicer);
        CostUnits {
            force: servicer.force_limit_n.map(|f| f.min(factor::MOST_FORCE * typical.force_n)),
            bus_torque: servicer
                .bus_torque_limit_n_m
                .map(|t| t.min(factor::MOST_TORQUE * typical.bus_torque_n_m)),
            joint_torque: servicer
                .joint_torque_limit_n_m
                .map(|t| t.min(factor::MOST_TORQUE * typical.joint_torque_n_m)),
            joint_rate: servicer.joint_rate_limit_rad_s.map(|q| q.min(typical.joint_rate_rad_s)),
        }
    }

    /// Typical magnitudes: the mission's own, or those that follow from it. None is above the
    /// largest limit that concerns it; what an axis or a joint is scaled by is not above its own.
    pub fn typical(&self) -> Typical {
        let (servicer, time) = (&self.servicer, self.approach.duration_s);
        let (mut arm, mut whole) = (0.0, moment_bounds(&servicer.bus_inertia_kg_m2)[1]);
        let mut joint = servicer.arm_base_m;
        for link in &servicer.links {
            let center = joint + link.center_of_mass_m;
            let [_, own] = moment_bounds(&link.inertia_kg_m2);
            arm += own + link.mass_kg * (center - servicer.arm_base_m).norm_squared();
            whole += own + link.mass_kg * center.norm_squared();
            joint += link.tip_m;
        }
        let length = 1.0;
        let per_square = 1.0 / (time * time);
        let derived = Typical {
            length_m: length,
            velocity_m_s: factor::VELOCITY * length / time,
            force_n: factor::FORCE * servicer.total_mass() * length * per_square,
            angle_rad: 0.1,
            rate_rad_s: factor::RATE / time,
            joint_rate_rad_s: factor::JOINT_RATE / time,
            bus_torque_n_m: factor::BUS_TORQUE * whole * per_square,
            joint_torque_n_m: factor::JOINT_TORQUE * arm * per_square,
        };
        let t = self.typical_magnitudes.unwrap_or(derived);
        Typical {
            force_n: t.force_n.min(servicer.force_limit_n.max()),
            joint_rate_rad_s: t.joint_rate_rad_s.min(servicer.joint_rate_limit_rad_s.max()),
            bus_torque_n_m: t.bus_torque_n_m.min(servicer.bus_torque_limit_n_m.max()),
            joint_torque_n_m: t.joint_torque_n_m.min(servicer.joint_torque_limit_n_m.max()),
            ..t
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_servicer_has_what_is_seen_in_its_plans() {
        let t = Mission::default().typical();
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.01;
        assert!(near(t.velocity_m_s, 1e-2) && near(t.force_n, 2e-2), "{t:?}");
        assert!(near(t.rate_rad_s, 1e-3) && near(t.joint_rate_rad_s, 5e-3), "{t:?}");
        assert!(near(t.bus_torque_n_m, 5e-4) && near(t.joint_torque_n_m, 5e-4), "{t:?}");
    }

    #[test]
    fn limits_measure_the_cost_where_they_are_near() {
        let mut mission = Mission::default();
        let paper = CostUnits {
            force: Vector3::repeat(2.5),
            bus_torque: Vector3::repeat(5e-3),
            joint_torque: SVector::repeat(5e-3),
            ..mission.cost_units()
        };
        assert_eq!(mission.cost_units(), paper);
        mission.servicer.joint_torque_limit_n_m[1] = 20.0;
        mission.servicer.bus_torque_limit_n_m.z = 1e-3;
        let units = mission.cost_units();
        assert!(units.joint_torque[1] < 6e-3 && units.joint_torque[2] == 5e-3);
        assert_eq!(units.bus_torque, Vector3::new(5e-3, 5e-3, 1e-3));
        assert_eq!(units.force, paper.force);
    }

    #[test]
    fn strength_does_not_matter_but_weakness_does() {
        let (mut strong, mut weak) = (Mission::default(), Mission::default());
        strong.servicer.joint_torque_limit_n_m.fill(20.0);
        strong.servicer.bus_torque_limit_n_m.fill(5.0);
        strong.servicer.force_limit_n.fill(100.0);
        assert_eq!(strong.typical(), Mission::default().typical());
        weak.servicer.force_limit_n.fill(1e-3);
        assert_eq!(weak.typical().force_n, 1e-3);
    }
}
