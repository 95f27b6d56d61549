//! Bits of answers to fixed programs, the same on every target. Whoever changes the method on purpose copies what
//! the test prints.

use super::common::edge::{Case, SOLVABLE, UNSOLVABLE, made};
use super::common::programs::{Answer, Recipe, bits, cold, embedded, random, sharp};
use remora_qp::time::Deadline;
use remora_qp::{Checksum, EmbeddedQp, InteriorPointSettings, Qp, QpSolver, QpStatus, Validate};

/// Answers of a family of programs.
struct Family {
    iterations: u32,
    solved: u32,
    checksum: Checksum,
}

impl Family {
    const EMPTY: Self = Self { iterations: 0, solved: 0, checksum: Checksum::new() };

    fn add<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &mut self,
        answer: &Answer<N, NX, NU, NG>,
    ) {
        self.iterations += answer.outcome.iterations;
        self.solved += u32::from(answer.outcome.status == QpStatus::Solved);
        self.checksum.integer(answer.outcome.status.code().into());
        self.checksum.integer(answer.outcome.iterations.into());
        // Of a NaN only that it is one.
        let point = bits(&answer.point);
        point
            .iter()
            .filter(|v| !f64::from_bits(**v).is_nan())
            .for_each(|v| self.checksum.integer(*v));
    }

    fn found(&self) -> (u32, u32, u64) {
        (self.iterations, self.solved, self.checksum.value())
    }
}

/// Families of one test: iterations, how many were solved, checksum.
fn are<const F: usize>(families: [Family; F], expected: [(u32, u32, u64); F]) {
    let found = families.map(|family| family.found());
    let lines = found.map(|(n, solved, sum)| format!("({n}, {solved}, 0x{sum:016x}),"));
    assert_eq!(found, expected, "\n{}", lines.join("\n"));
}

/// Programs of one size, of every kind in turn.
fn recipes(count: u64, like: Recipe) -> impl Iterator<Item = Recipe> {
    (0..count).map(move |seed| Recipe {
        seed,
        width: [0.03, 0.3, 3.0][(seed % 3) as usize],
        slope: [0.3, 5.0][(seed / 3 % 2) as usize],
        curvature: [0.01, 1.0][(seed / 6 % 2) as usize],
        ..like
    })
}

fn family<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    solver: &mut EmbeddedQp<N, NX, NU, NG>,
    count: u64,
    like: Recipe,
    change: impl Fn(&mut Qp<N, NX, NU, NG>),
) -> Family {
    let mut family = Family::EMPTY;
    for recipe in recipes(count, like) {
        let mut qp = random::<N, NX, NU, NG>(&recipe);
        change(&mut qp);
        family.add(&cold(solver, &qp));
    }
    family
}

const SOFT: Recipe = Recipe::PLAIN;
const HARD: Recipe = Recipe::HARD;

#[test]
fn soft_dynamics() {
    are(
        [family(&mut *embedded::<12, 4, 2, 1>(), 48, SOFT, |_| ())],
        [(1203, 48, 0x9817_cd29_89a7_4b9c)],
    );
}

#[test]
fn hard_dynamics() {
    are(
        [family(&mut *embedded::<12, 4, 2, 1>(), 48, HARD, |_| ())],
        [(613, 48, 0x6efc_732e_2674_039e)],
    );
}

#[test]
fn two_stages() {
    are(
        [family(&mut *embedded::<2, 1, 1, 1>(), 96, SOFT, |_| ())],
        [(928, 96, 0x08ca_b920_b198_f132)],
    );
}

#[test]
fn a_planner_s_size() {
    let hard = family(&mut *embedded::<10, 12, 6, 1>(), 6, HARD, |_| ());
    let soft = family(&mut *embedded::<10, 12, 6, 1>(), 6, SOFT, |_| ());
    are([hard, soft], [(89, 6, 0xb09e_a6af_dcc9_2627), (169, 6, 0xb7a5_124f_c1cc_2bf3)]);
}

