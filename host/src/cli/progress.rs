//! Progress of long work on standard error: a bar on a terminal, a line a tenth elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use remora_host::progress::Progress;
use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const TEMPLATE: &str = "{prefix}  {bar:30} {pos}/{len}  {msg}  {per_sec}  {eta} left";

/// How often a bar is drawn anew while nothing is done.
const TICK: Duration = Duration::from_millis(200);

/// Whether `--quiet` was given.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Shows no progress from now on.
pub fn silence() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Whether progress is shown to somebody at a terminal.
pub fn is_shown_live() -> bool {
    stderr().is_terminal() && !IS_QUIET.load(Ordering::Relaxed)
}

/// A line about progress.
pub fn tell(line: &str) {
    if !IS_QUIET.load(Ordering::Relaxed) {
        let _ = writeln!(stderr(), "{line}");
    }
}

/// Scenarios done, with rate and time left.
pub struct Bar {
    name: &'static str,
    bar: Option<ProgressBar>,
    started: Option<Instant>,
    total: usize,
    before: usize,
    done: usize,
    unsolved: usize,
}

impl Bar {
    /// A bar of the work of this name.
    pub fn named(name: &'static str) -> Self {
        Self { name, bar: None, started: None, total: 0, before: 0, done: 0, unsolved: 0 }
    }

    fn print(&self) {
        let elapsed = self.started.map_or(0.0, |started| started.elapsed().as_secs_f64());
        let rate = (self.done - self.before) as f64 / elapsed.max(1e-9);
        let left = (self.total - self.done) as f64 / rate;
        let Self { name, done, total, unsolved, .. } = self;
        tell(&format!(
            "{name}  {done}/{total}  {unsolved} not solved  {rate:.1}/s  {left:.0} s left"
        ));
    }
}

impl Progress for Bar {
    fn begin(&mut self, total: usize, done: usize) {
        *self = Self {
            started: Some(Instant::now()),
            total,
            before: done,
            done,
            ..Self::named(self.name)
        };
        if done > 0 {
            tell(&format!("resuming: {done} of {total} are there already"));
        }
        if is_shown_live() && done < total {
            let bar = ProgressBar::new(total as u64).with_position(done as u64);
            if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
                bar.set_style(style);
            }
            bar.set_prefix(self.name);
            bar.reset_eta();
            bar.enable_steady_tick(TICK);
            self.bar = Some(bar);
        }
    }

    fn done(&mut self, is_solved: bool) {
        let tenth = |done: usize| done * 10 / self.total.max(1);
        let line = tenth(self.done) != tenth(self.done + 1);
        self.done += 1;
        self.unsolved += usize::from(!is_solved);
        match &self.bar {
            Some(bar) => {
                bar.set_message(format!("{} not solved", self.unsolved));
                bar.inc(1);
            }
            None if line => self.print(),
            None => {}
        }
    }

    fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish();
        }
    }
}
