//! A plan's forces and torques as they stand, without guidance and without errors: what simulators are
//! compared by.
//!
//! Force is held in inertial axes, so that it means the same to every simulator: the plan's force, resolved
//! in the RTN axes at the interval's begin. Bus torques are held in bus axes.
//! Switches are at the nodes, not at a control period's end. Limits are not looked at, and nothing ends a
//! flight early.
//!
//! Where the tip ends is informative only: the plan's model has linear gravity and axes that turn with the
//! mean motion, and a constant 1e-6 N m on the last joint moves the tip by more than a metre.

use nalgebra::Vector3;
use remora_core::advanced::dynamics::Control;
use remora_core::advanced::model::Grid;
use remora_core::advanced::stages::{NODES, TranslationTrajectory};
use remora_host::formats::{MAX_JOINTS, Motion};
use remora_truth::{
    Axes, Command, Dispersion, Errors, JointCommand, Limits, Sampling, Sensors, Setup, View, World,
    WorldError,
};

/// Force and torques that are held from one node to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// When it begins [s].
    pub begins: f64,
    /// When it ends [s].
    pub ends: f64,
    /// Force at the vehicle's force point, RTN axes at the begin [N].
    pub force: Vector3<f64>,
    /// Torque on the bus, bus axes [N m].
    pub bus_torque: Vector3<f64>,
    /// Torques of the joints [N m]; zero where the arm has none.
    pub joint_torque: [f64; MAX_JOINTS],
}

impl Held {
    /// A command of these torques, and of a force in inertial axes [N].
    fn command<const M: usize>(&self, force: &Vector3<f64>) -> Command<M> {
        Command {
            force: *force,
            axes: Axes::Inertial,
            bus_torque: self.bus_torque,
            joints: JointCommand::Torque(core::array::from_fn(|i| self.joint_torque[i])),
        }
    }
}

/// Lists the held forces and torques of a plan, an entry an interval.
pub fn held(grid: &Grid, path: &TranslationTrajectory<NODES>, motion: &Motion) -> Vec<Held> {
    let interval = |k: usize| {
        let Control { bus_torque, joint_torque } = motion.controls[k];
        Held {
            begins: grid.time(k),
            ends: grid.time(k + 1),
            force: path.force[k],
            bus_torque,
            joint_torque: joint_torque.data.0[0],
        }
    };
    (0..grid.nodes.min(NODES) - 1).map(interval).collect()
}

/// A flight in open loop, in a truth with room for `M` joints.
#[derive(Clone, Debug)]
pub struct OpenLoop<const M: usize> {
    /// The forces that acted, inertial axes [N], an entry an interval.
    pub forces: Vec<Vector3<f64>>,
    /// The truth at the nodes, from the start on: one entry more.
    pub nodes: Vec<View<M>>,
    /// Steps of the integrator: taken and refused.
    pub steps: (u64, u64),
}

/// Samples a second of sensors that nobody asks: each would end a step of the integrator [Hz].
const NEVER: f64 = 1e-9;

