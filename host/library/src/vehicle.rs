//! Figures that follow from a mission: the arm's reach, the actuators' margins, and whether an
//! approach can end.

use crate::formats::{Mission, Scenario};
use crate::method::Integrator;
use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{MAX_NODE_TURN, Refusal, Typical};
use remora_core::advanced::stages::NODES;
use serde::Serialize;

/// The `format` of `remora mission show --json`.
pub const FORMAT: &str = "remora-vehicle/1";

/// The numbers of a mission that follow from others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Vehicle {
    /// [`FORMAT`].
    pub format: &'static str,
    /// Discretisation that decides what is in force.
    pub integrator: Integrator,
    /// From the system's centre of mass to the end effector at capture [m].
    pub reach_m: f64,
    /// Farthest that the end effector gets from the system's centre of mass [m].
    pub extension_m: f64,
    /// Keep-out distance while far [m].
    pub keep_out_far_m: f64,
    /// Keep-out distance afterwards [m].
    pub keep_out_near_m: f64,
    /// Mass of the bus [kg].
    pub bus_mass_kg: f64,
    /// Mass of the arm [kg].
    pub arm_mass_kg: f64,
    /// Mass of both [kg].
    pub system_mass_kg: f64,
    /// Inertia about the system's centre of mass at the start, bus axes [kg m^2].
    pub inertia_at_start_kg_m2: [[f64; 3]; 3],
    /// Inertia about the system's centre of mass at capture, bus axes [kg m^2].
    pub inertia_at_capture_kg_m2: [[f64; 3]; 3],
    /// The way of each joint.
    pub joints: Vec<Joint>,
    /// Typical magnitudes that scale steps of the optimisation, the mission's own or derived.
    pub typical: Typical,
    /// Torque that reaches the target's rate within the horizon, about the axis with the least margin [N m].
    pub spin_up: Margin,
    /// Angular momentum of the bus at the target's rate [N m s].
    pub momentum: Margin,
    /// Force [N].
    pub force: Margin,
    /// Turn of the target from node to node [deg].
    pub turn: Margin,
    /// Reason why no approach of the mission can end, where that is so.
    pub refused: Option<UnmetConstraint>,
}

/// The way of a joint from the start to the preset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Joint {
    /// Its way [rad].
    pub travel_rad: f64,
    /// Time for it at the rate that plans allow [s].
    pub needed_s: f64,
    /// Time until the preset [s].
    pub available_s: f64,
}

/// Amount needed, against the amount available.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margin {
    /// Least amount needed.
    pub needed: Option<f64>,
    /// Amount available.
    pub available: Option<f64>,
    /// Reason why one of them is unknown.
    pub unknown: Option<String>,
}

impl Margin {
    fn new(needed: f64, available: f64) -> Self {
        Self { needed: Some(needed), available: Some(available), unknown: None }
    }

    /// Available over needed; none if nothing is needed, or one of them is unknown.
    pub fn factor(&self) -> Option<f64> {
        Some(self.available? / self.needed?).filter(|factor| factor.is_finite())
    }
}

/// A constraint that cannot be met.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnmetConstraint {
    /// Its name.
    pub constraint: &'static str,
    /// One line with the numbers.
    pub reason: String,
}

impl Vehicle {
    /// Computes the figures of a valid mission.
    pub fn of(mission: &Mission, integrator: Integrator) -> Self {
        let s = &mission.servicer;
        let rows = |m: Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
        let bus_mass_kg = s.bus_mass_kg;
        Self {
            format: FORMAT,
            integrator,
            reach_m: s.capture_geometry().reach,
            extension_m: s.extension(),
            keep_out_far_m: mission.approach.keep_out_far_m,
            keep_out_near_m: mission.approach.keep_out_near_m,
            bus_mass_kg,
            arm_mass_kg: s.total_mass() - bus_mass_kg,
            system_mass_kg: s.total_mass(),
            inertia_at_start_kg_m2: rows(s.system_inertia(&s.initial_joint_angle_rad)),
            inertia_at_capture_kg_m2: rows(s.system_inertia(&s.capture_joint_angle_rad)),
            joints: (0..mission.joints()).map(|i| joint(mission, integrator, i)).collect(),
            typical: mission.typical(),
            spin_up: spin_up(mission),
            momentum: momentum(mission),
            force: force(mission, integrator),
            turn: turn(mission),
            refused: refused(mission, integrator),
        }
    }
}

fn joint(mission: &Mission, integrator: Integrator, i: usize) -> Joint {
    let s = &mission.servicer;
    let travel_rad = (s.capture_joint_angle_rad[i] - s.initial_joint_angle_rad[i]).abs();
    Joint {
        travel_rad,
        needed_s: travel_rad / mission.planned_joint_rate(integrator)[i],
        available_s: mission.time_to_preset(integrator, &mission.own_grid()),
    }
}

