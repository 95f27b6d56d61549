//! Worker threads that plan.

use crate::error::Error;
use crate::interrupt;
use crate::memory::STACK_BYTES;
use crate::planning::Planner;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;

/// State that the workers share.
struct Workload<'a, I, M, F> {
    pending: &'a [I],
    make: M,
    plan: F,
    next: AtomicUsize,
    stop: AtomicBool,
}

/// Calls `plan` for each of `pending` on so many threads, each with a planner of its own, and
/// hands every result to `finish` on the calling thread as it comes. The first error stops all; so does
/// a signal that asks the program to end ([`interrupt`]), once what is being planned is finished.
pub fn plan_all<I: Copy + Send + Sync, T: Send>(
    jobs: NonZeroUsize,
    pending: &[I],
    plan: impl Fn(&mut Planner, I) -> Result<T, Error> + Sync,
    finish: impl FnMut(I, T) -> Result<(), Error>,
) -> Result<(), Error> {
    plan_all_with(jobs, pending, |_| Planner::new(), plan, finish)
}

/// Does the work of [`plan_all`] with other planners. `make` gets the worker's number, below
/// `jobs`, and runs on its thread.
pub fn plan_all_with<I: Copy + Send + Sync, T: Send, W>(
    jobs: NonZeroUsize,
    pending: &[I],
    make: impl Fn(usize) -> W + Sync,
    plan: impl Fn(&mut W, I) -> Result<T, Error> + Sync,
    mut finish: impl FnMut(I, T) -> Result<(), Error>,
) -> Result<(), Error> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let shared = Workload { pending, make, plan, next, stop };
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        let mut workers = Vec::new();
        let mut outcome = Ok(());
        for number in 0..jobs.get().min(pending.len()) {
            let (shared, sender) = (&shared, sender.clone());
            let worker = thread::Builder::new()
                .name(format!("planner {number}"))
                .stack_size(STACK_BYTES)
                .spawn_scoped(scope, move || work(shared, number, &sender));
            match worker {
                Ok(worker) => workers.push(worker),
                Err(cause) => outcome = Err(Error::Thread { reason: cause.to_string() }),
            }
        }
        drop(sender);
        let mut finished = 0;
        for (item, result) in receiver {
            finished += 1;
            outcome = outcome.and_then(|()| finish(item, result?));
            if outcome.is_err() {
                shared.stop.store(true, Ordering::Relaxed);
            }
        }
        if let Some(signal) = interrupt::signal().filter(|_| finished < pending.len()) {
            outcome = outcome.and(Err(Error::Interrupted { signal }));
        }
        for worker in workers {
            if worker.join().is_err() {
                let reason = "a planner stopped; its results are missing".into();
                outcome = outcome.and(Err(Error::Thread { reason }));
            }
        }
        outcome
    })
}

/// One worker: takes the next item, plans, sends what came of it.
fn work<I: Copy, T, W>(
    shared: &Workload<'_, I, impl Fn(usize) -> W, impl Fn(&mut W, I) -> Result<T, Error>>,
    number: usize,
    sender: &Sender<(I, Result<T, Error>)>,
) {
    let mut planner = (shared.make)(number);
    while !shared.stop.load(Ordering::Relaxed) && interrupt::signal().is_none() {
        let Some(item) = shared.pending.get(shared.next.fetch_add(1, Ordering::Relaxed)) else {
            return;
        };
        if sender.send((*item, (shared.plan)(&mut planner, *item))).is_err() {
            return;
        }
    }
}
