//! Fork-join executor of the caller's: the second core where there is one. It never changes a result,
//! because the two closures share nothing that either writes.

/// A fork-join executor: runs two closures and waits for both.
///
/// The closures may run one after the other in either order or at the same time; `join` returns when
/// both are done. Planning calls it some ten times an iteration with closures of about equal size, 0.02
/// to 1 ms each on a desktop, and never nested: a second core should wait awake.
///
/// ```
/// use remora_core::prelude::*;
///
/// /// A thread for each second closure; a flight computer would wake its second core.
/// struct Threads;
///
/// impl ForkJoin for Threads {
///     fn join<A: Send, B: Send>(
///         &self,
///         a: impl FnOnce() -> A + Send,
///         b: impl FnOnce() -> B + Send,
///     ) -> (A, B) {
///         std::thread::scope(|scope| {
///             let second = scope.spawn(b);
///             (a(), second.join().unwrap())
///         })
///     }
/// }
/// assert_eq!(Threads.join(|| 1, || 2), Sequential.join(|| 1, || 2));
/// ```
pub trait ForkJoin: Sync {
    /// Runs `a` and `b`; returns their results.
    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B);
}

/// The executor of one core: one closure after the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequential;

impl ForkJoin for Sequential {
    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        (a(), b())
    }
}
