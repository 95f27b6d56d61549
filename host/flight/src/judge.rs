//! Outcome of a flight, and how near it comes to limits on the way.

use nalgebra::{SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{Multibody, State};
use remora_core::advanced::guidance::{Command, Limits};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Grid, Mission, TargetState, signed_distance_to_box};
use remora_core::advanced::stages::clearances_at;
use remora_truth::View;
use serde::{Deserialize, Serialize};

/// Criteria of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Criteria {
    /// Largest miss of the end effector [m].
    pub miss_m: f64,
    /// Largest angle between the approach axis and the port's [rad].
    pub angle_rad: f64,
    /// Largest speed of the end effector relative to the port [m/s].
    pub speed_m_s: f64,
}

impl Default for Criteria {
    fn default() -> Self {
        Self { miss_m: 0.012, angle_rad: 2.0_f64.to_radians(), speed_m_s: 0.005 }
    }
}

/// The state at the port.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arrival {
    /// Distance of the end effector from the port [m].
    pub miss_m: f64,
    /// Position of the end effector from the port, target's axes [m].
    pub miss_target_m: [f64; 3],
    /// Angle between the approach axis and the port's [rad].
    pub angle_rad: f64,
    /// Speed of the end effector relative to the port [m/s].
    pub speed_m_s: f64,
}

impl Arrival {
    /// Measures the true state.
    pub fn of<const NL: usize>(view: &View<NL>) -> Self {
        let axes = quaternion::rotation_matrix(&Vector4::from(view.target.attitude));
        Self {
            miss_m: view.miss(),
            miss_target_m: axes.tr_mul(&(view.tip - view.port)).data.0[0],
            angle_rad: view.angle(),
            speed_m_s: view.relative_speed(),
        }
    }

    /// Whether it is a capture.
    pub fn is_captured(&self, criteria: &Criteria) -> bool {
        self.miss_m <= criteria.miss_m
            && self.angle_rad <= criteria.angle_rad
            && self.speed_m_s <= criteria.speed_m_s
    }
}

/// How near a flight comes to limits: the least room left, negative beyond the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// Arm and target [m].
    pub arm_m: f64,
    /// Bus and target [m].
    pub bus_m: f64,
    /// Arm and its own bus [m].
    pub own_m: f64,
    /// Centre of mass, as the mission has it, beyond the keep-out distance in force [m].
    pub keep_out_m: f64,
    /// Port within the field of view, as a cosine.
    pub view: f64,
    /// Joints within their stops [rad].
    pub joint_rad: f64,
    /// Largest joint rate over its limit.
    pub joint_rate: f64,
    /// Largest command over its limit: of forces and torques.
    pub command: f64,
}

impl Room {
    /// Nothing looked at yet.
    pub const ALL: Self = Self {
        arm_m: f64::INFINITY,
        bus_m: f64::INFINITY,
        own_m: f64::INFINITY,
        keep_out_m: f64::INFINITY,
        view: f64::INFINITY,
        joint_rad: f64::INFINITY,
        joint_rate: 0.0,
        command: 0.0,
    };

    /// Whether bodies overlapped.
    pub fn collided(&self) -> bool {
        !(self.arm_m >= 0.0 && self.bus_m >= 0.0 && self.own_m >= 0.0)
    }
}

/// Tolerances of keep-out distance and view: the miss that capture itself may have, and the verifier's
/// tolerance.
pub const KEEP_OUT_TOLERANCE_M: f64 = 0.012;
/// Missing cosine that is rounding.
pub const VIEW_TOLERANCE: f64 = 1e-4;

/// Looks at a flight from one instant to the next.
pub struct Judge<'a, const NL: usize> {
    mission: &'a Mission<NL>,
    body: Multibody<'a, NL>,
    grid: &'a Grid,
    /// Field of view's cosine.
    widest: f64,
    /// Depth of the port below the planned one; zero where it stands farther out [m].
    deeper: f64,
    /// Room found so far.
    pub room: Room,
    /// Least distance of the centre of mass from the target's box so far [m].
    pub nearest_m: f64,
}