/// Dynamics whose rounding grows from stage to stage.
#[test]
fn long_horizons() {
    let hard = family(&mut *embedded::<60, 5, 2, 1>(), 12, HARD, |_| ());
    let soft = family(&mut *embedded::<60, 5, 2, 1>(), 12, SOFT, |_| ());
    are([hard, soft], [(199, 12, 0xebf6_930c_8296_9d6b), (446, 10, 0x7a77_0982_223a_3bcb)]);
}

/// As far as numbers allow: where rounding ends the iteration.
#[test]
fn to_the_last_digit() {
    let hard = family(&mut *sharp::<12, 4, 2, 1>(), 24, HARD, |_| ());
    let soft = family(&mut *sharp::<12, 4, 2, 1>(), 24, SOFT, |_| ());
    are([hard, soft], [(514, 22, 0x6019_d688_0198_6394), (991, 3, 0x39ea_5740_8e40_8a02)]);
}

#[test]
fn to_what_is_asked_for() {
    let families = [1e-8, 1e-5].map(|asked| {
        family(&mut *embedded::<12, 4, 2, 1>(), 24, HARD, |qp| qp.complementarity = asked)
    });
    are(families, [(263, 24, 0x0898_60a1_befa_14dc), (232, 24, 0xd109_8580_4d2d_f1de)]);
}

#[test]
fn a_fixed_number_of_iterations() {
    let mut solver = embedded::<12, 4, 2, 1>();
    let settings = InteriorPointSettings { fixed_iterations: Some(20), ..Default::default() };
    solver.configure(settings.validated().unwrap());
    are([family(&mut *solver, 24, HARD, |_| ())], [(480, 24, 0x6c95_ef53_2af4_ebab)]);
}

#[test]
fn few_iterations() {
    let mut solver = embedded::<12, 4, 2, 1>();
    let settings = InteriorPointSettings { max_iterations: 12, ..Default::default() };
    solver.configure(settings.validated().unwrap());
    are([family(&mut *solver, 24, SOFT, |_| ())], [(288, 0, 0x09c0_d166_8a80_ce60)]);
}

/// Without a solution: the certificate's programs, and those that only stall.
#[test]
fn out_of_reach() {
    let far = |by: f64| move |qp: &mut Qp<12, 4, 2, 1>| qp.stages[3].c.fill(by);
    let hard = family(&mut *embedded(), 24, HARD, far(4.0));
    let soft = family(&mut *embedded(), 24, SOFT, far(40.0));
    are([hard, soft], [(1680, 1, 0xf2bc_566e_2640_980a), (994, 11, 0x49c2_8859_7bf5_bc4f)]);
}

#[test]
fn second_order_corrections() {
    let mut family = Family::EMPTY;
    for recipe in recipes(24, HARD).chain(recipes(24, SOFT)) {
        let mut qp = random::<12, 4, 2, 1>(&recipe);
        let mut solver = embedded();
        let mut answer = cold(&mut *solver, &qp);
        for stage in &mut qp.stages {
            stage.path_offset.add_scalar_mut(0.05);
            stage.gradient_x *= 1.1;
        }
        answer.outcome = solver.solve_again(&qp, &mut answer.point, &Deadline::never());
        family.add(&answer);
    }
    are([family], [(609, 48, 0x5b53_351e_8488_8f72)]);
}

#[test]
fn the_edge() {
    let of = |cases: &mut dyn Iterator<Item = &'static Case>| {
        let mut family = Family::EMPTY;
        cases.for_each(|case| family.add(&cold(&mut *embedded(), &made(case))));
        family
    };
    let families = [of(&mut SOLVABLE.iter()), of(&mut UNSOLVABLE.iter().map(|case| &case.0))];
    are(families, [(722, 31, 0x2c04_7f25_0bb9_29d0), (32, 0, 0x0e55_6151_16ff_cb2a)]);
}
