//! Joint angles at capture, found: the end effector's own axis points at the port as the line of
//! sight from the system's centre of mass does, and the servicer stays clear of the target.
//!
//! At capture planning turns the bus until the direction from the system's centre of mass to the
//! end effector points into the port. A gripper that must meet the port squarely has an axis of its
//! own; it points into the port, too, exactly where the arm makes the two directions one. That is a
//! matter of the joint angles alone, and is settled here, before planning.

mod constraints;
mod pose;
mod search;

use super::Servicer;
use core::fmt;
use nalgebra::{SVector, Vector3};

/// Largest angle between the end effector's axis and its direction from the system's centre of mass
/// in a configuration that is found [rad].
pub const CAPTURE_ALIGNMENT: f64 = 1e-9;

/// Name of what [`CaptureViolation::stop`] measures.
const STOPS: &str = "the joints' stops";

/// Constraints on the joint angles at capture. Besides, the end effector's axis points the way that the
/// end effector lies from the system's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureSearch {
    /// Unit axis of the end effector, in the last link's axes: what points into the port.
    pub axis: Vector3<f64>,
    /// Largest angle between the camera's boresight and the direction of the end effector from the
    /// system's centre of mass [rad].
    pub max_off_boresight: f64,
    /// Least distance of the arm from its own bus, and of all but the last link from the port's plane
    /// [m].
    pub clearance: f64,
    /// Least distance of each joint from its stops [rad].
    pub stop_margin: f64,
}

/// Violations of the constraints at capture by joint angles; negative where they are satisfied.
///
/// A number that is not one counts as a violation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureViolation {
    /// Angle between the end effector's axis and its direction from the system's centre of mass
    /// [rad]; never negative.
    pub axis: f64,
    /// Angle between boresight and direction, beyond the largest [rad].
    pub view: f64,
    /// The farthest that a joint is beyond its stop and the margin before it [rad].
    pub stop: f64,
    /// The arm, beyond its first link of any length, less than the clearance from the bus [m].
    pub bus: f64,
    /// Bus or links, all but the last of any length, less than the clearance behind the port's plane
    /// [m]: who is behind it is clear of a target that is in front of it.
    pub port: f64,
}

impl CaptureViolation {
    /// The largest violation, radians and metres side by side, where the axis may be off by
    /// `alignment` [rad]; none where all is satisfied.
    pub fn worst(&self, alignment: f64) -> Option<CaptureFailure> {
        let mut worst: Option<CaptureFailure> = None;
        for (constraint, violation, allowed) in [
            ("the end effector's axis", self.axis, alignment),
            ("the camera's view", self.view, 0.0),
            (STOPS, self.stop, 0.0),
            ("clearance of the bus", self.bus, 0.0),
            ("clearance of the port's plane", self.port, 0.0),
        ] {
            let larger = worst.is_none_or(|other| !(violation <= other.violation));
            // NaN is a violation.
            if !(violation <= allowed) && larger {
                worst = Some(CaptureFailure { constraint, violation });
            }
        }
        worst
    }
}

/// A constraint that no joint angles were found to satisfy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureFailure {
    /// Name of the constraint, in words.
    pub constraint: &'static str,
    /// Violation by the best joint angles that were found [rad or m].
    pub violation: f64,
}

impl fmt::Display for CaptureFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no arm at capture: {}, missed by {:.3e}", self.constraint, self.violation)
    }
}

impl core::error::Error for CaptureFailure {}

impl<const NL: usize> Servicer<NL> {
    /// Violations of the constraints at capture by the joint angles `angles` [rad].
    ///
    /// Cost: a sine and cosine and a distance of a segment from a box a link.
    pub fn capture_violation(
        &self,
        search: &CaptureSearch,
        angles: &SVector<f64, NL>,
    ) -> CaptureViolation {
        constraints::Constraints::new(self, search).violation(angles)
    }

    /// The joint angles at capture [rad] that are soonest reached from `near` [rad], of those found:
    /// least is the longest time that a joint takes at its largest rate. They satisfy all of
    /// `search`, with the end effector's axis off by less than [`CAPTURE_ALIGNMENT`].
    ///
    /// The servicer must be that of a valid mission, and `near` finite. The search is local, from
    /// a fixed set of starts: what it finds is the least nearby, not for certain the least of all,
    /// and a narrow set of solutions may escape it. The same arguments give the same bits everywhere.
    ///
    /// Cost: at most 5000 evaluations of the arm's geometry with derivatives, each with a system of
    /// `NL` equations; four milliseconds for seven joints on a desktop processor. Not for flight.
    ///
    /// ```
    /// use remora_core::advanced::model::{CaptureSearch, Servicer};
    /// use remora_core::nalgebra::Vector3;
    ///
    /// let servicer = Servicer::default();
    /// let search = CaptureSearch {
    ///     axis: Vector3::z(),
    ///     max_off_boresight: 0.3,
    ///     clearance: 0.05,
    ///     stop_margin: 0.02,
    /// };
    /// let angles = servicer.capture_configuration(&search, &servicer.initial_joint_angle_rad)?;
    /// assert!(servicer.capture_violation(&search, &angles).axis < 1e-9);
    /// # Ok::<(), remora_core::advanced::model::CaptureFailure>(())
    /// ```
    ///
    /// # Errors
    /// The constraint that the best joint angles found violate most, where none satisfy all. An arm
    /// of one or two joints, or one that does not bend in all planes, may have none.
    pub fn capture_configuration(
        &self,
        search: &CaptureSearch,
        near: &SVector<f64, NL>,
    ) -> Result<SVector<f64, NL>, CaptureFailure> {
        search::nearest(&constraints::Constraints::new(self, search), near)
    }
}

#[cfg(test)]
mod tests;
