//! Variables between their bounds, against the barriers' own formulas.

use super::*;

fn placed(bounds: (f64, f64), wanted: f64, multiplier: f64, mu: f64) -> Bounded<1> {
    let mut bounded = Bounded::FREE;
    bounded.place(0, bounds, wanted, multiplier, mu);
    bounded
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * (1.0 + b.abs())
}

/// Value, distances and multipliers of the lower and the upper bound.
fn all(bounded: &Bounded<1>) -> [f64; 5] {
    let Bounded { value, lower, upper } = bounded;
    [value[0], lower.distance[0], lower.multiplier[0], upper.distance[0], upper.multiplier[0]]
}

#[test]
fn a_variable_starts_inside_with_products_of_mu() {
    let mu = 0.1;
    for ((bounds, wanted, multiplier), expected) in [
        // In the middle nothing is moved: products are mu.
        (((-1.0, 3.0), 0.0, 0.0), [0.0, 1.0, 0.1, 3.0, 0.1 / 3.0]),
        // A tenth from a bound, whose multiplier is then one.
        (((-1.0, 3.0), 9.0, 0.0), [2.9, 3.9, 0.1 / 3.9, 0.1, 1.0]),
        (((-1.0, 3.0), -9.0, 0.0), [-0.9, 0.1, 1.0, 3.9, 0.1 / 3.9]),
        // A multiplier of five asks for a distance of mu over five.
        (((-1.0, 3.0), 9.0, 5.0), [2.98, 3.98, 0.1 / 3.98, 0.02, 5.0]),
        (((-1.0, 3.0), -9.0, -5.0), [-0.98, 0.02, 5.0, 3.98, 0.1 / 3.98]),
        // Where a larger product is wanted it is kept.
        (((-1.0, 3.0), 1.0, 5.0), [1.0, 2.0, 0.05, 2.0, 5.0]),
        // Narrow bounds are kept off by a quarter.
        (((0.0, 0.2), -9.0, 0.0), [0.05, 0.05, 2.0, 0.15, 0.1 / 0.15]),
        (((0.0, 0.2), 9.0, 0.0), [0.15, 0.15, 0.1 / 0.15, 0.05, 2.0]),
        // Bounds that are not there have a distance of one and no multiplier.
        (((-1.0, f64::INFINITY), 4.0, 0.0), [4.0, 5.0, 0.02, 1.0, 0.0]),
        (((f64::NEG_INFINITY, 3.0), 9.0, 0.0), [2.9, 1.0, 0.0, 0.1, 1.0]),
        (((f64::NEG_INFINITY, f64::INFINITY), 9.0, 3.0), [9.0, 1.0, 0.0, 1.0, 0.0]),
    ] {
        let bounded = placed(bounds, wanted, multiplier, mu);
        let found = all(&bounded);
        let same = found.iter().zip(&expected).all(|(a, b)| is_near(*a, *b));
        assert!(same, "{bounds:?} {wanted} {multiplier}: {found:?}");
        let count = u32::from(bounds.0.is_finite()) + u32::from(bounds.1.is_finite());
        assert_eq!(bounded.pairs(), count);
        let (lower, upper) = (found[2], found[4]);
        assert!(is_near(bounded.multipliers()[0], upper - lower));
        let scaling = lower / found[1] + upper / found[3];
        assert!(is_near(bounded.scaling()[0], scaling), "{}", bounded.scaling()[0]);
    }
}

#[test]
fn a_fixed_variable_has_neither_bounds_nor_limits() {
    let mut bounded = placed((-1.0, 3.0), 0.0, 0.0, 0.1);
    bounded.fix(0, 2.5);
    assert_eq!(all(&bounded), [2.5, 1.0, 0.0, 1.0, 0.0]);
    assert_eq!((bounded.pairs(), bounded.scaling(), bounded.multipliers()), (0, [0.0], [0.0]));
    let mut worst = [0.0];
    bounded.limit_step(&[1e9], target(&[0.0], 0.0, 0.0), &mut worst);
    assert_eq!(worst, [0.0]);
    bounded.advance(&[0.0], target(&[0.0], 0.1, 1.0), 1.0);
    assert_eq!(all(&bounded), [2.5, 1.0, 0.0, 1.0, 0.0]);
}

fn target<const D: usize>(affine: &[f64; D], sigma_mu: f64, corrector: f64) -> Target<'_, D> {
    Target { centering: Centering { sigma_mu, corrector }, affine }
}

