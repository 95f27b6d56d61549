//! Why an approach cannot be planned, as far as that is known before planning.

use super::MIN_NODES;
use core::fmt;

/// Reason why an approach cannot be planned, whatever the planner tries, with the numbers that show it.
///
/// Angles are in radians, all else in SI units; [`Display`](fmt::Display) writes one line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// A number of the scenario is not finite, or too large to compute with.
    NotFinite {
        /// The scenario's field.
        field: &'static str,
    },
    /// The target's attitude is not a unit quaternion.
    Attitude {
        /// Its norm.
        norm: f64,
    },
    /// The servicer starts at the target's centre: no direction leads there.
    Position {
        /// Distance from the centre [m].
        distance: f64,
    },
    /// The time to capture is not one.
    Duration {
        /// The time to capture [s].
        duration: f64,
    },
    /// Too few nodes for a plan, or more than this build has room for.
    Nodes {
        /// Nodes asked for.
        nodes: usize,
        /// The most there is room for.
        most: usize,
    },
    /// Nodes are too far apart for the orbit.
    NodeInterval {
        /// From node to node [s].
        interval: f64,
        /// The most that is accepted [s].
        limit: f64,
    },
    /// The orbit is too far from a circle for the planner's model.
    Eccentricity {
        /// The orbit's eccentricity.
        eccentricity: f64,
        /// Error of the model's free motion from the start to the end, at the worst true anomaly [m].
        error: f64,
        /// Largest error that is accepted: distance of the start from the zone that must not be entered [m].
        limit: f64,
        /// Time from the start to the end [s].
        duration: f64,
    },
    /// The arm is to be in its capture configuration before the approach begins.
    PresetLead {
        /// Intervals before the end.
        lead: usize,
        /// The most that leave the arm an interval to move in.
        limit: usize,
    },
    /// A joint is too slow for its way to the capture configuration.
    JointRate {
        /// The joint, from 1.
        joint: usize,
        /// Its way [rad].
        travel: f64,
        /// The fastest that plans let it turn [rad/s].
        rate: f64,
        /// The time it has until the preset [s].
        time: f64,
        /// A horizon that gives it time enough [s].
        duration: f64,
    },
    /// The start has a joint farther beyond its stop than it can come back in time.
    JointStop {
        /// The joint, from 1.
        joint: usize,
        /// How far it is beyond its stop [rad].
        beyond: f64,
        /// The time within which it has to be back [s].
        time: f64,
    },
    /// The port is outside the field of view at capture.
    CaptureView {
        /// Between boresight and port [rad].
        angle: f64,
        /// Half angle of the field of view [rad].
        limit: f64,
    },
    /// The bus is inside the target at capture.
    Clearance {
        /// Distance of the bus's centre from the target's box, at most [m].
        distance: f64,
        /// Radius of the sphere about it that the bus fills [m].
        limit: f64,
    },
    /// The arm is inside its own bus at capture.
    OwnBus {
        /// The link, from 1.
        link: usize,
        /// How deep it is in the box that holds the bus [m].
        depth: f64,
    },
    /// The servicer starts within the keep-out distance.
    KeepOut {
        /// From the target's box [m].
        distance: f64,
        /// The least that is allowed [m].
        limit: f64,
    },
    /// The port is out of the camera's sight at the start, whose attitude is given.
    FieldOfView {
        /// Between boresight and port [rad].
        angle: f64,
        /// Half angle of the field of view [rad].
        limit: f64,
    },
    /// The target turns too far from node to node.
    Tumble {
        /// Turn relative to inertial space, the largest from node to node [rad].
        turn: f64,
        /// The most that can be followed [rad].
        limit: f64,
        /// A horizon over which it turns no farther [s].
        duration: f64,
    },
    /// The end effector reaches less far than the keep-out distance that holds a node before the
    /// end, by more than the last interval can close.
    Reach {
        /// Distance from the target's box where capture takes place [m].
        distance: f64,
        /// The most it can have been one node before [m].
        before: f64,
        /// The least that is allowed there [m].
        limit: f64,
    },
    /// The thrusters are too weak to be in front of the port in time.
    Force {
        /// The least force, on the axis with the largest limit, all used in proportion to theirs [N].
        needed: f64,
        /// Limit on that axis [N].
        limit: f64,
    },
    /// The bus cannot be turned as fast as the target in time.
    BusTorque {
        /// The least torque, on the axis with the largest limit, all used in proportion to theirs [N m].
        needed: f64,
        /// Limit on that axis [N m].
        limit: f64,
    },
    /// Inputs of the plan changed in memory during planning, or two runs of the verifier differed.
    Damaged {
        /// Name of the damaged part.
        what: &'static str,
    },
}

impl Refusal {
    /// Stable code for records; 0 is none.
    pub fn code(&self) -> u32 {
        match self {
            Self::NotFinite { .. } => 1,
            Self::Attitude { .. } => 2,
            Self::Position { .. } => 3,
            Self::NodeInterval { .. } => 4,
            Self::PresetLead { .. } => 5,
            Self::JointRate { .. } => 6,
            Self::CaptureView { .. } => 7,
            Self::Clearance { .. } => 8,
            Self::KeepOut { .. } => 9,
            Self::FieldOfView { .. } => 10,
            Self::Tumble { .. } => 11,
            Self::Reach { .. } => 12,
            Self::Force { .. } => 13,
            Self::BusTorque { .. } => 14,
            Self::Duration { .. } => 15,
            Self::JointStop { .. } => 16,
            Self::Nodes { .. } => 17,
            Self::OwnBus { .. } => 18,
            Self::Damaged { .. } => 19,
            Self::Eccentricity { .. } => 20,
        }
    }

