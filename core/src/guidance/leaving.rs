//! Leaving the target: away from it, or past it, where force away from it does not come.

use super::tracking::{Effort, SOON, Tracking};
use super::{Estimate, Limits};
use crate::dynamics::{Acceleration, Control, Multibody, State};
use crate::math::quaternion;
use crate::model::{Mission, signed_distance_to_box};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use remora_qp::dense::clamp;

/// Share of the torques' limits that holds against the moment of an escape's force.
const HOLDING: f64 = 0.5;

/// The end effector is near the target within this distance of its box [m].
const NEAR: f64 = 1.0;

/// It has to go past the target where no force comes along a direction within 60 degrees of the port's
/// normal.
const ALONG: f64 = 0.5;

/// Speed at which the servicer goes past the target [m/s].
const PAST: f64 = 0.05;

/// The way past the target begins on the side where the end effector would be so long from now [s].
const AHEAD: f64 = 15.0;

/// How the target is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leaving<const NL: usize> {
    /// Unit vector along which force does not come, RTN; zero for none.
    without: Vector3<f64>,
    /// Unit vector along which the servicer speeds up to go past the target, bus axes, zero once it need
    /// not; chosen by the first step.
    past: Option<Vector3<f64>>,
    /// Where the joints stay [rad].
    pub joint_angle: SVector<f64, NL>,
}

impl<const NL: usize> Leaving<NL> {
    /// Without force along a unit vector (RTN), zero for none.
    pub fn without(without: Vector3<f64>) -> Self {
        Self { without, past: None, joint_angle: SVector::zeros() }
    }

    /// What one step asks of the actuators.
    pub fn effort(
        &mut self,
        tracking: &Tracking<'_, NL>,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
    ) -> Effort<NL> {
        let past = match self.past {
            Some(past) => past,
            None => {
                self.joint_angle = estimate.state.joint_angle;
                tracking.way_past(mission, estimate, &self.without)
            }
        };
        let along = quaternion::rotation_matrix(&estimate.state.attitude) * past;
        let (_, drift) = tracking.body.center_of_mass(&estimate.state);
        let is_passing = past != Vector3::zeros() && (estimate.velocity + drift).dot(&along) < PAST;
        self.past = Some(if is_passing { past } else { Vector3::zeros() });
        if is_passing {
            tracking.pass(estimate, &self.joint_angle, &along)
        } else {
            tracking.escape(estimate, &self.joint_angle, &self.without)
        }
    }
}

