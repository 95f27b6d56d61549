//! Typical magnitudes of an approach: what steps of the optimisation are divided by.

use super::{Mission, moment_bounds};
use nalgebra::{SVector, Vector3};

/// Typical magnitudes. They follow from time, travel and inertia, not from limits: a stronger
/// servicer moves no faster for it, and its subproblems look the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Typical {
    /// Position [m].
    pub length: f64,
    /// Velocity [m/s].
    pub velocity: f64,
    /// Force [N].
    pub force: f64,
    /// Attitude and joint angles [rad].
    pub angle: f64,
    /// Bus rate [rad/s].
    pub rate: f64,
    /// Joint rates [rad/s].
    pub joint_rate: f64,
    /// Bus torque [N m].
    pub bus_torque: f64,
    /// Joint torques [N m].
    pub joint_torque: f64,
}

/// Dimensionless factors, such that the problem definition's servicer has the magnitudes seen in
/// its plans (docs/problem.md, section 11): 1 cm/s, 0.02 N, 1e-3 and 5e-3 rad/s, 5e-4 N m.
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

/// What controls are divided by in the cost [N, N m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostUnits<const NL: usize> {
    /// Force, RTN axes.
    pub force: Vector3<f64>,
    /// Bus torque, body axes.
    pub bus_torque: Vector3<f64>,
    /// Joint torques.
    pub joint_torque: SVector<f64, NL>,
}

impl<const NL: usize> Mission<NL> {
    /// What controls are divided by in the cost: their limits, as in the paper, but no more than a
    /// multiple of what is typical. A limit that is never near is no measure, and were it one, the
    /// stronger actuator would be free to chatter.
    // Not inlined: both stages ask once, before they begin.
    #[inline(never)]
    pub fn cost_units(&self) -> CostUnits<NL> {
        let (typical, servicer) = (self.typical(), &self.servicer);
        CostUnits {
            force: servicer.max_force.map(|f| f.min(factor::MOST_FORCE * typical.force)),
            bus_torque: servicer
                .max_bus_torque
                .map(|t| t.min(factor::MOST_TORQUE * typical.bus_torque)),
            joint_torque: servicer
                .max_joint_torque
                .map(|t| t.min(factor::MOST_TORQUE * typical.joint_torque)),
        }
    }

    /// Typical magnitudes: the mission's own, or those that follow from it. None is above the
    /// largest limit that concerns it; what an axis or a joint is scaled by is not above its own.
    pub fn typical(&self) -> Typical {
        let (servicer, time) = (&self.servicer, self.approach.duration);
        let (mut arm, mut whole) = (0.0, moment_bounds(&servicer.bus_inertia)[1]);
        let mut joint = servicer.arm_base;
        for link in &servicer.links {
            let center = joint + link.center_of_mass;
            let [_, own] = moment_bounds(&link.inertia);
            arm += own + link.mass * (center - servicer.arm_base).norm_squared();
            whole += own + link.mass * center.norm_squared();
            joint += link.tip;
        }
        let length = 1.0;
        let per_square = 1.0 / (time * time);
        let derived = Typical {
            length,
            velocity: factor::VELOCITY * length / time,
            force: factor::FORCE * servicer.total_mass() * length * per_square,
            angle: 0.1,
            rate: factor::RATE / time,
            joint_rate: factor::JOINT_RATE / time,
            bus_torque: factor::BUS_TORQUE * whole * per_square,
            joint_torque: factor::JOINT_TORQUE * arm * per_square,
        };
        let t = self.typical_magnitudes.unwrap_or(derived);
        Typical {
            force: t.force.min(servicer.max_force.max()),
            joint_rate: t.joint_rate.min(servicer.max_joint_rate.max()),
            bus_torque: t.bus_torque.min(servicer.max_bus_torque.max()),
            joint_torque: t.joint_torque.min(servicer.max_joint_torque.max()),
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
        assert!(near(t.velocity, 1e-2) && near(t.force, 2e-2), "{t:?}");
        assert!(near(t.rate, 1e-3) && near(t.joint_rate, 5e-3), "{t:?}");
        assert!(near(t.bus_torque, 5e-4) && near(t.joint_torque, 5e-4), "{t:?}");
    }

    #[test]
    fn limits_measure_the_cost_where_they_are_near() {
        let mut mission = Mission::default();
        let paper = CostUnits {
            force: Vector3::repeat(2.5),
            bus_torque: Vector3::repeat(5e-3),
            joint_torque: SVector::repeat(5e-3),
        };
        assert_eq!(mission.cost_units(), paper);
        mission.servicer.max_joint_torque[1] = 20.0;
        mission.servicer.max_bus_torque.z = 1e-3;
        let units = mission.cost_units();
        assert!(units.joint_torque[1] < 6e-3 && units.joint_torque[2] == 5e-3);
        assert_eq!(units.bus_torque, Vector3::new(5e-3, 5e-3, 1e-3));
        assert_eq!(units.force, paper.force);
    }

    #[test]
    fn strength_does_not_matter_but_weakness_does() {
        let (mut strong, mut weak) = (Mission::default(), Mission::default());
        strong.servicer.max_joint_torque.fill(20.0);
        strong.servicer.max_bus_torque.fill(5.0);
        strong.servicer.max_force.fill(100.0);
        assert_eq!(strong.typical(), Mission::default().typical());
        weak.servicer.max_force.fill(1e-3);
        assert_eq!(weak.typical().force, 1e-3);
    }
}
