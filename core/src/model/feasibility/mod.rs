//! Checks before planning: they refuse approaches that no plan can end well.
//!
//! Every check is a bound: it refuses what is certainly impossible and lets pass what may not be.
//! Tolerances of the verifier are granted, and limits count in full.

mod bounds;
mod eccentricity;

pub use eccentricity::MAX_ECCENTRICITY_STEPS;

use super::{
    Grid, Integrator, Mission, Refusal, Scenario, Start, TargetState, signed_distance_to_box,
};
use crate::math::{nearly_unit, quaternion};
use nalgebra::{SVector, Vector3};
use remora_qp::dense::{clamp, divisor, is_usable};
use remora_qp::{Valid, Validate};

/// Farthest that the target may turn from node to node, relative to inertial space [rad].
pub const MAX_NODE_TURN: f64 = core::f64::consts::PI / 6.0;

/// Largest distance from one of the norm of a quaternion that is not normalised.
const QUATERNION: f64 = 1e-6;
/// Nearest start to the target's centre [m].
const NEAREST: f64 = 1e-3;
/// Longest time from node to node, in orbits.
const NODE_INTERVAL: f64 = 0.1;
/// Slack of geometry beside the verifier's tolerances [m or rad].
const SLACK: f64 = 1e-3;
/// Shortest and longest approach [s].
const MIN_DURATION: f64 = 1.0;
const MAX_DURATION: f64 = 1e6;
/// Fewest nodes of a plan.
pub const MIN_NODES: usize = 4;
/// Share by which a limit must be missed.
const SHARE: f64 = 0.01;