impl<'a, const NL: usize> Judge<'a, NL> {
    /// Judges by the geometry of `mission`, the true one, against a plan whose port is at `planned`
    /// (target's axes, m). A port that is deeper than planned takes the near keep-out distance with it:
    /// that is the distance of capture itself.
    pub fn new(mission: &'a Mission<NL>, planned: &Vector3<f64>, grid: &'a Grid) -> Self {
        let target = &mission.target;
        let deeper = f64::max(0.0, (planned - target.port_position_m).dot(&target.port_normal));
        let widest = libm::cos(mission.approach.field_of_view_half_angle_rad);
        Self {
            mission,
            body: Multibody::new(mission),
            grid,
            widest,
            deeper,
            room: Room::ALL,
            nearest_m: f64::INFINITY,
        }
    }

    /// Forgets the room found so far.
    pub fn begin(&mut self) {
        (self.room, self.nearest_m) = (Room::ALL, f64::INFINITY);
    }

    /// Looks at the true state.
    pub fn look(&mut self, view: &View<NL>) {
        // Distances do not depend on the axes: inertial ones do.
        let state = State {
            attitude: Vector4::from(view.attitude),
            joint_angle: SVector::from(view.joint_angle),
            rate: view.bus_rate,
            joint_rate: SVector::from(view.joint_rate),
        };
        let target =
            TargetState { attitude: Vector4::from(view.target.attitude), rate: Vector3::zeros() };
        let (center, _) = self.body.center_of_mass(&state);
        let position = view.bus_position + center;
        let found = clearances_at(self.mission, view.time, &target, &position, &state);
        let room = &mut self.room;
        least(&mut room.arm_m, found.arm.distance);
        least(&mut room.bus_m, found.bus.distance);
        least(&mut room.own_m, found.own.distance);
        let to_target = quaternion::rotation_matrix(&target.attitude).transpose();
        let half = &self.mission.target.half_extents_m;
        let distance = signed_distance_to_box(half, &(to_target * position)).value;
        least(&mut room.keep_out_m, distance - keep_out(self.grid, view.time) + self.deeper);
        least(&mut self.nearest_m, distance);
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let sight = view.port - view.center;
        let cosine = boresight.dot(&sight) / libm::sqrt(sight.dot(&sight));
        least(&mut room.view, cosine - self.widest);
        let servicer = &self.mission.servicer;
        for i in 0..NL {
            let angle = view.joint_angle[i];
            least(&mut room.joint_rad, servicer.max_joint_angle_rad[i] - angle);
            least(&mut room.joint_rad, angle - servicer.min_joint_angle_rad[i]);
            most(
                &mut room.joint_rate,
                view.joint_rate[i].abs() / servicer.joint_rate_limit_rad_s[i],
            );
        }
    }

    /// Looks at a command.
    pub fn look_at_command(&mut self, command: &Command<NL>, limits: &Limits<NL>) {
        let force = command.force.iter().zip(&limits.force);
        let bus = command.control.bus_torque.iter().zip(&limits.bus_torque);
        let joint = command.control.joint_torque.iter().zip(&limits.joint_torque);
        for (value, limit) in force.chain(bus).chain(joint) {
            most(&mut self.room.command, value.abs() / limit);
        }
    }
}

/// The keep-out distance in force at a time: within an interval the smaller of those at its ends [m].
fn keep_out(grid: &Grid, time: f64) -> f64 {
    // Saturates; of what is no number, zero.
    let k = ((time / grid.interval()) as usize).min(grid.last());
    grid.keep_out(k).min(grid.keep_out((k + 1).min(grid.last())))
}

/// Keeps the smaller; what is no number stays.
fn least(room: &mut f64, value: f64) {
    if !(value >= *room) {
        *room = value;
    }
}

/// Keeps the larger; what is no number stays.
fn most(share: &mut f64, value: f64) {
    if !(value <= *share) {
        *share = value;
    }
}
