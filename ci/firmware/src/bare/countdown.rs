//! A timer of 32 bits that counts down and begins anew, as a counter that only goes up.

use super::read_register;
use core::cell::Cell;

/// The ticks of such a timer; read more often than it wraps.
pub struct Countdown {
    /// Address of its value.
    value: usize,
    /// Ticks up to the last reading, and the timer then.
    last: Cell<(u64, u32)>,
}

// SAFETY: a board has one core, and no interrupt reads its clock.
unsafe impl Sync for Countdown {}

impl Countdown {
    /// A timer that begins now at the largest value.
    ///
    /// # Safety
    /// `value` is the address of the register that holds its value, and reading that has no effect.
    pub unsafe fn new(value: usize) -> Self {
        Self { value, last: Cell::new((0, u32::MAX)) }
    }

    /// Ticks since it began.
    pub fn ticks(&self) -> u64 {
        // SAFETY: the timer's register, as whoever made this promised.
        let now: u32 = unsafe { read_register(self.value) };
        let (ticks, before) = self.last.get();
        let ticks = ticks.wrapping_add(u64::from(before.wrapping_sub(now)));
        self.last.set((ticks, now));
        ticks
    }
}
