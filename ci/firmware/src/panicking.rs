//! A panic that no compiler can rule out: built only to see the proof fail.

use crate::Board;
use crate::output::Line;

/// Prints an element whose index is known at run time alone.
pub fn run<B: Board>(board: &B) {
    let table = [1, 2, 3, 5, 7];
    let index = board.instructions() as usize;
    Line::new(board, "panicking").number("element", table[index]).end();
}
