//! Progress of a training: a bar on a terminal, a line each half minute elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use remora_cli::cli::progress::{is_shown_live, tell};
use remora_training::Observer;
use remora_training::checkpoint::LossRow;
use remora_training::network::Losses;
use std::time::Instant;

const TEMPLATE: &str = "train  {bar:30} {pos}/{len}  {msg}  {per_sec}  {eta} left";

/// Steps done, with losses and time left.
#[derive(Default)]
pub(super) struct Steps {
    bar: Option<ProgressBar>,
    started: Option<(Instant, u64, f64)>,
    told: Option<Instant>,
    steps: u64,
    loss: f64,
    validation: String,
}

impl Observer for Steps {
    fn begin(&mut self, step: u64, steps: u64, parameters: usize) {
        tell(&format!("{parameters} parameters, step {step} of {steps}"));
        self.steps = steps;
        if is_shown_live() {
            let bar = ProgressBar::new(steps).with_position(step);
            if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
                bar.set_style(style);
            }
            bar.reset_eta();
            self.bar = Some(bar);
        }
    }

    fn step(&mut self, step: u64, losses: Losses, progress: f64) {
        let (started, first, before) =
            *self.started.get_or_insert((Instant::now(), step, progress));
        let keep = if self.loss == 0.0 { 0.0 } else { 0.98 };
        self.loss = keep * self.loss + (1.0 - keep) * losses.action;
        let message = format!("loss {:.5}  {}", self.loss, self.validation);
        match &self.bar {
            Some(bar) => {
                bar.set_position(step);
                bar.set_message(message);
            }
            None if self.told.is_none_or(|told| told.elapsed().as_secs() >= 30) => {
                self.told = Some(Instant::now());
                let elapsed = started.elapsed().as_secs_f64();
                let rate = (step - first) as f64 / elapsed.max(1e-9);
                let left = elapsed * (1.0 - progress) / (progress - before) / 60.0;
                let left = match progress > before {
                    true => format!("  {rate:.2} steps/s  {left:.1} min left"),
                    false => String::new(),
                };
                tell(&format!("{step}/{}  {message}{left}", self.steps));
            }
            None => {}
        }
    }

    fn validated(&mut self, row: &LossRow) {
        self.validation = format!("validation {:.5}", row.validation);
        if let Some(error) = row.rollout {
            self.validation += &format!("  roll-out {:.4} m", error.mean_m);
        }
        self.validation += &format!("  {:.0} nodes/s", row.nodes_per_s);
        self.told = None;
    }
}