/// The least of its actuators that an approach takes, whatever the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// Force, on the axis with the largest limit, all used in proportion to theirs [N].
    pub force: f64,
    /// Bus torque, likewise [N m]; negative where none is needed.
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
        scenario: &Scenario<NL>,
        integrator: Integrator,
    ) -> Result<(), Refusal> {
        scenario.validate()?;
        let grid = self.grid(scenario);
        check_nodes(grid.nodes, N)?;
        self.check_interval(&grid)?;
        self.check_eccentricity(&grid, scenario)?;
        self.check_arm(&grid, scenario, integrator)?;
        self.check_capture(integrator)?;
        self.check_start(&grid, scenario)?;
        let mut target = [TargetState::ZERO; N];
        let target = &mut target[..grid.nodes.min(N)];
        self.tumble_of(scenario, integrator, &grid, target)?;
        self.check_turn(&grid, target)?;
        if !scenario.start.is_given() {
            self.check_reach(&grid, target)?;
        }
        let limit = self.servicer.force_limit_n.max();
        let needed = self.least_force(scenario, &grid, target);
        if needed > limit * (1.0 + SHARE) {
            return Err(Refusal::Force { needed, limit });
        }
        let limit = self.servicer.bus_torque_limit_n_m.max();
        let needed = self.least_bus_torque(scenario, &grid, target);
        if needed > limit * (1.0 + SHARE) {
            return Err(Refusal::BusTorque { needed, limit });
        }
        Ok(())
    }

    /// Checks all that no scenario changes: the grid of nodes, the arm's way, the view and the bus's
    /// place at capture.
    ///
    /// # Errors
    /// The first thing found impossible.
    pub fn check_vehicle<const N: usize>(&self, integrator: Integrator) -> Result<(), Refusal> {
        let grid = self.own_grid();
        check_nodes(grid.nodes, N)?;
        self.check_interval(&grid)?;
        self.check_arm(&grid, &Scenario::default(), integrator)?;
        self.check_capture(integrator)
    }

    fn check_interval(&self, grid: &Grid) -> Result<(), Refusal> {
        let interval = grid.interval();
        let limit = NODE_INTERVAL * 2.0 * core::f64::consts::PI / self.mean_motion();
        if !(interval <= limit * (1.0 + 1e-9)) {
            return Err(Refusal::NodeInterval { interval, limit });
        }
        Ok(())
    }

    /// Least needs of an approach; the scenario must be one that [`Mission::check`] accepts
    /// as input.
    ///
    /// # Errors
    /// A target that tumbles too fast to be followed.
    pub fn needs<const N: usize>(
        &self,
        scenario: &Scenario<NL>,
        integrator: Integrator,
    ) -> Result<Needs, Refusal> {
        scenario.validate()?;
        let grid = self.grid(scenario);
        check_nodes(grid.nodes, N)?;
        let mut target = [TargetState::ZERO; N];
        let target = &mut target[..grid.nodes.min(N)];
        self.tumble_of(scenario, integrator, &grid, target)?;
        Ok(Needs {
            force: self.least_force(scenario, &grid, target),
            bus_torque: self.least_bus_torque(scenario, &grid, target),
            turn: self.largest_turn(&grid, target),
        })
    }

    /// Fastest that plans let each joint turn [rad/s].
    pub fn planned_joint_rate(&self, integrator: Integrator) -> SVector<f64, NL> {
        let limit = self.servicer.joint_rate_limit_rad_s;
        match self.approach.between_nodes.is_on(integrator) {
            true => limit * (1.0 - self.margins.joint_rate),
            false => limit,
        }
    }

    /// Time that the arm has until its preset [s]: with Euler none of the first interval, over
    /// which the rate is that of the start.
    pub fn time_to_preset(&self, integrator: Integrator, grid: &Grid) -> f64 {
        let lost = usize::from(!integrator.is_flown());
        let intervals = grid.preset_node().saturating_sub(lost);
        intervals as f64 * grid.interval()
    }

    /// The joint that falls shortest of its way is the one that decides.
    fn check_arm(
        &self,
        grid: &Grid,
        scenario: &Scenario<NL>,
        integrator: Integrator,
    ) -> Result<(), Refusal> {
        let is_given = scenario.start.is_given();
        let (lead, limit) = (grid.preset_lead(), grid.nodes.saturating_sub(2));
        if lead > limit && !is_given {
            return Err(Refusal::PresetLead { lead, limit });
        }
        // While it recovers its rate, a joint turns faster than it may.
        if self.recovery(scenario, grid.keep_out(0)).joint_rate.contains(&true) {
            return Ok(());
        }
        // Over the first interval of Euler an arm goes on as it began.
        let lost = if integrator.is_flown() { 0.0 } else { grid.interval() };
        let way = self.servicer.capture_joint_angle_rad - self.joint_angle_at_start(scenario);
        let rates = match is_given {
            true => self.servicer.joint_rate_limit_rad_s,
            false => self.planned_joint_rate(integrator),
        };
        let time = self.time_to_preset(integrator, grid);
        let (mut joint, mut travel, mut rate, mut most) = (0, 0.0, 0.0, f64::NEG_INFINITY);
        for i in 0..NL {
            let left = way[i].abs() - lost * scenario.start.joint_rate[i].abs();
            let missing = left - rates[i] * time;
            if missing > most {
                (joint, travel, rate, most) = (i + 1, left, rates[i], missing);
            }
        }
        if travel <= rate * time + SLACK {
            return Ok(());
        }
        let way = rate * time;
        let duration = match way > 0.0 {
            true => libm::ceil(grid.duration * travel / divisor(way)),
            false => f64::INFINITY,
        };
        Err(Refusal::JointRate { joint, travel, rate, time, duration })
    }

    /// At capture the arm's direction is the approach's, so that boresight and bus are known up to
    /// the roll about it.
    fn check_capture(&self, integrator: Integrator) -> Result<(), Refusal> {
        let (s, limit) = (&self.servicer, self.approach.field_of_view_half_angle_rad);
        let direction = s.capture_geometry().direction;
        let seen = direction.dot(&s.boresight);
        if !(seen >= libm::cos(limit) - self.tolerances.pointing - 2.0 * SLACK) {
            return Err(Refusal::CaptureView { angle: libm::acos(clamp(seen, -1.0, 1.0)), limit });
        }
        if !self.approach.clearance.is_on(integrator) {
            return Ok(());
        }
        let (_, tip) = s.center_of_mass_and_end_effector(&s.capture_joint_angle_rad);
        let distance = self.farthest_bus(&tip, &direction);
        let limit = s.bus_half_extents_m.x.min(s.bus_half_extents_m.y).min(s.bus_half_extents_m.z);
        if distance < limit - self.tolerances.clearance_m - SLACK {
            return Err(Refusal::Clearance { distance, limit });
        }
        let (link, distance) = s.distance_from_own_bus(&s.capture_joint_angle_rad);
        if distance < -self.tolerances.clearance_m - SLACK {
            return Err(Refusal::OwnBus { link, depth: -distance });
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
                t.port_position_m + t.port_normal * along + (first * cos + second * sin) * across;
            farthest = farthest.max(signed_distance_to_box(&t.half_extents_m, &bus).value);
        }
        // Between two of these rolls the bus is nearer to one of them than this.
        farthest + across * core::f64::consts::PI / ROLLS as f64
    }

    /// A start that is given is led back, where a joint's rate allows it; one that follows from the
    /// position is refused.
    fn check_start(&self, grid: &Grid, scenario: &Scenario<NL>) -> Result<(), Refusal> {
        if scenario.start.is_given() {
            return self.check_stops(grid, scenario);
        }
        let (distance, limit) = (self.distance_at_start(scenario), grid.keep_out(0));
        if !(distance >= limit - self.tolerances.keep_out_m) {
            return Err(Refusal::KeepOut { distance, limit });
        }
        let seen = self.pointing_at_start(scenario);
        let limit = self.approach.field_of_view_half_angle_rad;
        if !(seen >= libm::cos(limit) - self.tolerances.pointing) {
            return Err(Refusal::FieldOfView { angle: libm::acos(clamp(seen, -1.0, 1.0)), limit });
        }
        Ok(())
    }

    fn check_stops(&self, grid: &Grid, scenario: &Scenario<NL>) -> Result<(), Refusal> {
        let (s, time) = (&self.servicer, grid.time(grid.recovery_node()));
        let angle = self.joint_angle_at_start(scenario);
        for i in 0..NL {
            let beyond = s.beyond_stop(i, angle[i]);
            let rate = s.joint_rate_limit_rad_s[i].max(scenario.start.joint_rate[i].abs());
            if beyond > rate * time + SLACK {
                return Err(Refusal::JointStop { joint: i + 1, beyond, time });
            }
        }
        Ok(())
    }

    /// The target's tumble, unless it begins too fast to be worth integrating.
    fn tumble_of(
        &self,
        scenario: &Scenario<NL>,
        integrator: Integrator,
        grid: &Grid,
        target: &mut [TargetState],
    ) -> Result<(), Refusal> {
        let (n, interval) = (self.mean_motion(), grid.interval());
        let (attitude, rate) = (&scenario.target_attitude, &scenario.target_rate);
        let orbit = quaternion::rotation_matrix(attitude).transpose() * Vector3::new(0.0, 0.0, n);
        turn_within(grid, norm(&(rate + orbit)) * interval)?;
        self.target.tumble(integrator, n, attitude, rate, interval, target);
        Ok(())
    }

    fn largest_turn(&self, grid: &Grid, target: &[TargetState]) -> f64 {
        let interval = grid.interval();
        let orbit = Vector3::new(0.0, 0.0, self.mean_motion());
        target.iter().fold(0.0, |most, x| f64::max(most, norm(&(x.rate + orbit)) * interval))
    }

    fn check_turn(&self, grid: &Grid, target: &[TargetState]) -> Result<(), Refusal> {
        turn_within(grid, self.largest_turn(grid, target))
    }
}

