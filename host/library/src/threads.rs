//! The second core of a desktop.

use crate::choice::choices;
use crate::memory::STACK_BYTES;
use rayon::{ThreadPool, ThreadPoolBuilder};
use remora_core::advanced::executor::{ForkJoin, Sequential};
use std::hint;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

choices! {
    /// How many threads work on one plan. The plan's bits are the same either way.
    ///
    /// The second starts at the first use on each calling thread and is kept until that ends. Handing work over
    /// then allocates nothing and takes a microsecond: after work the helper stays awake for some milliseconds,
    /// and so keeps its core busy all through a plan.
    #[derive(Default)]
    pub enum Threads {
        /// Plan on one thread.
        One = "1" default,
        /// Share each linearisation between two threads.
        Two = "2",
    }
}

thread_local! {
    /// The calling thread with a helper; none where the thread belongs to another pool.
    static WITH_HELPER: Option<HelperThread> = HelperThread::new();
}

/// The longest that a helper is waited for when it is started.
const PATIENCE: Duration = Duration::from_millis(50);

/// How long a helper without work stays awake: longer than a plan goes on between two pieces of
/// work that are handed over. To wake a thread takes a kernel as long as small pieces take.
const AWAKE: Duration = Duration::from_millis(10);

/// How long the calling thread waits for the other piece before it goes to sleep over it.
const WATCHFUL: Duration = Duration::from_millis(1);

/// Looks for work between two readings of the clock.
const LOOKS: u32 = 100;

/// The calling thread with a helper.
struct HelperThread {
    pool: ThreadPool,
    state: Arc<State>,
}

/// State that the two threads share.
#[derive(Default)]
struct State {
    /// Grows with each piece of work.
    uses: AtomicUsize,
    is_asleep: AtomicBool,
    is_over: AtomicBool,
    helper: OnceLock<Thread>,
}

impl HelperThread {
    /// Starts a helper. Both threads have then handed work over, and looked for the other's: the first
    /// time they do, they allocate. That the calling one looks is not left to chance: where it waits
    /// for the helper it mostly finds the work done.
    fn new() -> Option<Self> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(2)
            .use_current_thread()
            .stack_size(STACK_BYTES)
            .build()
            .ok()?;
        // Before there is any work, which it would take.
        pool.install(rayon::yield_now);
        let state = Arc::new(State::default());
        // On a single core a thread that stays awake is in the way.
        if thread::available_parallelism().is_ok_and(|cores| cores > NonZeroUsize::MIN) {
            let shared = Arc::clone(&state);
            pool.spawn(move || shared.stay());
        }
        let helped = Self { pool, state };
        helped.on_helper(|| thread::sleep(Duration::from_millis(1)));
        Some(helped)
    }

    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        self.state.wake();
        let (begun, done) = (AtomicBool::new(false), AtomicBool::new(false));
        let first = || {
            let result = a();
            // Begun work is nearly done: to sleep over it would take longer.
            wait_while(WATCHFUL, || begun.load(Ordering::Acquire) && !done.load(Ordering::Acquire));
            result
        };
        let second = || {
            begun.store(true, Ordering::Release);
            let result = b();
            done.store(true, Ordering::Release);
            result
        };
        // The calling thread is of the pool, so that nothing is sent to it.
        self.pool.install(|| rayon::join(first, second))
    }

    /// Runs `work` on the helper; `None` where that does not come to it in time.
    fn on_helper<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Option<T> {
        let caller = thread::current().id();
        let begun = AtomicBool::new(false);
        let wait = || wait_while(PATIENCE, || !begun.load(Ordering::Acquire));
        let help = || {
            begun.store(true, Ordering::Release);
            (thread::current().id() != caller).then(work)
        };
        self.join(wait, help).1
    }
}

impl Drop for HelperThread {
    fn drop(&mut self) {
        self.state.is_over.store(true, Ordering::SeqCst);
        self.state.wake();
    }
}

impl State {
    /// The helper's life: it takes what work there is, and sleeps once there has been none for a
    /// while.
    fn stay(&self) {
        let _ = self.helper.set(thread::current());
        let mut seen = self.uses.load(Ordering::SeqCst);
        while !self.is_over.load(Ordering::SeqCst) {
            let is_used = || self.uses.load(Ordering::SeqCst) != seen;
            wait_while(AWAKE, || {
                rayon::yield_now();
                !is_used()
            });
            self.is_asleep.store(true, Ordering::SeqCst);
            if !is_used() {
                thread::park();
            }
            self.is_asleep.store(false, Ordering::SeqCst);
            seen = self.uses.load(Ordering::SeqCst);
        }
    }

    /// Tells the helper that there will be work.
    fn wake(&self) {
        self.uses.fetch_add(1, Ordering::SeqCst);
        if self.is_asleep.load(Ordering::SeqCst)
            && let Some(helper) = self.helper.get()
        {
            helper.unpark();
        }
    }
}

/// Waits awake while `condition` holds, so long at most.
fn wait_while(most: Duration, condition: impl Fn() -> bool) {
    let started = Instant::now();
    let mut looks = 0;
    while condition() {
        looks += 1;
        if looks < LOOKS {
            hint::spin_loop();
            continue;
        }
        looks = 0;
        if started.elapsed() > most {
            return;
        }
        // Another program may want the core, or this one's other thread.
        thread::yield_now();
    }
}

impl ForkJoin for Threads {
    fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        match self {
            Self::One => Sequential.join(a, b),
            Self::Two => WITH_HELPER.with(|helped| match helped {
                Some(helped) => helped.join(a, b),
                None => rayon::join(a, b),
            }),
        }
    }
}

impl Threads {
    /// Wakes the helper, where there is one: work will come within some milliseconds.
    pub fn prepare(&self) {
        if *self == Self::Two {
            WITH_HELPER.with(|helped| helped.iter().for_each(|helped| helped.state.wake()));
        }
    }
}

/// Runs `work` on the calling thread's helper, which is started where there is none; `None` where
/// there can be none.
pub fn on_helper<T: Send>(work: impl FnOnce() -> T + Send) -> Option<T> {
    WITH_HELPER.with(|helped| helped.as_ref()?.on_helper(work))
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

    #[test]
    fn a_helper_that_has_gone_to_sleep_comes_back() {
        let caller = thread::current().id();
        for _ in 0..3 {
            thread::sleep(2 * AWAKE);
            assert_eq!(Threads::Two.join(|| 1, || 2), (1, 2));
        }
        let helper = (0..100).find_map(|_| on_helper(|| thread::current().id()));
        assert!(helper.is_some_and(|helper| helper != caller));
    }
}
