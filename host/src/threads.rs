//! The second core of a desktop.

use rayon::{ThreadPool, ThreadPoolBuilder};
use remora_core::pair::{Pair, Sequential};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// How many threads work on one plan. The plan's bits are the same either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Threads {
    /// The calling one.
    #[default]
    #[value(name = "1", help = "Plan on one thread")]
    One,
    /// A second one, started at the first use on each calling thread and kept until that ends.
    /// Handing work over then allocates nothing and takes some microseconds.
    #[value(name = "2", help = "Share each linearisation between two threads")]
    Two,
}

thread_local! {
    /// The calling thread with a helper; none where the thread belongs to another pool.
    static WITH_HELPER: Option<ThreadPool> = with_helper();
}

/// The longest that a helper is waited for when it is started.
const PATIENCE: Duration = Duration::from_millis(50);

/// The calling thread with a helper, both of which have handed work over and waited for it once:
/// the first time they do, they allocate.
fn with_helper() -> Option<ThreadPool> {
    let pool = ThreadPoolBuilder::new().num_threads(2).use_current_thread().build().ok()?;
    let (begun, started) = (AtomicBool::new(false), Instant::now());
    let wait = || {
        while !begun.load(Ordering::Acquire) && started.elapsed() < PATIENCE {
            thread::yield_now();
        }
    };
    let help = || {
        begun.store(true, Ordering::Release);
        thread::sleep(Duration::from_millis(1));
    };
    pool.install(|| rayon::join(wait, help));
    Some(pool)
}

impl Pair for Threads {
    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        match self {
            Self::One => Sequential.join(a, b),
            Self::Two => WITH_HELPER.with(|pool| match pool {
                // The calling thread is of the pool, so that nothing is sent to it.
                Some(pool) => pool.install(|| rayon::join(a, b)),
                None => rayon::join(a, b),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_pieces_are_done_whoever_calls() {
        let both = || Threads::Two.join(|| 6 * 7, || "b");
        assert_eq!(both(), (42, "b"));
        assert_eq!(both(), (42, "b"));
        assert_eq!(Threads::One.join(|| 6 * 7, || "b"), (42, "b"));
        assert_eq!(thread::spawn(both).join().unwrap(), (42, "b"));
        let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(both), (42, "b"));
    }
}