/// Variables whose pairs are far from central, one of each kind of bounds.
fn several() -> Bounded<4> {
    let mut bounded = Bounded::FREE;
    bounded.place(0, (-1.0, 3.0), 0.5, 0.7, 0.1);
    bounded.place(1, (-2.0, f64::INFINITY), 1.0, -0.4, 0.3);
    bounded.place(2, (f64::NEG_INFINITY, 1.5), 0.25, 0.9, 0.2);
    bounded.place(3, (f64::NEG_INFINITY, f64::INFINITY), 0.25, 0.0, 0.2);
    bounded
}

/// Where there is no corrector, the gradient is that of `-mu ln s`.
#[test]
fn the_barrier_s_gradient_is_the_logarithm_s() {
    let bounded = several();
    let mu = 0.05;
    let found = bounded.barrier_gradient(target(&[0.3; 4], mu, 0.0));
    let expected = [-mu / 1.5 + mu / 2.5, -mu / 3.0, mu / 1.25, 0.0];
    assert!((0..4).all(|i| is_near(found[i], expected[i])), "{found:?}");
}

/// Pairs of variable `i` that exist: distance, multiplier, sign of the distance's step.
fn pairs(bounded: &Bounded<4>, i: usize) -> impl Iterator<Item = (f64, f64, f64)> {
    let sides = [(bounded.lower, 1.0), (bounded.upper, -1.0)];
    let exists = move |(side, _): &(Side<4>, f64)| side.inverse[i] != 0.0;
    sides
        .into_iter()
        .filter(exists)
        .map(move |(side, sign)| (side.distance[i], side.multiplier[i], sign))
}

/// Step of the multiplier by the definition `s dz + z ds = sigma mu - s z - corrector ds_aff dz_aff`.
fn multiplier_step((s, z): (f64, f64), ds: f64, affine: f64, sigma_mu: f64, corrector: f64) -> f64 {
    let affine_z = (-s * z - z * affine) / s;
    (sigma_mu - s * z - corrector * affine * affine_z - z * ds) / s
}

const AFFINE: [f64; 4] = [0.6, -0.8, 0.4, 1.0];
const STEP: [f64; 4] = [0.5, -0.9, 0.3, -2.0];

#[test]
fn products_after_a_step_are_those_of_linear_complementarity() {
    let bounded = several();
    for (sigma_mu, corrector) in [(0.0, 0.0), (0.02, 0.0), (0.02, 1.0), (0.3, 0.5)] {
        let target = target(&AFFINE, sigma_mu, corrector);
        let gradient = bounded.barrier_gradient(target);
        for length in [0.0, 0.3, 1.0] {
            let mut sum = [1.0; 4];
            bounded.add_complementarity_after(&STEP, target, length, &mut sum);
            let mut moved = bounded;
            moved.advance(&STEP, target, length);
            let (mut products, mut most) = ([1.0; 4], [0.0; 4]);
            moved.add_complementarity(&mut products, &mut most);
            for i in 0..4 {
                let (mut expected, mut largest, mut slope) = (1.0, 0.0f64, 0.0);
                for (s, z, sign) in pairs(&bounded, i) {
                    let (ds, affine) = (sign * STEP[i], sign * AFFINE[i]);
                    let dz = multiplier_step((s, z), ds, affine, sigma_mu, corrector);
                    let product = (s + length * ds) * (z + length * dz);
                    expected += product;
                    largest = largest.max(product);
                    // The barrier's term is what the multiplier becomes where the variable stands still.
                    let still = multiplier_step((s, z), 0.0, affine, sigma_mu, corrector);
                    slope -= sign * (z + still);
                }
                assert!(is_near(sum[i], expected), "{i}: {} {expected}", sum[i]);
                assert!(is_near(products[i], expected), "{i}: {} {expected}", products[i]);
                assert!(is_near(most[i], largest), "{i}: {} {largest}", most[i]);
                assert!(is_near(gradient[i], slope), "{i}: {} {slope}", gradient[i]);
                assert!(is_near(moved.value[i], bounded.value[i] + length * STEP[i]));
            }
        }
    }
}

