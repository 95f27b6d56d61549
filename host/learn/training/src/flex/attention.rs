//! Causal attention, head by head: what a head needs is copied together and stays in the cache,
//! and what lies ahead is never computed.

use super::lanes::{LANES, exp, fma, sum};

/// Shape of an attention.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Tokens of a sequence.
    pub tokens: usize,
    /// Heads.
    pub heads: usize,
    /// Width of a token.
    pub width: usize,
}

impl Form {
    /// Tokens, rounded up to whole vectors.
    fn padded(self) -> usize {
        self.tokens.next_multiple_of(LANES)
    }

    /// Numbers of a head's triangle of shares: a padded row a token.
    fn shares(self) -> usize {
        self.tokens * self.padded()
    }
}

/// Calls the kernel that is built for the size of a head.
macro_rules! for_head {
    ($form:expr, $call:ident($($argument:expr),*)) => {
        match $form.width / $form.heads {
            8 => $call::<8>($($argument),*),
            16 => $call::<16>($($argument),*),
            24 => $call::<24>($($argument),*),
            32 => $call::<32>($($argument),*),
            48 => $call::<48>($($argument),*),
            64 => $call::<64>($($argument),*),
            96 => $call::<96>($($argument),*),
            other => unreachable!("no kernel for heads of {other}"),
        }
    };
}

/// `[sequences * tokens][3 * width]` to `[sequences * tokens][width]`, and the shares that each
/// token has in the others' sums, which the way back needs.
pub fn forward(qkv: &[f32], form: Form) -> (Vec<f32>, Vec<f32>) {
    let sequences = qkv.len() / (3 * form.width * form.tokens);
    let mut out = vec![0.0; qkv.len() / 3];
    let mut shares = vec![0.0; sequences * form.heads * form.shares()];
    for_head!(form, forward_heads(qkv, form, &mut out, &mut shares));
    (out, shares)
}

/// The gradient of `qkv`.
pub fn backward(qkv: &[f32], shares: &[f32], gradient: &[f32], form: Form) -> Vec<f32> {
    let mut out = vec![0.0; qkv.len()];
    for_head!(form, backward_heads(qkv, shares, gradient, form, &mut out));
    out
}

/// Copies a head's part of each token together.
fn gather<const D: usize>(rows: &[f32], width: usize, from: usize, out: &mut [[f32; D]]) {
    for (row, out) in rows.chunks_exact(width).zip(out) {
        out.copy_from_slice(&row[from..from + D]);
    }
}

/// Transposes rows: number by number, a padded row each.
fn transpose<const D: usize>(rows: &[[f32; D]], padded: usize, out: &mut [f32]) {
    for (j, row) in rows.iter().enumerate() {
        for (d, value) in row.iter().enumerate() {
            out[d * padded + j] = *value;
        }
    }
}

/// `out[j] = a . b_j` for the first `count` rows `b_j`, given transposed; whole vectors.
#[inline(always)]
fn products<const D: usize>(a: &[f32; D], b: &[f32], padded: usize, count: usize, out: &mut [f32]) {
    const WIDE: usize = 4 * LANES;
    let count = count.next_multiple_of(LANES);
    let mut from = 0;
    while from + WIDE <= count {
        let mut sums = [0.0; WIDE];
        for (d, a) in a.iter().enumerate() {
            let b = &b[d * padded + from..d * padded + from + WIDE];
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = fma(*a, *b, *sum);
            }
        }
        out[from..from + WIDE].copy_from_slice(&sums);
        from += WIDE;
    }
    while from < count {
        let mut sums = [0.0; LANES];
        for (d, a) in a.iter().enumerate() {
            let b = &b[d * padded + from..d * padded + from + LANES];
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = fma(*a, *b, *sum);
            }
        }
        out[from..from + LANES].copy_from_slice(&sums);
        from += LANES;
    }
}

/// `sum_j weight_j rows_j`.
#[inline(always)]
fn combine<const D: usize>(weights: &[f32], rows: &[[f32; D]]) -> [f32; D] {
    let mut out = [0.0; D];
    for (weight, row) in weights.iter().zip(rows) {
        for (sum, x) in out.iter_mut().zip(row) {
            *sum = fma(*weight, *x, *sum);
        }
    }
    out
}

/// Scores to shares: all of `row` beyond `count` becomes zero.
#[inline(always)]
fn softmax(row: &mut [f32], count: usize, scale: f32) {
    row[count..].fill(f32::NEG_INFINITY);
    let mut most = [f32::NEG_INFINITY; LANES];
    for lanes in row.chunks_exact(LANES) {
        most.iter_mut().zip(lanes).for_each(|(most, x)| *most = most.max(*x));
    }
    let most = most.iter().fold(f32::NEG_INFINITY, |most, x| most.max(*x));
    for x in row.iter_mut() {
        *x = exp(scale * (*x - most));
    }
    row[count..].fill(0.0);
    let factor = 1.0 / sum(row.len(), |i| row[i]);
    row.iter_mut().for_each(|x| *x *= factor);
}