    /// Name of the constraint, in files and tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "not_finite",
            Self::Attitude { .. } => "attitude",
            Self::Position { .. } => "position",
            Self::NodeInterval { .. } => "node_interval",
            Self::PresetLead { .. } => "preset_lead",
            Self::JointRate { .. } => "joint_rate",
            Self::CaptureView { .. } => "capture_view",
            Self::Clearance { .. } => "clearance",
            Self::KeepOut { .. } => "keep_out",
            Self::FieldOfView { .. } => "field_of_view",
            Self::Tumble { .. } => "tumble",
            Self::Reach { .. } => "reach",
            Self::Force { .. } => "force",
            Self::BusTorque { .. } => "bus_torque",
            Self::Duration { .. } => "duration",
            Self::JointStop { .. } => "joint",
            Self::Nodes { .. } => "nodes",
            Self::OwnBus { .. } => "own_bus",
            Self::Damaged { .. } => "damaged",
            Self::Eccentricity { .. } => "eccentricity",
        }
    }

    /// Whether the input makes no sense; otherwise it does, and cannot be done.
    pub fn is_invalid_input(&self) -> bool {
        matches!(
            self,
            Self::NotFinite { .. }
                | Self::Attitude { .. }
                | Self::Position { .. }
                | Self::Duration { .. }
                | Self::Nodes { .. }
                | Self::NodeInterval { .. }
                | Self::PresetLead { .. }
                | Self::Eccentricity { .. }
        )
    }
}

/// An angle as it is shown.
struct Degrees(f64);

impl fmt::Display for Degrees {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} deg", self.0 * 180.0 / core::f64::consts::PI)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.name())?;
        self.write_input(f)?;
        self.write_feasibility(f)
    }
}

impl Refusal {
    /// Writes what is wrong with the input; nothing for other refusals.
    fn write_input(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { field } => {
                write!(f, "the scenario's {field} is not finite, or beyond 1e30")
            }
            Self::Attitude { norm } => {
                write!(f, "not a unit quaternion, of target or bus: its norm is {norm}")
            }
            Self::Duration { duration } => {
                write!(f, "{duration} s is no time to capture: from 1 s to 1e6 s")
            }
            Self::Nodes { nodes, most } => {
                write!(f, "{nodes} nodes are no plan for this build: from {MIN_NODES} to {most}")
            }
            Self::Position { distance } => write!(
                f,
                "the start is {distance:.1e} m from the target's centre, from where nothing points at it"
            ),
            Self::NodeInterval { interval, limit } => write!(
                f,
                "from node to node it is {interval:.1} s, at most {limit:.1} s (a tenth of an orbit) can be followed"
            ),
            Self::Eccentricity { eccentricity, error, limit, duration } => write!(
                f,
                "orbit.eccentricity is {eccentricity}: plans take the orbit for a circle (HCW), which after {duration:.0} s is wrong by up to {error:.2} m, at most {limit:.2} m are accepted"
            ),
            Self::PresetLead { lead, limit } => write!(
                f,
                "the arm is preset {lead} intervals before the end, at most {limit} leave it time to move"
            ),
            Self::JointRate { joint, travel, rate, time, duration } => write!(
                f,
                "joint {joint} has to turn {} at {rate:.2e} rad/s, for which it needs {:.0} s and has {time:.0} s: lengthen the horizon to {duration:.0} s",
                Degrees(travel),
                libm::ceil(travel / rate),
            ),
            _ => Ok(()),
        }
    }

    /// Writes why a valid input is infeasible; nothing for other refusals.
    fn write_feasibility(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::JointStop { joint, beyond, time } => write!(
                f,
                "joint {joint} starts {} beyond its stop, too far to be back within {time:.0} s",
                Degrees(beyond),
            ),
            Self::CaptureView { angle, limit } => write!(
                f,
                "in the capture configuration the port is {} off the boresight, at most {} can be seen",
                Degrees(angle),
                Degrees(limit),
            ),
            Self::Clearance { distance, limit } => write!(
                f,
                "in the capture configuration the bus's centre is {distance:.3} m from the target, less than the {limit:.3} m that the bus fills"
            ),
            Self::OwnBus { link, depth } => write!(
                f,
                "in the capture configuration link {link} is {depth:.3} m within the box of its own bus"
            ),
            Self::KeepOut { distance, limit } => write!(
                f,
                "the start is {distance:.3} m from the target's box, the least allowed is {limit:.3} m"
            ),
            Self::FieldOfView { angle, limit } => write!(
                f,
                "at the start the port is {} off the boresight, at most {} can be seen",
                Degrees(angle),
                Degrees(limit),
            ),
            Self::Tumble { turn, limit, duration } => write!(
                f,
                "the target turns {} a node, at most {} can be followed: shorten the horizon to {duration:.0} s",
                Degrees(turn),
                Degrees(limit),
            ),
            Self::Reach { distance, before, limit } => write!(
                f,
                "capture is {distance:.3} m from the target's box, from at most {before:.3} m a node before, where {limit:.3} m must be kept: lower the near keep-out distance or lengthen the arm"
            ),
            Self::Force { needed, limit } => write!(
                f,
                "to be in front of the port in time takes at least {needed:.3} N, the limit is {limit:.3} N"
            ),
            Self::BusTorque { needed, limit } => write!(
                f,
                "to turn with the target in time takes at least {needed:.2e} N m, the limit is {limit:.2e} N m"
            ),
            Self::Damaged { what } => {
                write!(f, "{what} changed meanwhile: memory is damaged")
            }
            _ => Ok(()),
        }
    }
}

impl core::error::Error for Refusal {}
