//! Programs of any size from a seed, and how they are solved.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use remora_qp::nalgebra::{SMatrix, SVector};
use remora_qp::time::Deadline;
use remora_qp::{EmbeddedQp, InteriorPointSettings, Qp, QpOutcome, QpSolver, Solution, Validate};

/// How a random program is made.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    pub seed: u64,
    /// Whether the dynamics may be violated at a price. Some intervals then have to be.
    pub soft: bool,
    /// Share of bounds that are infinite.
    pub open: f64,
    /// Least curvature of the cost; the rest of it has rank one.
    pub curvature: f64,
    /// Largest distance of a bound from a feasible point.
    pub width: f64,
    /// Size of the linear cost: the larger, the more bounds are active.
    pub slope: f64,
}

impl Recipe {
    pub const PLAIN: Self =
        Self { seed: 1, soft: true, open: 0.1, curvature: 0.1, width: 1.0, slope: 1.0 };
    pub const HARD: Self = Self { soft: false, ..Self::PLAIN };
}

/// `count` cases, the same in every run: a build must not depend on luck. `PROPTEST_RNG_SEED=N`
/// looks at others.
pub fn cases(count: u32) -> ProptestConfig {
    let mut config =
        ProptestConfig { cases: count, failure_persistence: None, ..Default::default() };
    if std::env::var_os("PROPTEST_RNG_SEED").is_none() {
        config.rng_seed = RngSeed::Fixed(1);
    }
    config
}

/// Recipes of strictly convex programs.
pub fn recipes() -> impl Strategy<Value = Recipe> {
    let sizes = (0.0..0.5f64, -2.0..1.0f64, -2.0..1.0f64, -1.0..1.0f64);
    (any::<u64>(), any::<bool>(), sizes).prop_map(
        |(seed, soft, (open, curvature, width, slope))| {
            let [curvature, width, slope] = [curvature, width, slope].map(|x| 10f64.powf(x));
            Recipe { seed, soft, open, curvature, width, slope }
        },
    )
}

/// Uniform numbers.
struct Numbers(ChaCha8Rng);

impl Numbers {
    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [-1, 1).
    fn next(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn matrix<const R: usize, const C: usize>(&mut self, size: f64) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|_, _| size * self.next())
    }

    /// Bounds around `point`, strictly where they are finite.
    fn bounds<const R: usize>(
        &mut self,
        point: &SVector<f64, R>,
        recipe: &Recipe,
    ) -> [SVector<f64, R>; 2] {
        [-1.0, 1.0].map(|side| {
            point.map(|value| {
                let distance = recipe.width * (0.1 + 0.9 * self.unit());
                let open = self.unit() < recipe.open;
                value + side * if open { f64::INFINITY } else { distance }
            })
        })
    }
}

/// A program with a feasible point strictly inside its boxes: the first state is pinned, the last
/// as far as one control reaches, the rest has bounds around a roll-out.
pub fn random<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    recipe: &Recipe,
) -> Box<Qp<N, NX, NU, NG>> {
    let mut numbers = Numbers(ChaCha8Rng::seed_from_u64(recipe.seed));
    let mut qp = Box::new(Qp::<N, NX, NU, NG>::ZERO);
    qp.constant = numbers.next();
    qp.defect_penalty = if recipe.soft { 2.0 + 8.0 * numbers.unit() } else { f64::INFINITY };
    qp.path_penalty = 10.0 * numbers.unit();
    let mut x: SVector<f64, NX> = numbers.matrix(0.5);
    for k in 0..N {
        let stage = &mut qp.stages[k];
        hessian(&mut numbers, recipe, stage);
        stage.gradient_x = numbers.matrix(recipe.slope);
        [stage.lower_x, stage.upper_x] = match k {
            0 => [x, x],
            _ => numbers.bounds(&x, recipe),
        };
        if k + 1 == N {
            for i in 0..NX.min(NU) {
                (stage.lower_x[i], stage.upper_x[i]) = (x[i], x[i]);
            }
        }
        stage.path_jacobian = numbers.matrix(1.0);
        let margin: SVector<f64, NG> = numbers.matrix(0.5 * recipe.width);
        stage.path_offset = margin - stage.path_jacobian * x;
        if k + 1 < N {
            let u: SVector<f64, NU> = numbers.matrix(0.5);
            stage.gradient_u = numbers.matrix(recipe.slope);
            [stage.lower_u, stage.upper_u] = numbers.bounds(&u, recipe);
            stage.a = numbers.matrix(1.5 / (NX as f64).sqrt());
            stage.b = numbers.matrix(1.0);
            stage.c = numbers.matrix(0.3);
            x = stage.a * x + stage.b * u + stage.c;
            if recipe.soft && numbers.unit() < 0.3 {
                let beyond: SVector<f64, NX> = numbers.matrix(3.0 * recipe.width);
                stage.c += beyond;
            }
        }
    }
    qp
}

