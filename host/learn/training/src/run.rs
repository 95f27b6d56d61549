//! The training loop.

use crate::checkpoint::{self, Checkpoint, LossRow};
use crate::config::{Config, Encoding};
use crate::fitted;
use crate::kernels::Kernels;
use crate::model::{self, Origin};
use crate::network::{Losses, Network};
use crate::optimiser::{AdamW, clip};
use crate::output::{self, Outcome};
use crate::params::Table;
use crate::rollout::RolloutError;
use crate::source::{Batch, Batches, ExampleSource, Split, Statistics};
use remora_core::advanced::nn::MAGIC;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, ModelFile, read_bytes, write_atomically};
use remora_host::lineage::Lineage;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Observer of a training while it runs.
pub trait Observer {
    /// It begins, or goes on, at a step of so many.
    fn begin(&mut self, step: u64, steps: u64, parameters: usize);
    /// A step was made: with its losses, and how far the schedule is, from 0 to 1.
    fn step(&mut self, step: u64, losses: Losses, progress: f64);
    /// A validation was made.
    fn validated(&mut self, row: &LossRow);
}

/// Measures a model by rolling it out.
pub type Rollout<'a> = &'a dyn Fn(&[u8]) -> Option<RolloutError>;

/// A training.
pub struct Run<'a> {
    /// Configuration of the training.
    pub config: Config,
    /// Source of the examples.
    pub source: &'a dyn ExampleSource,
    /// Origin of the examples; a parent's datasets are added to it.
    pub origin: Origin,
    /// Where results go.
    pub out: PathBuf,
    /// Whether to go on where a checkpoint in `out` stopped.
    pub resume: bool,
    /// Ends early after so many steps of this call, as a kill would.
    pub stop_after: Option<u64>,
    /// How a model is rolled out.
    pub rollout: Rollout<'a>,
}

/// A training in motion.
struct Running<'a, B: Kernels> {
    run: &'a Run<'a>,
    table: &'a Table,
    network: Network<'a, B>,
    batches: Batches<'a>,
    state: Checkpoint,
    started: Instant,
    before_s: f64,
    last_row: (u64, f64),
}

