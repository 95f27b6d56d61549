//! DOP853: its order, its accuracy on problems with known solutions, where its steps end.

use remora_truth::dop853::{Dop853, Equation, IntegrationError, Tolerance};

/// Two bodies, mu = 1.
struct Kepler;

impl Equation for Kepler {
    type State = [f64; 4];

    fn slope(&self, _: f64, y: &[f64; 4]) -> [f64; 4] {
        let r3 = (y[0] * y[0] + y[1] * y[1]).powf(1.5);
        [y[2], y[3], -y[0] / r3, -y[1] / r3]
    }
}

const E: f64 = 0.1;

/// Position and velocity on the ellipse of semi-major axis 1 at a time after perigee.
fn ellipse(time: f64) -> [f64; 4] {
    let mut anomaly = time;
    for _ in 0..50 {
        anomaly -= (anomaly - E * anomaly.sin() - time) / (1.0 - E * anomaly.cos());
    }
    let (s, c) = anomaly.sin_cos();
    let (b, per) = ((1.0 - E * E).sqrt(), 1.0 / (1.0 - E * c));
    [c - E, b * s, -s * per, b * c * per]
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

const FINE: Tolerance = Tolerance { absolute: 1e-14, relative: 1e-14 };

/// Slope of error over step, both as logarithms, from the first to the last.
fn order(errors: &[(f64, f64)]) -> f64 {
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    (first.1 / last.1).ln() / (first.0 / last.0).ln()
}

#[test]
fn global_error_is_of_order_eight() {
    let end = 5.0;
    let errors = [16, 24, 32, 48].map(|steps| {
        let (mut y, h) = (ellipse(0.0), end / f64::from(steps));
        let mut integrator = Dop853::new(FINE, 1.0);
        for i in 0..steps {
            y = integrator.fixed(&Kepler, f64::from(i) * h, &y, h);
        }
        (h, distance(&y, &ellipse(end)))
    });
    let order = order(&errors);
    println!("errors {errors:?}, order {order:.2}");
    assert!((7.5..8.5).contains(&order), "{errors:?}: order {order}");
}

#[test]
fn dense_output_is_of_order_seven() {
    // Error in the middle of one step: of order h^8.
    let errors = [0.4, 0.2, 0.1].map(|h: f64| {
        let (start, y) = (0.3, ellipse(0.3));
        let mut integrator = Dop853::new(Tolerance { absolute: 1.0, relative: 1.0 }, h);
        let (end, after) = integrator.advance(&Kepler, start, &y, 10.0).unwrap();
        assert_eq!(end, start + h);
        let segment = integrator.segment(&Kepler, (start, &y), (end, &after));
        assert_eq!(segment.at(start), y);
        assert!(distance(&segment.at(end), &after) < 1e-15);
        let (part, whole) = (segment.part::<2>(1, end - 0.01), segment.at(end - 0.01));
        assert!(distance(&part, &whole[1..3]) < 1e-15);
        (h, distance(&segment.at(start + 0.4 * h), &ellipse(start + 0.4 * h)))
    });
    let order = order(&errors);
    println!("errors {errors:?}, order {order:.2}");
    assert!((7.5..9.0).contains(&order), "{errors:?}: order {order}");
}

#[test]
fn an_ellipse_is_followed_to_rounding() {
    let mut integrator = Dop853::new(FINE, 10.0);
    let y = integrator.integrate(&Kepler, 0.0, &ellipse(0.0), 20.0).unwrap();
    let error = distance(&y, &ellipse(20.0));
    println!("error {error:.1e} after three revolutions, steps {:?}", integrator.steps());
    assert!(error < 1e-12, "{error:e}");
    // A looser tolerance costs fewer steps and keeps what it promises, about.
    let tolerance = Tolerance { absolute: 1e-8, relative: 1e-8 };
    let mut loose = Dop853::new(tolerance, 10.0);
    let y = loose.integrate(&Kepler, 0.0, &ellipse(0.0), 20.0).unwrap();
    let error = distance(&y, &ellipse(20.0));
    assert!(error > 1e-11 && error < 1e-5, "{error:e}");
    assert!(loose.steps().0 * 3 < integrator.steps().0);
}

/// `y' = cos t`, which tells at what times it was asked.
struct Clocked(std::cell::RefCell<Vec<f64>>);

impl Equation for Clocked {
    type State = [f64; 1];

    fn slope(&self, time: f64, _: &[f64; 1]) -> [f64; 1] {
        self.0.borrow_mut().push(time);
        [time.cos()]
    }
}

#[test]
fn steps_end_at_the_asked_time_and_never_look_beyond() {
    let clock = Clocked(Vec::new().into());
    let mut integrator = Dop853::new(FINE, f64::INFINITY);
    let mut y = [0.0];
    for k in 0..30 {
        let (from, to) = (f64::from(k) * 0.1, f64::from(k + 1) * 0.1);
        y = integrator.integrate(&clock, from, &y, to).unwrap();
        assert!(clock.0.borrow().iter().all(|&t| t <= to));
    }
    assert!((y[0] - 3f64.sin()).abs() < 1e-14);
    // Intervals cut short do not make the step wanted shorter: one step each.
    assert_eq!(integrator.steps(), (30, 0));
    assert_eq!(clock.0.borrow().len(), 30 * 12);
}

/// Grows without bound before t = 1.
struct Explosion;

impl Equation for Explosion {
    type State = [f64; 1];

    fn slope(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
        [y[0] * y[0]]
    }
}

#[test]
fn what_cannot_be_integrated_is_an_error() {
    let mut integrator = Dop853::new(FINE, f64::INFINITY);
    assert!(integrator.integrate(&Explosion, 0.0, &[1.0], 2.0).is_err());
    assert!(integrator.integrate(&Explosion, 0.0, &[f64::NAN], 2.0).is_err());
}

#[test]
fn no_more_steps_are_taken_than_are_allowed() {
    let mut integrator = Dop853::new(FINE, 0.5);
    integrator.allow(10);
    let stopped = integrator.integrate(&Kepler, 0.0, &ellipse(0.0), 20.0).unwrap_err();
    assert!(matches!(stopped, IntegrationError::TooManySteps { time } if time < 5.0), "{stopped}");
    let (taken, refused) = integrator.steps();
    assert_eq!(taken + refused, 10);
    // It goes on where more are allowed.
    integrator.allow(u64::MAX);
    integrator.integrate(&Kepler, 0.0, &ellipse(0.0), 20.0).unwrap();
}
