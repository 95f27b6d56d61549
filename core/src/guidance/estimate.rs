//! Input and output of guidance: estimate, limits and command.

use super::Reference;
use crate::dynamics::{Control, Multibody, State};
use crate::model::{Mission, Servicer, TargetState};
use crate::stages::LINKS;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::{clamp, divisor, is_usable};

/// Square of a quaternion's length up to which it is no attitude.
const LEAST_SQUARE: f64 = 1e-12;

/// Navigation estimate at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const NL: usize = LINKS> {
    /// Time on the clock that plans are dated by [s].
    pub time: f64,
    /// Bus centre of mass relative to the target's, RTN [m].
    pub position: Vector3<f64>,
    /// Its velocity relative to RTN, in RTN [m/s].
    pub velocity: Vector3<f64>,
    /// Attitude and rate of the bus, angles and rates of the joints.
    pub state: State<NL>,
    /// Attitude and rate of the target.
    pub target: TargetState,
    /// End effector from the port, RTN axes [m], where a camera at the wrist sees it.
    pub wrist: Option<Vector3<f64>>,
}

impl<const NL: usize> Estimate<NL> {
    /// Estimate of a servicer and a target that are exactly where a plan has them at `time` [s]. Near capture
    /// guidance has the servicer elsewhere: [`Guidance::expected`](super::Guidance::expected).
    pub fn as_planned(mission: &Mission<NL>, time: f64, planned: &Reference<NL>) -> Self {
        let (center, drift) = Multibody::new(mission).center_of_mass(&planned.state);
        Self {
            time,
            position: planned.position - center,
            velocity: planned.velocity - drift,
            state: planned.state,
            target: planned.target,
            wrist: None,
        }
    }

    /// Whether every number is finite, and small enough to compute with, and no attitude is nearly zero.
    pub fn is_finite(&self) -> bool {
        let State { attitude, joint_angle, rate, joint_rate } = &self.state;
        let TargetState { attitude: target, rate: target_rate } = &self.target;
        let wrist = self.wrist.unwrap_or_default();
        let quaternions = attitude.iter().chain(target);
        let joints = joint_angle.iter().chain(joint_rate);
        let vectors = [&self.position, &self.velocity, rate, target_rate, &wrist];
        let numbers = quaternions.chain(joints).chain(vectors.into_iter().flatten());
        numbers.fold(is_usable(self.time), |sound, x| sound & is_usable(*x))
            && [attitude, target].iter().all(|q| q.dot(q) > LEAST_SQUARE)
    }
}

/// Limits of the actuators.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const NL: usize = LINKS> {
    /// Largest force along each axis, RTN [N].
    pub force: Vector3<f64>,
    /// Largest bus torque about each axis, bus axes [N m].
    pub bus_torque: Vector3<f64>,
    /// Largest joint torques [N m].
    pub joint_torque: SVector<f64, NL>,
}

impl<const NL: usize> Limits<NL> {
    /// Those of a servicer in full.
    pub fn of(servicer: &Servicer<NL>) -> Self {
        Self {
            force: servicer.force_limit_n,
            bus_torque: servicer.bus_torque_limit_n_m,
            joint_torque: servicer.joint_torque_limit_n_m,
        }
    }

    /// The force `planned + s feedback` with the largest share `s`, from zero to one, that keeps the limits.
    pub(super) fn force(
        &self,
        planned: &Vector3<f64>,
        feedback: &Vector3<f64>,
    ) -> (Vector3<f64>, f64) {
        let planned = planned.zip_map(&self.force, within);
        let share = planned
            .iter()
            .zip(feedback)
            .zip(&self.force)
            .fold(1.0, |share, ((planned, more), most)| {
                share_within(share, *planned, *more, *most)
            });
        // Rounding may go past a limit.
        ((planned + feedback * share).zip_map(&self.force, within), share)
    }

    /// Likewise the torques, bus and joints by one share: what the bus does not do the arm would suffer.
    pub(super) fn torques(
        &self,
        planned: &Control<NL>,
        feedback: &Control<NL>,
    ) -> (Control<NL>, f64) {
        let bus = planned.bus_torque.zip_map(&self.bus_torque, within);
        let joint = planned.joint_torque.zip_map(&self.joint_torque, within);
        let share = bus
            .iter()
            .zip(&feedback.bus_torque)
            .zip(&self.bus_torque)
            .chain(joint.iter().zip(&feedback.joint_torque).zip(&self.joint_torque))
            .fold(1.0, |share, ((planned, more), most)| {
                share_within(share, *planned, *more, *most)
            });
        let bus_torque = (bus + feedback.bus_torque * share).zip_map(&self.bus_torque, within);
        let joint_torque =
            (joint + feedback.joint_torque * share).zip_map(&self.joint_torque, within);
        (Control { bus_torque, joint_torque }, share)
    }
}

/// The nearest number no larger than `most`.
fn within(value: f64, most: f64) -> f64 {
    clamp(value, -most, most)
}

/// The share of `more` that takes `planned` no farther than `most`, at most `share`; of what is no
/// number nothing.
fn share_within(share: f64, planned: f64, more: f64, most: f64) -> f64 {
    let room = if more > 0.0 { most - planned } else { most + planned };
    let size = more.abs();
    if size * share <= room {
        share
    } else if size > 0.0 && size < f64::INFINITY {
        clamp(room / divisor(size), 0.0, share)
    } else {
        0.0
    }
}

/// State of guidance; its codes never change their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum FlightMode {
    /// It tracks the plan.
    Track = 0,
    /// It tracks the plan and wants another one; [`Command::wanted`] says why.
    ReplanWanted = 1,
    /// It cannot track: the estimate is no number or too old a plan is in force, and what is planned goes
    /// out as it stands.
    Degraded = 2,
    /// It leaves the target.
    Abort = 3,
    /// The plan's time is over.
    Done = 4,
}

/// Why another plan is wanted, by a code that stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum Reason {
    /// The plan is as old as it may be.
    Time = 1,
    /// The servicer is too far from the plan.
    Error = 2,
    /// The target is, or turns, too far from what the plan was made for.
    Tumble = 3,
    /// The caller asked for it.
    Caller = 4,
}

/// Commands to the actuators until the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<const NL: usize = LINKS> {
    /// State of guidance.
    pub mode: FlightMode,
    /// Why another plan is wanted, where it is.
    pub wanted: Option<Reason>,
    /// Force on the bus at its centre of mass, RTN [N].
    pub force: Vector3<f64>,
    /// Torques; [`Control::joint_torque`] is the feed-forward of joints that follow references.
    pub control: Control<NL>,
    /// Angles and rates for joints with servos of their own.
    pub joint_angle: SVector<f64, NL>,
    /// Rates for joints with servos of their own [rad/s].
    pub joint_rate: SVector<f64, NL>,
    /// How far the servicer is from what the plan asks for.
    pub error: TrackingError,
    /// Shares of the feedback that the limits leave: of the force, and of the torques.
    pub share: [f64; 2],
}

/// How far the servicer is from what the plan asks for.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct TrackingError {
    /// Centre of mass [m].
    pub position: f64,
    /// Bus attitude [rad].
    pub attitude: f64,
    /// The joint farthest off [rad].
    pub joint: f64,
    /// Target's attitude from what the plan expects [rad].
    pub target: f64,
}
