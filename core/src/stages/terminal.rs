//! The bus at capture: the end effector along the approach, and rolled about it where the mission says
//! how.

use crate::math::quaternion;
use crate::model::{Mission, TargetState};
use nalgebra::{Vector3, Vector4};

/// Condition on the bus's attitude at capture.
pub(super) struct Terminal {
    /// Direction of the end effector, RTN: into the port.
    pub approach: Vector3<f64>,
    /// Direction of the end effector from the centre of mass at capture, bus axes.
    pub end_effector: Vector3<f64>,
    /// Two directions that are one seen along the approach: in bus axes and in RTN.
    pub roll: Option<[Vector3<f64>; 2]>,
}

impl Terminal {
    /// That of a mission, the target in its last state.
    pub fn new<const NL: usize>(mission: &Mission<NL>, last: &TargetState) -> Self {
        let target = quaternion::rotation_matrix(&last.attitude);
        let servicer = &mission.servicer;
        Self {
            approach: -(target * mission.target.port_normal),
            end_effector: servicer.capture_geometry().direction,
            roll: mission.roll.as_ref().map(|roll| {
                [servicer.in_bus_axes_at_capture(&roll.end_effector), target * roll.port]
            }),
        }
    }

    /// Turn of a bus of attitude `attitude` until the end effector is along the approach, the shortest.
    pub fn alignment(&self, attitude: &Vector4<f64>) -> Vector4<f64> {
        let arm = quaternion::rotation_matrix(attitude) * self.end_effector;
        quaternion::between(&arm, &self.approach)
    }

    /// Angle of the roll about the approach that is left of a bus of attitude `attitude`, whose end
    /// effector is along it [rad]; zero where the roll is free.
    // Not inlined, as `fixed`.
    #[inline(never)]
    pub fn roll_left(&self, attitude: &Vector4<f64>) -> f64 {
        let Some([end_effector, port]) = &self.roll else { return 0.0 };
        let is = quaternion::rotation_matrix(attitude) * end_effector;
        let across = |v: &Vector3<f64>| v - self.approach * self.approach.dot(v);
        let (is, wanted) = (across(&is), across(port));
        libm::atan2(self.approach.dot(&is.cross(&wanted)), is.dot(&wanted))
    }

    /// The attitude of a bus of attitude `attitude`, turned and rolled as at capture, and its turn
    /// [rad, RTN].
    // Not inlined: it is called once a trajectory, and an image's room counts.
    #[inline(never)]
    pub fn fixed(&self, attitude: &Vector4<f64>) -> (Vector4<f64>, Vector3<f64>) {
        let mut turn = self.alignment(attitude);
        let mut turned = quaternion::normalized(&quaternion::product(&turn, attitude));
        if self.roll.is_some() {
            let roll = quaternion::exp(&(self.approach * self.roll_left(&turned)));
            turn = quaternion::product(&roll, &turn);
            turned = quaternion::normalized(&quaternion::product(&roll, &turned));
        }
        (turned, quaternion::log(&turn))
    }
}
