//! The network's operations on the CPU.
//!
//! Burn's own compose a layer norm of a dozen passes over memory and an attention of several
//! copies, each kept for the way back. Here each is one pass forward and one back; matrix products
//! remain Burn's. Plain loops over fixed numbers of lanes, which the compiler makes vectors of.

mod attention;
mod lanes;
mod norm;

use crate::kernels::Kernels;
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::{Autodiff, Flex};
use burn::prelude::Tensor;
use burn::tensor::ops::{FloatTensor, FloatTensorOps};
use burn::tensor::{TensorData, TensorPrimitive};
use burn_flex::FlexTensor;

type Cpu = Autodiff<Flex>;

fn matrix(values: Vec<f32>, rows: usize, columns: usize) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, [rows, columns]))
}

/// Makes a tensor contiguous, its numbers in order.
fn ordered(tensor: FlexTensor) -> FlexTensor {
    if tensor.as_slice::<f32>().is_some() { tensor } else { tensor.to_contiguous() }
}

/// The numbers of a tensor that [`ordered`] has seen.
fn numbers(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().unwrap_or(&[])
}

fn inner(tensor: Tensor<Cpu, 2>) -> FloatTensor<Cpu> {
    tensor.into_primitive().tensor()
}

fn outer(tensor: FloatTensor<Cpu>) -> Tensor<Cpu, 2> {
    Tensor::from_primitive(TensorPrimitive::Float(tensor))
}

/// Adds gradients to the parents that want them.
fn register<S, const N: usize>(ops: &Ops<S, N>, grads: &mut Gradients, values: [FlexTensor; N]) {
    for (parent, value) in ops.parents.iter().zip(values) {
        if let Some(parent) = parent {
            grads.register::<Flex>(parent.id, value);
        }
    }
}

impl Kernels for Cpu {
    fn dense(
        x: Tensor<Self, 2>,
        weight: Tensor<Self, 2>,
        bias: Tensor<Self, 2>,
        relu: bool,
    ) -> Tensor<Self, 2> {
        let (x, weight, bias) = (inner(x), inner(weight), inner(bias));
        let y = dense(&x.primitive, &weight.primitive, &bias.primitive, relu);
        let nodes = [x.node.clone(), weight.node.clone(), bias.node.clone()];
        outer(match Dense.prepare::<NoCheckpointing>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => {
                let output = relu.then(|| y.clone());
                prepared.finish(DenseState { x: x.primitive, weight: weight.primitive, output }, y)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(y),
        })
    }

    fn standardise(
        x: Tensor<Self, 2>,
        gain: Tensor<Self, 2>,
        bias: Tensor<Self, 2>,
    ) -> Tensor<Self, 2> {
        let (x, gain, bias) = (inner(x), inner(gain), inner(bias));
        let input = ordered(x.primitive.clone());
        let (y, moments) =
            norm::forward(numbers(&input), numbers(&gain.primitive), numbers(&bias.primitive));
        let columns = numbers(&gain.primitive).len();
        let rows = moments.len();
        let y = matrix(y, rows, columns);
        let nodes = [x.node.clone(), gain.node.clone(), bias.node.clone()];
        outer(match Norm.prepare::<NoCheckpointing>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => {
                prepared.finish(NormState { input, gain: gain.primitive, moments }, y)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(y),
        })
    }

    fn attend(qkv: Tensor<Self, 2>, size: usize, heads: usize) -> Tensor<Self, 2> {
        let [rows, columns] = qkv.dims();
        let qkv = inner(qkv);
        let input = ordered(qkv.primitive.clone());
        let form = attention::Form { tokens: rows / size, heads, width: columns / 3 };
        let (y, shares) = attention::forward(numbers(&input), form);
        let y = matrix(y, rows, form.width);
        let nodes = [qkv.node.clone()];
        outer(match Attend.prepare::<NoCheckpointing>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => prepared.finish(AttendState { input, shares, form }, y),
            OpsKind::UnTracked(prepared) => prepared.finish(y),
        })
    }
}

/// `x W^T + b`, and its positive part if so wished.
fn dense(x: &FlexTensor, weight: &FlexTensor, bias: &FlexTensor, relu: bool) -> FlexTensor {
    let mut y = Flex::float_matmul(x.clone(), weight.transpose(0, 1));
    let bias = numbers(bias);
    for row in y.storage_mut::<f32>().chunks_exact_mut(bias.len()) {
        if relu {
            row.iter_mut().zip(bias).for_each(|(y, b)| *y = (*y + b).max(0.0));
        } else {
            row.iter_mut().zip(bias).for_each(|(y, b)| *y += b);
        }
    }
    y
}

#[derive(Debug)]
struct Dense;

#[derive(Clone, Debug)]
struct DenseState {
    x: FlexTensor,
    weight: FlexTensor,
    /// Where only the positive part was kept.
    output: Option<FlexTensor>,
}

impl Backward<Flex, 3> for Dense {
    type State = DenseState;

    fn backward(self, ops: Ops<DenseState, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let mut gradient = ordered(grads.consume::<Flex>(&ops.node));
        let DenseState { x, weight, output } = &ops.state;
        let columns = gradient.layout().shape()[1];
        if let Some(output) = output {
            for (g, y) in gradient.storage_mut::<f32>().iter_mut().zip(numbers(output)) {
                *g = if *y > 0.0 { *g } else { 0.0 };
            }
        }
        let mut bias = vec![0.0; columns];
        for row in numbers(&gradient).chunks_exact(columns) {
            bias.iter_mut().zip(row).for_each(|(sum, g)| *sum += g);
        }
        let weight_gradient = Flex::float_matmul(gradient.transpose(0, 1), x.clone());
        if ops.parents[0].is_some() {
            let x_gradient = Flex::float_matmul(gradient, weight.clone());
            register(&ops, grads, [x_gradient, weight_gradient, matrix(bias, 1, columns)]);
        } else {
            // Inputs: nobody wants their gradient.
            for (parent, value) in
                ops.parents[1..].iter().zip([weight_gradient, matrix(bias, 1, columns)])
            {
                if let Some(parent) = parent {
                    grads.register::<Flex>(parent.id, value);
                }
            }
        }
    }
}

