//! A plan over time, in RTN: at its nodes what stands in its file, between them its own dynamics.

use crate::epoch::MICROS;
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::dynamics::{Control, Integrator, Multibody, State};
use remora_core::advanced::guidance::FlightPlan;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Grid, Orbit, TargetState};
use remora_core::advanced::stages::{NODES, TranslationTrajectory};
use remora_host::error::{Error, FieldError};
use remora_host::formats::{self, MAX_JOINTS, Mission, PlanFile};
use std::path::Path;

/// Instants that are no farther apart are one [µs].
const SAME: i64 = 1;

/// Most instants of a motion.
const MOST: f64 = 1e6;

/// A plan over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Instants in their order: the nodes, and in between those of the steps.
    pub moments: Vec<Moment>,
    /// Bodies that move.
    pub bodies: Bodies,
    /// The target's orbit, as the plan's mission has it.
    pub orbit: Orbit,
    /// Distance of the start from the target [m].
    pub start_distance_m: f64,
    /// Largest error of the plan's model of relative motion that is accepted [m].
    pub hcw_error_limit_m: f64,
}

/// All of it at one instant. Vectors are in RTN, attitudes body to RTN, rates relative to RTN.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Time since the first node [µs].
    pub micros: i64,
    /// Centre of mass of bus and arm [m].
    pub position: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
    /// Centre of mass of the bus alone [m].
    pub bus_position: Vector3<f64>,
    /// The bus.
    pub attitude: Vector4<f64>,
    /// Of the bus [rad/s].
    pub rate: Vector3<f64>,
    /// Angles [rad] and rates [rad/s] of the joints, and torques until the next node [N m].
    pub joints: [Vec<f64>; 3],
    /// The target.
    pub target_attitude: Vector4<f64>,
    /// Force until the next node [N].
    pub force: Vector3<f64>,
    /// Torque on the bus until then, bus axes [N m].
    pub bus_torque: Vector3<f64>,
    /// End effector from the port, target axes [m].
    pub tip: Vector3<f64>,
}

/// Bodies that move, each in its own axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// Half edge lengths of the target's box [m].
    pub target_half_extents: Vector3<f64>,
    /// Where its port is [m].
    pub port: Vector3<f64>,
    /// The port's outward unit normal.
    pub port_normal: Vector3<f64>,
    /// Half edge lengths of the bus [m].
    pub bus_half_extents: Vector3<f64>,
    /// The links, from the bus outwards.
    pub links: Vec<Link>,
}

/// A link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Its joint in the axes of the body before it [m].
    pub joint: Vector3<f64>,
    /// The joint's unit axis.
    pub axis: Vector3<f64>,
    /// The next joint, or the end effector [m].
    pub tip: Vector3<f64>,
    /// Ends of the capsule that holds it [m].
    pub capsule: [Vector3<f64>; 2],
    /// Radius of that capsule [m].
    pub radius: f64,
}

impl Motion {
    /// A plan's motion, at the nodes and at multiples of a step between them [s]; none is one second for
    /// plans that say something between nodes, and nodes alone for others.
    ///
    /// # Errors
    /// A plan whose inputs are not sound; a step for a plan that says nothing between its nodes;
    /// a step that is none.
    pub fn of(file: &Path, plan: &PlanFile, step: Option<f64>) -> Result<Self, Error> {
        let step = match (plan.integrator, step) {
            (Integrator::Euler, Some(_)) => {
                let reason = "made with Euler's step, the plan says nothing between its nodes; \
                              leave --step out for the nodes alone";
                return Err(Error::input(file, "integrator", reason));
            }
            (Integrator::Euler, None) => None,
            (_, step) => Some(step.unwrap_or(1.0)),
        };
        let track = Track::of(plan).map_err(|error| error.at(file))?;
        track.motion(step).ok_or_else(|| {
            let reason =
                "expected a step of at least a microsecond, and no more than a million of them";
            Error::argument("--step", reason)
        })
    }

    /// Time from the first node to the last [s].
    pub fn duration(&self) -> f64 {
        self.moments.last().map_or(0.0, |moment| moment.micros as f64 / MICROS)
    }
}

/// A plan as its file has it.
struct Track {
    mission: Mission,
    grid: Grid,
    path: TranslationTrajectory<NODES>,
    motion: formats::Motion,
    target: [TargetState; NODES],
    /// Plan between the nodes; none with Euler's step.
    between: Option<Box<FlightPlan<MAX_JOINTS>>>,
}