/// Fastest tumble of the scenarios that are drawn, relative to RTN [rad/s].
fn fastest(mission: &Mission) -> f64 {
    let from = &mission.scenarios;
    from.rate_norm_rad_s.unwrap_or(3f64.sqrt() * from.rate_rad_s)
}

/// Angular momentum of the system that turns as fast as the target may [N m s].
fn fastest_momentum(mission: &Mission) -> f64 {
    let s = &mission.servicer;
    let inertia = s.system_inertia(&s.capture_joint_angle_rad);
    inertia.symmetric_eigenvalues().max() * fastest(mission)
}

/// Spin-up of the bus from rest to the target's fastest rate, by torque alone over the whole horizon.
fn spin_up(mission: &Mission) -> Margin {
    let needed = fastest_momentum(mission) / mission.approach.duration_s;
    Margin::new(needed, mission.servicer.bus_torque_limit_n_m.min())
}

/// A mission limits the wheels' torque, not their momentum.
fn momentum(mission: &Mission) -> Margin {
    let reason = "a mission does not say what the wheels store: compare with theirs";
    let needed = Some(fastest_momentum(mission));
    Margin { needed, available: None, unknown: Some(reason.into()) }
}

/// A start in front of the port at rest, the target tumbling as fast as scenarios let it.
fn middle(mission: &Mission) -> Scenario {
    let rate = fastest(mission) / 3f64.sqrt();
    Scenario {
        target_attitude: quaternion::IDENTITY,
        target_rate: Vector3::repeat(rate),
        position: mission.target.port_position_m
            + mission.target.port_normal * mission.scenarios.standoff_m,
        ..Scenario::default()
    }
}

fn force(mission: &Mission, integrator: Integrator) -> Margin {
    let available = mission.servicer.force_limit_n.max();
    match mission.needs::<NODES>(&middle(mission), integrator) {
        Ok(needs) => Margin::new(needs.force, available),
        Err(refusal) => {
            Margin { needed: None, available: Some(available), unknown: Some(refusal.to_string()) }
        }
    }
}

fn turn(mission: &Mission) -> Margin {
    let interval = mission.own_grid().interval();
    let turn = (fastest(mission) + mission.mean_motion()) * interval;
    Margin::new(turn.to_degrees(), MAX_NODE_TURN.to_degrees())
}

fn refused(mission: &Mission, integrator: Integrator) -> Option<UnmetConstraint> {
    let named = |refusal: Refusal| UnmetConstraint {
        constraint: refusal.name(),
        reason: refusal.to_string(),
    };
    mission.check::<NODES>(&middle(mission), integrator).err().map(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_the_problem_definition_says() {
        let vehicle = Vehicle::of(&Mission::default(), Integrator::RK4);
        assert_eq!(vehicle.refused, None);
        assert_eq!((vehicle.keep_out_far_m, vehicle.keep_out_near_m), (1.85, 1.46));
        assert!((vehicle.extension_m - 1.85).abs() < 5e-3, "{}", vehicle.extension_m);
        assert!((vehicle.reach_m - 1.46).abs() < 5e-5, "{}", vehicle.reach_m);
        assert_eq!((vehicle.system_mass_kg, vehicle.arm_mass_kg), (530.0, 30.0));
        // 0.877 rad at 90 % of 5e-3 rad/s.
        assert!((vehicle.joints[1].needed_s - 194.9).abs() < 0.1, "{:?}", vehicle.joints[1]);
        assert!(vehicle.force.factor() > Some(100.0) && vehicle.spin_up.factor() > Some(10.0));
        assert!((2.0..4.0).contains(&vehicle.turn.needed.unwrap()), "{:?}", vehicle.turn);
        // Torque held over the horizon is more than any wheel stores.
        assert_eq!((vehicle.momentum.available, vehicle.momentum.factor()), (None, None));
    }

    #[test]
    fn a_servicer_that_cannot_end_is_refused() {
        let mut mission = Mission::default();
        mission.servicer.joint_rate_limit_rad_s.fill(5e-4);
        let refused = Vehicle::of(&mission, Integrator::RK4).refused.unwrap();
        assert_eq!(refused.constraint, "joint_rate");
        assert!(refused.reason.starts_with("joint_rate: joint 2"), "{}", refused.reason);
        let mut mission = Mission::default();
        mission.scenarios.rate_norm_rad_s = Some(3f64.to_radians());
        let vehicle = Vehicle::of(&mission, Integrator::RK4);
        assert_eq!(vehicle.refused.unwrap().constraint, "tumble");
        assert_eq!((vehicle.force.needed, vehicle.force.factor()), (None, None));
        assert!(vehicle.force.unknown.unwrap().starts_with("tumble: "));
    }
}
