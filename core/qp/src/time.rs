//! The caller's clock, for phase timings and deadlines. It never changes a result.

use core::fmt;

/// A monotonic clock. Both cores may read it at the same time.
pub trait Clock: Sync {
    /// Time since some fixed instant [s].
    fn seconds(&self) -> f64;

    /// Called between slices of work, deadline or not: the place to do something else where there is one
    /// core and no operating system, such as a step of guidance while a plan is made. It must not
    /// touch what the work uses. Does nothing unless implemented.
    fn pause(&self) {}
}

/// A clock that stands still, for targets without one. Its deadlines never pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    fn seconds(&self) -> f64 {
        0.0
    }
}

/// A moment by which work ends, with the clock that measures it. Each check lets the clock
/// [pause](Clock::pause) the work and reads it once; a deadline that never comes reads nothing.
#[derive(Clone, Copy)]
pub struct Deadline<'a> {
    clock: &'a dyn Clock,
    at_s: f64,
}

impl<'a> Deadline<'a> {
    /// The moment `seconds` from now: at once where NaN, never where infinite.
    pub fn after(clock: &'a dyn Clock, seconds: f64) -> Self {
        Self { clock, at_s: clock.seconds() + seconds }
    }

    /// The deadline that never comes.
    pub const fn never() -> Self {
        Self { clock: &NoClock, at_s: f64::INFINITY }
    }

    /// The deadline `seconds` before this one.
    pub fn earlier_by(&self, seconds: f64) -> Self {
        Self { at_s: self.at_s - seconds, ..*self }
    }

    /// Whether the deadline ever comes.
    pub fn is_finite(&self) -> bool {
        self.at_s != f64::INFINITY
    }

    /// Time on its clock [s].
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Whether the deadline has passed.
    // Not inlined: all calls through the clock's pointer stay in this module, where the stack bound
    // resolves them.
    #[inline(never)]
    pub fn has_passed(&self) -> bool {
        self.clock.pause();
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
    use core::sync::atomic::{AtomicU32, Ordering};

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

    /// A clock that goes on by a second each time work is paused, and not by being read.
    struct Pausing(AtomicU32);

    impl Clock for Pausing {
        fn seconds(&self) -> f64 {
            f64::from(self.0.load(Ordering::Relaxed))
        }

        fn pause(&self) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn each_check_pauses_once_before_it_reads() {
        let clock = Pausing(AtomicU32::new(10));
        let deadline = Deadline::after(&clock, 2.0);
        assert_eq!((deadline.seconds(), NoClock.seconds()), (10.0, 0.0));
        assert!(!deadline.has_passed());
        assert_eq!(deadline.seconds(), 11.0);
        assert!(deadline.has_passed());
        assert!(deadline.earlier_by(0.5).has_passed());
        assert_eq!(deadline.seconds(), 13.0);
        // One that never comes lets the clock pause all the same.
        assert!(!Deadline::after(&clock, f64::INFINITY).has_passed());
        assert_eq!(deadline.seconds(), 14.0);
    }

    #[test]
    fn earlier_deadlines_are_earlier_by_that() {
        let deadline = Deadline::after(&Fixed(5.0), 3.0).earlier_by(2.0);
        let shown = |deadline: &Deadline| {
            let mut text = Text([0; 64], 0);
            fmt::write(&mut text, format_args!("{deadline:?}")).unwrap();
            text
        };
        let text = shown(&deadline);
        assert_eq!(&text.0[..text.1], b"Deadline { at_s: 6.0, .. }");
        assert!(!deadline.has_passed() && deadline.earlier_by(1.0).has_passed());
    }

    /// Text on the stack.
    struct Text([u8; 64], usize);

    impl fmt::Write for Text {
        fn write_str(&mut self, s: &str) -> fmt::Result {
            self.0[self.1..][..s.len()].copy_from_slice(s.as_bytes());
            self.1 += s.len();
            Ok(())
        }
    }
}
