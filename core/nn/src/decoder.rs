//! From a latent to normalised actions.

use super::arithmetic::{add_multiple, relu};
use super::header::{ACTION, Dimensions, limit};
use super::kernels::Kernel;
use super::linear::{Input, Output, apply};
use super::memory::Quantised;
use super::model::{Flow, Head};
use super::noise::normal_pair;
use super::rows::from;

/// Room for the largest prediction.
pub(super) type Prediction = [f32; ACTION * limit::CHUNK];

/// What the flow decoder has to know besides the latent.
pub(super) struct Draw<'a, F> {
    pub seed: u64,
    pub node: usize,
    /// Euler steps, if not the file's.
    pub steps: Option<u16>,
    /// Asked before each of them whether to give up.
    pub should_stop: &'a F,
}

/// The prediction for a latent. `hidden`: two rows of scratch, `stride` apart, each of at least
/// four widths.
pub(super) fn decode<F: Fn() -> bool>(
    kernel: Kernel,
    head: &Head,
    size: &Dimensions,
    latent: &[f32],
    draw: Draw<'_, F>,
    (hidden, stride): (&mut [f32], usize),
    quantised: &mut Quantised,
) -> Prediction {
    let mut prediction = [0.0; ACTION * limit::CHUNK];
    match head {
        Head::Linear(map) => {
            let x = Input { data: latent, stride: size.width, count: 1 };
            let y = Output { data: &mut prediction, stride: ACTION * limit::CHUNK };
            apply(kernel, map, x, y, quantised);
        }
        Head::Flow(flow) => {
            let (first, second) = hidden.split_at_mut(stride.min(hidden.len()));
            let buffers = [first, second];
            noise(&mut prediction, size.actions, &draw);
            flow_from(kernel, flow, size, latent, draw, &mut prediction, buffers, quantised);
        }
    }
    prediction
}

/// The numbers at which the flow of a node begins.
fn noise<F>(z: &mut Prediction, actions: usize, draw: &Draw<'_, F>) {
    let pairs = (ACTION * limit::CHUNK / 2) as u64;
    let from = draw.node as u64 * pairs;
    let (z, _) = z.as_chunks_mut::<2>();
    for (pair, z) in (from..).zip(z.iter_mut().take(actions / 2)) {
        *z = normal_pair(draw.seed, pair);
    }
}

/// Euler steps along the velocity. Cost a step: `8 width^2` flops in bytes for the hidden map, and
/// `8 width` an action in single precision.
#[expect(clippy::too_many_arguments)]
fn flow_from<F: Fn() -> bool>(
    kernel: Kernel,
    flow: &Flow,
    size: &Dimensions,
    latent: &[f32],
    draw: Draw<'_, F>,
    z: &mut Prediction,
    [first, second]: [&mut [f32]; 2],
    quantised: &mut Quantised,
) {
    let width = 2 * size.width;
    let (base, layer1) = first.split_at_mut(width.min(first.len()));
    let x = Input { data: latent, stride: size.width, count: 1 };
    apply(kernel, &flow.latent, x, Output { data: base, stride: width }, quantised);

    let steps = draw.steps.unwrap_or(flow.steps).max(1);
    // Bound: flow_steps.
    for step in 0..steps {
        if (draw.should_stop)() {
            // Half a flow is no action.
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
        let mut velocity = [0.0; ACTION * limit::CHUNK];
        let x = Input { data: from(layer2, 0), stride: width, count: 1 };
        let y = Output { data: &mut velocity, stride: ACTION * limit::CHUNK };
        apply(kernel, &flow.out, x, y, quantised);
        for (z, velocity) in z.iter_mut().zip(velocity) {
            *z += velocity / f32::from(steps);
        }
    }
}
