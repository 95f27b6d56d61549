//! Notes on inputs that were changed on reading. The program shows them.

use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock, PoisonError};

static SHOW: OnceLock<fn(&str)> = OnceLock::new();
static SHOWN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Shows notes by `show`, from the first call on. Without it they are dropped.
pub fn show_by(show: fn(&str)) {
    let _ = SHOW.set(show);
}

/// Shows a note on a field, once for each key: a set has thousands of scenarios.
pub(crate) fn note(field: &str, text: &str) {
    let Some(show) = SHOW.get() else { return };
    let key: String = field.chars().filter(|c| !c.is_ascii_digit()).collect();
    if SHOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key) {
        show(&format!("{field}: {text}"));
    }
}
