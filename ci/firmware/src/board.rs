//! What a board has to offer.

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

    /// High-water mark of the stack; `None` where it is not painted.
    fn stack(&self) -> Option<Stack>;
}

/// Retired instructions as a clock, one nanosecond each, so that the planner's own phase timings
/// count instructions.
pub struct InstructionClock<'a, B>(pub &'a B);

impl<B: Board> Clock for InstructionClock<'_, B> {
    fn seconds(&self) -> f64 {
        self.0.instructions() as f64 * 1e-9
    }
}

/// The instructions between two readings of [`InstructionClock`].
pub fn instructions_of(seconds: f64) -> u64 {
    // Exact: a difference of a few seconds is known to far better than half a nanosecond.
    (seconds * 1e9 + 0.5) as u64
}
