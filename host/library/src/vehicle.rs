//! What follows from a mission's numbers: how far the arm reaches, what its actuators leave to
//! spare, and whether an approach can end at all.

use crate::formats::MissionTypical;
use crate::method::Integrator;
use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{MAX_NODE_TURN, Mission, Refusal, Scenario};
use remora_core::advanced::stages::NODES;
use serde::Serialize;

/// The `format` of `remora mission --json`.
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
    /// The same with the arm at its most extended [m].
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
    /// The same at capture [kg m^2].
    pub inertia_at_capture_kg_m2: [[f64; 3]; 3],
    /// The way of each joint.
    pub joints: Vec<Joint>,
    /// What steps of the optimisation are divided by, the mission's own or derived.
    pub typical: MissionTypical,
    /// Angular momentum [N m s].
    pub spin_up: Margin,
    /// Force [N].
    pub force: Margin,
    /// Turn of the target from node to node [deg].
    pub turn: Margin,
    /// Why no approach of the mission can end, where that is so.
    pub refused: Option<Refused>,
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

/// What is needed of what there is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margin {
    /// At least so much is needed.
    pub needed: f64,
    /// There is so much.
    pub available: f64,
}

impl Margin {
    /// How many times what is needed there is.
    pub fn factor(&self) -> f64 {
        self.available / self.needed
    }
}

/// A constraint that cannot be met.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Refused {
    /// Its name.
    pub constraint: &'static str,
    /// One line with the numbers.
    pub reason: String,
}

impl Vehicle {
    /// What follows from a valid mission.
    pub fn of<const NL: usize>(mission: &Mission<NL>, integrator: Integrator) -> Self {
        let s = &mission.servicer;
        let rows = |m: Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
        let bus_mass_kg = s.bus_mass;
        Self {
            format: FORMAT,
            integrator,
            reach_m: s.capture_geometry().reach,
            extension_m: s.extension(),
            keep_out_far_m: mission.approach.keep_out_far,
            keep_out_near_m: mission.approach.keep_out_near,
            bus_mass_kg,
            arm_mass_kg: s.total_mass() - bus_mass_kg,
            system_mass_kg: s.total_mass(),
            inertia_at_start_kg_m2: rows(s.system_inertia(&s.initial_joint_angle)),
            inertia_at_capture_kg_m2: rows(s.system_inertia(&s.capture_joint_angle)),
            joints: (0..NL).map(|i| joint(mission, integrator, i)).collect(),
            typical: MissionTypical::from(&mission.typical()),
            spin_up: spin_up(mission),
            force: force(mission, integrator),
            turn: turn(mission),
            refused: refused(mission, integrator),
        }
    }
}

fn joint<const NL: usize>(mission: &Mission<NL>, integrator: Integrator, i: usize) -> Joint {
    let s = &mission.servicer;
    let travel_rad = (s.capture_joint_angle[i] - s.initial_joint_angle[i]).abs();
    Joint {
        travel_rad,
        needed_s: travel_rad / mission.planned_joint_rate(integrator)[i],
        available_s: mission.time_to_preset(integrator, &mission.own_grid()),
    }
}

/// Fastest tumble of the scenarios that are drawn, relative to RTN [rad/s].
fn fastest<const NL: usize>(mission: &Mission<NL>) -> f64 {
    let from = &mission.scenarios;
    from.rate_norm.unwrap_or(3f64.sqrt() * from.rate)
}

/// The bus at rest, then at the target's fastest rate; by torque alone, over the whole horizon.
fn spin_up<const NL: usize>(mission: &Mission<NL>) -> Margin {
    let s = &mission.servicer;
    let inertia = s.system_inertia(&s.capture_joint_angle);
    let largest = inertia.symmetric_eigenvalues().max();
    Margin {
        needed: largest * fastest(mission),
        available: s.max_bus_torque.norm() * mission.approach.duration,
    }
}

/// A start in front of the port at rest, the target tumbling as fast as scenarios let it.
fn middle<const NL: usize>(mission: &Mission<NL>) -> Scenario<NL> {
    let rate = fastest(mission) / 3f64.sqrt();
    Scenario {
        target_attitude: quaternion::IDENTITY,
        target_rate: Vector3::repeat(rate),
        position: mission.target.port_position
            + mission.target.port_normal * mission.scenarios.standoff,
        ..Scenario::default()
    }
}

fn force<const NL: usize>(mission: &Mission<NL>, integrator: Integrator) -> Margin {
    let needs = mission.needs::<NODES>(&middle(mission), integrator);
    let needed = needs.map_or(f64::NAN, |needs| needs.force);
    Margin { needed, available: mission.servicer.max_force.max() }
}

fn turn<const NL: usize>(mission: &Mission<NL>) -> Margin {
    let interval = mission.own_grid().interval();
    let turn = (fastest(mission) + mission.mean_motion()) * interval;
    Margin { needed: turn.to_degrees(), available: MAX_NODE_TURN.to_degrees() }
}

fn refused<const NL: usize>(mission: &Mission<NL>, integrator: Integrator) -> Option<Refused> {
    let named =
        |refusal: Refusal| Refused { constraint: refusal.name(), reason: refusal.to_string() };
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
        assert!(vehicle.force.factor() > 100.0 && vehicle.spin_up.factor() > 10.0);
        assert!((2.0..4.0).contains(&vehicle.turn.needed), "{:?}", vehicle.turn);
    }

    #[test]
    fn a_servicer_that_cannot_end_is_refused() {
        let mut mission = Mission::default();
        mission.servicer.max_joint_rate.fill(5e-4);
        let refused = Vehicle::of(&mission, Integrator::RK4).refused.unwrap();
        assert_eq!(refused.constraint, "joint_rate");
        assert!(refused.reason.starts_with("joint_rate: joint 2"), "{}", refused.reason);
        let mut mission = Mission::default();
        mission.scenarios.rate_norm = Some(3f64.to_radians());
        let vehicle = Vehicle::of(&mission, Integrator::RK4);
        assert_eq!(vehicle.refused.unwrap().constraint, "tumble");
        assert!(vehicle.force.needed.is_nan());
    }
}
