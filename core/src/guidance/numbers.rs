//! The numbers of guidance's state, one by one, as fault injection reaches them.

use super::{AbortErrors, Closing, Guidance, GuidanceSettings, Leaving, Request, Triggers};
use core::slice::from_mut;
use remora_qp::kept::nth;

/// A part of guidance's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GuidancePart {
    /// The settings' bandwidths and limits.
    Feedback,
    /// When the approach is given up, another plan is wanted, or the last way is gone.
    Settings,
    /// The place on the plan.
    Cursor,
    /// The integrals of the errors.
    Integrals,
    /// Offset that the wrist camera has found.
    Offset,
    /// When the plan began, the first step and the last one, and since when.
    Times,
    /// Last command.
    Commanded,
    /// How the target is left; nothing before it is.
    Leaving,
    /// Jump of the command to the plan in force, while it is faded out.
    Jump,
}

impl GuidancePart {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Feedback,
        Self::Settings,
        Self::Cursor,
        Self::Integrals,
        Self::Offset,
        Self::Times,
        Self::Commanded,
        Self::Leaving,
        Self::Jump,
    ];
}

impl<const NL: usize> Guidance<NL> {
    /// Number `element` of a part; none where there is none now.
    pub fn number(&mut self, part: GuidancePart, element: usize) -> Option<&mut f64> {
        match part {
            GuidancePart::Feedback => self.settings.feedback(element),
            GuidancePart::Settings => self.settings.times_and_limits(element),
            GuidancePart::Cursor => self.cursor.number(element),
            GuidancePart::Integrals => {
                let super::Errors { position, attitude, joint } = &mut self.memory.integrals;
                let numbers =
                    [position.as_mut_slice(), attitude.as_mut_slice(), joint.as_mut_slice()];
                nth(numbers, element)
            }
            GuidancePart::Offset => {
                let super::Offset { seen, value, rate, .. } = &mut self.memory.offset;
                nth([seen, value, rate].map(|vector| vector.as_mut_slice()), element)
            }
            GuidancePart::Times => match element {
                0 => self.begins.as_mut(),
                1 => self.memory.first.as_mut(),
                2 => self.last.as_mut(),
                3 => Some(&mut self.since),
                _ => None,
            },
            GuidancePart::Commanded => {
                let (force, control) = &mut self.commanded;
                let numbers = [
                    force.as_mut_slice(),
                    control.bus_torque.as_mut_slice(),
                    control.joint_torque.as_mut_slice(),
                ];
                nth(numbers, element)
            }
            GuidancePart::Leaving => match &mut self.memory.asked {
                Some(Request::Abort(leaving)) => leaving.number(element),
                _ => None,
            },
            GuidancePart::Jump => {
                let super::Jump { force, control, at } = self.memory.jump.as_mut()?;
                let numbers = [
                    force.as_mut_slice(),
                    control.bus_torque.as_mut_slice(),
                    control.joint_torque.as_mut_slice(),
                    at.as_mut().map_or(&mut [], from_mut),
                ];
                nth(numbers, element)
            }
        }
    }
}

impl<const NL: usize> Leaving<NL> {
    fn number(&mut self, element: usize) -> Option<&mut f64> {
        let Self { without, past, joint_angle } = self;
        let numbers = [
            without.as_mut_slice(),
            joint_angle.as_mut_slice(),
            past.as_mut().map_or(&mut [], |past| past.as_mut_slice()),
        ];
        nth(numbers, element)
    }
}

impl GuidanceSettings {
    fn feedback(&mut self, element: usize) -> Option<&mut f64> {
        let Self { translation, attitude, joint, most_per_step, integral, .. } = self;
        let numbers = [
            from_mut(translation),
            from_mut(attitude),
            from_mut(joint),
            from_mut(most_per_step),
            from_mut(integral),
            &mut self.integral_limit,
            &mut self.fade,
            from_mut(&mut self.camera),
        ];
        nth(numbers, element)
    }

    fn times_and_limits(&mut self, element: usize) -> Option<&mut f64> {
        let Closing { distances, out, back, settle } = &mut self.closing;
        let Triggers { age, position, attitude, target, last } = &mut self.triggers;
        let AbortErrors { settling, settled, settles, near, near_times, port } = &mut self.abort;
        let triggers = [age, position, attitude, target, last].map(from_mut);
        let limits: [&mut [f64]; 10] = [
            distances,
            out,
            back.as_flattened_mut(),
            from_mut(settle),
            settling,
            settled,
            from_mut(settles),
            near,
            near_times,
            from_mut(port),
        ];
        nth(limits.into_iter().chain(triggers), element)
    }
}
