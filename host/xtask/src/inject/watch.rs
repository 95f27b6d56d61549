//! Cases of the workers and their starts. Time is counted in looks of the watchdog, not by a clock: time while the
//! whole program is stopped does not count.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How often the watchdog looks.
const PERIOD: Duration = Duration::from_millis(200);

/// Cases that the workers are at. Watching them never holds up a worker.
pub(super) struct Watch {
    /// Cases, each with the look at which it began.
    slots: Vec<Mutex<Option<(u64, u32)>>>,
    /// Looks of the watchdog so far.
    looks: AtomicU32,
    ended: Mutex<bool>,
    end: Condvar,
}

/// A panic while a lock is held leaves what it guards as it is, which is sound here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watch {
    /// Watch of so many workers.
    pub fn new(workers: usize) -> Self {
        let slots = (0..workers).map(|_| Mutex::new(None)).collect();
        Self { slots, looks: AtomicU32::new(0), ended: Mutex::new(false), end: Condvar::new() }
    }

    /// A worker begins a case.
    pub fn begin(&self, worker: usize, case: u64) {
        if let Some(slot) = self.slots.get(worker) {
            *lock(slot) = Some((case, self.looks.load(Ordering::Relaxed)));
        }
    }

    /// Ends a worker's case.
    pub fn done(&self, worker: usize) {
        if let Some(slot) = self.slots.get(worker) {
            *lock(slot) = None;
        }
    }

    /// A case that has been under way for longer than `limit`.
    pub fn overdue(&self, limit: Duration) -> Option<u64> {
        let looks = self.looks.load(Ordering::Relaxed);
        let cases = self.slots.iter().filter_map(|slot| *lock(slot));
        let is_late = |since: u32| PERIOD.saturating_mul(looks.wrapping_sub(since)) > limit;
        cases.filter(|(_, since)| is_late(*since)).map(|(case, _)| case).min()
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
            self.looks.fetch_add(1, Ordering::Relaxed);
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
        // Workers beyond the last have no case.
        watch.begin(2, 8);
        watch.looks.fetch_add(9, Ordering::Relaxed);
        assert_eq!(watch.overdue(limit), None);
        watch.done(2);
    }

    /// A program that is stopped, as by SIGSTOP, finds no case overdue: the clock's time does not count.
    #[test]
    fn a_case_does_not_hang_while_the_program_is_stopped() {
        let watch = Watch::new(1);
        watch.begin(0, 3);
        let limit = 5 * PERIOD;
        // One look is one period, however long the watchdog slept.
        std::thread::sleep(6 * PERIOD);
        watch.looks.fetch_add(1, Ordering::Relaxed);
        assert_eq!(watch.overdue(limit), None);
        watch.looks.fetch_add(5, Ordering::Relaxed);
        assert_eq!(watch.overdue(limit), Some(3));
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