/// A Hessian of rank one and the recipe's curvature.
fn hessian<const NX: usize, const NU: usize, const NG: usize>(
    numbers: &mut Numbers,
    recipe: &Recipe,
    stage: &mut remora_qp::QpStage<NX, NU, NG>,
) {
    let (x, u): (SVector<f64, NX>, SVector<f64, NU>) = (numbers.matrix(1.5), numbers.matrix(1.5));
    stage.hessian_xx = x * x.transpose() + SMatrix::identity() * recipe.curvature;
    stage.hessian_ux = u * x.transpose();
    stage.hessian_uu = u * u.transpose() + SMatrix::identity() * recipe.curvature;
}

/// The embedded solver on the heap.
#[inline(never)]
pub fn embedded<const N: usize, const NX: usize, const NU: usize, const NG: usize>()
-> Box<EmbeddedQp<N, NX, NU, NG>> {
    Box::new(EmbeddedQp::new())
}

/// The same, which goes on as long as numbers allow.
pub fn sharp<const N: usize, const NX: usize, const NU: usize, const NG: usize>()
-> Box<EmbeddedQp<N, NX, NU, NG>> {
    let mut solver = embedded();
    solver.configure(
        InteriorPointSettings { complementarity: 1e-17, ..solver.settings() }.validated().unwrap(),
    );
    solver
}

/// An answer.
#[derive(Clone, Debug)]
pub struct Answer<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    pub point: Box<Solution<N, NX, NU, NG>>,
    pub outcome: QpOutcome,
}

/// Solves from nothing.
pub fn cold<S, const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    solver: &mut S,
    qp: &Qp<N, NX, NU, NG>,
) -> Answer<N, NX, NU, NG>
where
    S: QpSolver<N, NX, NU, NG>,
{
    let mut point = Box::new(Solution::ZERO);
    solver.reset();
    let outcome = solver.solve(qp, &mut point, &Deadline::never());
    Answer { point, outcome }
}

/// Solves into an earlier answer's point, without a reset.
pub fn next<S, const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    solver: &mut S,
    qp: &Qp<N, NX, NU, NG>,
    from: &Answer<N, NX, NU, NG>,
) -> Answer<N, NX, NU, NG>
where
    S: QpSolver<N, NX, NU, NG>,
{
    let mut point = from.point.clone();
    let outcome = solver.solve(qp, &mut point, &Deadline::never());
    Answer { point, outcome }
}

/// All bits of a point.
pub fn bits<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    point: &Solution<N, NX, NU, NG>,
) -> Vec<u64> {
    let mut bits = Vec::new();
    let mut add = |values: &[f64]| bits.extend(values.iter().map(|v| v.to_bits()));
    for k in 0..N {
        add(point.x[k].as_slice());
        add(point.u[k].as_slice());
        add(point.defect_multiplier[k].as_slice());
        add(point.bound_multiplier_x[k].as_slice());
        add(point.bound_multiplier_u[k].as_slice());
        add(point.path_multiplier[k].as_slice());
    }
    bits
}
