//! Interface of a board: output, instruction counter, stack, watchdog.

use core::sync::atomic::{AtomicU32, Ordering};
use remora_core::advanced::time::Clock;

/// The stack of an image, as it was last painted: by the start-up code, or since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    /// Deepest use since it was last painted [bytes].
    pub used: usize,
    /// Room for it [bytes].
    pub size: usize,
}

/// A board: where text goes, and how many instructions have been retired.
pub trait Board: Sync {
    /// Its name in the report.
    const NAME: &'static str;
    /// Instructions between two values of [`Board::instructions`]: its resolution.
    const RESOLUTION: u64;

    /// Sends one character.
    fn write(&self, byte: u8);

    /// Retired instructions since some fixed moment, rounded down to the resolution.
    fn instructions(&self) -> u64;

    /// Runs a loop of this many turns and returns the instructions it takes, known from its
    /// assembly: what [`Board::instructions`] is held against.
    fn known_loop(&self, turns: u32) -> u64;

    /// Paints what lies below the stack in use anew, where it is painted at all.
    fn paint_stack(&self);

    /// Starts the watchdog anew, where there is one: it ends what takes far longer than a plan.
    fn start_watchdog(&self) {}

    /// High-water mark of the stack; `None` where it is not painted.
    fn stack(&self) -> Option<Stack>;
}

/// Retired instructions as a clock, one nanosecond each, so that the planner's own phase timings
/// count instructions; and the most of them between two pauses.
pub struct InstructionClock<'a, B> {
    board: &'a B,
    /// Instructions at the last pause; of this and the next the low half, which all processors can share.
    paused: AtomicU32,
    longest: AtomicU32,
}

impl<'a, B: Board> InstructionClock<'a, B> {
    /// A clock of a plan that begins now.
    pub fn new(board: &'a B) -> Self {
        let paused = AtomicU32::new(board.instructions() as u32);
        Self { board, paused, longest: AtomicU32::new(0) }
    }

    /// The most instructions between two pauses, from the clock's beginning until now.
    pub fn longest_slice(&self) -> u32 {
        self.pause();
        self.longest.load(Ordering::Relaxed)
    }
}

impl<B: Board> Clock for InstructionClock<'_, B> {
    fn seconds(&self) -> f64 {
        self.board.instructions() as f64 * 1e-9
    }

    // One core alone comes here, so that what is read is still there when it is written.
    fn pause(&self) {
        let now = self.board.instructions() as u32;
        let slice = now.wrapping_sub(self.paused.load(Ordering::Relaxed));
        self.paused.store(now, Ordering::Relaxed);
        if slice > self.longest.load(Ordering::Relaxed) {
            self.longest.store(slice, Ordering::Relaxed);
        }
    }
}

/// The instructions between two readings of [`InstructionClock`].
pub fn instructions_of(seconds: f64) -> u64 {
    // Exact: a difference of a few seconds is known to far better than half a nanosecond.
    (seconds * 1e9 + 0.5) as u64
}