impl Run<'_> {
    /// Trains on a device.
    ///
    /// # Errors
    /// Data, checkpoint or output that cannot be used.
    pub fn train<B: Kernels>(
        &self,
        device: B::Device,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        for split in [Split::Training, Split::Validation] {
            if self.source.is_empty(split) {
                let reason = format!("no trajectory in the {split:?} split");
                return Err(Error::input(&self.config.data.path, "", reason));
            }
        }
        let table = Table::new(&self.config, self.source.shape());
        if model::header(&self.config, &table, &self.origin, 0).dimensions().is_err() {
            let reason = "a model file has no room for a network of these sizes and this arm";
            return Err(Error::input(&self.out, "model", reason));
        }
        output::prepare(&self.out, &self.config)?;
        let state = self.start(&table)?;
        let statistics = state.statistics.clone();
        let training = &self.config.training;
        let running = Running::<B> {
            run: self,
            table: &table,
            network: Network::new(&table, device, self.config.model.dropout, training.state_loss),
            batches: Batches {
                source: self.source,
                statistics: &statistics,
                table: &table,
                seed: training.seed,
            },
            started: Instant::now(),
            before_s: state.elapsed_s,
            last_row: (state.optimiser.step, state.elapsed_s),
            state,
        };
        let (checkpoint, complete) = running.go(observer)?;
        Ok(Outcome { checkpoint, table, complete })
    }

    /// The state to start from: an interrupted training's, another training's parameters, or new.
    fn start(&self, table: &Table) -> Result<Checkpoint, Error> {
        let (digest, shape) = (self.config.digest(), shape_text(table));
        let file = self.out.join(checkpoint::FILE);
        if self.resume && file.exists() {
            let found = Checkpoint::read(&file)?;
            if found.digest != digest || found.shape != shape {
                return Err(Error::input(&file, "", "belongs to another configuration"));
            }
            return Ok(found);
        }
        if !self.resume && file.exists() {
            let reason = "there is a training already: --resume, or another --out";
            return Err(Error::input(&file, "", reason));
        }
        let new = Checkpoint {
            digest,
            shape,
            origin: self.origin(),
            statistics: Statistics::default(),
            elapsed_s: 0.0,
            rows: Vec::new(),
            sums: [0.0; 4],
            parameters: Vec::new(),
            optimiser: AdamW::new(table.len()),
        };
        let seed = self.config.training.seed;
        match &self.config.training.init_from {
            Some(path) => self.start_from(&checkpoint::locate(path), table, new),
            None => Ok(Checkpoint {
                statistics: Statistics::of(self.source, seed)?,
                parameters: table.start(seed),
                ..new
            }),
        }
    }

    /// Where what is learnt comes from, with the size of a step.
    fn origin(&self) -> Origin {
        let training = &self.config.training;
        let batch = (training.batch * training.accumulation) as u64;
        Origin { batch: Some(batch), ..self.origin.clone() }
    }

    /// The state to start from, with the parameters and statistics of a checkpoint or model file.
    fn start_from(&self, file: &Path, table: &Table, new: Checkpoint) -> Result<Checkpoint, Error> {
        let bytes = read_bytes(file, Limit::BINARY)?;
        let refused = |error: FieldError| error.at(file);
        let more = self.config.training.parent_learnt_from.as_deref().unwrap_or_default();
        let origin =
            |parent, learnt: &str| self.origin().from(parent, &[learnt, more]).map_err(refused);
        if !bytes.starts_with(&MAGIC) {
            let found = Checkpoint::read(file)?;
            if found.shape != new.shape {
                return Err(Error::input(file, "", "is of a network of another shape"));
            }
            let folder = name(file.parent().unwrap_or(file));
            let before = found.origin.lineage(folder.clone(), found.optimiser.step);
            let parent = format!("{} {folder}", found.digest);
            let origin = origin(parent, &found.origin.dataset)?.after(before);
            let Checkpoint { statistics, parameters, .. } = found;
            return Ok(Checkpoint { origin, statistics, parameters, ..new });
        }
        let found = ModelFile::parse(&bytes).map_err(refused)?;
        let wider = match self.config.model.encoding {
            Encoding::Servicer => fitted::for_servicers(&found).map_err(refused)?,
            _ => None,
        };
        // A model knows no means of numbers that it has not seen.
        let is_new = wider.is_some();
        let model = wider.unwrap_or(found);
        let seed = self.config.training.seed;
        let own = Statistics::of(self.source, seed)?;
        let (mut statistics, mut parameters) = (own.clone(), table.start(seed));
        model::take_over(&model, &self.config, table, &mut statistics, &mut parameters)
            .map_err(refused)?;
        if self.config.training.own_statistics || is_new {
            statistics = own;
        }
        let checksum = bytes.last_chunk().map_or(0, |last| u32::from_le_bytes(*last));
        let parent = format!("{checksum:08x} {}", name(file));
        let before = Lineage::beside(file, checksum, &model.header().provenance)?;
        let origin = origin(parent, &model.header().provenance.dataset)?.after(before);
        Ok(Checkpoint { origin, statistics, parameters, ..new })
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn shape_text(table: &Table) -> String {
    let line = |e: &crate::params::Entry| format!("{} {}x{}\n", e.name, e.rows, e.columns);
    format!("{:?}\n", table.token_types) + &table.entries.iter().map(line).collect::<String>()
}

/// Batches made ahead of their use.
const AHEAD: usize = 2;

impl<B: Kernels> Running<'_, B> {
    fn go(mut self, observer: &mut dyn Observer) -> Result<(Checkpoint, bool), Error> {
        let training = &self.run.config.training;
        let (size, accumulation) = (training.batch, training.accumulation as u64);
        let first = self.state.optimiser.step * accumulation;
        observer.begin(self.state.optimiser.step, training.steps, self.table.len());
        let (sender, receiver) = mpsc::sync_channel(AHEAD);
        let batches = Batches { ..self.batches };
        std::thread::scope(|scope| {
            scope.spawn(move || {
                let mut epoch = (0, Vec::new());
                for index in first.. {
                    let batch = batches.training(index, size, &mut epoch);
                    // Sending fails where the training has ended.
                    if sender.send(batch).is_err() {
                        break;
                    }
                }
            });
            let complete = self.steps(&receiver, observer);
            drop(receiver);
            complete.map(|complete| (self.state, complete))
        })
    }

    /// Steps until the schedule ends; whether it did.
    fn steps(
        &mut self,
        batches: &mpsc::Receiver<Result<Batch, Error>>,
        observer: &mut dyn Observer,
    ) -> Result<bool, Error> {
        let training = &self.run.config.training;
        let mut saved = Instant::now();
        let mut gradient = vec![0.0; self.table.len()];
        let last = self.run.stop_after.map(|count| self.state.optimiser.step + count);
        let mut progress = self.progress();
        while progress < 1.0 {
            if last.is_some_and(|last| self.state.optimiser.step >= last) {
                self.save()?;
                return Ok(false);
            }
            let losses = self.step(batches, progress, &mut gradient)?;
            let step = self.state.optimiser.step;
            progress = self.progress();
            observer.step(step, losses, progress);
            if step.is_multiple_of(training.validate_every) || progress >= 1.0 {
                observer.validated(&self.validate(progress)?);
            }
            let interval = Duration::from_secs_f64(60.0 * training.checkpoint_minutes);
            if saved.elapsed() >= interval {
                self.save()?;
                saved = Instant::now();
            }
        }
        self.save()?;
        self.write_model()?;
        Ok(true)
    }

    fn elapsed(&self) -> f64 {
        self.before_s + self.started.elapsed().as_secs_f64()
    }

    /// How far the schedule is, from 0 to 1: by steps, or by the clock where it is asked to be.
    fn progress(&self) -> f64 {
        let training = &self.run.config.training;
        let done = self.state.optimiser.step as f64;
        let steps = done / training.steps as f64;
        let least = training.least_steps.map_or(f64::INFINITY, |least| done / least as f64);
        let clock = |minutes: f64| (self.elapsed() / (60.0 * minutes)).min(least);
        training.minutes.map_or(steps, |minutes| steps.max(clock(minutes)))
    }

    fn step(
        &mut self,
        batches: &mpsc::Receiver<Result<Batch, Error>>,
        progress: f64,
        gradient: &mut [f32],
    ) -> Result<Losses, Error> {
        let training = &self.run.config.training;
        gradient.fill(0.0);
        let mut losses = Losses::default();
        let share = 1.0 / training.accumulation as f64;
        for _ in 0..training.accumulation {
            let ended = |_| Error::Thread { reason: "the batches ended".into() };
            let batch = batches.recv().map_err(ended)??;
            let found =
                self.network.gradient(&self.state.parameters, &batch, share as f32, gradient);
            losses.action += share * found.action;
            losses.state += share * found.state;
        }
        let norm = clip(gradient, training.clip_norm);
        if !norm.is_finite() {
            return Err(Error::Thread { reason: "the gradient is not finite".into() });
        }
        let rate = training.rate(self.state.optimiser.step, progress);
        let state = &mut self.state;
        let parameters = &mut state.parameters;
        state.optimiser.update(self.table, parameters, gradient, rate, training.weight_decay);
        for (sum, value) in state.sums.iter_mut().zip([losses.action, losses.state, norm, 1.0]) {
            *sum += value;
        }
        Ok(losses)
    }

    /// Validates, writes the model and the report.
    fn validate(&mut self, progress: f64) -> Result<LossRow, Error> {
        let training = &self.run.config.training;
        let available = self.run.source.len(Split::Validation);
        let count = training.validation_count.min(available);
        let mut sum = Losses::default();
        let mut from = 0;
        while from < count {
            let size = training.batch.min(count - from);
            let batch = self.batches.validation(from, size)?;
            let found = self.network.losses(&self.state.parameters, &batch);
            sum.action += found.action * size as f64 / count as f64;
            sum.state += found.state * size as f64 / count as f64;
            from += size;
        }
        let model = self.write_model()?;
        let state = &mut self.state;
        let [train, train_state, norm, steps] = state.sums;
        let elapsed = self.before_s + self.started.elapsed().as_secs_f64();
        let step = state.optimiser.step;
        let nodes = (step - self.last_row.0) as usize
            * training.batch
            * training.accumulation
            * (self.table.nodes - 1);
        let row = LossRow {
            step,
            train: train / steps,
            train_state: train_state / steps,
            validation: sum.action,
            validation_state: sum.state,
            rollout: (self.run.rollout)(&model),
            gradient_norm: norm / steps,
            learning_rate: training.rate(step, progress),
            nodes_per_s: nodes as f64 / (elapsed - self.last_row.1).max(1e-9),
            elapsed_s: elapsed,
        };
        state.sums = [0.0; 4];
        state.elapsed_s = elapsed;
        state.rows.push(row.clone());
        // Validation and rollout are not counted in the rate.
        self.last_row = (step, self.before_s + self.started.elapsed().as_secs_f64());
        output::report(&self.run.out, &self.state.rows)?;
        Ok(row)
    }

    /// Writes the model file; its bytes.
    fn write_model(&self) -> Result<Vec<u8>, Error> {
        let (config, state) = (&self.run.config, &self.state);
        let header = model::header(config, self.table, &state.origin, state.optimiser.step);
        let file = self.run.out.join(output::MODEL);
        let bytes = model::model_bytes(header, self.table, &state.statistics, &state.parameters)
            .map_err(|error| error.at(&file))?;
        write_atomically(&file, &bytes)?;
        let checksum = bytes.last_chunk().map_or(0, |last| u32::from_le_bytes(*last));
        let lineage = state.origin.lineage(name(&self.run.out), state.optimiser.step);
        lineage.write_beside(&file, checksum)?;
        Ok(bytes)
    }

    fn save(&mut self) -> Result<(), Error> {
        self.state.elapsed_s = self.elapsed();
        self.state.write(&self.run.out.join(checkpoint::FILE))
    }
}
