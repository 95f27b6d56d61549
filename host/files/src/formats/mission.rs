//! The one mission type of the host, with room for every arm that there is a planner for.

use crate::error::FieldError;
use nalgebra::SVector;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::model::{
    self, CaptureFailure, CaptureSearch, CaptureViolation, InvalidField,
};
use remora_core::advanced::planner;
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory, TranslationTrajectory};
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Most joints of an arm.
pub const MAX_JOINTS: usize = 7;

/// Arms that are planned for, in words for messages.
pub const PLANNED_JOINTS: &str = "arms of 1 to 7 joints are planned for";

/// A scenario; the joints that its mission's arm does not have are at zero.
pub type Scenario = model::Scenario<MAX_JOINTS>;

/// A number for each joint; zero for those that an arm does not have.
pub type JointVector = SVector<f64, MAX_JOINTS>;

/// Bus and arm of a plan; the joints that its mission's arm does not have are at zero.
pub type Motion = ReorientationTrajectory<NODES, MAX_JOINTS>;

/// A mission with room for [`MAX_JOINTS`] joints, and how many its arm has.
///
/// It is the core's mission ([`Deref`]). Joints that the arm does not have are at its tip and stand
/// still: see [`model::Servicer::resized`].
///
/// ```
/// use remora_files::formats::{MAX_JOINTS, Mission};
///
/// let mission = Mission::default();
/// assert_eq!(mission.joints(), 3);
/// assert_eq!(mission.servicer.links.len(), MAX_JOINTS);
/// assert_eq!(mission.servicer.total_mass(), 530.0);
/// ```
#[derive(Clone, Copy)]
pub struct Mission {
    roomy: model::Mission<MAX_JOINTS>,
    joints: usize,
}

/// Evaluates an expression in which `$sized` is the core's mission in the size of its arm.
macro_rules! in_size {
    ($mission:expr, $sized:ident => $body:expr) => {
        match $mission.joints {
            1 => in_size!(@ 1, $mission, $sized, $body),
            2 => in_size!(@ 2, $mission, $sized, $body),
            3 => in_size!(@ 3, $mission, $sized, $body),
            4 => in_size!(@ 4, $mission, $sized, $body),
            5 => in_size!(@ 5, $mission, $sized, $body),
            6 => in_size!(@ 6, $mission, $sized, $body),
            _ => in_size!(@ MAX_JOINTS, $mission, $sized, $body),
        }
    };
    (@ $joints:expr, $mission:expr, $sized:ident, $body:expr) => {{
        let $sized = $mission.roomy.resized::<{ $joints }>();
        $body
    }};
}

impl Deref for Mission {
    type Target = model::Mission<MAX_JOINTS>;

    fn deref(&self) -> &Self::Target {
        &self.roomy
    }
}

impl DerefMut for Mission {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.roomy
    }
}

impl PartialEq for Mission {
    fn eq(&self, other: &Self) -> bool {
        self.joints == other.joints && in_size!(self, sized => sized == other.roomy.resized())
    }
}

impl fmt::Debug for Mission {
    /// The core's mission in the size of its arm.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        in_size!(self, sized => sized.fmt(f))
    }
}

impl Default for Mission {
    /// The built-in mission.
    fn default() -> Self {
        Self::from(&model::Mission::<LINKS>::default())
    }
}

impl<const NL: usize> From<&model::Mission<NL>> for Mission {
    fn from(mission: &model::Mission<NL>) -> Self {
        Self { roomy: mission.resized(), joints: NL }
    }
}

impl<const NL: usize> From<model::Mission<NL>> for Mission {
    fn from(mission: model::Mission<NL>) -> Self {
        Self::from(&mission)
    }
}

impl Mission {
    /// A mission whose arm has the first `joints` joints, between one and [`MAX_JOINTS`].
    pub(super) fn new(roomy: model::Mission<MAX_JOINTS>, joints: usize) -> Self {
        let mission = Self { roomy, joints };
        in_size!(mission, sized => Self::from(&sized))
    }

    /// How many joints the arm has.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// The core's mission in a build with room for `M` joints.
    pub fn sized<const M: usize>(&self) -> model::Mission<M> {
        in_size!(self, sized => sized.resized())
    }

    /// Refuses the first field whose value makes no sense.
    ///
    /// # Errors
    /// The field, by the core's name, and what is wrong with it.
    pub fn validate(&self) -> Result<(), InvalidField> {
        in_size!(self, sized => sized.validate())
    }

    /// Checksum of the mission without the ranges that scenarios are drawn from.
    pub fn checksum(&self) -> u64 {
        in_size!(self, sized => planner::mission_checksum(&sized))
    }

    /// Checksum of a scenario of this mission.
    pub fn scenario_checksum(&self, scenario: &Scenario) -> u64 {
        in_size!(self, sized => planner::scenario_checksum(&alike(&sized, scenario)))
    }