#[derive(Debug)]
struct Norm;

#[derive(Clone, Debug)]
struct NormState {
    input: FlexTensor,
    gain: FlexTensor,
    moments: Vec<[f32; 2]>,
}

impl Backward<Flex, 3> for Norm {
    type State = NormState;

    fn backward(self, ops: Ops<NormState, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let gradient = ordered(grads.consume::<Flex>(&ops.node));
        let NormState { input, gain, moments } = &ops.state;
        let found = norm::backward(numbers(input), numbers(gain), moments, numbers(&gradient));
        let columns = found.gain.len();
        let values = [
            matrix(found.x, moments.len(), columns),
            matrix(found.gain, 1, columns),
            matrix(found.bias, 1, columns),
        ];
        register(&ops, grads, values);
    }
}

#[derive(Debug)]
struct Attend;

#[derive(Clone, Debug)]
struct AttendState {
    input: FlexTensor,
    shares: Vec<f32>,
    form: attention::Form,
}

impl Backward<Flex, 1> for Attend {
    type State = AttendState;

    fn backward(self, ops: Ops<AttendState, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let gradient = ordered(grads.consume::<Flex>(&ops.node));
        let AttendState { input, shares, form } = &ops.state;
        let found = attention::backward(numbers(input), shares, numbers(&gradient), *form);
        let rows = found.len() / (3 * form.width);
        register(&ops, grads, [matrix(found, rows, 3 * form.width)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::composed;
    use crate::random::Random;
    use burn::backend::autodiff::checkpoint::strategy::BalancedCheckpointing;
    use burn::tensor::backend::AutodiffBackend;

    /// Backend with Burn's own operations.
    type Plain = Autodiff<Flex, BalancedCheckpointing>;

    fn values(count: usize, seed: u64) -> Vec<f32> {
        let mut random = Random::new(seed, 0, 0);
        (0..count).map(|_| random.normal() as f32).collect()
    }

    fn tensor<B: AutodiffBackend>(values: &[f32], columns: usize) -> Tensor<B, 2> {
        let shape = [values.len() / columns, columns];
        Tensor::from_data(TensorData::new(values.to_vec(), shape), &Default::default())
            .require_grad()
    }

    /// Result, and gradients of a weighted sum of it.
    fn evaluate<B: AutodiffBackend>(
        inputs: &[(Vec<f32>, usize)],
        operation: impl Fn(&[Tensor<B, 2>]) -> Tensor<B, 2>,
    ) -> Vec<Vec<f32>> {
        let tensors: Vec<Tensor<B, 2>> = inputs.iter().map(|(v, n)| tensor(v, *n)).collect();
        let y = operation(&tensors);
        let [rows, columns] = y.dims();
        let gradients = (y.clone() * tensor(&values(rows * columns, 9), columns)).sum().backward();
        let mut out: Vec<Vec<f32>> = vec![y.into_data().iter().collect()];
        out.extend(
            tensors.iter().map(|t| t.grad(&gradients).unwrap().into_data().iter().collect()),
        );
        out
    }

    fn agree(found: &[Vec<f32>], expected: &[Vec<f32>]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!(found.len(), expected.len());
            assert!(expected.iter().any(|x| *x != 0.0));
            for (a, b) in found.iter().zip(expected) {
                assert!((a - b).abs() < 2e-5 * (1.0 + b.abs()), "{a} {b}");
            }
        }
    }

    #[test]
    fn linear_layers_are_burns() {
        let inputs = [(values(7 * 5, 1), 5), (values(3 * 5, 2), 5), (values(3, 3), 3)];
        for relu in [false, true] {
            agree(
                &evaluate::<Cpu>(&inputs, |t| {
                    Cpu::dense(t[0].clone(), t[1].clone(), t[2].clone(), relu)
                }),
                &evaluate::<Plain>(&inputs, |t| {
                    composed::dense(t[0].clone(), t[1].clone(), t[2].clone(), relu)
                }),
            );
        }
    }

    #[test]
    fn layer_norm_is_burns() {
        let inputs = [(values(6 * 21, 1), 21), (values(21, 2), 21), (values(21, 3), 21)];
        agree(
            &evaluate::<Cpu>(&inputs, |t| {
                Cpu::standardise(t[0].clone(), t[1].clone(), t[2].clone())
            }),
            &evaluate::<Plain>(&inputs, |t| {
                composed::standardise(t[0].clone(), t[1].clone(), t[2].clone())
            }),
        );
    }

    #[test]
    fn attention_is_burns() {
        for (size, tokens, heads, head) in [(2, 19, 2, 8), (1, 59, 3, 32), (1, 50, 1, 64)] {
            let inputs = [(values(size * tokens * 3 * heads * head, 1), 3 * heads * head)];
            agree(
                &evaluate::<Cpu>(&inputs, |t| Cpu::attend(t[0].clone(), size, heads)),
                &evaluate::<Plain>(&inputs, |t| composed::attend(t[0].clone(), size, heads)),
            );
        }
    }
}
