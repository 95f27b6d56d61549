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

/// The same transposed: number by number, a padded row each.
fn transpose<const D: usize>(rows: &[[f32; D]], padded: usize, out: &mut [f32]) {
    for (j, row) in rows.iter().enumerate() {
        for (d, value) in row.iter().enumerate() {
            out[d * padded + j] = *value;
        }
    }
}

/// Rows that are worked on at once: what is loaded for one serves the other, and their sums do not
/// wait for each other.
const PAIR: usize = 2;

/// `out[r][j] = a_r . b_j` for the first `count` rows `b_j`, given transposed; whole vectors.
#[inline(always)]
fn products<const D: usize, const R: usize>(
    a: [&[f32; D]; R],
    b: &[f32],
    padded: usize,
    count: usize,
    mut out: [&mut [f32]; R],
) {
    const WIDE: usize = 4 * LANES;
    let count = count.next_multiple_of(LANES);
    let mut from = 0;
    while from + WIDE <= count {
        strip::<D, R, WIDE>(a, b, padded, from, &mut out);
        from += WIDE;
    }
    while from < count {
        strip::<D, R, LANES>(a, b, padded, from, &mut out);
        from += LANES;
    }
}

/// [`products`] for `W` rows `b_j`.
#[inline(always)]
fn strip<const D: usize, const R: usize, const W: usize>(
    a: [&[f32; D]; R],
    b: &[f32],
    padded: usize,
    from: usize,
    out: &mut [&mut [f32]; R],
) {
    let mut sums = [[0.0; W]; R];
    for (d, b) in b.chunks_exact(padded).enumerate() {
        let b = &b[from..from + W];
        for (sums, a) in sums.iter_mut().zip(a) {
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = fma(a[d], *b, *sum);
            }
        }
    }
    for (out, sums) in out.iter_mut().zip(sums) {
        out[from..from + W].copy_from_slice(&sums);
    }
}

/// `sum_j weight_rj rows_j` for each `r`.
#[inline(always)]
fn combine<const D: usize, const R: usize>(
    weights: [&[f32]; R],
    rows: &[[f32; D]],
) -> [[f32; D]; R] {
    let mut out = [[0.0; D]; R];
    for (j, row) in rows.iter().enumerate() {
        for (out, weights) in out.iter_mut().zip(weights) {
            let weight = weights[j];
            for (sum, x) in out.iter_mut().zip(row) {
                *sum = fma(weight, *x, *sum);
            }
        }
    }
    out
}

/// Scores to shares: all of `row` beyond `count` becomes zero.
#[inline(always)]
fn softmax(row: &mut [f32], count: usize, scale: f32) {
    let (row, ahead) = row.split_at_mut(count.next_multiple_of(LANES));
    ahead.fill(0.0);
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
            for (pair, rows) in shares.chunks_mut(PAIR * padded).enumerate() {
                let i = PAIR * pair;
                let (one, two) = rows.split_at_mut(padded);
                let out = &mut out[i * width + head * D..];
                if two.is_empty() {
                    products([&q[i]], &columns, padded, i + 1, [one]);
                    softmax(one, i + 1, scale);
                    let [one] = combine([one], &v[..=i]);
                    out[..D].copy_from_slice(&one);
                } else {
                    products([&q[i], &q[i + 1]], &columns, padded, i + 2, [&mut *one, &mut *two]);
                    softmax(one, i + 1, scale);
                    softmax(two, i + 2, scale);
                    let [one, two] = combine([one, two], &v[..i + 2]);
                    out[..D].copy_from_slice(&one);
                    out[width..][..D].copy_from_slice(&two);
                }
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
    /// Gradients of the scores, a padded row a token.
    slopes: Vec<f32>,
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
            slopes: vec![0.0; form.shares()],
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
        let (padded, tokens) = (self.padded, self.q.len());
        let (whole, last) = (tokens - tokens % PAIR, tokens - 1);
        for i in (0..whole).step_by(PAIR) {
            let gradients = [&self.gradient[i], &self.gradient[i + 1]];
            let (one, two) = self.slopes[i * padded..].split_at_mut(padded);
            let two = &mut two[..padded];
            products(gradients, &self.columns, padded, i + 2, [&mut *one, &mut *two]);
            slopes::<D>(one, &shares[i * padded..][..padded], i + 1);
            slopes::<D>(two, &shares[(i + 1) * padded..][..padded], i + 2);
            let found = combine([one, two], &self.k[..i + 2]);
            self.dq[i..i + 2].copy_from_slice(&found);
        }
        if whole < tokens {
            let slope = &mut self.slopes[last * padded..];
            products([&self.gradient[last]], &self.columns, padded, tokens, [&mut *slope]);
            slopes::<D>(slope, &shares[last * padded..], tokens);
            [self.dq[last]] = combine([slope], &self.k);
        }
        for j in 0..tokens {
            self.dk[j] = gathered(&self.slopes, padded, j, &self.q);
            self.dv[j] = gathered(shares, padded, j, &self.gradient);
        }
    }
}

/// The gradients of a row's shares to those of its scores, beyond `count` zero.
#[inline(always)]
fn slopes<const D: usize>(row: &mut [f32], shares: &[f32], count: usize) {
    let scale = 1.0 / (D as f32).sqrt();
    let (row, ahead) = row.split_at_mut(count.next_multiple_of(LANES));
    ahead.fill(0.0);
    // Shares beyond `count` are zero.
    let mean = sum(row.len(), |j| row[j] * shares[j]);
    for (x, share) in row.iter_mut().zip(shares) {
        *x = scale * share * (*x - mean);
    }
}

/// `sum_i weights[i][j] rows_i` over all `i` from `j` on, in two sums that do not wait for each
/// other.
#[inline(always)]
fn gathered<const D: usize>(
    weights: &[f32],
    padded: usize,
    j: usize,
    rows: &[[f32; D]],
) -> [f32; D] {
    let (mut one, mut two) = ([0.0; D], [0.0; D]);
    let (pairs, rest) = rows[j..].as_chunks::<PAIR>();
    let at = |i: usize| weights[(j + i) * padded + j];
    for (pair, [a, b]) in pairs.iter().enumerate() {
        let (x, y) = (at(PAIR * pair), at(PAIR * pair + 1));
        for d in 0..D {
            one[d] = fma(x, a[d], one[d]);
            two[d] = fma(y, b[d], two[d]);
        }
    }
    for row in rest {
        let x = at(PAIR * pairs.len());
        for d in 0..D {
            one[d] = fma(x, row[d], one[d]);
        }
    }
    core::array::from_fn(|d| one[d] + two[d])
}
