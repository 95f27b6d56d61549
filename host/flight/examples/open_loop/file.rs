//! Flights in open loop as files, `*.open-loop.json`: all that another simulator needs to fly the same, and
//! where the truth's tip was.
//!
//! Axes are inertial where a key names none: x to the orbit's ascending node, z to the pole. Positions are
//! relative to the target's centre of mass, which flies along its orbit; velocities are rates of change in
//! these axes. Quaternions are `[x, y, z, w]`, body to inertial. A body's inertia is that about its centre
//! of mass, in its own axes.

use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::stages::LINKS;
use remora_flight::nominal::{self, Surroundings};
use remora_flight::open_loop::{self, Held, OpenLoop};
use remora_host::error::Error;
use remora_host::formats::{MAX_JOINTS, MadeFor, PlanFile, Program};
use remora_truth::{
    Body, Dispersion, Environment, Errors, Oblateness, Setup, Start, Vehicle, WorldError,
};
use serde::Serialize;
use std::path::Path;

/// The format of these files.
pub const FORMAT: &str = "remora-open-loop/1";

/// World that a plan is flown in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// No gravity at all; the target flies straight on.
    Free,
    /// The Earth as a sphere.
    Sphere,
    /// With its oblateness.
    Oblate,
    /// That, with typical errors of masses, inertias, places and orbit, drawn by the scenario's checksum: a
    /// servicer whose axes are nowhere principal and whose force acts beside its bus's centre of mass.
    Dispersed,
}

impl Case {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Free, Self::Sphere, Self::Oblate, Self::Dispersed];

    fn environment(self) -> Environment {
        match self {
            Self::Free => Environment::FREE,
            Self::Sphere => Environment::EARTH,
            Self::Oblate | Self::Dispersed => {
                Environment { oblateness: Some(Oblateness::EARTH), ..Environment::EARTH }
            }
        }
    }

    fn setup<const M: usize>(self, made: &MadeFor) -> Setup<M> {
        let environment = self.environment();
        let surroundings = Surroundings { environment, ..Surroundings::default() };
        let (mission, scenario) = (made.mission.sized(), made.scenario.resized());
        let setup = nominal::setup(&mission, &scenario, &surroundings);
        match self {
            Self::Dispersed => {
                let seed = made.mission.scenario_checksum(&made.scenario);
                Dispersion { errors: Errors::typical(), seed, run: 0 }.disperse(&setup)
            }
            _ => setup,
        }
    }
}