/// A step of the inverse of what is found takes one distance or multiplier to zero, and no other below.
#[test]
fn the_longest_step_ends_at_a_bound() {
    let bounded = several();
    for scale in [-20.0, -1.0, -0.1, 0.1, 1.0, 20.0] {
        let step = STEP.map(|v| scale * v);
        for (sigma_mu, corrector) in [(0.0, 0.0), (0.02, 1.0)] {
            let target = target(&AFFINE, sigma_mu, corrector);
            let mut worst = [0.0; 4];
            bounded.limit_step(&step, target, &mut worst);
            for i in 0..4 {
                let after = |length: f64| {
                    pairs(&bounded, i).fold(f64::INFINITY, |least, (s, z, sign)| {
                        let (ds, affine) = (sign * step[i], sign * AFFINE[i]);
                        let dz = multiplier_step((s, z), ds, affine, sigma_mu, corrector);
                        least.min((s + length * ds) / s).min((z + length * dz) / z)
                    })
                };
                match worst[i] > 0.0 {
                    true => assert!(after(1.0 / worst[i]).abs() < 1e-13, "{i} of {scale}"),
                    false => assert!(after(1e6) > 0.0, "{i} of {scale}"),
                }
            }
            // A worse value from before stays.
            let mut kept = [1e9; 4];
            bounded.limit_step(&step, target, &mut kept);
            assert_eq!(kept, [1e9; 4]);
        }
    }
}

/// Every one of `D` variables moves, whatever `D` is a multiple of; distances stay those to the bounds.
fn all_advance<const D: usize>() {
    let mut bounded = Bounded::<D>::FREE;
    for i in 0..D {
        bounded.place(i, (-1.0, 2.0 + i as f64), 0.0, 0.0, 0.1);
    }
    let step: [f64; D] = core::array::from_fn(|i| 0.1 + 0.05 * i as f64);
    let before = bounded;
    bounded.advance(&step, target(&[0.0; D], 0.1, 0.0), 0.5);
    for i in 0..D {
        assert!(is_near(bounded.value[i], 0.5 * step[i]));
        assert!(is_near(bounded.lower.distance[i], bounded.value[i] + 1.0));
        assert!(is_near(bounded.upper.distance[i], 2.0 + i as f64 - bounded.value[i]));
        for side in [bounded.lower, bounded.upper] {
            assert!(is_near(side.inverse[i] * side.distance[i], 1.0));
        }
        // Distances change, products tend to mu: the nearer bound's multiplier rises.
        assert!(bounded.upper.multiplier[i] > before.upper.multiplier[i]);
        assert!(bounded.lower.multiplier[i] < before.lower.multiplier[i]);
    }
    let mut free = Bounded::<D>::FREE;
    free.move_by(&step, 2.0);
    assert!((0..D).all(|i| is_near(free.value[i], 2.0 * step[i])));
}

#[test]
fn all_variables_advance() {
    all_advance::<1>();
    all_advance::<2>();
    all_advance::<3>();
    all_advance::<4>();
    all_advance::<5>();
    all_advance::<6>();
    all_advance::<7>();
    all_advance::<9>();
}

/// Variables at their bounds move away from them, and keep the side that pushes.
#[test]
fn recentring_keeps_bounds_and_raises_products() {
    let mut bounded = Bounded::<4>::FREE;
    bounded.place(0, (-1.0, 3.0), 9.0, 2.0, 1e-9);
    bounded.place(1, (-2.0, f64::INFINITY), -9.0, -0.5, 1e-9);
    bounded.place(2, (f64::NEG_INFINITY, 1.5), 9.0, 0.0, 1e-9);
    bounded.place(3, (f64::NEG_INFINITY, f64::INFINITY), 0.25, 0.0, 1e-9);
    let mu = 0.01;
    bounded.recentre(mu);
    assert_eq!((bounded.pairs(), bounded.value[3]), (4, 0.25));
    for (i, bounds) in [(0, (-1.0, 3.0)), (1, (-2.0, f64::INFINITY)), (2, (f64::NEG_INFINITY, 1.5))]
    {
        for (s, z, sign) in pairs(&bounded, i) {
            assert!(s * z >= 0.999 * mu, "{i}: {}", s * z);
            let bound = if sign > 0.0 { bounds.0 } else { bounds.1 };
            assert!(is_near(s, sign * (bounded.value[i] - bound)));
        }
    }
    // Multipliers of 2 and 1/2 were known before: they say how near the bounds are.
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found}");
    near(bounded.upper.distance[0], mu / 2.0);
    near(bounded.upper.multiplier[0], 2.0);
    near(bounded.lower.distance[1], mu / 0.5);
}

#[test]
fn the_larger_number_is_never_one_that_is_none() {
    assert_eq!((larger(1.0, 2.0), larger(2.0, 1.0), larger(-2.0, -3.0)), (2.0, 2.0, -2.0));
    assert_eq!(larger(f64::NAN, 1.0), 1.0);
    assert!(larger(1.0, f64::NAN).is_nan());
    // Of two zeros the second.
    assert!(larger(0.0, -0.0).is_sign_negative());
}
