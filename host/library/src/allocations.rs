//! How often the program asks for memory.
//!
//! The program `remora` counts all its requests (`main.rs` installs the counting allocator); a
//! program that only links this library need not.

use stats_alloc::INSTRUMENTED_SYSTEM;
use std::hint::black_box;

/// Requests for memory, of all threads, so far: allocations and reallocations.
fn requests() -> usize {
    let stats = INSTRUMENTED_SYSTEM.stats();
    stats.allocations + stats.reallocations
}

/// Whether this program counts them.
pub fn are_counted() -> bool {
    let before = requests();
    drop(black_box(Box::new(0u64)));
    requests() != before
}

/// How often memory was asked for while `work` ran, by any thread.
pub fn during(work: impl FnOnce()) -> usize {
    let before = requests();
    work();
    requests() - before
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_test_program_does_not_count() {
        assert!(!are_counted());
        assert_eq!(during(|| drop(black_box(Box::new(1u64)))), 0);
    }
}
