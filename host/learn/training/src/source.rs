//! Where examples come from, and the batches made of them.

use crate::config::Decoder;
use crate::params::Table;
use crate::random::Random;
use crate::shape::Shape;
use remora_host::error::Error;

/// One trajectory as the network learns it, raw numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// `[seen][features]`: at the last node there is nothing to do.
    pub features: Vec<f32>,
    /// `[nodes - 1][action]`.
    pub actions: Vec<f32>,
    /// `[seen][states]`: the states that the first actions from there lead to.
    pub states: Vec<f32>,
}

impl Example {
    /// One of zeros.
    pub fn zeros(shape: &Shape) -> Self {
        Self {
            features: vec![0.0; shape.seen() * shape.features()],
            actions: vec![0.0; shape.steps() * shape.action()],
            states: vec![0.0; shape.seen() * shape.states],
        }
    }
}

/// Part of the trajectories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Learnt from.
    Training,
    /// Looked at only.
    Validation,
}

/// Trajectories to learn from.
pub trait ExampleSource: Sync {
    /// Shape of all its examples.
    fn shape(&self) -> &Shape;

    /// Trajectories of a split.
    fn len(&self, split: Split) -> usize;

    /// Whether a split has none.
    fn is_empty(&self, split: Split) -> bool {
        self.len(split) == 0
    }

    /// Writes trajectory `index` of a split. Those of the training split may be disturbed, another
    /// way each time.
    ///
    /// # Errors
    /// The reason why a trajectory cannot be used.
    fn sample(
        &self,
        split: Split,
        index: usize,
        random: &mut Random,
        example: &mut Example,
    ) -> Result<(), Error>;
}

/// Mean and standard deviation of features, actions and next states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Mean and deviation of each feature.
    pub features: Vec<[f32; 2]>,
    /// Of each number of an action.
    pub actions: Vec<[f32; 2]>,
    /// Of each number of a state.
    pub states: Vec<[f32; 2]>,
}

/// Trajectories that statistics are taken of.
const STATISTICS_COUNT: usize = 4000;

/// At most `count` of so many places, evenly spread from the first on.
pub(super) fn spread(all: usize, count: usize) -> impl Iterator<Item = usize> {
    let count = count.min(all);
    (0..count).map(move |i| i * all / count)
}

/// Running first and second moments, column by column, about the first row seen.
struct Moments {
    shift: Vec<f64>,
    sums: Vec<[f64; 2]>,
    count: f64,
}

impl Moments {
    fn new(columns: usize) -> Self {
        Self { shift: Vec::new(), sums: vec![[0.0; 2]; columns], count: 0.0 }
    }

    fn add(&mut self, rows: &[f32]) {
        for row in rows.chunks_exact(self.sums.len()) {
            if self.shift.is_empty() {
                self.shift = row.iter().map(|x| f64::from(*x)).collect();
            }
            for ((x, shift), [one, two]) in row.iter().zip(&self.shift).zip(&mut self.sums) {
                let x = f64::from(*x) - shift;
                *one += x;
                *two += x * x;
            }
            self.count += 1.0;
        }
    }

    /// Mean and deviation. What hardly varies beside its size is taken not to vary at all: its
    /// deviation becomes one, so that rounding is not blown up.
    fn finish(&self) -> Vec<[f32; 2]> {
        let column = |(shift, [one, two]): (&f64, &[f64; 2])| {
            let mean = one / self.count;
            let deviation = (two / self.count - mean * mean).max(0.0).sqrt();
            let floor = 1e-9 + 1e-5 * (shift + mean).abs();
            [(shift + mean) as f32, if deviation > floor { deviation as f32 } else { 1.0 }]
        };
        self.shift.iter().zip(&self.sums).map(column).collect()
    }
}