/// A plan's flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OpenLoopFile {
    format: &'static str,
    program: Program,
    /// Id of the plan's scenario.
    pub scenario: String,
    flights: Vec<FlightRecord>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct VehicleRecord {
    bus: BodyRecord,
    /// Where the force acts, bus frame.
    force_point_m: [f64; 3],
    joints: Vec<JointRecord>,
    /// End effector, last link's frame.
    tip_m: [f64; 3],
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct BodyRecord {
    mass_kg: f64,
    center_m: [f64; 3],
    /// Row by row.
    inertia_kg_m2: [[f64; 3]; 3],
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct JointRecord {
    /// In the frame of the body before.
    pivot_m: [f64; 3],
    axis: [f64; 3],
    armature_kg_m2: f64,
    link: BodyRecord,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct FlightRecord {
    case: Case,
    vehicle: VehicleRecord,
    /// Zero: no gravity.
    mu_m3_s2: f64,
    j2: f64,
    equatorial_radius_m: f64,
    /// The target's centre of mass from the Earth's, at the start.
    target_position_m: [f64; 3],
    target_velocity_m_s: [f64; 3],
    start: StartRecord,
    intervals: Vec<IntervalRecord>,
    truth: TruthRecord,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct StartRecord {
    /// Origin of the bus's frame.
    position_m: [f64; 3],
    velocity_m_s: [f64; 3],
    attitude_body_to_inertial: [f64; 4],
    rate_rad_s: [f64; 3],
    joint_angle_rad: Vec<f64>,
    joint_rate_rad_s: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct IntervalRecord {
    begins_s: f64,
    ends_s: f64,
    force_n: [f64; 3],
    bus_torque_body_n_m: [f64; 3],
    joint_torque_n_m: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct TruthRecord {
    steps: u64,
    time_s: Vec<f64>,
    tip_m: Vec<[f64; 3]>,
}

impl OpenLoopFile {
    /// Flies a plan's forces and torques in each of the worlds.
    ///
    /// # Errors
    /// A plan whose inputs are not sound; a truth that cannot be integrated.
    pub fn fly(file: &Path, plan: &PlanFile, cases: &[Case]) -> Result<Self, Error> {
        let made = plan.inputs.read(&plan.scenario).map_err(|error| error.at(file))?;
        let (path, motion) = (plan.stage1.trajectory(), plan.stage2.trajectory());
        let held = open_loop::held(&made.mission.grid(&made.scenario), &path, &motion);
        let fly = |case: &Case| {
            // Sizes of flights in closed loop.
            let flown = match made.mission.joints() {
                LINKS => FlightRecord::flown::<LINKS>(*case, &made, &held),
                _ => FlightRecord::flown::<MAX_JOINTS>(*case, &made, &held),
            };
            flown.map_err(|error| Error::input(file, "inputs", format!("cannot be flown: {error}")))
        };
        Ok(Self {
            format: FORMAT,
            program: Program::this(),
            scenario: plan.scenario.clone(),
            flights: cases.iter().map(fly).collect::<Result<_, Error>>()?,
        })
    }
}

impl VehicleRecord {
    /// Record of a vehicle whose first `joints` joints are the arm's.
    fn of<const M: usize>(vehicle: &Vehicle<M>, joints: usize) -> Self {
        // Pivot of the first joint that the arm does not have.
        let tip = vehicle.joints.get(joints).map_or(&vehicle.tip, |absent| &absent.pivot);
        let joint = |joint: &remora_truth::Joint| JointRecord {
            pivot_m: row(&joint.pivot),
            axis: row(&joint.axis),
            armature_kg_m2: joint.armature,
            link: BodyRecord::of(&joint.link),
        };
        Self {
            bus: BodyRecord::of(&vehicle.bus),
            force_point_m: row(&vehicle.force_point),
            joints: vehicle.joints.iter().take(joints).map(joint).collect(),
            tip_m: row(tip),
        }
    }
}

impl BodyRecord {
    fn of(body: &Body) -> Self {
        Self { mass_kg: body.mass, center_m: row(&body.center), inertia_kg_m2: rows(&body.inertia) }
    }
}

impl FlightRecord {
    fn flown<const M: usize>(
        case: Case,
        made: &MadeFor,
        held: &[Held],
    ) -> Result<Self, WorldError> {
        let setup = case.setup::<M>(made);
        let flown = open_loop::fly(&setup, held)?;
        Ok(Self::of(case, &setup, (held, &flown), made.mission.joints()))
    }

    fn of<const M: usize>(
        case: Case,
        setup: &Setup<M>,
        (held, flown): (&[Held], &OpenLoop<M>),
        joints: usize,
    ) -> Self {
        let environment = &setup.environment;
        let oblateness = environment.oblateness;
        // Without gravity the target flies straight on, as fast as it would on its orbit.
        let (position, velocity) = setup.orbit.state(environment.mu);
        let interval = |(held, force): (&Held, &Vector3<f64>)| IntervalRecord {
            begins_s: held.begins,
            ends_s: held.ends,
            force_n: row(force),
            bus_torque_body_n_m: row(&held.bus_torque),
            joint_torque_n_m: held.joint_torque[..joints].to_vec(),
        };
        Self {
            case,
            vehicle: VehicleRecord::of(&setup.vehicle, joints),
            mu_m3_s2: if environment.has_gravity { environment.mu } else { 0.0 },
            j2: oblateness.map_or(0.0, |o| o.j2),
            equatorial_radius_m: oblateness.map_or(0.0, |o| o.radius),
            target_position_m: row(&position),
            target_velocity_m_s: row(&velocity),
            start: StartRecord::of(&setup.start, joints),
            intervals: held.iter().zip(&flown.forces).map(interval).collect(),
            truth: TruthRecord {
                steps: flown.steps.0,
                time_s: flown.nodes.iter().map(|view| view.time).collect(),
                tip_m: flown.nodes.iter().map(|view| row(&view.tip)).collect(),
            },
        }
    }
}

impl StartRecord {
    fn of<const M: usize>(start: &Start<M>, joints: usize) -> Self {
        Self {
            position_m: row(&start.position),
            velocity_m_s: row(&start.velocity),
            attitude_body_to_inertial: start.attitude,
            rate_rad_s: row(&start.rate),
            joint_angle_rad: start.joint_angle[..joints].to_vec(),
            joint_rate_rad_s: start.joint_rate[..joints].to_vec(),
        }
    }
}

fn row(v: &Vector3<f64>) -> [f64; 3] {
    v.data.0[0]
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    core::array::from_fn(|i| core::array::from_fn(|j| m[(i, j)]))
}
