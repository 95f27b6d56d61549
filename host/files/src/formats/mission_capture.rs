//! Joint angles at capture: given, or found where the mission is read.

use super::mission_servicer::{Capture, Servicer};
use super::quantities::rotation;
use super::{JointVector, Mission, unit};
use crate::error::FieldError;
use nalgebra::Vector3;
use remora_core::advanced::model::{CaptureFailure, CaptureSearch, Roll};

/// How far off the boresight the port may be at capture, as a share of the field of view's half angle.
const OFF_BORESIGHT: f64 = 0.1;
/// The end effector's axis where a file does not say.
const AXIS: [f64; 3] = [0.0, 0.0, 1.0];

/// Conditions on the joint angles at capture: they keep the mission's margins and hold the port
/// near the boresight. `axis` is the end effector's, in the last link's axes.
pub fn capture_search(mission: &Mission, axis: Vector3<f64>) -> CaptureSearch {
    CaptureSearch {
        axis,
        max_off_boresight: OFF_BORESIGHT * mission.approach.field_of_view_half_angle_rad,
        clearance: mission.margins.clearance_m,
        stop_margin: mission.margins.joint_angle_rad,
    }
}

impl Servicer {
    /// The roll of the end effector, whose direction is given in the last link's axes.
    ///
    /// # Errors
    /// The arm's base is rotated by no unit quaternion.
    pub(super) fn roll(&self, roll: &Roll) -> Result<Roll, FieldError> {
        let [end_effector, port] = [roll.end_effector.into(), roll.port.into()];
        let end_effector = unit::direction(&end_effector, || "roll.end_effector".into())?;
        let end_effector = self.in_bus_axes(end_effector.into())?;
        let port = unit::direction(&port, || "roll.port".into())?;
        Ok(Roll { end_effector, port: port.into() })
    }

    /// A vector of the axes that the links are given in, in bus axes.
    fn in_bus_axes(&self, vector: Vector3<f64>) -> Result<Vector3<f64>, FieldError> {
        Ok(match self.arm_base_rotation {
            None => vector,
            Some(q) => rotation(q, "servicer.arm_base_rotation")? * vector,
        })
    }

    /// The end effector's axis in the last link's axes, bus axes at zero joint angles, where joint angles
    /// at capture are to be found.
    ///
    /// # Errors
    /// It is no unit vector, or stands beside joint angles that are given; they beside it.
    pub fn capture_axis(&self) -> Result<Option<Vector3<f64>>, FieldError> {
        let refuse =
            |key: &str, reason: &str| Err(FieldError::new(format!("servicer.{key}"), reason));
        if self.capture == Capture::Joints {
            return match self.end_effector_axis {
                None => Ok(None),
                Some(_) => {
                    refuse("end_effector_axis", "has a meaning only with capture = \"pose\"")
                }
            };
        }
        if self.capture_joint_angle_rad.is_some() {
            return refuse(
                "capture_joint_angle_rad",
                "is found with capture = \"pose\": leave it out",
            );
        }
        let axis = self.end_effector_axis.unwrap_or(AXIS);
        let axis = unit::direction(&axis, || "servicer.end_effector_axis".into())?;
        self.in_bus_axes(axis.into()).map(Some)
    }
}

/// The joint angles at capture of a valid mission, nearest in time to those at the start.
///
/// # Errors
/// The constraint that the best joint angles violate, and by how much.
pub(super) fn found(mission: &Mission, axis: Vector3<f64>) -> Result<JointVector, FieldError> {
    let search = capture_search(mission, axis);
    mission
        .capture_configuration(&search, &mission.servicer.initial_joint_angle_rad)
        .map_err(|failure| FieldError::new("servicer.capture", reason(&failure)))
}

fn reason(failure: &CaptureFailure) -> String {
    let CaptureFailure { constraint, violation } = failure;
    // Clearances are distances, all else are angles.
    let unit = if constraint.starts_with("clearance") { "m" } else { "rad" };
    format!("no joint angles were found: the best miss {constraint} by {violation:.3} {unit}")
}