impl Statistics {
    /// Statistics of trajectories from all over the training split.
    ///
    /// # Errors
    /// Those of the source.
    pub fn of(source: &dyn ExampleSource, seed: u64) -> Result<Self, Error> {
        let shape = source.shape();
        let mut example = Example::zeros(shape);
        let mut moments = [shape.features(), shape.action(), shape.states].map(Moments::new);
        let mut random = Random::new(seed, Random::STATISTICS, 0);
        for index in spread(source.len(Split::Training), STATISTICS_COUNT) {
            source.sample(Split::Training, index, &mut random, &mut example)?;
            moments[0].add(&example.features);
            moments[1].add(&example.actions);
            moments[2].add(&example.states);
        }
        let [features, actions, states] = moments.map(|m| m.finish());
        Ok(Self { features, actions, states })
    }
}

/// Normalised examples, ready for a device. Rows are `trajectory * seen + node`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Trajectories.
    pub size: usize,
    /// For each kind of token, `[rows][inputs]`.
    pub token_types: Vec<Vec<f32>>,
    /// Target of the decoder, `[rows][outputs]`: actions, or velocities.
    pub target: Vec<f32>,
    /// Weight of each of them in the sum of squares, zero beyond the horizon.
    pub weight: Vec<f32>,
    /// Input of the flow decoder beside the latent, `[rows][outputs + 1]`; empty for the linear one.
    pub question: Vec<f32>,
    /// Next states, `[rows][states]`.
    pub states: Vec<f32>,
    /// Seed of the dropout masks.
    pub dropout_seed: u64,
}

/// Makes batches.
pub struct Batches<'a> {
    /// Trajectories.
    pub source: &'a dyn ExampleSource,
    /// Normalisation.
    pub statistics: &'a Statistics,
    /// Sizes.
    pub table: &'a Table,
    /// Seed.
    pub seed: u64,
}

impl Batches<'_> {
    /// Batch `index` of the training: consecutive trajectories of an order that is new each epoch.
    ///
    /// `epoch` remembers the order of the epoch that was used last.
    ///
    /// # Errors
    /// Those of the source.
    pub fn training(
        &self,
        index: u64,
        size: usize,
        epoch: &mut (u64, Vec<u32>),
    ) -> Result<Batch, Error> {
        let count = self.source.len(Split::Training);
        let picks: Vec<usize> = (index * size as u64..(index + 1) * size as u64)
            .map(|example| {
                let (number, place) = (example / count as u64, example % count as u64);
                if epoch.1.len() != count || epoch.0 != number {
                    *epoch = (number, Random::new(self.seed, Random::ORDER, number).order(count));
                }
                epoch.1[place as usize] as usize
            })
            .collect();
        let random = Random::new(self.seed, Random::BATCH, index);
        self.batch(Split::Training, &picks, random)
    }

    /// The batch of validation trajectories from `first` on.
    ///
    /// # Errors
    /// Those of the source.
    pub fn validation(&self, first: usize, size: usize) -> Result<Batch, Error> {
        let picks: Vec<usize> = (first..first + size).collect();
        let random = Random::new(self.seed, Random::VALIDATION, first as u64);
        self.batch(Split::Validation, &picks, random)
    }

    fn batch(&self, split: Split, picks: &[usize], mut random: Random) -> Result<Batch, Error> {
        let shape = self.source.shape();
        let mut example = Example::zeros(shape);
        let mut batch = Batch { size: picks.len(), ..Batch::default() };
        batch.token_types = vec![Vec::new(); self.table.token_types.len()];
        for index in picks {
            self.source.sample(split, *index, &mut random, &mut example)?;
            self.add(&example, &mut random, &mut batch);
        }
        // The mean over all that count, in both losses alike.
        let total: f32 = batch.weight.iter().sum();
        batch.weight.iter_mut().for_each(|w| *w /= total);
        batch.dropout_seed = random.bits();
        Ok(batch)
    }

    fn add(&self, example: &Example, random: &mut Random, batch: &mut Batch) {
        let (shape, statistics) = (self.source.shape(), self.statistics);
        let size = shape.action();
        for features in example.features.chunks_exact(shape.features()) {
            let mut from = 0;
            for (kind, inputs) in batch.token_types.iter_mut().zip(&self.table.token_types) {
                let range = from..from + inputs;
                kind.extend(normalised(&features[range.clone()], &statistics.features[range]));
                from += inputs;
            }
        }
        for state in example.states.chunks_exact(shape.states) {
            batch.states.extend(normalised(state, &statistics.states));
        }
        let actions: Vec<f32> = example
            .actions
            .chunks_exact(size)
            .flat_map(|action| normalised(action, &statistics.actions))
            .collect();
        for from in (0..shape.steps()).step_by(shape.stride).map(|node| size * node) {
            let ahead = &actions[from..(from + self.table.outputs).min(actions.len())];
            self.add_target(ahead, random, batch);
        }
    }

    /// Adds the decoder's target at a node, given the actions ahead that there are.
    fn add_target(&self, ahead: &[f32], random: &mut Random, batch: &mut Batch) {
        let outputs = self.table.outputs;
        let tau = random_tau(self.table.decoder, random);
        for i in 0..outputs {
            let action = ahead.get(i).copied();
            batch.weight.push(f32::from(u8::from(action.is_some())));
            let action = action.unwrap_or(0.0);
            match self.table.decoder {
                Decoder::Linear => batch.target.push(action),
                Decoder::Flow => {
                    let start = random.normal() as f32;
                    batch.target.push(action - start);
                    batch.question.push((1.0 - tau) * start + tau * action);
                }
            }
        }
        if self.table.decoder == Decoder::Flow {
            batch.question.push(tau);
        }
    }
}

