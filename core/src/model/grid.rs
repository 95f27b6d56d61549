//! The time grid of a plan, and when what is in force on it.

use super::{Approach, Mission, Scenario};
use remora_qp::dense::{clamp, count, divisor};

/// Share of an interval by which a node may miss an instant and still be at it: rounding.
const ROUNDING: f64 = 1e-9;

/// The first node whose pose the torques change with every integrator: Euler's at node 1 follows from the
/// start's rates.
const FREE_POSE: usize = 2;

/// Nodes at equal intervals from t = 0 to capture. What depends on the phase of the approach counts in
/// time from the end, whatever the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Time from the first node to the last [s].
    pub duration: f64,
    /// Nodes, at least two; the mission's or the scenario's.
    pub nodes: usize,
    keep_out: [f64; 2],
    near_time: f64,
    preset_time: f64,
    /// How long limits that a given start violates may stay so [s]; none for the default start.
    recovery_time: Option<f64>,
    /// Time that a given start leaves the arm's slowest joint to need at its planned rate [s].
    arm_time: f64,
}

impl Grid {
    /// Placeholder with all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self = Self {
        duration: 0.0,
        nodes: 0,
        keep_out: [0.0; 2],
        near_time: 0.0,
        preset_time: 0.0,
        recovery_time: None,
        arm_time: 0.0,
    };

    /// The grid of an approach of so long.
    fn new(approach: &Approach, duration: f64, nodes: usize) -> Self {
        Self {
            duration,
            nodes: nodes.max(2),
            keep_out: [approach.keep_out_far_m, approach.keep_out_near_m],
            near_time: approach.keep_out_near_s,
            preset_time: approach.preset_s,
            recovery_time: None,
            arm_time: 0.0,
        }
    }

    /// Duration of an interval [s].
    pub fn interval(&self) -> f64 {
        self.duration / (self.nodes - 1) as f64
    }

    /// Time of node `k` [s].
    pub fn time(&self, k: usize) -> f64 {
        self.duration * k as f64 / (self.nodes - 1) as f64
    }

    /// Last node: capture.
    pub fn last(&self) -> usize {
        self.nodes - 1
    }

    /// Whole intervals that hold `time` [s].
    // One copy of it makes images smaller.
    #[inline(never)]
    fn intervals_in(&self, time: f64) -> usize {
        // Saturates: more than there are is all of them.
        count(libm::ceil(time / self.interval() - ROUNDING))
    }

    /// Intervals before the end from which the arm has its capture configuration, as the mission asks.
    pub fn preset_lead(&self) -> usize {
        self.intervals_in(self.preset_time)
    }

    /// The node from which the arm has its capture configuration: never the first. After a given start no
    /// earlier than recovery ends, and where the arm is behind a node later than its slowest joint needs.
    pub fn preset_node(&self) -> usize {
        let asked = self.last().saturating_sub(self.preset_lead()).max(1);
        // One interval more than needed: joints push each other.
        let needed = match self.arm_time > 0.0 {
            true => self.intervals_in(self.arm_time).saturating_add(1).min(self.last()),
            false => 0,
        };
        asked.max(needed).max(self.recovery_node())
    }

    /// The node from which limits hold that a given start violates; the first without a given start,
    /// else the second at the earliest and the last at the latest.
    pub fn recovery_node(&self) -> usize {
        let nodes = |time| self.intervals_in(time).max(FREE_POSE).min(self.last());
        self.recovery_time.map_or(0, nodes)
    }

    /// Whether limits that the start violates need not hold yet at `time` [s].
    pub fn is_recovering(&self, time: f64) -> bool {
        let step = self.interval();
        time < (self.recovery_node() as f64 - ROUNDING) * step
    }

    /// Fraction of the duration up to which the far keep-out distance holds; negative where the
    /// approach begins later.
    fn far_until(&self) -> f64 {
        1.0 - self.near_time / self.duration
    }

    /// Keep-out distance [m] at node `k` (from 0).
    pub fn keep_out(&self, k: usize) -> f64 {
        // In node counts, so that a node exactly at the switch is not lost to rounding of times.
        let fraction = k as f64 / (self.nodes - 1) as f64;
        let [far, near] = self.keep_out;
        if fraction <= self.far_until() { far } else { near }
    }

    /// Share of the margins in force at `time` [s]. They fade in over as long as the arm is preset
    /// before the end, since the start is given, and out over the part with the near keep-out distance,
    /// since the end is at the port: with the square of the time left, as a distance does that a
    /// constant force closes, so that fading costs next to nothing.
    pub fn margin_share(&self, time: f64) -> f64 {
        let ramp = self.duration * self.preset_lead() as f64 / (self.nodes - 1) as f64;
        let near = ((1.0 - self.far_until()) * self.duration).max(ramp);
        let share = |passed: f64, whole: f64| match whole > 0.0 {
            true => clamp(passed / divisor(whole), 0.0, 1.0),
            false => 1.0,
        };
        let (begun, left) = (share(time, ramp), share(self.duration - time, near));
        begun.min(left * left)
    }
}

