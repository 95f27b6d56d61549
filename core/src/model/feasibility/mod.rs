//! What is decided before planning: approaches that no plan can end well.
//!
//! Every check is a bound: it refuses what is certainly impossible and lets pass what may not be.
//! Tolerances of the verifier are granted, and limits count in full.

mod bounds;

use super::{
    Integrator, Mission, Refusal, Scenario, TargetState, initial_bus_attitude,
    signed_distance_to_box,
};
use crate::math::quaternion;
use nalgebra::Vector3;
use remora_qp::Validate;

/// Farthest that the target may turn from node to node, relative to inertial space [rad].
pub const MAX_NODE_TURN: f64 = core::f64::consts::PI / 6.0;

/// How far a quaternion's norm may be from one.
const QUATERNION: f64 = 1e-6;
/// Nearest start to the target's centre [m].
const NEAREST: f64 = 1e-3;
/// Longest time from node to node, in orbits.
const NODE_INTERVAL: f64 = 0.1;
/// What geometry is granted beside the verifier's tolerances [m or rad].
const SLACK: f64 = 1e-3;
/// Share by which a limit must be missed.
const SHARE: f64 = 0.01;

/// The least of its actuators that an approach takes, whatever the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// Force, each component [N].
    pub force: f64,
    /// Bus torque, each component [N m]; negative where none is needed.
    pub bus_torque: f64,
    /// Largest turn of the target from node to node, relative to inertial space [rad].
    pub turn: f64,
}

fn norm(v: &Vector3<f64>) -> f64 {
    libm::sqrt(v.dot(v))
}

impl<const NL: usize> Mission<NL> {
    /// Refuses an approach that no plan of `N` nodes can end well, whatever the planner tries.
    ///
    /// The mission must be [valid](Mission::validate). Cost: the target's tumble, fifteen sweeps
    /// over the horizon; no memory but the tumble's.
    ///
    /// # Errors
    /// The first thing found impossible, with its numbers.
    // Its memory is on the stack only while it runs.
    #[inline(never)]
    pub fn check<const N: usize>(
        &self,
        scenario: &Scenario,
        integrator: Integrator,
    ) -> Result<(), Refusal> {
        scenario.validate()?;
        self.check_vehicle::<N>(integrator)?;
        self.check_start::<N>(scenario)?;
        let mut target = [TargetState::ZERO; N];
        self.tumble_of(scenario, integrator, &mut target)?;
        self.check_turn(&target)?;
        self.check_reach(&target)?;
        let limit = self.servicer.max_force;
        let needed = self.least_force(scenario, &target);
        if needed > limit * (1.0 + SHARE) {
            return Err(Refusal::Force { needed, limit });
        }
        let limit = self.servicer.max_bus_torque;
        let needed = self.least_bus_torque(scenario, &target);
        if needed > limit * (1.0 + SHARE) {
            return Err(Refusal::BusTorque { needed, limit });
        }
        Ok(())
    }

    /// The same for what no scenario changes: the grid of nodes, the arm's way, what is seen and
    /// where the bus is at capture.
    ///
    /// # Errors
    /// The first thing found impossible.
    pub fn check_vehicle<const N: usize>(&self, integrator: Integrator) -> Result<(), Refusal> {
        let interval = self.approach.duration / (N - 1) as f64;
        let limit = NODE_INTERVAL * 2.0 * core::f64::consts::PI / self.mean_motion();
        if !(interval <= limit * (1.0 + 1e-9)) {
            return Err(Refusal::NodeInterval { interval, limit });
        }
        let (lead, limit) = (self.approach.preset_lead, N.saturating_sub(2));
        if lead > limit {
            return Err(Refusal::PresetLead { lead, limit });
        }
        self.check_joints::<N>(integrator)?;
        self.check_capture(integrator)
    }

    /// What an approach takes at least; the scenario must be one that [`Mission::check`] accepts
    /// as input.
    ///
    /// # Errors
    /// Where the target tumbles too fast to be followed.
    pub fn needs<const N: usize>(
        &self,
        scenario: &Scenario,
        integrator: Integrator,
    ) -> Result<Needs, Refusal> {
        scenario.validate()?;
        let mut target = [TargetState::ZERO; N];
        self.tumble_of(scenario, integrator, &mut target)?;
        Ok(Needs {
            force: self.least_force(scenario, &target),
            bus_torque: self.least_bus_torque(scenario, &target),
            turn: self.largest_turn(&target),
        })
    }

    /// Fastest that plans let a joint turn [rad/s].
    pub fn planned_joint_rate(&self, integrator: Integrator) -> f64 {
        let limit = self.servicer.max_joint_rate;
        match self.approach.between_nodes.is_on(integrator) {
            true => limit * (1.0 - self.margins.joint_rate),
            false => limit,
        }
    }

    /// Time that the arm has until its preset [s]: with Euler none of the first interval, over
    /// which the rate is that of the start.
    pub fn time_to_preset(&self, integrator: Integrator, nodes: usize) -> f64 {
        let interval = self.approach.duration / (nodes - 1) as f64;
        let lost = usize::from(!integrator.is_flown());
        let intervals = (nodes - 1).saturating_sub(self.approach.preset_lead + lost);
        intervals as f64 * interval
    }

    /// The joint with the longest way is the one that decides.
    fn check_joints<const N: usize>(&self, integrator: Integrator) -> Result<(), Refusal> {
        let way = self.servicer.capture_joint_angle - self.servicer.initial_joint_angle;
        let (mut joint, mut travel) = (0, 0.0);
        for i in 0..NL {
            if way[i].abs() > travel {
                (joint, travel) = (i + 1, way[i].abs());
            }
        }
        let rate = self.planned_joint_rate(integrator);
        let time = self.time_to_preset(integrator, N);
        if travel <= rate * time + SLACK {
            return Ok(());
        }
        let duration = libm::ceil(self.approach.duration * travel / (rate * time));
        Err(Refusal::JointRate { joint, travel, rate, time, duration })
    }

