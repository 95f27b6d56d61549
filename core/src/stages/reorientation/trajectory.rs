//! The trajectory that Stage 2 improves.

use crate::dynamics::{Control, State};
use nalgebra::Vector4;
use remora_qp::kept::nth;

/// Trajectory of bus attitude and arm: states at the nodes, torques over the intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReorientationTrajectory<const N: usize, const NL: usize> {
    /// States at the nodes.
    pub states: [State<NL>; N],
    /// Controls over the intervals; the last is zero.
    pub controls: [Control<NL>; N],
}

impl<const N: usize, const NL: usize> ReorientationTrajectory<N, NL> {
    /// Placeholder for storage.
    pub const ZERO: Self = Self { states: [State::ZERO; N], controls: [Control::ZERO; N] };

    /// Placeholder with all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self = Self {
        states: [State { attitude: Vector4::new(0.0, 0.0, 0.0, 0.0), ..State::ZERO }; N],
        controls: [Control::ZERO; N],
    };

    /// Sets all from node `first` on to [`Self::ZERO`]: what a plan of fewer nodes leaves open.
    pub(crate) fn clear_from(&mut self, first: usize) {
        self.states.iter_mut().skip(first).for_each(|state| *state = State::ZERO);
        self.controls.iter_mut().skip(first).for_each(|control| *control = Control::ZERO);
    }

    /// Number `element` of node `k`, for fault injection: attitude, joint angles, rates of bus and joints,
    /// torques of bus and joints.
    pub fn number(&mut self, k: usize, element: usize) -> Option<&mut f64> {
        let (state, control) = (self.states.get_mut(k)?, self.controls.get_mut(k)?);
        let numbers = [
            state.attitude.as_mut_slice(),
            state.joint_angle.as_mut_slice(),
            state.rate.as_mut_slice(),
            state.joint_rate.as_mut_slice(),
            control.bus_torque.as_mut_slice(),
            control.joint_torque.as_mut_slice(),
        ];
        nth(numbers, element)
    }
}
