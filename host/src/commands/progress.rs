//! Progress of long work on standard error: a bar on a terminal, a line a tenth elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use remora_host::progress::Progress;
use std::io::{IsTerminal, Write, stderr};
use std::time::Instant;

const TEMPLATE: &str = "{bar:30} {pos}/{len}  {msg}  {per_sec}  {eta} left";

/// Scenarios done, with rate and time left.
#[derive(Default)]
pub(super) struct Bar {
    bar: Option<ProgressBar>,
    started: Option<Instant>,
    total: usize,
    before: usize,
    done: usize,
    unsolved: usize,
}

impl Progress for Bar {
    fn begin(&mut self, total: usize, done: usize) {
        *self =
            Self { started: Some(Instant::now()), total, before: done, done, ..Self::default() };
        if done > 0 {
            let _ = writeln!(stderr(), "resuming: {done} of {total} are there already");
        }
        if stderr().is_terminal() && done < total {
            let bar = ProgressBar::new(total as u64).with_position(done as u64);
            if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
                bar.set_style(style);
            }
            bar.reset_eta();
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

impl Bar {
    fn print(&self) {
        let elapsed = self.started.map_or(0.0, |started| started.elapsed().as_secs_f64());
        let rate = (self.done - self.before) as f64 / elapsed.max(1e-9);
        let left = (self.total - self.done) as f64 / rate;
        let _ = writeln!(
            stderr(),
            "{}/{}  {} not solved  {rate:.1}/s  {left:.0} s left",
            self.done,
            self.total,
            self.unsolved,
        );
    }
}