    /// At capture the arm's direction is the approach's, so that boresight and bus are known up to
    /// the roll about it.
    fn check_capture(&self, integrator: Integrator) -> Result<(), Refusal> {
        let (s, limit) = (&self.servicer, self.approach.field_of_view_half_angle);
        let direction = s.capture_geometry().direction;
        let seen = direction.dot(&s.boresight);
        if !(seen >= libm::cos(limit) - self.tolerances.pointing - 2.0 * SLACK) {
            return Err(Refusal::CaptureView { angle: libm::acos(seen), limit });
        }
        if !self.approach.clearance.is_on(integrator) {
            return Ok(());
        }
        let (_, tip) = s.center_of_mass_and_end_effector(&s.capture_joint_angle);
        let distance = self.farthest_bus(&tip, &direction);
        let limit = s.bus_half_extents.x.min(s.bus_half_extents.y).min(s.bus_half_extents.z);
        if distance < limit - self.tolerances.clearance - SLACK {
            return Err(Refusal::Clearance { distance, limit });
        }
        Ok(())
    }

    /// Farthest that the bus's centre can be from the target's box at capture, over all rolls.
    fn farthest_bus(&self, tip: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        const ROLLS: usize = 24;
        let t = &self.target;
        let along = tip.dot(direction);
        let across = norm(&(tip - direction * along));
        let first = quaternion::any_normal(&t.port_normal);
        let second = t.port_normal.cross(&first);
        let mut farthest = f64::NEG_INFINITY;
        for roll in 0..ROLLS {
            let angle = 2.0 * core::f64::consts::PI * roll as f64 / ROLLS as f64;
            let (sin, cos) = libm::sincos(angle);
            let bus =
                t.port_position + t.port_normal * along + (first * cos + second * sin) * across;
            farthest = farthest.max(signed_distance_to_box(&t.half_extents, &bus).value);
        }
        // Between two of these rolls the bus is nearer to one of them than this.
        farthest + across * core::f64::consts::PI / ROLLS as f64
    }

    fn check_start<const N: usize>(&self, scenario: &Scenario) -> Result<(), Refusal> {
        let a = &self.approach;
        let rotation = quaternion::rotation_matrix(&scenario.target_attitude);
        let local = rotation.transpose() * scenario.position;
        let distance = signed_distance_to_box(&self.target.half_extents, &local).value;
        let limit = a.keep_out(0, N);
        if !(distance >= limit - self.tolerances.keep_out) {
            return Err(Refusal::KeepOut { distance, limit });
        }
        let sight = rotation * self.target.port_position - scenario.position;
        let bus = quaternion::rotation_matrix(&initial_bus_attitude(&scenario.position));
        let seen = sight.dot(&(bus * self.servicer.boresight)) / norm(&sight);
        let limit = a.field_of_view_half_angle;
        if !(seen >= libm::cos(limit) - self.tolerances.pointing) {
            return Err(Refusal::FieldOfView { angle: libm::acos(seen), limit });
        }
        Ok(())
    }

    /// The target's tumble, unless it begins too fast to be worth integrating.
    fn tumble_of<const N: usize>(
        &self,
        scenario: &Scenario,
        integrator: Integrator,
        target: &mut [TargetState; N],
    ) -> Result<(), Refusal> {
        let n = self.mean_motion();
        let interval = self.approach.duration / (N - 1) as f64;
        let (attitude, rate) = (&scenario.target_attitude, &scenario.target_rate);
        let orbit = quaternion::rotation_matrix(attitude).transpose() * Vector3::new(0.0, 0.0, n);
        self.turn_within(norm(&(rate + orbit)) * interval)?;
        self.target.tumble(integrator, n, attitude, rate, interval, target);
        Ok(())
    }

    fn turn_within(&self, turn: f64) -> Result<(), Refusal> {
        let limit = MAX_NODE_TURN;
        if turn <= limit {
            return Ok(());
        }
        let duration = libm::floor(self.approach.duration * limit / turn);
        Err(Refusal::Tumble { turn, limit, duration })
    }

    fn largest_turn<const N: usize>(&self, target: &[TargetState; N]) -> f64 {
        let interval = self.approach.duration / (N - 1) as f64;
        let orbit = Vector3::new(0.0, 0.0, self.mean_motion());
        target.iter().fold(0.0, |most, x| f64::max(most, norm(&(x.rate + orbit)) * interval))
    }

    fn check_turn<const N: usize>(&self, target: &[TargetState; N]) -> Result<(), Refusal> {
        self.turn_within(self.largest_turn(target))
    }
}

impl Validate for Scenario {
    type Error = Refusal;

    /// Refuses what is no input at all: numbers that are not finite, an attitude that is not of
    /// unit length, a start from which no direction leads to the target.
    fn validate(&self) -> Result<(), Refusal> {
        let finite = |values: &[f64], field| match values.iter().all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(Refusal::NotFinite { field }),
        };
        finite(self.target_attitude.as_slice(), "target attitude")?;
        finite(self.target_rate.as_slice(), "target rate")?;
        finite(self.position.as_slice(), "position")?;
        finite(self.velocity.as_slice(), "velocity")?;
        let length = quaternion::norm(&self.target_attitude);
        if !((length - 1.0).abs() <= QUATERNION) {
            return Err(Refusal::Attitude { norm: length });
        }
        let distance = norm(&self.position);
        if !(distance >= NEAREST) {
            return Err(Refusal::Position { distance });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
