//! Instructions retired, as a clock for the planner: its phase times are then instructions.

use remora_core::advanced::time::Clock;

/// A counter of the instructions that the thread which opened it retires outside the kernel.
pub struct Instructions {
    #[cfg(target_os = "linux")]
    counter: std::sync::Mutex<perf_event::Counter>,
}

#[cfg(target_os = "linux")]
impl Instructions {
    /// Opens and starts the counter.
    ///
    /// # Errors
    /// Why there is none: virtual machines often have none, and systems may forbid it.
    pub fn open() -> Result<Self, String> {
        let mut counter = perf_event::Builder::new().build().map_err(|error| reason(&error))?;
        counter.enable().map_err(|error| reason(&error))?;
        let opened = Self { counter: counter.into() };
        let before = opened.seconds();
        std::hint::black_box((0..1000u64).fold(0, |sum, i| std::hint::black_box(sum ^ i)));
        match opened.seconds() - before {
            counted if counted >= 1000.0 => Ok(opened),
            _ => Err("the counter does not count".into()),
        }
    }
}

/// Why a counter cannot be had.
#[cfg(target_os = "linux")]
fn reason(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound | ErrorKind::Unsupported => "this machine has no such counter".into(),
        ErrorKind::PermissionDenied => {
            "not permitted, see /proc/sys/kernel/perf_event_paranoid".into()
        }
        _ => error.to_string(),
    }
}

#[cfg(not(target_os = "linux"))]
impl Instructions {
    /// # Errors
    /// Always: counters are read on Linux only.
    pub fn open() -> Result<Self, String> {
        Err("counters are read on Linux only".into())
    }
}

impl Clock for Instructions {
    /// Instructions, not seconds; not a number where the counter cannot be read.
    fn seconds(&self) -> f64 {
        #[cfg(target_os = "linux")]
        return self
            .counter
            .lock()
            .ok()
            .and_then(|mut counter| counter.read().ok())
            .map_or(f64::NAN, |count| count as f64);
        #[cfg(not(target_os = "linux"))]
        return f64::NAN;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn reasons_are_for_people() {
        let reason = |code| reason(&std::io::Error::from_raw_os_error(code));
        // ENOENT, EACCES.
        assert_eq!(reason(2), "this machine has no such counter");
        assert!(reason(13).contains("perf_event_paranoid"));
    }

    /// Where there is a counter, more work counts more; where there is none, the reason is told.
    #[test]
    fn counts_or_says_why_not() {
        let work = |counter: &Instructions, n: u64| {
            let before = counter.seconds();
            std::hint::black_box((0..n).fold(0, |sum, i| std::hint::black_box(sum ^ i)));
            counter.seconds() - before
        };
        match Instructions::open() {
            Ok(counter) => {
                let (little, much) = (work(&counter, 1_000), work(&counter, 1_000_000));
                assert!(little >= 1e3 && much >= 1e6 && much > 100.0 * little);
            }
            Err(reason) => assert!(!reason.is_empty()),
        }
    }
}
