//! From a hidden state to normalised actions.

use super::arithmetic::{add_multiple, relu};
use super::header::{Dimensions, limit};
use super::kernels::Kernel;
use super::linear::{Input, Output, apply};
use super::memory::Quantised;
use super::model::{Flow, Head};
use super::noise::normal_pair;
use super::rows::from;

/// Room for the largest prediction.
pub(super) type Prediction = [f32; limit::ACTIONS];

/// How the flow decoder samples an action.
pub(super) struct Sampling<'a, F> {
    /// Seed of the rollout.
    pub seed: u64,
    /// Node of the rollout: noise is a function of seed and node alone.
    pub node: usize,
    /// Euler steps; `None`: as many as the file says.
    pub steps: Option<u16>,
    /// Asked before each step whether to give up.
    pub should_stop: &'a F,
}

/// Settings and scratch of a decoder, besides its weights and the hidden state.
pub(super) struct Workbench<'a, 'm, F> {
    pub kernel: Kernel,
    pub size: &'a Dimensions,
    pub sampling: Sampling<'a, F>,
    /// Two rows of scratch, `stride` apart, each of at least four widths.
    pub intermediate: &'a mut [f32],
    pub stride: usize,
    pub quantised: &'a mut Quantised<'m>,
}

/// Predicts normalised actions from a hidden state; NaN where the decoder was told to stop.
pub(super) fn decode<F: Fn() -> bool>(
    head: &Head,
    hidden_state: &[f32],
    work: Workbench<'_, '_, F>,
) -> Prediction {
    let mut prediction = [0.0; limit::ACTIONS];
    match head {
        Head::Linear(map) => {
            let x = Input { data: hidden_state, stride: work.size.width, count: 1 };
            let y = Output { data: &mut prediction, stride: limit::ACTIONS };
            apply(work.kernel, map, x, y, work.quantised);
        }
        Head::Flow(flow) => {
            noise(&mut prediction, work.size, &work.sampling);
            integrate(flow, hidden_state, work, &mut prediction);
        }
    }
    prediction
}

/// Writes the noise from which the flow of a node starts.
fn noise<F>(z: &mut Prediction, size: &Dimensions, sampling: &Sampling<'_, F>) {
    // Enough for the longest chunk of such actions, odd or even.
    let pairs = (size.action * limit::CHUNK / 2) as u64;
    let from = sampling.node as u64 * pairs;
    let (z, _) = z.as_chunks_mut::<2>();
    for (pair, z) in (from..).zip(z.iter_mut().take(size.actions.div_ceil(2))) {
        *z = normal_pair(sampling.seed, pair);
    }
}

/// Integrates the flow from the noise in `z` by Euler steps. Cost a step: `8 width^2` flops in bytes
/// for the hidden map, and `8 width` an action in single precision.
fn integrate<F: Fn() -> bool>(
    flow: &Flow,
    hidden_state: &[f32],
    work: Workbench<'_, '_, F>,
    z: &mut Prediction,
) {
    let Workbench { kernel, size, sampling, intermediate, stride, quantised } = work;
    let (first, second) = intermediate.split_at_mut(stride.min(intermediate.len()));
    let width = 2 * size.width;
    let (base, layer1) = first.split_at_mut(width.min(first.len()));
    let x = Input { data: hidden_state, stride: size.width, count: 1 };
    apply(kernel, &flow.latent, x, Output { data: base, stride: width }, quantised);

    let steps = sampling.steps.unwrap_or(flow.steps).max(1);
    // Bound: flow_steps.
    for step in 0..steps {
        if (sampling.should_stop)() {
            // An unfinished flow is no action.
            z.fill(f32::NAN);
            return;
        }
        let tau = f32::from(step) / f32::from(steps);
        let layer1 = layer1.get_mut(..base.len()).unwrap_or_default();
        layer1.iter_mut().zip(&*base).for_each(|(layer, base)| *layer = *base);
        let inputs = z.iter().take(size.actions).chain([&tau]);
        for (input, row) in inputs.zip(flow.action.chunks(width.max(1))) {
            add_multiple(layer1, *input, row);
        }
        relu(layer1);
        let x = Input { data: layer1, stride: width, count: 1 };
        apply(kernel, &flow.hidden, x, Output { data: second, stride: width }, quantised);
        let layer2 = second.get_mut(..width).unwrap_or_default();
        relu(layer2);
        let mut velocity = [0.0; limit::ACTIONS];
        let x = Input { data: from(layer2, 0), stride: width, count: 1 };
        let y = Output { data: &mut velocity, stride: limit::ACTIONS };
        apply(kernel, &flow.out, x, y, quantised);
        for (z, velocity) in z.iter_mut().zip(velocity) {
            *z += velocity / f32::from(steps);
        }
    }
}
