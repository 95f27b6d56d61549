//! Leaving the target: away from it, or past it, where force away from it does not come.

use super::guarded::{Parity, bits};
use super::tracking::{Effort, SOON, Tracking};
use super::{Estimate, Limits};
use crate::dynamics::{Acceleration, Control, Multibody, State};
use crate::math::quaternion;
use crate::model::{Mission, signed_distance_to_box};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use remora_qp::dense::{clamp, divisor};

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
    pub without: Vector3<f64>,
    /// Unit vector along which the servicer speeds up to go past the target, bus axes, zero once it need
    /// not; chosen by the first step.
    pub past: Option<Vector3<f64>>,
    /// Where the joints stay [rad].
    pub joint_angle: SVector<f64, NL>,
}

impl<const NL: usize> Parity for Leaving<NL> {
    fn parity(&self) -> u64 {
        let Self { without, past, joint_angle } = self;
        let past = past.unwrap_or_default();
        bits(&without.data.0[0]) ^ bits(&past.data.0[0]) ^ bits(&joint_angle.data.0[0])
    }
}

impl<const NL: usize> Leaving<NL> {
    /// Without force along a unit vector (RTN), zero for none.
    pub fn without(without: Vector3<f64>) -> Self {
        Self { without, past: None, joint_angle: SVector::zeros() }
    }

    /// Computes the actuators' effort of one step.
    pub fn effort(
        &mut self,
        tracking: &Tracking<'_, NL>,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
    ) -> Effort<NL> {
        let rigid = Rigid::of(&tracking.body, &estimate.state);
        if self.past.is_none() {
            self.joint_angle = estimate.state.joint_angle;
            self.past = Some(tracking.way_past(mission, estimate, &rigid, &self.without));
        }
        let force = self.push(tracking, estimate, &rigid);
        tracking.stop(estimate, &rigid.held, &self.joint_angle, &force)
    }

    /// The force: past the target up to a speed, and then outwards.
    #[inline(never)]
    fn push(
        &mut self,
        tracking: &Tracking<'_, NL>,
        estimate: &Estimate<NL>,
        rigid: &Rigid<NL>,
    ) -> Vector3<f64> {
        let past = self.past.unwrap_or_default();
        let along = quaternion::rotation_matrix(&estimate.state.attitude) * past;
        let (_, drift) = tracking.body.center_of_mass(&estimate.state);
        if past != Vector3::zeros() && (estimate.velocity + drift).dot(&along) < PAST {
            tracking.largest_past(estimate, rigid, &along)
        } else {
            self.past = Some(Vector3::zeros());
            tracking.outwards(estimate, rigid, &self.without)
        }
    }
}

