//! Settings that lie in memory for a whole flight, against flipped bits.

use super::{AbortErrors, Closing, GuidanceSettings, Triggers};
use core::ops::Deref;

/// Settings in memory twice, and the parity of their bits. What one flipped bit makes of any of the three,
/// [`Guarded::restore`] undoes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guarded {
    pub(super) value: GuidanceSettings,
    spare: GuidanceSettings,
    parity: u64,
}

impl Guarded {
    pub(super) fn new(value: GuidanceSettings) -> Self {
        Self { value, spare: value, parity: parity(&value) }
    }

    /// Makes good what differs from the parity; the defaults where neither copy is sound. Cost: a few
    /// hundred instructions.
    // Apart, so that what is looked at here is on no other stack.
    #[inline(never)]
    pub(super) fn restore(&mut self) {
        let [value, spare] = [parity(&self.value), parity(&self.spare)];
        match (value == self.parity, spare == self.parity) {
            (true, true) => {}
            (true, false) => self.spare = self.value,
            (false, true) => self.value = self.spare,
            (false, false) if value == spare => self.parity = value,
            (false, false) => *self = Self::new(GuidanceSettings::DEFAULT),
        }
    }
}

impl Deref for Guarded {
    type Target = GuidanceSettings;

    fn deref(&self) -> &GuidanceSettings {
        &self.value
    }
}

/// Each bit is how often it is set in all numbers, odd or even.
fn parity(settings: &GuidanceSettings) -> u64 {
    let GuidanceSettings { translation, attitude, joint, most_per_step, integral, .. } = settings;
    let GuidanceSettings { integral_limit, fade, camera, closing, triggers, abort, .. } = settings;
    let Closing { distances, out, back, settle } = closing;
    let Triggers { age, position, attitude: turned, target, last } = triggers;
    let AbortErrors { settling, settled, settles, near, near_times, port } = abort;
    let alone = [translation, attitude, joint, most_per_step, integral, camera, settle];
    let triggers = [age, position, turned, target, last, settles, port];
    let pairs = [integral_limit, fade, distances, out, near_times];
    let of = |numbers: &[f64]| numbers.iter().fold(0, |all, x| all ^ x.to_bits());
    let single = alone.into_iter().chain(triggers).fold(0, |all, x| all ^ x.to_bits());
    let pairs = pairs.into_iter().fold(of(back.as_flattened()), |all, pair| all ^ of(pair));
    [settling, settled, near].into_iter().fold(single ^ pairs, |all, three| all ^ of(three))
}

#[cfg(test)]
mod tests {
    use super::super::{Guidance, GuidancePart};
    use super::*;
    use remora_qp::Validate;

    /// Wherever a bit of the settings flips, whatever they are, the next step has them back.
    #[test]
    fn one_flipped_bit_is_undone() {
        let own = GuidanceSettings { joint: 0.3, camera: 0.07, ..GuidanceSettings::DEFAULT };
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
        guidance.settings.spare.joint = 0.1;
        guidance.settings.restore();
        assert_eq!(guidance.settings.spare, own);
        guidance.settings.parity ^= 1 << 17;
        guidance.settings.restore();
        assert_eq!((*guidance.settings, guidance.settings.parity), (own, parity(&own)));
        (guidance.settings.value.joint, guidance.settings.spare.camera) = (0.1, 0.1);
        guidance.settings.restore();
        assert_eq!(*guidance.settings, GuidanceSettings::DEFAULT);
    }
}