/// A plan needs [`MIN_NODES`], and a build has room for `most`.
fn check_nodes(nodes: usize, most: usize) -> Result<(), Refusal> {
    match (MIN_NODES..=most).contains(&nodes) {
        true => Ok(()),
        false => Err(Refusal::Nodes { nodes, most }),
    }
}

fn turn_within(grid: &Grid, turn: f64) -> Result<(), Refusal> {
    let limit = MAX_NODE_TURN;
    if turn <= limit {
        return Ok(());
    }
    Err(Refusal::Tumble {
        turn,
        limit,
        duration: libm::floor(grid.duration * limit / divisor(turn)),
    })
}

impl<const NL: usize> Validate for Scenario<NL> {
    type Error = Refusal;

    /// Attitudes whose norm differs from one by at most 1e-3 are normalised.
    fn validated(mut self) -> Result<Valid<Self>, Refusal> {
        self.target_attitude = nearly_unit(&self.target_attitude, QUATERNION);
        self.start.bus_attitude = self.start.bus_attitude.map(|q| nearly_unit(&q, QUATERNION));
        self.validate().map(|()| Valid::of_constant(self))
    }

    /// Refuses what is no input at all: numbers that are not finite, an attitude that is not of
    /// unit length, a start from which no direction leads to the target, no time.
    fn validate(&self) -> Result<(), Refusal> {
        let finite = |values: &[f64], field| match values.iter().all(|v| is_usable(*v)) {
            true => Ok(()),
            false => Err(Refusal::NotFinite { field }),
        };
        finite(self.target_attitude.as_slice(), "target attitude")?;
        finite(self.target_rate.as_slice(), "target rate")?;
        finite(self.position.as_slice(), "position")?;
        finite(self.velocity.as_slice(), "velocity")?;
        let Start { bus_attitude, bus_rate, joint_angle, joint_rate } = &self.start;
        finite(bus_attitude.unwrap_or_default().as_slice(), "bus attitude")?;
        finite(bus_rate.as_slice(), "bus rate")?;
        finite(joint_angle.unwrap_or_else(SVector::zeros).as_slice(), "joint angles")?;
        finite(joint_rate.as_slice(), "joint rates")?;
        for attitude in [Some(self.target_attitude), *bus_attitude].iter().flatten() {
            let length = quaternion::norm(attitude);
            if !((length - 1.0).abs() <= QUATERNION) {
                return Err(Refusal::Attitude { norm: length });
            }
        }
        if let Some(duration) = self.duration
            && !(MIN_DURATION..=MAX_DURATION).contains(&duration)
        {
            return Err(Refusal::Duration { duration });
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
