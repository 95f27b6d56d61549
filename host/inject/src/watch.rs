//! Who is at which case, and since when.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How often the watchdog looks.
const PERIOD: Duration = Duration::from_millis(200);

/// What the workers are at. None of it ever holds up a worker.
pub(super) struct Watch {
    slots: Vec<Mutex<Option<(u64, Instant)>>>,
    ended: Mutex<bool>,
    end: Condvar,
}

/// A panic while a lock is held leaves what it guards as it is, which is sound here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watch {
    /// For so many workers.
    pub fn new(workers: usize) -> Self {
        let slots = (0..workers).map(|_| Mutex::new(None)).collect();
        Self { slots, ended: Mutex::new(false), end: Condvar::new() }
    }

    /// A worker begins a case.
    pub fn begin(&self, worker: usize, case: u64) {
        if let Some(slot) = self.slots.get(worker) {
            *lock(slot) = Some((case, Instant::now()));
        }
    }

    /// A worker is done with its case; how long it took.
    pub fn done(&self, worker: usize) -> Duration {
        let case = self.slots.get(worker).and_then(|slot| lock(slot).take());
        case.map_or(Duration::ZERO, |(_, since)| since.elapsed())
    }

    /// A case that has been under way for longer than `limit`.
    pub fn overdue(&self, limit: Duration) -> Option<u64> {
        let cases = self.slots.iter().filter_map(|slot| *lock(slot));
        cases.filter(|(_, since)| since.elapsed() > limit).map(|(case, _)| case).min()
    }

    /// All work is done: the watchdog goes home.
    pub fn end(&self) {
        *lock(&self.ended) = true;
        self.end.notify_all();
    }

    /// The watchdog: tells `alarm` of the first case that takes longer than `limit`, then ends; or
    /// ends with the work.
    pub fn guard(&self, limit: Duration, alarm: &dyn Fn(u64)) {
        let mut ended = lock(&self.ended);
        while !*ended {
            if let Some(case) = self.overdue(limit) {
                return alarm(case);
            }
            let waited = self.end.wait_timeout(ended, PERIOD);
            ended = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_case_that_does_not_end_is_reported() {
        let watch = Watch::new(2);
        let limit = Duration::ZERO;
        let reported = Cell::new(None);
        watch.begin(1, 7);
        watch.guard(limit, &|case| reported.set(Some(case)));
        assert_eq!(reported.get(), Some(7));
        // Not before its time, and not once it is done.
        assert_eq!(watch.overdue(Duration::from_secs(1 << 40)), None);
        watch.done(1);
        assert_eq!(watch.overdue(limit), None);
        // Beyond the workers there is nobody.
        watch.begin(2, 8);
        assert_eq!((watch.overdue(limit), watch.done(2)), (None, Duration::ZERO));
    }

    #[test]
    fn the_watchdog_ends_with_the_work() {
        let watch = Watch::new(1);
        watch.begin(0, 1);
        std::thread::scope(|scope| {
            scope.spawn(|| watch.guard(Duration::MAX, &|case| panic!("case {case}")));
            watch.done(0);
            watch.end();
        });
    }
}
