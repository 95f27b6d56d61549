//! Wall and processor time side by side: whether a machine was busy with something else.

use std::time::Instant;

/// A thread's processor time below this share of the wall time tells of other work on the machine.
const BUSY_BELOW: f64 = 0.8;
/// Shorter work says nothing [s]: the system counts processor time in steps.
const SHORTEST: f64 = 5e-3;

/// Measures work of the calling thread.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    wall: Instant,
    cpu_s: Option<f64>,
}

/// Time that some work of a thread took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spent {
    /// Wall time [s].
    pub wall_s: f64,
    /// Processor time of the thread [s]; none where the system does not tell.
    pub cpu_s: Option<f64>,
}

impl Stopwatch {
    /// Starts to measure.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu_s: thread_s() }
    }

    /// Time since the start, wall and processor, of the thread that started.
    pub fn spent(&self) -> Spent {
        let cpu_s = thread_s().zip(self.cpu_s).map(|(now, then)| (now - then).max(0.0));
        Spent { wall_s: self.wall.elapsed().as_secs_f64(), cpu_s }
    }
}

impl Spent {
    /// The thread's share of a processor, where that says that the machine was busy.
    pub fn busy_share(&self) -> Option<f64> {
        busy_share(self.wall_s, self.cpu_s?)
    }
}

/// The share of a processor that a thread had, where that says that the machine was busy.
pub fn busy_share(wall_s: f64, cpu_s: f64) -> Option<f64> {
    let share = cpu_s / wall_s;
    (wall_s >= SHORTEST && share < BUSY_BELOW).then_some(share)
}

/// Processor time of the calling thread since it began [s].
#[cfg(unix)]
fn thread_s() -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

/// Processor time of the calling thread: not told here.
#[cfg(not(unix))]
fn thread_s() -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_takes_time_but_no_processor() {
        let watch = Stopwatch::start();
        std::thread::sleep(std::time::Duration::from_millis(60));
        let spent = watch.spent();
        assert!(spent.wall_s >= 0.06, "{spent:?}");
        if let Some(cpu_s) = spent.cpu_s {
            assert!(cpu_s < 0.03, "{spent:?}");
            assert!(spent.busy_share().is_some(), "{spent:?}");
        }
    }

    #[test]
    fn only_long_work_with_little_processor_tells_of_a_busy_machine() {
        assert_eq!(busy_share(0.5, 0.125), Some(0.25));
        assert_eq!(busy_share(0.1, 0.095), None);
        assert_eq!(busy_share(1e-3, 1e-4), None);
        assert_eq!(busy_share(0.0, 0.0), None);
    }
}