impl Track {
    fn of(plan: &PlanFile) -> Result<Self, FieldError> {
        let made = plan.inputs.read(&plan.scenario)?;
        let (mission, scenario) = (made.mission, made.scenario);
        let path = plan.stage1.trajectory();
        let motion = plan.stage2.trajectory();
        let between = FlightPlan::new(&mission, &scenario, plan.integrator, &path, &motion);
        Ok(Self {
            grid: mission.grid(&scenario),
            mission,
            path,
            motion,
            target: plan.target.nodes(),
            between: between.ok().map(Box::new),
        })
    }

    /// All of it; none where the step is none.
    fn motion(&self, step: Option<f64>) -> Option<Motion> {
        let mut moments = Vec::new();
        for k in 0..self.grid.nodes {
            moments.push(self.at_node(k));
            if let (Some(step), Some(plan)) = (step, &self.between) {
                self.between(k, step, |time, micros| {
                    moments.push(self.inside(plan, k, (time, micros)));
                })?;
            }
        }
        let start = &self.path.position[0];
        let start_distance_m = libm::sqrt(start.dot(start));
        Some(Motion {
            moments,
            bodies: self.bodies(),
            orbit: self.mission.orbit,
            start_distance_m,
            hcw_error_limit_m: self.mission.hcw_error_limit(start_distance_m),
        })
    }

    /// The multiples of a step within an interval; none where the step is none.
    fn between(&self, k: usize, step: f64, mut at: impl FnMut(f64, i64)) -> Option<()> {
        let is_step = step * MICROS >= 1.0 && self.grid.duration / step <= MOST;
        if !is_step || k == self.grid.last() {
            return is_step.then_some(());
        }
        let (begins, ends) = (micros(self.grid.time(k)), micros(self.grid.time(k + 1)));
        let mut count = (self.grid.time(k) / step).floor();
        loop {
            count += 1.0;
            let time = count * step;
            let now = micros(time);
            // A step beyond all times ends at the greatest.
            if now.saturating_add(SAME) >= ends {
                return Some(());
            }
            if now > begins + SAME {
                at(time, now);
            }
        }
    }

    /// Takes a node's moment from the plan's file.
    fn at_node(&self, k: usize) -> Moment {
        let held = k.min(self.grid.last().saturating_sub(1));
        let place = (self.path.position[k], self.path.velocity[k]);
        let control = (self.motion.controls[held], self.path.force[held]);
        let time = micros(self.grid.time(k));
        self.moment(time, place, &self.motion.states[k], &self.target[k], control)
    }

    /// Along the plan's own dynamics from node `k`.
    fn inside(
        &self,
        plan: &FlightPlan<MAX_JOINTS>,
        k: usize,
        (time, micros): (f64, i64),
    ) -> Moment {
        let there = plan.at(&self.mission, time);
        let place = (there.position, there.velocity);
        let control = (there.control, self.path.force[k]);
        self.moment(micros, place, &there.state, &there.target, control)
    }

    fn moment(
        &self,
        micros: i64,
        (position, velocity): (Vector3<f64>, Vector3<f64>),
        state: &State<MAX_JOINTS>,
        target: &TargetState,
        (control, force): (Control<MAX_JOINTS>, Vector3<f64>),
    ) -> Moment {
        let arm = Multibody::new(&self.mission).arm_pose(&state.joint_angle);
        let bus = quaternion::rotation_matrix(&state.attitude);
        let bus_position = position - bus * arm.center;
        let axes = quaternion::rotation_matrix(&target.attitude);
        let tip = axes.tr_mul(&(bus_position + bus * arm.end));
        let of = |values: &[f64]| values.iter().take(self.mission.joints()).copied().collect();
        Moment {
            micros,
            position,
            velocity,
            bus_position,
            attitude: state.attitude,
            rate: state.rate,
            joints: [
                of(state.joint_angle.as_slice()),
                of(state.joint_rate.as_slice()),
                of(control.joint_torque.as_slice()),
            ],
            target_attitude: target.attitude,
            force,
            bus_torque: control.bus_torque,
            tip: tip - self.mission.target.port_position_m,
        }
    }

    fn bodies(&self) -> Bodies {
        let (target, servicer) = (&self.mission.target, &self.mission.servicer);
        let mut joint = servicer.arm_base_m;
        let links = servicer.links.iter().take(self.mission.joints()).map(|link| {
            let capsule = link.capsule(&Vector3::zeros(), &link.tip_m, |end| *end);
            let (axis, tip, radius) = (link.axis, link.tip_m, link.radius_m);
            let here = Link { joint, axis, tip, capsule, radius };
            joint = link.tip_m;
            here
        });
        Bodies {
            target_half_extents: target.half_extents_m,
            port: target.port_position_m,
            port_normal: target.port_normal,
            bus_half_extents: servicer.bus_half_extents_m,
            links: links.collect(),
        }
    }
}

/// A time in whole microseconds.
fn micros(time: f64) -> i64 {
    (time * MICROS).round() as i64
}