impl<const NL: usize> Tracking<'_, NL> {
    /// Force that leads outwards, as large as a share of what wheels and joints can do holds against,
    /// and the torques that stop bus and joints meanwhile: where the force does not come, since a
    /// thruster is lost, what holds against it must not win. No force is asked for along the unit
    /// vector `without`, zero for none.
    pub fn escape(
        &self,
        estimate: &Estimate<NL>,
        joint_angle: &SVector<f64, NL>,
        without: &Vector3<f64>,
    ) -> Effort<NL> {
        let (center, drift) = self.body.center_of_mass(&estimate.state);
        let soon = estimate.position + center + (estimate.velocity + drift) * SOON;
        let full = largest_along(&(soon - without * without.dot(&soon)), &self.limits.force);
        let rigid = Rigid::of(&self.body, &estimate.state);
        let moment = rigid.moment(&self.body, &estimate.state, &full);
        let share = self.holding().torques(&Control::ZERO, &moment).1;
        self.stopping(estimate, joint_angle, full * share, share)
    }

    /// Force along the unit vector `past`, RTN, as large as joints can hold against. The bus may turn:
    /// wheels are far weaker than thrusters, and to touch is worse.
    fn pass(
        &self,
        estimate: &Estimate<NL>,
        joint_angle: &SVector<f64, NL>,
        past: &Vector3<f64>,
    ) -> Effort<NL> {
        let force = self.largest_past(estimate, past);
        self.stopping(estimate, joint_angle, force, 1.0)
    }

    /// The largest force along the unit vector `past`, RTN, that joints can hold against while the bus
    /// gives way.
    fn largest_past(&self, estimate: &Estimate<NL>, past: &Vector3<f64>) -> Vector3<f64> {
        let full = largest_along(past, &self.limits.force);
        let rigid = Rigid::of(&self.body, &estimate.state);
        let moment = rigid.moment(&self.body, &estimate.state, &full);
        let joint_torque = moment.joint_torque - rigid.held(&moment.bus_torque);
        let moment = Control { bus_torque: Vector3::zeros(), joint_torque };
        full * self.holding().torques(&Control::ZERO, &moment).1
    }

    /// The force, and torques that stop bus and joints under it. Where wheels are too weak the bus turns,
    /// and the arm with it.
    fn stopping(
        &self,
        estimate: &Estimate<NL>,
        joint_angle: &SVector<f64, NL>,
        force: Vector3<f64>,
        force_share: f64,
    ) -> Effort<NL> {
        let bus = estimate.state.rate * (-2.0 * self.bandwidth(self.settings.attitude));
        let w = self.bandwidth(self.settings.joint);
        let off = estimate.state.joint_angle - joint_angle;
        let joint = (off * w + estimate.state.joint_rate * 2.0) * -w;
        let stop = Acceleration { bus, joint };
        let wanted = self.body.torques(&estimate.state, &force, &stop);
        let most = &self.limits.bus_torque;
        let bus_torque = wanted.bus_torque.zip_map(most, |torque, most| clamp(torque, -most, most));
        let turning =
            Rigid::of(&self.body, &estimate.state).held(&(bus_torque - wanted.bus_torque));
        let needed = Control { bus_torque, joint_torque: wanted.joint_torque + turning };
        let (control, share) = self.limits.torques(&needed, &Control::ZERO);
        Effort { force, control, share: [force_share, share], ..Effort::NONE }
    }

    /// The bus axis along which the servicer gets past the target soonest where force along `without`
    /// (RTN) does not come; zero where it need not, since the target is far or force away from it comes.
    #[inline(never)]
    fn way_past(
        &self,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
        without: &Vector3<f64>,
    ) -> Vector3<f64> {
        let bus = quaternion::rotation_matrix(&estimate.state.attitude);
        let target = quaternion::rotation_matrix(&estimate.target.attitude);
        let (center, drift) = self.body.center_of_mass(&estimate.state);
        let effector = self.body.end_effector(&estimate.state).position;
        let tip = estimate.position + center + effector;
        let distance = signed_distance_to_box(&mission.target.half_extents, &target.tr_mul(&tip));
        let has_to = without.dot(&(target * mission.target.port_normal)).abs() > ALONG;
        if !has_to || !(distance.value < NEAR) {
            return Vector3::zeros();
        }
        // Joints move slowly beside the bus.
        let moving = estimate.velocity + drift + estimate.state.rate.cross(&effector);
        let ahead = tip + (moving - estimate.target.rate.cross(&tip)) * AHEAD;
        let lost = bus.tr_mul(without).abs();
        let mut best = (0.0, Vector3::zeros());
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let side = if (bus * axis).dot(&ahead) < 0.0 { -axis } else { axis };
            let force = self.largest_past(estimate, &(bus * side));
            // Not the axis that does not answer.
            let most = if lost.dot(&axis) < lost.max() { force.dot(&force) } else { 0.0 };
            if most > best.0 {
                best = (most, side);
            }
        }
        best.1
    }

    /// The share of limits that holds against a force's moment.
    fn holding(&self) -> Limits<NL> {
        Limits {
            bus_torque: self.limits.bus_torque * HOLDING,
            joint_torque: self.limits.joint_torque * HOLDING,
            ..*self.limits
        }
    }
}

/// Bus and arm as one body: what forces and turns ask of the torques.
struct Rigid<const NL: usize> {
    /// Torques without force and acceleration.
    still: Control<NL>,
    /// Angular acceleration of the bus (RTN) for a torque on it (bus axes).
    turn: Matrix3<f64>,
    /// Joint torques that hold the arm against an angular acceleration of the bus (RTN).
    hold: SMatrix<f64, NL, 3>,
}

impl<const NL: usize> Rigid<NL> {
    fn of(body: &Multibody<'_, NL>, state: &State<NL>) -> Self {
        let torques = |bus: Vector3<f64>| {
            let acceleration = Acceleration { bus, joint: SVector::zeros() };
            body.torques(state, &Vector3::zeros(), &acceleration)
        };
        let still = torques(Vector3::zeros());
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(torques);
        let bus = axes.map(|turned| turned.bus_torque - still.bus_torque);
        let turn = Matrix3::from_columns(&bus).try_inverse().unwrap_or_default();
        let hold = axes.map(|turned| turned.joint_torque - still.joint_torque);
        Self { still, turn, hold: SMatrix::from_columns(&hold) }
    }

    /// What a force (RTN) adds to the torques where nothing accelerates.
    fn moment(
        &self,
        body: &Multibody<'_, NL>,
        state: &State<NL>,
        force: &Vector3<f64>,
    ) -> Control<NL> {
        let rest = Acceleration { bus: Vector3::zeros(), joint: SVector::zeros() };
        let held = body.torques(state, force, &rest);
        Control {
            bus_torque: held.bus_torque - self.still.bus_torque,
            joint_torque: held.joint_torque - self.still.joint_torque,
        }
    }

    /// Joint torques that hold the arm where the bus turns by a torque on it (bus axes).
    fn held(&self, bus_torque: &Vector3<f64>) -> SVector<f64, NL> {
        self.hold * (self.turn * bus_torque)
    }
}

/// The largest force along `direction` within limits by axis; none along zero.
fn largest_along(direction: &Vector3<f64>, limits: &Vector3<f64>) -> Vector3<f64> {
    let longest = direction
        .iter()
        .zip(limits)
        .fold(0.0, |most: f64, (along, limit)| most.max(along.abs() / limit));
    if longest > 0.0 && longest < f64::INFINITY { direction / longest } else { Vector3::zeros() }
}