/// Flies what is held in the world of a setup.
///
/// # Errors
/// A truth that cannot be integrated.
pub fn fly<const M: usize>(setup: &Setup<M>, held: &[Held]) -> Result<OpenLoop<M>, WorldError> {
    // The tip is nowhere within a negative distance of the port: no contact.
    let mut setup = Setup { contact_radius: -1.0, ..setup.clone() };
    setup.vehicle.limits = Limits::NONE;
    let mut errors = Errors::none();
    errors.sensors = Sensors::all(Sampling { rate_hz: NEVER, delay_s: 0.0 });
    let mut world = World::new(&setup, &Dispersion { errors, seed: 0, run: 0 })?;
    let mut flown =
        OpenLoop { forces: Vec::new(), nodes: vec![world.view()], steps: world.steps() };
    for interval in held {
        let force = world.rtn().axes * interval.force;
        world.advance(interval.ends, &interval.command(&force))?;
        flown.forces.push(force);
        flown.nodes.push(world.view());
    }
    flown.steps = world.steps();
    Ok(flown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nominal::{self, Surroundings};
    use remora_core::advanced::model::{Mission, Scenario};
    use remora_core::advanced::stages::LINKS;
    use remora_host::draw::draw;
    use remora_host::formats;
    use remora_truth::{EARTH_MU, Environment};

    const FREE: Surroundings =
        Surroundings { environment: Environment::FREE, argument_of_latitude: 0.0 };

    fn drawn() -> (Mission<LINKS>, Scenario<LINKS>) {
        let mission = formats::Mission::default();
        let set = draw(1, 1, &mission).unwrap();
        (mission.sized(), set.scenarios[0].scenario().resized())
    }

    /// Some force and torques, about as large as a plan's, in 20 intervals of 60 s.
    fn some() -> Vec<Held> {
        let interval = |k: i32| {
            let sign = f64::from(k % 3 - 1);
            Held {
                begins: 60.0 * f64::from(k),
                ends: 60.0 * f64::from(k + 1),
                force: Vector3::new(0.02, -0.01, 0.01) * sign,
                bus_torque: Vector3::new(1e-4, 2e-4, -1e-4) * sign,
                joint_torque: [1e-5 * sign, -1e-5 * sign, 5e-6 * sign, 0.0, 0.0, 0.0, 0.0],
            }
        };
        (0..20).map(interval).collect()
    }

    /// Without gravity the centre of mass goes by the forces alone, on parabolas.
    #[test]
    fn the_center_of_mass_follows_newton() {
        let (mission, scenario) = drawn();
        let setup = nominal::setup(&mission, &scenario, &FREE);
        let held = some();
        let flown = fly(&setup, &held).unwrap();
        let mass = setup.vehicle.mass();
        let (mut p, mut v) = (flown.nodes[0].center, flown.nodes[0].center_velocity);
        for (k, interval) in held.iter().enumerate() {
            let (a, dt) = (flown.forces[k] / mass, interval.ends - interval.begins);
            (p, v) = (p + v * dt + a * (0.5 * dt * dt), v + a * dt);
            let node = &flown.nodes[k + 1];
            assert_eq!(node.time, interval.ends);
            assert!((node.center - p).amax() < 1e-11);
            assert!((node.center_velocity - v).amax() < 1e-14);
        }
    }

    /// The first force is the plan's in the RTN axes of the start, where the orbit's frame is known:
    /// R to the ascending node, T upwards.
    #[test]
    fn the_force_is_resolved_at_the_begin() {
        let (mission, scenario) = drawn();
        let setup = nominal::setup(&mission, &scenario, &Surroundings::default());
        let flown = fly(&setup, &some()).unwrap();
        let (s, c) = (setup.orbit.inclination.sin(), setup.orbit.inclination.cos());
        let f = some()[0].force;
        let expected = Vector3::new(f.x, f.y * c - f.z * s, f.y * s + f.z * c);
        assert!((flown.forces[0] - expected).amax() < 1e-15);
        // Three nodes on, they have turned by the orbit's motion.
        let angle = 180.0 * (EARTH_MU / setup.orbit.semi_major_axis.powi(3)).sqrt();
        assert!((flown.forces[3].angle(&expected) - angle * plane(&f)).abs() < 1e-3);
    }

    /// Share of a turn about N by which a vector turns: small angles only.
    fn plane(f: &Vector3<f64>) -> f64 {
        (f.x * f.x + f.y * f.y).sqrt() / f.norm()
    }

    /// Steps of the integrator change the result far less than simulators differ: in the same world
    /// with sensors, which end a step ten times a second, the tip is the same.
    #[test]
    fn steps_do_not_matter() {
        let (mission, scenario) = drawn();
        for surroundings in [FREE, Surroundings::default()] {
            let setup = nominal::setup(&mission, &scenario, &surroundings);
            let flown = fly(&setup, &some()).unwrap();
            let dispersion = Dispersion { errors: Errors::none(), seed: 0, run: 0 };
            let mut world = World::new(&setup, &dispersion).unwrap();
            for (held, force) in some().iter().zip(&flown.forces) {
                world.advance(held.ends, &held.command(force)).unwrap();
            }
            assert!(world.steps().0 > 10 * flown.steps.0);
            let apart = (flown.nodes[20].tip - world.view().tip).norm();
            assert!(apart < 1e-8, "{apart}");
        }
    }
}
