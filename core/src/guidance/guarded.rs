//! Protection of a flight's memory against flipped bits.

use super::{AbortErrors, Closing, GuidanceSettings, Triggers};
use core::ops::{Deref, DerefMut};

/// Value with a parity that shows whether one of its bits has flipped.
pub(super) trait Parity: Copy {
    /// Parity of each bit position over all numbers.
    fn parity(&self) -> u64;
}

/// A value in memory twice, and the parity of its bits. [`Guarded::restore`] undoes a flipped bit in
/// the value in use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guarded<T> {
    value: T,
    spare: T,
    parity: u64,
}

impl<T: Parity> Guarded<T> {
    pub(super) fn new(value: T) -> Self {
        Self { value, spare: value, parity: value.parity() }
    }

    /// Takes what the value has been changed to for sound.
    // Separate function: its frame is on no other stack.
    #[inline(never)]
    pub(super) fn keep(&mut self) {
        self.spare = self.value;
        self.parity = self.value.parity();
    }

    /// Makes good what differs from the parity. Cost: three instructions a number. The spare is looked at where
    /// it is needed.
    // Separate function, as for keeping.
    #[inline(never)]
    pub(super) fn restore(&mut self) {
        let parity = self.value.parity();
        if parity != self.parity {
            self.mend(parity);
        }
    }

    #[cold]
    #[inline(never)]
    fn mend(&mut self, parity: u64) {
        match self.spare.parity() {
            spare if spare == self.parity => self.value = self.spare,
            spare if spare == parity => self.parity = parity,
            // Two faults: what is right cannot be told.
            _ => {}
        }
    }
}

/// Callers that change the value have it [kept](Guarded::keep) before the next look at it.
impl<T> DerefMut for Guarded<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T> Deref for Guarded<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

/// Parity of each bit position over the numbers.
#[inline(always)]
pub(super) fn bits<const N: usize>(numbers: &[f64; N]) -> u64 {
    numbers.iter().fold(0, |all, x| all ^ x.to_bits())
}