impl<const NL: usize> Mission<NL> {
    /// The grid of a scenario's plan.
    pub fn grid(&self, scenario: &Scenario<NL>) -> Grid {
        let duration = scenario.duration.unwrap_or(self.approach.duration_s);
        let nodes = scenario.nodes.unwrap_or(self.approach.nodes);
        let grid = Grid::new(&self.approach, duration, nodes);
        if !scenario.start.is_given() {
            return grid;
        }
        Grid {
            recovery_time: Some(self.approach.recovery_s),
            arm_time: self.arm_time(scenario),
            ..grid
        }
    }

    /// Time that the slowest joint needs to its capture angle, none turning faster than in plans:
    /// speeding up, turning on and braking, with half its torque against all that it carries, the arm
    /// straight [s].
    fn arm_time(&self, scenario: &Scenario<NL>) -> f64 {
        let s = &self.servicer;
        let way = s.capture_joint_angle_rad - self.joint_angle_at_start(scenario);
        let mut slowest = 0.0;
        for (i, travel) in way.iter().enumerate() {
            let acceleration = 0.5 * s.joint_torque_limit_n_m[i] / s.inertia_beyond(i);
            let rate = s.joint_rate_limit_rad_s[i] * (1.0 - self.margins.joint_rate);
            let speed = rate.min(libm::sqrt(acceleration * travel.abs()));
            let now = scenario.start.joint_rate[i] * travel.signum();
            let missing = speed - clamp(now, -speed, speed);
            // Zero for a joint at its angle already: it needs no time.
            let divisor = divisor(speed);
            let lost = 0.5 * (speed + missing * missing / divisor) / acceleration;
            slowest = f64::max(slowest, travel.abs() / divisor + lost);
        }
        slowest
    }

    /// The grid of plans of the mission's duration from the default start.
    pub fn own_grid(&self) -> Grid {
        Grid::new(&self.approach, self.approach.duration_s, self.approach.nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Start;

    #[test]
    fn the_default_switches_keep_out_after_node_42_and_presets_the_arm_at_56() {
        let grid = Mission::default().own_grid();
        // One-based node 42 of 60 is at 41/59 = 0.695 of the duration, node 43 at 0.712.
        assert_eq!((grid.keep_out(41), grid.keep_out(42)), (1.85, 1.46));
        assert_eq!((grid.preset_node(), grid.preset_lead(), grid.recovery_node()), (55, 4, 0));
        assert!(!grid.is_recovering(0.0));
    }

    #[test]
    fn phases_count_from_the_end_whatever_the_horizon() {
        let mission = Mission::default();
        for (duration, nodes) in [(300.0, 60), (1200.0, 20), (3600.0, 60), (7200.0, 30)] {
            let scenario =
                Scenario { duration: Some(duration), nodes: Some(nodes), ..Scenario::default() };
            let grid = mission.grid(&scenario);
            let left = |k: usize| duration - grid.time(k);
            let preset = grid.preset_node();
            assert!(left(preset) >= 80.0 && (left(preset + 1) < 80.0), "{duration} {nodes}");
            for k in 0..nodes {
                let far = left(k) >= 360.0 - 1e-6;
                assert_eq!(grid.keep_out(k), if far { 1.85 } else { 1.46 }, "{duration} {k}");
            }
        }
    }

    #[test]
    fn the_arm_is_set_once_recovery_is_over_and_at_the_end_at_the_latest() {
        let mission = Mission::default();
        let there = Some(mission.servicer.capture_joint_angle_rad);
        let start = Start { joint_angle: there, ..Start::default() };
        let of = |duration: f64| {
            let scenario = Scenario { start, duration: Some(duration), ..Scenario::default() };
            mission.grid(&scenario)
        };
        let grid = of(1200.0);
        assert_eq!((grid.recovery_node(), grid.preset_node()), (4, 55));
        assert!(grid.is_recovering(3.99 * grid.interval()) && !grid.is_recovering(grid.time(4)));
        assert_eq!((of(100.0).recovery_node(), of(100.0).preset_node()), (48, 48));
        assert_eq!((of(60.0).recovery_node(), of(60.0).preset_node()), (59, 59));
        // An arm that is not there yet is set once its slowest joint can be: the second, 0.88 rad away.
        let start = Start { bus_rate: [1e-5, 0.0, 0.0].into(), ..Start::default() };
        let scenario = Scenario { start, duration: Some(300.0), ..Scenario::default() };
        let grid = mission.grid(&scenario);
        assert!(grid.time(grid.preset_node()) > 0.877 / 4.5e-3 && grid.preset_node() < 59);
    }
}