fn random_tau(decoder: Decoder, random: &mut Random) -> f32 {
    match decoder {
        Decoder::Linear => 0.0,
        Decoder::Flow => random.uniform() as f32,
    }
}

fn normalised<'a>(raw: &'a [f32], statistics: &'a [[f32; 2]]) -> impl Iterator<Item = f32> + 'a {
    raw.iter().zip(statistics).map(|(x, [mean, deviation])| (x - mean) / deviation)
}

/// Random trajectories of a linear system under feedback, for tests and benchmarks.
#[derive(Clone, Debug)]
pub struct Synthetic {
    shape: Shape,
    count: usize,
}

impl Synthetic {
    /// `count` training trajectories, a tenth as many for validation.
    pub fn new(shape: Shape, count: usize) -> Self {
        Self { shape, count }
    }
}

impl ExampleSource for Synthetic {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn len(&self, split: Split) -> usize {
        match split {
            Split::Training => self.count,
            Split::Validation => self.count.div_ceil(10),
        }
    }

    fn sample(
        &self,
        split: Split,
        index: usize,
        _: &mut Random,
        example: &mut Example,
    ) -> Result<(), Error> {
        let number = 2 * index as u64 + u64::from(split == Split::Validation);
        let mut own = Random::new(0, Random::SYNTHETIC, number);
        let (features, states) = (self.shape.features(), self.shape.states);
        let goal: Vec<f64> = (0..states).map(|_| own.normal()).collect();
        let mut state: Vec<f64> = (0..states).map(|_| own.normal()).collect();
        let size = self.shape.action();
        let mut action = vec![0.0; size];
        for k in 0..self.shape.steps() {
            let seen = (k % self.shape.stride == 0).then_some(k / self.shape.stride);
            if let Some(seen) = seen {
                let row = &mut example.features[seen * features..(seen + 1) * features];
                row.fill(k as f32);
                let time = [k as f64];
                let numbers = action.iter().chain(&time).chain(&goal);
                row.iter_mut().zip(numbers).for_each(|(x, value)| *x = *value as f32);
                row.iter_mut().rev().zip(&state).for_each(|(x, value)| *x = *value as f32);
            }
            let feedback = |i: usize| 0.2 * (goal[i % states] - state[i % states]);
            action = (0..size).map(feedback).collect();
            state.iter_mut().enumerate().for_each(|(i, x)| *x += action[i % size]);
            let out = &mut example.actions[k * size..(k + 1) * size];
            out.iter_mut().zip(&action).for_each(|(x, value)| *x = *value as f32);
            if let Some(seen) = seen {
                let out = &mut example.states[seen * states..(seen + 1) * states];
                out.iter_mut().zip(&state).for_each(|(x, value)| *x = *value as f32);
            }
        }
        Ok(())
    }
}