fn forward_heads<const D: usize>(qkv: &[f32], form: Form, out: &mut [f32], shares: &mut [f32]) {
    let Form { tokens, heads, width } = form;
    let (padded, scale) = (form.padded(), 1.0 / (D as f32).sqrt());
    let mut q = vec![[0.0; D]; tokens];
    let (mut k, mut v) = (q.clone(), q.clone());
    let mut columns = vec![0.0; D * padded];
    let sequences = qkv.chunks_exact(3 * width * tokens).zip(out.chunks_exact_mut(width * tokens));
    for ((qkv, out), shares) in sequences.zip(shares.chunks_exact_mut(heads * form.shares())) {
        for (head, shares) in shares.chunks_exact_mut(form.shares()).enumerate() {
            gather(qkv, 3 * width, head * D, &mut q);
            gather(qkv, 3 * width, width + head * D, &mut k);
            gather(qkv, 3 * width, 2 * width + head * D, &mut v);
            transpose(&k, padded, &mut columns);
            for (i, row) in shares.chunks_exact_mut(padded).enumerate() {
                let row = &mut row[..(i + 1).next_multiple_of(LANES)];
                products(&q[i], &columns, padded, i + 1, row);
                softmax(row, i + 1, scale);
                let sum = combine(&row[..=i], &v);
                out[i * width + head * D..][..D].copy_from_slice(&sum);
            }
        }
    }
}

fn backward_heads<const D: usize>(
    qkv: &[f32],
    shares: &[f32],
    gradient: &[f32],
    form: Form,
    out: &mut [f32],
) {
    let Form { tokens, heads, width } = form;
    let mut head = Head::<D>::new(form);
    let sequences = qkv.chunks_exact(3 * width * tokens).zip(gradient.chunks_exact(width * tokens));
    let shares = shares.chunks_exact(heads * form.shares());
    for (((qkv, gradient), shares), out) in
        sequences.zip(shares).zip(out.chunks_exact_mut(3 * width * tokens))
    {
        for (index, shares) in shares.chunks_exact(form.shares()).enumerate() {
            head.read(qkv, gradient, width, index);
            head.back(shares);
            for (i, row) in out.chunks_exact_mut(3 * width).enumerate() {
                for (part, values) in [&head.dq, &head.dk, &head.dv].into_iter().enumerate() {
                    row[part * width + index * D..][..D].copy_from_slice(&values[i]);
                }
            }
        }
    }
}

/// Memory of one head on the way back.
struct Head<const D: usize> {
    padded: usize,
    q: Vec<[f32; D]>,
    k: Vec<[f32; D]>,
    v: Vec<[f32; D]>,
    gradient: Vec<[f32; D]>,
    columns: Vec<f32>,
    row: Vec<f32>,
    dq: Vec<[f32; D]>,
    dk: Vec<[f32; D]>,
    dv: Vec<[f32; D]>,
}

impl<const D: usize> Head<D> {
    fn new(form: Form) -> Self {
        let rows = || vec![[0.0; D]; form.tokens];
        Self {
            padded: form.padded(),
            q: rows(),
            k: rows(),
            v: rows(),
            gradient: rows(),
            columns: vec![0.0; D * form.padded()],
            row: vec![0.0; form.padded()],
            dq: rows(),
            dk: rows(),
            dv: rows(),
        }
    }

    fn read(&mut self, qkv: &[f32], gradient: &[f32], width: usize, head: usize) {
        gather(qkv, 3 * width, head * D, &mut self.q);
        gather(qkv, 3 * width, width + head * D, &mut self.k);
        gather(qkv, 3 * width, 2 * width + head * D, &mut self.v);
        gather(gradient, width, head * D, &mut self.gradient);
        transpose(&self.v, self.padded, &mut self.columns);
    }

    fn back(&mut self, shares: &[f32]) {
        let scale = 1.0 / (D as f32).sqrt();
        self.dk.fill([0.0; D]);
        self.dv.fill([0.0; D]);
        for (i, shares) in shares.chunks_exact(self.padded).enumerate() {
            let count = (i + 1).next_multiple_of(LANES);
            let (row, shares) = (&mut self.row[..count], &shares[..count]);
            let gradient = &self.gradient[i];
            products(gradient, &self.columns, self.padded, i + 1, row);
            let mean = sum(count, |j| row[j] * shares[j]);
            for (x, share) in row.iter_mut().zip(shares) {
                *x = scale * share * (*x - mean);
            }
            self.dq[i] = combine(&row[..=i], &self.k);
            let rows = self.dk[..=i].iter_mut().zip(&mut self.dv[..=i]);
            for ((dk, dv), (x, share)) in rows.zip(row.iter().zip(shares)) {
                for d in 0..D {
                    dk[d] = fma(*x, self.q[i][d], dk[d]);
                    dv[d] = fma(*share, gradient[d], dv[d]);
                }
            }
        }
    }
}
