//! Long work on a thread with a large stack, without the interpreter's lock. The caller looks for signals
//! meanwhile, so that Ctrl-C is answered within a second.

use crate::raised::{Failure, raised};
use pyo3::prelude::*;
use remora_core::advanced::time::Clock;
use remora_host::error::Error;
use remora_host::memory::STACK_BYTES;
use remora_host::stoppable::Stoppable;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// Time between looks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Time for stopped work to end. After that it is left alone, and ends at its next check.
const PATIENCE: Duration = Duration::from_millis(400);

/// A function of Python, to be called on the caller's thread. An exception ends the work.
type Call = Box<dyn FnOnce(Python<'_>) -> Option<PyErr> + Send>;

/// The waiting caller, as the work sees it.
#[derive(Clone)]
pub(crate) struct Caller {
    stop: Arc<AtomicBool>,
    calls: Sender<Call>,
}

impl Caller {
    /// An error once the work is to stop.
    pub(crate) fn go_on(&self) -> Result<(), Failure> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(nobody()),
            false => Ok(()),
        }
    }

    /// Stops the work, on all its threads.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether the work is to stop.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.stop
    }

    /// A clock that ends planning once the work is to stop.
    pub(crate) fn clock(&self) -> Stoppable<Arc<AtomicBool>> {
        Stoppable::new(self.stop.clone())
    }

    /// The clock in a form that threads share.
    pub(crate) fn shared_clock(&self) -> Arc<dyn Clock + Send> {
        Arc::new(self.clock())
    }

    /// Has the caller's thread call a function of Python, so that signals interrupt it.
    pub(crate) fn call<T: Send + 'static>(
        &self,
        call: impl FnOnce(Python<'_>) -> PyResult<T> + Send + 'static,
    ) -> Result<T, Failure> {
        let (sender, receiver) = mpsc::channel();
        let call: Call = Box::new(move |py| {
            // The receiver is gone if the work was stopped.
            call(py).map(|answer| drop(sender.send(answer))).err()
        });
        self.calls.send(call).map_err(|_| nobody())?;
        receiver.recv().map_err(|_| nobody())
    }
}

fn nobody() -> Failure {
    Error::Thread { reason: "was stopped".into() }.into()
}

/// Does long work. Raises the exceptions of signals and calls.
pub(crate) fn waited<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Caller) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let found = Arc::new(Mutex::new(None));
    let answer = found.clone();
    let keep = move |caller: &Caller| {
        let done = work(caller)?;
        *answer.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(done);
        Ok::<(), Failure>(())
    };
    run(py, Box::new(keep))?;
    let mut found = found.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    found.take().ok_or_else(|| nobody().into())
}

/// Work that stores its answer, so that this code is compiled once for all types of answers.
type Work = Box<dyn FnOnce(&Caller) -> Result<(), Failure> + Send>;

fn run(py: Python<'_>, work: Work) -> PyResult<()> {
    let (calls, called) = mpsc::channel();
    let stop = Arc::new(AtomicBool::new(false));
    let caller = Caller { stop: stop.clone(), calls };
    let worker = Builder::new()
        .stack_size(STACK_BYTES)
        .spawn(move || work(&caller))
        .map_err(|cause| raised(Error::Thread { reason: cause.to_string() }))?;
    py.detach(move || match attend(&called, &worker, &stop) {
        Some(error) => Err(error),
        None => {
            let broken = |_| raised(Error::Thread { reason: "the planner stopped".into() });
            Ok(worker.join().map_err(broken)??)
        }
    })
}

/// Makes the work's calls until it ends. Returns the exception of a call or a signal.
fn attend(
    called: &Receiver<Call>,
    worker: &JoinHandle<Result<(), Failure>>,
    stop: &AtomicBool,
) -> Option<PyErr> {
    let mut looked = Instant::now();
    let error = loop {
        match called.recv_timeout(LOOK.saturating_sub(looked.elapsed())) {
            Ok(call) => {
                if let Some(error) = Python::attach(call) {
                    break error;
                }
            }
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if looked.elapsed() >= LOOK {
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                break error;
            }
            looked = Instant::now();
        }
    };
    stop.store(true, Ordering::Relaxed);
    let stopped = Instant::now();
    while !worker.is_finished() && stopped.elapsed() < PATIENCE {
        // Calls are dropped: the work that asks learns that the caller has left.
        let _ = called.recv_timeout(Duration::from_millis(5));
    }
    Some(error)
}
