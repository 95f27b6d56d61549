//! Heaps and stacks for what is too large for a usual stack.

use crate::error::Error;

/// Stack of threads that plan [bytes]. The planner's large memory is on the heap; what is left
/// needs less than the system's usual 8 MiB.
pub const STACK_BYTES: usize = 8 << 20;

/// Makes what is too large for a stack. A function of its own, so that what the compiler puts on
/// the stack on the way is gone before the next comes.
#[inline(never)]
pub fn on_heap<T>(make: impl FnOnce() -> T) -> Box<T> {
    Box::new(make())
}

/// Runs `work` on a thread with [`STACK_BYTES`] of stack, which the main thread may not have.
pub fn on_large_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, work)
            .map_err(|cause| Error::Thread { reason: cause.to_string() })?;
        thread.join().map_err(|_| Error::Thread { reason: "the planner stopped".into() })
    })
}
