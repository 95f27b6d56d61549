//! Time, as a trait of the caller's: for phase timings and deadlines. It never changes a number.

use core::fmt;

/// A clock. It may be read by both cores at the same time.
pub trait Clock: Sync {
    /// Seconds since some fixed instant.
    fn seconds(&self) -> f64;
}

/// A clock that stands still, for targets without one: its deadlines never pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    fn seconds(&self) -> f64 {
        0.0
    }
}

/// A moment at which work ends with what it has, by a clock that also times the work. Costs one
/// reading of the clock each time it is looked at, none where the moment never comes.
#[derive(Clone, Copy)]
pub struct Deadline<'a> {
    clock: &'a dyn Clock,
    at_s: f64,
}

impl<'a> Deadline<'a> {
    /// The moment `seconds` from now: at once where that is not a number, never where infinite.
    pub fn after(clock: &'a dyn Clock, seconds: f64) -> Self {
        Self { clock, at_s: clock.seconds() + seconds }
    }

    /// The moment that never comes.
    pub const fn never() -> Self {
        Self { clock: &NoClock, at_s: f64::INFINITY }
    }

    /// The moment `seconds` before this one.
    pub fn earlier_by(&self, seconds: f64) -> Self {
        Self { at_s: self.at_s - seconds, ..*self }
    }

    /// Whether it ever comes.
    pub fn is_finite(&self) -> bool {
        self.at_s != f64::INFINITY
    }

    /// Seconds on its clock.
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Whether the moment has come.
    // A function of its own: calls through the clock's pointer then stand in this module alone, and
    // a bound on the stack knows what they may reach.
    #[inline(never)]
    pub fn has_passed(&self) -> bool {
        // Written so that NaN counts as passed.
        !(self.at_s == f64::INFINITY || self.clock.seconds() < self.at_s)
    }
}

impl fmt::Debug for Deadline<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Deadline").field("at_s", &self.at_s).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fixed(f64);

    impl Clock for Fixed {
        fn seconds(&self) -> f64 {
            self.0
        }
    }

    #[test]
    fn deadlines_pass_when_the_clock_says_so() {
        assert!(!Deadline::never().has_passed());
        assert!(!Deadline::after(&NoClock, 1e-9).has_passed());
        assert!(!Deadline::after(&Fixed(5.0), 1.0).has_passed());
        assert!(Deadline::after(&Fixed(5.0), 0.0).has_passed());
        assert!(Deadline::after(&Fixed(5.0), -1.0).has_passed());
        assert!(Deadline::after(&Fixed(5.0), f64::NAN).has_passed());
        assert!(Deadline::after(&Fixed(5.0), 1.0).earlier_by(1.0).has_passed());
        assert!(!Deadline::never().earlier_by(1.0).has_passed());
        assert!(Deadline::after(&NoClock, 1.0).is_finite() && !Deadline::never().is_finite());
    }
}
