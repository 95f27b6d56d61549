//! Load of the machine meanwhile: a tail cannot be judged without it.

use serde::{Deserialize, Serialize};
use std::fs;
use std::time::Instant;

/// The machine and its load while it was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor, as it calls itself.
    pub processor: String,
    /// Load averages over 1, 5 and 15 minutes before.
    pub load_before: Option<[f64; 3]>,
    /// Load averages over the same times afterwards.
    pub load_after: Option<[f64; 3]>,
    /// Share of all cores' time that they were idle.
    pub idle_share: Option<f64>,
    /// Share of all cores' time that the hypervisor gave to others.
    pub steal_share: Option<f64>,
    /// Least difference between two readings of the timer that differ [s].
    pub timer_resolution_s: f64,
    /// Time that a reading of the timer takes [s].
    pub timer_overhead_s: f64,
}

/// Watches the machine from its beginning on.
pub(super) struct Watch {
    load: Option<[f64; 3]>,
    ticks: Option<Ticks>,
}

impl Watch {
    pub(super) fn begin() -> Self {
        Self { load: load(), ticks: ticks() }
    }

    pub(super) fn end(self) -> Machine {
        let ticks = self.ticks.zip(ticks()).map(|(before, after)| after.since(&before));
        let (timer_resolution_s, timer_overhead_s) = timer();
        Machine {
            processor: processor(),
            load_before: self.load,
            load_after: load(),
            idle_share: ticks.map(|ticks| ticks.idle / ticks.all.max(1.0)),
            steal_share: ticks.map(|ticks| ticks.steal / ticks.all.max(1.0)),
            timer_resolution_s,
            timer_overhead_s,
        }
    }
}

fn load() -> Option<[f64; 3]> {
    parse_load(&fs::read_to_string("/proc/loadavg").ok()?)
}

fn parse_load(text: &str) -> Option<[f64; 3]> {
    let mut words = text.split_whitespace().map(|word| word.parse().ok());
    Some([words.next()??, words.next()??, words.next()??])
}

/// Time of all cores since the start of the system, in its ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ticks {
    all: f64,
    idle: f64,
    steal: f64,
}

impl Ticks {
    fn since(&self, before: &Self) -> Self {
        Self {
            all: self.all - before.all,
            idle: self.idle - before.idle,
            steal: self.steal - before.steal,
        }
    }
}

fn ticks() -> Option<Ticks> {
    parse_ticks(&fs::read_to_string("/proc/stat").ok()?)
}

/// The first line: `cpu user nice system idle iowait irq softirq steal guest guest_nice`; guests'
/// time is in the users' already.
fn parse_ticks(text: &str) -> Option<Ticks> {
    let line = text.lines().next()?.strip_prefix("cpu ")?;
    let ticks: Vec<f64> =
        line.split_whitespace().take(8).map(|word| word.parse().ok()).collect::<Option<_>>()?;
    Some(Ticks { all: ticks.iter().sum(), idle: *ticks.get(3)?, steal: *ticks.get(7)? })
}

pub(super) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or("unknown", |(_, name)| name.trim()).into()
}

/// Involuntary context switches of the calling thread so far; zero where nobody counts them.
pub(super) fn switches() -> u64 {
    let text = fs::read_to_string("/proc/thread-self/status").unwrap_or_default();
    parse_switches(&text).unwrap_or(0)
}

fn parse_switches(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("nonvoluntary_ctxt_switches:"));
    line?.trim().parse().ok()
}

/// Resolution and overhead of the timer [s].
fn timer() -> (f64, f64) {
    const READINGS: u32 = 10_000;
    let started = Instant::now();
    let mut last = started;
    let mut resolution = f64::INFINITY;
    for _ in 0..READINGS {
        let now = Instant::now();
        let step = now.duration_since(last).as_secs_f64();
        if step > 0.0 {
            resolution = resolution.min(step);
        }
        last = now;
    }
    let overhead = last.duration_since(started).as_secs_f64() / f64::from(READINGS);
    (if resolution.is_finite() { resolution } else { 0.0 }, overhead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_tells_is_understood() {
        assert_eq!(parse_load("0.03 0.46 1.08 3/88 19532\n"), Some([0.03, 0.46, 1.08]));
        assert_eq!(parse_load("a b"), None);
        let text = "cpu  10 1 5 80 2 0 1 1 0 0\ncpu0 5 0 2 40 1 0 0 0 0 0\n";
        assert_eq!(parse_ticks(text), Some(Ticks { all: 100.0, idle: 80.0, steal: 1.0 }));
        assert_eq!(parse_ticks("cpu  10 1 5\n"), None);
        assert_eq!(parse_ticks(""), None);
        let text = "Name:\tx\nvoluntary_ctxt_switches:\t7\nnonvoluntary_ctxt_switches:\t42\n";
        assert_eq!(parse_switches(text), Some(42));
        assert_eq!(parse_switches(""), None);
    }

    #[test]
    fn the_timer_moves() {
        let (resolution, overhead) = timer();
        assert!(resolution >= 0.0 && overhead > 0.0);
    }
}