impl<const NL: usize> Tracking<'_, NL> {
    /// Force that leads outwards, as large as a share of what wheels and joints can do holds against:
    /// where the force does not come, since a thruster is lost, what holds against it must not win. No
    /// force is asked for along the unit vector `without`, zero for none.
    #[inline(never)]
    fn outwards(
        &self,
        estimate: &Estimate<NL>,
        rigid: &Rigid<NL>,
        without: &Vector3<f64>,
    ) -> Vector3<f64> {
        let (center, drift) = self.body.center_of_mass(&estimate.state);
        let soon = estimate.position + center + (estimate.velocity + drift) * SOON;
        let full = largest_along(&(soon - without * without.dot(&soon)), &self.limits.force);
        full * self
            .holding()
            .torques(&Control::ZERO, &rigid.moment(&self.body, &estimate.state, &full))
            .1
    }

    /// The largest force along the unit vector `past`, RTN, that joints can hold against. The bus may
    /// turn: wheels are far weaker than thrusters, and to touch is worse.
    #[inline(never)]
    fn largest_past(
        &self,
        estimate: &Estimate<NL>,
        rigid: &Rigid<NL>,
        past: &Vector3<f64>,
    ) -> Vector3<f64> {
        let full = largest_along(past, &self.limits.force);
        let moment = rigid.moment(&self.body, &estimate.state, &full);
        let torque = moment.joint_torque - rigid.held * moment.bus_torque;
        let limits = torque.iter().zip(&self.limits.joint_torque);
        full * limits
            .filter(|(torque, _)| **torque != 0.0)
            .fold(1.0, |share: f64, (torque, most)| {
                share.min(HOLDING * most / divisor(torque.abs()))
            })
    }

    /// Torques that stop the bus and hold the joints where they are under a force. Where wheels are too
    /// weak the bus turns, and the arm with it.
    #[inline(never)]
    fn stop(
        &self,
        estimate: &Estimate<NL>,
        held: &SMatrix<f64, NL, 3>,
        joint_angle: &SVector<f64, NL>,
        force: &Vector3<f64>,
    ) -> Effort<NL> {
        let bus = estimate.state.rate * (-2.0 * self.bandwidth(self.settings.attitude));
        let w = self.bandwidth(self.settings.joint);
        let off = estimate.state.joint_angle - joint_angle;
        let joint = (off * w + estimate.state.joint_rate * 2.0) * -w;
        let wanted = self.body.torques(&estimate.state, force, &Acceleration { bus, joint });
        let most = &self.limits.bus_torque;
        let bus_torque = wanted.bus_torque.zip_map(most, |torque, most| clamp(torque, -most, most));
        let turning = held * (bus_torque - wanted.bus_torque);
        let needed = Control { bus_torque, joint_torque: wanted.joint_torque + turning };
        let (control, share) = self.limits.torques(&needed, &Control::ZERO);
        Effort { force: *force, control, share: [1.0, share], ..Effort::NONE }
    }

    /// The bus axis along which the servicer gets past the target soonest where force along `without`
    /// (RTN) does not come; zero where it need not, since the target is far or force away from it comes.
    #[inline(never)]
    fn way_past(
        &self,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
        rigid: &Rigid<NL>,
        without: &Vector3<f64>,
    ) -> Vector3<f64> {
        let mut best = (0.0, Vector3::zeros());
        let Some(ahead) = self.ahead(mission, estimate, without) else { return best.1 };
        let bus = quaternion::rotation_matrix(&estimate.state.attitude);
        for i in 0..3 {
            let axis: Vector3<f64> = bus.column(i).into();
            let side = if axis.dot(&ahead) < 0.0 { -1.0 } else { 1.0 };
            let force = self.largest_past(estimate, rigid, &(axis * side));
            // Not the axis that does not answer.
            let lost = axis.dot(without);
            let most = force.dot(&force) * (1.0 - lost * lost);
            if most > best.0 {
                best = (most, Vector3::ith(i, side));
            }
        }
        best.1
    }

    /// Where the end effector will be from the target's centre some time from now (RTN), if it is near the
    /// target and force away from the port does not come.
    #[inline(never)]
    fn ahead(
        &self,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
        without: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let target = quaternion::rotation_matrix(&estimate.target.attitude);
        let (center, drift) = self.body.center_of_mass(&estimate.state);
        let effector = self.body.end_effector(&estimate.state).position;
        let tip = estimate.position + center + effector;
        let distance = signed_distance_to_box(&mission.target.half_extents_m, &target.tr_mul(&tip));
        let has_to = without.dot(&(target * mission.target.port_normal)).abs() > ALONG;
        // Joints move slowly beside the bus.
        let moving = estimate.velocity + drift + estimate.state.rate.cross(&effector);
        let ahead = tip + (moving - estimate.target.rate.cross(&tip)) * AHEAD;
        (has_to && distance.value < NEAR).then_some(ahead)
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

/// Bus and arm as one body: what turns and forces ask of the torques.
struct Rigid<const NL: usize> {
    /// Joint torques that hold the arm where the bus turns by a torque on it (bus axes).
    held: SMatrix<f64, NL, 3>,
    /// Torques without turn and force.
    still: Control<NL>,
}

impl<const NL: usize> Rigid<NL> {
    /// Cost: four evaluations of the inverse dynamics.
    // Separate function: its columns are on no other stack.
    #[inline(never)]
    fn of(body: &Multibody<'_, NL>, state: &State<NL>) -> Self {
        let still = resting(body, state, &Vector3::zeros(), &Vector3::zeros());
        let mut turn = Matrix3::zeros();
        let mut hold = SMatrix::<f64, NL, 3>::zeros();
        for (i, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate() {
            let turned = resting(body, state, &axis, &Vector3::zeros());
            turn.set_column(i, &(turned.bus_torque - still.bus_torque));
            hold.set_column(i, &(turned.joint_torque - still.joint_torque));
        }
        Self { held: hold * turn.try_inverse().unwrap_or_default(), still }
    }

    /// Torques that hold against a force (RTN) where nothing accelerates.
    fn moment(
        &self,
        body: &Multibody<'_, NL>,
        state: &State<NL>,
        force: &Vector3<f64>,
    ) -> Control<NL> {
        let forced = resting(body, state, &Vector3::zeros(), force);
        Control {
            bus_torque: forced.bus_torque - self.still.bus_torque,
            joint_torque: forced.joint_torque - self.still.joint_torque,
        }
    }
}

/// Torques under a turn of the bus and a force (RTN), with joints that do not accelerate.
// Once, however often it is asked for: the stack of one call.
#[inline(never)]
fn resting<const NL: usize>(
    body: &Multibody<'_, NL>,
    state: &State<NL>,
    bus: &Vector3<f64>,
    force: &Vector3<f64>,
) -> Control<NL> {
    body.torques(state, force, &Acceleration { bus: *bus, joint: SVector::zeros() })
}

/// The largest force along `direction` within limits by axis; none along zero.
fn largest_along(direction: &Vector3<f64>, limits: &Vector3<f64>) -> Vector3<f64> {
    let longest = direction.iter().zip(limits).filter(|(along, _)| **along != 0.0).fold(
        0.0,
        |most: f64, (along, limit)| {
            let has_force = *limit != 0.0;
            most.max(if has_force { along.abs() / divisor(*limit) } else { f64::INFINITY })
        },
    );
    let has_force = longest > 0.0 && longest < f64::INFINITY;
    if has_force { direction / divisor(longest) } else { Vector3::zeros() }
}
