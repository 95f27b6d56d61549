//! Random numbers: what is drawn spreads as it should, and each source for itself.

use crate::common;

use remora_truth::{Dispersion, Drift, Errors, Source, Stream, World};
use std::collections::BTreeMap;

/// Mean and standard deviation.
fn spread(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / count).sqrt())
}

#[test]
fn quantities_read_back_spread_as_the_errors_say() {
    let setup = common::setup(common::servicer());
    let errors = Errors::typical();
    let mut rows: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for run in 0..500 {
        let dispersion = Dispersion { errors: errors.clone(), seed: 1, run };
        for quantity in World::new(&setup, &dispersion).unwrap().read_back() {
            rows.entry(quantity.name).or_default().push(quantity.value);
        }
    }
    let degree = 1f64.to_radians();
    for (name, mean, deviation) in [
        ("mass.bus.mass", 500.0, 15.0),
        ("mass.bus.inertia.xx", 83.3, 83.3 * (0.03f64.powi(2) + 0.07f64.powi(2)).sqrt()),
        ("mass.bus.center.y", 0.0, 5e-3),
        ("mass.link[2].center.z", 0.15, 2e-3),
        ("mass.link[1].mass", 10.0, 0.3),
        ("thrusters.x.x", 1.0, 0.03),
        ("thrusters.x.y", 0.0, degree),
        ("wheels.scale[2]", 1.0, 0.02),
        ("wheels.bias[0]", 0.0, 5e-5),
        ("joints.scale[1]", 1.0, 0.03),
        ("joints.bias[2]", 0.0, 5e-5),
        ("joints.angle_bias[0]", 0.0, 5e-4),
        ("geometry.port.x", 0.0, 5e-3),
        ("geometry.arm_base.z", 0.116, 2e-3),
        ("geometry.wrist_camera.y", 0.0, 1e-3),
        ("orbit.drag", 0.0, 2e-6),
        ("orbit.disturbance.z", 0.0, 2e-5),
        ("tumble.inertia.y", 3.0, 0.06),
        ("navigation.position_drift.x", 0.0, 3e-3),
        ("navigation.attitude_drift.y", 0.0, 0.05 * degree),
        ("navigation.target_attitude_drift.z", 0.0, 0.3 * degree),
    ] {
        let (found, spread) = spread(&rows[name]);
        assert!((found - mean).abs() < 0.2 * deviation, "{name}: mean {found}");
        assert!((spread / deviation - 1.0).abs() < 0.12, "{name}: deviation {spread}");
    }
    // No two of all numbers drawn are correlated but for those that are one draw.
    let classes = ["wheels", "joints", "orbit.d"];
    let all: Vec<(&String, Vec<f64>)> = rows
        .iter()
        .map(|(name, values)| (name, values, spread(values)))
        .filter(|(name, _, s)| s.1 > 0.0 && classes.iter().any(|p| name.starts_with(p)))
        .map(|(name, values, s)| (name, values.iter().map(|v| (v - s.0) / s.1).collect()))
        .collect();
    for (i, a) in all.iter().enumerate() {
        for b in &all[..i] {
            let sum: f64 = a.1.iter().zip(&b.1).map(|(x, y)| x * y).sum();
            assert!((sum / 500.0).abs() < 0.2, "{} and {}: {}", a.0, b.0, sum / 500.0);
        }
    }
}

#[test]
fn streams_are_normal_and_independent() {
    let draw = |seed, run, source| {
        let mut stream = Stream::new(seed, run, source);
        (0..20_000).map(|_| stream.normal()).collect::<Vec<f64>>()
    };
    let one = draw(1, 2, Source::WheelBias);
    let (mean, deviation) = spread(&one);
    assert!(mean.abs() < 0.025 && (deviation - 1.0).abs() < 0.02, "{mean} {deviation}");
    let within = one.iter().filter(|x| x.abs() < 1.0).count() as f64 / 20_000.0;
    assert!((within - 0.6827).abs() < 0.011, "{within}");
    let fourth = one.iter().map(|x| x.powi(4)).sum::<f64>() / 20_000.0;
    assert!((fourth - 3.0).abs() < 0.25, "{fourth}");
    for other in [
        draw(2, 2, Source::WheelBias),
        draw(1, 3, Source::WheelBias),
        draw(1, 2, Source::WheelScale),
        one[1..].iter().chain(&one[..1]).copied().collect(),
    ] {
        let sum: f64 = one.iter().zip(&other).map(|(a, b)| a * b).sum();
        assert!((sum / 20_000.0).abs() < 0.03);
    }
}

#[test]
fn drift_is_stationary_and_forgets_with_its_time_constant() {
    for step in [3.0, 40.0] {
        let mut drift = Drift::new(Stream::new(3, 1, Source::PositionDrift), 3e-3, 200.0);
        let mut values = vec![];
        for _ in 0..400_000 {
            values.push(drift.value().x);
            drift.advance(step);
        }
        let (mean, deviation) = spread(&values);
        assert!(mean.abs() < 3e-4, "{mean}");
        assert!((deviation / 3e-3 - 1.0).abs() < 0.04, "{deviation}");
        let lag = (200.0f64 / step).round() as usize;
        let products = values.iter().zip(&values[lag..]).map(|(a, b)| a * b);
        let kept = products.sum::<f64>() / (values.len() - lag) as f64 / (deviation * deviation);
        let wanted = (-(lag as f64) * step / 200.0).exp();
        assert!((kept - wanted).abs() < 0.04, "{kept} {wanted}");
    }
}
