//! A panic that no compiler can rule out, and that never happens: built only to see the proof fail.

use crate::Board;
use crate::output::Line;

/// Prints an element whose index is known at run time alone.
pub fn run<B: Board>(board: &B) {
    let table = [1, 2, 3, 5, 7];
    // Zero for the next 36 years, which the compiler does not know.
    let index = (board.instructions() >> 60) as usize;
    Line::new(board, "panicking").number("element", table[index]).end();
}
