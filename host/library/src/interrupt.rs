//! Request to end the program. The listener for the system's signals stores it here; long work
//! looks, keeps its finished parts and ends.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

static ASKED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Where the number of a signal is to be stored.
pub fn flag() -> Arc<AtomicUsize> {
    ASKED.get_or_init(Arc::default).clone()
}

/// The signal that asked the program to end, if one did.
pub fn signal() -> Option<u8> {
    let number = ASKED.get()?.load(Ordering::Relaxed);
    u8::try_from(number).ok().filter(|number| *number > 0)
}
