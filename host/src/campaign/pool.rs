//! Worker threads.

use super::Campaign;
use crate::error::Error;
use crate::formats::Row;
use crate::planning::{Planner, STACK_BYTES};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;

/// What the workers share.
struct Shared<'a> {
    campaign: &'a Campaign,
    pending: &'a [usize],
    next: AtomicUsize,
    stop: AtomicBool,
}

/// Plans the scenarios whose indices are in `pending`, and hands each row to `finish` on the
/// calling thread as it comes. The first error stops all.
pub(super) fn plan_all(
    campaign: &Campaign,
    pending: &[usize],
    mut finish: impl FnMut(usize, Row) -> Result<(), Error>,
) -> Result<(), Error> {
    let shared =
        Shared { campaign, pending, next: AtomicUsize::new(0), stop: AtomicBool::new(false) };
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        let mut workers = Vec::new();
        let mut outcome = Ok(());
        for number in 0..campaign.jobs.get().min(pending.len()) {
            let (shared, sender) = (&shared, sender.clone());
            let worker = thread::Builder::new()
                .name(format!("planner {number}"))
                .stack_size(STACK_BYTES)
                .spawn_scoped(scope, move || work(shared, &sender));
            match worker {
                Ok(worker) => workers.push(worker),
                Err(cause) => outcome = Err(Error::Thread { reason: cause.to_string() }),
            }
        }
        drop(sender);
        for (index, result) in receiver {
            outcome = outcome.and_then(|()| finish(index, result?));
            if outcome.is_err() {
                shared.stop.store(true, Ordering::Relaxed);
            }
        }
        for worker in workers {
            if worker.join().is_err() {
                let reason = "a planner stopped; its rows are missing".into();
                outcome = outcome.and(Err(Error::Thread { reason }));
            }
        }
        outcome
    })
}

/// One worker: plans, writes the plan file where one is wanted, sends the row.
fn work(shared: &Shared<'_>, sender: &Sender<(usize, Result<Row, Error>)>) {
    let campaign = shared.campaign;
    let mut planner = Planner::new();
    while !shared.stop.load(Ordering::Relaxed) {
        let Some(index) = shared.pending.get(shared.next.fetch_add(1, Ordering::Relaxed)) else {
            return;
        };
        let scenario = &campaign.scenarios[*index];
        let planned = planner.plan(&campaign.mission, scenario, &campaign.method);
        let written = match campaign.save_plans {
            true => planned.file.write(&campaign.plan_path(&scenario.id)),
            false => Ok(()),
        };
        let row = written.map(|()| planned.row());
        if sender.send((*index, row)).is_err() {
            return;
        }
    }
}