    /// Checksum of mission and scenario, as a plan's record has it.
    pub fn input_checksum(&self, scenario: &Scenario) -> u64 {
        in_size!(self, sized => planner::input_checksum(&sized, &alike(&sized, scenario)))
    }

    /// Checksum of the first `nodes` nodes of a plan of this mission.
    pub fn output_checksum(
        &self,
        nodes: usize,
        path: &TranslationTrajectory<NODES>,
        motion: &Motion,
    ) -> u64 {
        in_size!(self, sized => {
            planner::output_checksum(nodes, path, &motion_alike(&sized, motion))
        })
    }

    /// Joint angles at capture: see [`model::Servicer::capture_configuration`].
    ///
    /// # Errors
    /// The constraint that the best joint angles found violate most.
    pub fn capture_configuration(
        &self,
        search: &CaptureSearch,
        near: &JointVector,
    ) -> Result<JointVector, CaptureFailure> {
        in_size!(self, sized => {
            let angles = sized.servicer.capture_configuration(search, &each(near.as_slice()))?;
            Ok(each(angles.as_slice()))
        })
    }

    /// By how much joint angles violate what holds at capture.
    pub fn capture_violation(
        &self,
        search: &CaptureSearch,
        angles: &JointVector,
    ) -> CaptureViolation {
        in_size!(self, sized => {
            sized.servicer.capture_violation(search, &each(angles.as_slice()))
        })
    }
}

/// Refuses an arm of `has` joints where one of `joints` joints is needed.
///
/// # Errors
/// The servicer's links, and both numbers.
pub fn check_arm(has: usize, joints: usize) -> Result<(), FieldError> {
    if has == joints {
        return Ok(());
    }
    let reason = format!("has {has} entries; here the arm has {joints} joints");
    Err(FieldError::new("servicer.links", reason))
}

/// The first of some numbers; zero where there are no more.
pub(super) fn each<const M: usize>(numbers: &[f64]) -> SVector<f64, M> {
    SVector::from_fn(|i, _| numbers.get(i).copied().unwrap_or(0.0))
}

/// A state of the first `M` joints; those that it does not have stand at zero.
pub fn resized_state<const NL: usize, const M: usize>(x: &State<NL>) -> State<M> {
    State {
        attitude: x.attitude,
        joint_angle: each(x.joint_angle.as_slice()),
        rate: x.rate,
        joint_rate: each(x.joint_rate.as_slice()),
    }
}

/// Torques of the bus and the first `M` joints; zero for those that it does not have.
pub fn resized_control<const NL: usize, const M: usize>(u: &Control<NL>) -> Control<M> {
    Control { bus_torque: u.bus_torque, joint_torque: each(u.joint_torque.as_slice()) }
}

/// A motion of the first `M` joints; those that it does not have stand at zero.
pub fn resized_motion<const NL: usize, const M: usize>(
    motion: &ReorientationTrajectory<NODES, NL>,
) -> ReorientationTrajectory<NODES, M> {
    ReorientationTrajectory {
        states: motion.states.each_ref().map(resized_state),
        controls: motion.controls.each_ref().map(resized_control),
    }
}

/// A motion in the size of a mission.
fn motion_alike<const NL: usize>(
    _: &model::Mission<NL>,
    motion: &Motion,
) -> ReorientationTrajectory<NODES, NL> {
    resized_motion(motion)
}

/// A scenario in the size of a mission.
fn alike<const NL: usize>(_: &model::Mission<NL>, scenario: &Scenario) -> model::Scenario<NL> {
    scenario.resized()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_keeps_its_joints() {
        let mut motion = ReorientationTrajectory::<NODES, 2>::ZERO;
        motion.states[3].joint_rate[1] = 0.5;
        motion.controls[3].joint_torque[0] = 0.25;
        let roomy: Motion = resized_motion(&motion);
        assert_eq!(resized_motion(&roomy), motion);
        assert_eq!(roomy.states[3].joint_rate.sum(), 0.5);
    }

    /// Checksums are those of the arm's own size, whatever stands beyond it.
    #[test]
    fn checksums_leave_out_joints_that_are_not_there() {
        let own = model::Mission::<LINKS>::default();
        let mut mission = Mission::from(&own);
        mission.servicer.joint_rate_limit_rad_s[5] = 7.0;
        assert_eq!(mission.checksum(), planner::mission_checksum(&own));
        let scenario = model::Scenario::<LINKS>::default();
        let checksum = planner::input_checksum(&own, &scenario);
        assert_eq!(mission.input_checksum(&scenario.resized()), checksum);
        assert_eq!(mission.sized::<3>(), own);
        assert_eq!(mission.sized::<MAX_JOINTS>(), own.resized());
    }
}