impl Parity for GuidanceSettings {
    // Once in an image.
    #[inline(never)]
    fn parity(&self) -> u64 {
        let Self { translation, attitude, joint, most_per_step, integral, camera, .. } = *self;
        let Self { integral_limit, fade, closing, triggers, abort, .. } = self;
        let Closing { distances, out, back, settle } = closing;
        let Triggers { age, position, attitude: turned, target, last } = *triggers;
        let AbortErrors { settling, settled, settles, near, near_times, port } = abort;
        // One after the other, not in a loop: a step of guidance counts its instructions.
        bits(&[translation, attitude, joint, most_per_step, integral, camera])
            ^ bits(&[*settle, age, position, turned, target, last, *settles, *port])
            ^ bits(integral_limit)
            ^ bits(fade)
            ^ bits(distances)
            ^ bits(out)
            ^ bits(&back[0])
            ^ bits(&back[1])
            ^ bits(settling)
            ^ bits(settled)
            ^ bits(near)
            ^ bits(near_times)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::{Command, Estimate, FlightPlan, Guidance, GuidancePart, Limits};
    use super::*;
    use crate::model::{Mission, Scenario};
    use crate::plan::Planner;
    use crate::planner::Options;
    use crate::stages::Mode;
    use remora_qp::{Valid, Validate};
    use std::boxed::Box;

    fn own() -> GuidanceSettings {
        GuidanceSettings { joint: 0.3, camera: 0.07, ..GuidanceSettings::DEFAULT }
    }

    /// Wherever a bit of the settings flips, whatever they are, the next step has them back.
    #[test]
    fn one_flipped_bit_is_undone() {
        let own = own();
        let mut guidance = Guidance::<3>::new(own.validated().unwrap());
        let mut struck = 0;
        for part in [GuidancePart::Feedback, GuidancePart::Settings] {
            for element in 0.. {
                let Some(number) = guidance.number(part, element) else { break };
                let bit = 1 << (element % 64);
                *number = f64::from_bits(number.to_bits() ^ bit);
                assert_ne!(*guidance.settings, own);
                guidance.settings.restore();
                assert_eq!(*guidance.settings, own);
                struck += 1;
            }
        }
        // All of them are reached: each is eight bytes.
        assert_eq!(struck * 8, size_of::<GuidanceSettings>());
        guidance.settings.parity ^= 1 << 17;
        guidance.settings.restore();
        assert_eq!((*guidance.settings, guidance.settings.parity), (own, own.parity()));
    }

    /// A flight: its mission, its plan, what navigation knows and what actuators can do.
    struct Flying(Valid<Mission<3>>, FlightPlan<3>, Limits<3>);

    impl Flying {
        fn new() -> Self {
            let mission = Mission::default().validated().unwrap();
            let scenario = Scenario::default().validated().unwrap();
            let options = Options::builder().mode(Mode::Feasible).build().unwrap();
            let mut planner = Box::new(Planner::new());
            let solution = planner.plan(&mission, &scenario, &options).unwrap();
            let plan = solution.flight_plan(0.0).unwrap();
            let limits = Limits::of(&mission.servicer);
            Self(mission, plan, limits)
        }

        /// A step at a time [s], a little beside the plan, with a target that turns otherwise than planned.
        fn step(&self, guidance: &mut Guidance, time: f64) -> Command {
            self.step_along(&self.1, guidance, time)
        }

        /// Steps along another plan of the same motion.
        fn step_along(&self, plan: &FlightPlan<3>, guidance: &mut Guidance, time: f64) -> Command {
            let Self(mission, _, limits) = self;
            let reference = plan.at(mission, time);
            let mut estimate = Estimate::as_planned(mission, time, &reference);
            estimate.position.x += 2e-3;
            estimate.target.rate.y += 1e-5;
            estimate.wrist = Some(nalgebra::Vector3::new(1e-3, -2e-3, 0.5e-3));
            guidance.step(mission, plan, &estimate, limits)
        }
    }

    /// The next command is the same to the bit, whatever bit flips between two steps. The place on the plan
    /// is the exception: it is reached from the node before in one step instead of many.
    #[test]
    fn a_flipped_bit_leaves_the_command() {
        let flying = Flying::new();
        let mut flown = Guidance::new(own().validated().unwrap());
        for i in 0..50 {
            flying.step(&mut flown, 300.0 + 0.5 * f64::from(i));
        }
        leaves_the_command(flown, &|guidance| flying.step(guidance, 325.0));
    }

    /// The command is the same after a change of plans and on the way out, too: the jump is faded out, and
    /// the way out is taken, as without a fault.
    #[test]
    fn a_flipped_bit_leaves_the_next_plan_and_the_way_out() {
        let flying = Flying::new();
        let mut flown = Guidance::new(own().validated().unwrap());
        flying.step(&mut flown, 300.0);
        let later = flying.1.beginning_at(-0.5);
        for i in 1..4 {
            flying.step_along(&later, &mut flown, 300.0 + 0.5 * f64::from(i));
        }
        assert!(flown.number(GuidancePart::Jump, 0).is_some());
        leaves_the_command(flown, &|guidance| flying.step_along(&later, guidance, 302.0));
        let mut asked = flown;
        asked.ask_for_plan();
        leaves_the_command(asked, &|guidance| flying.step_along(&later, guidance, 302.0));
        // Bits that flip before a request of the caller are repaired, too.
        for ask in [Guidance::ask_for_plan, Guidance::abort] {
            leaves_the_command(flown, &|guidance| {
                ask(guidance);
                flying.step_along(&later, guidance, 302.0)
            });
        }
        flown.abort();
        for i in 4..7 {
            flying.step_along(&later, &mut flown, 300.0 + 0.5 * f64::from(i));
        }
        assert!(flown.number(GuidancePart::Leaving, 8).is_some());
        leaves_the_command(flown, &|guidance| flying.step_along(&later, guidance, 303.5));
    }

    /// Flips bits of all that is guarded, one at a time, and compares the next step.
    fn leaves_the_command(mut flown: Guidance, step: &dyn Fn(&mut Guidance) -> Command) {
        let sound = step(&mut flown.clone());
        let guarded = [
            GuidancePart::Feedback,
            GuidancePart::Settings,
            GuidancePart::Cursor,
            GuidancePart::Integrals,
            GuidancePart::Offset,
            GuidancePart::Leaving,
            GuidancePart::Jump,
        ];
        for part in guarded {
            for element in 0.. {
                if flown.number(part, element).is_none() {
                    break;
                }
                for bit in [0, 31, 51, 62, 63] {
                    let mut struck = flown;
                    let number = struck.number(part, element).unwrap();
                    *number = f64::from_bits(number.to_bits() ^ (1 << bit));
                    let command = step(&mut struck);
                    if part != GuidancePart::Cursor {
                        assert_eq!(command, sound, "{part:?} {element}, bit {bit}");
                        continue;
                    }
                    let force = (command.force - sound.force).amax();
                    let angle = (command.joint_angle - sound.joint_angle).amax();
                    assert!(force < 1e-6 && angle < 1e-6, "{element}, bit {bit}: {force} {angle}");
                    assert_eq!(command.mode, sound.mode);
                }
            }
        }
    }
}
