//! Sensors: what is measured, when, and when it is told.

use crate::dispersion::Dispersion;
use crate::errors::Sampling;
use crate::random::{Drift, Source, Stream};
use crate::rotation::{Quaternion, exponential, inverse, length, matrix, normalized, product};
use crate::ticker::{SAME, Ticker};
use crate::view::View;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A value and when it was true [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// When it was measured [s].
    pub time: f64,
    /// Measured value.
    pub value: T,
}

/// The newest sample of every sensor that has been told; none before the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement<const NL: usize> {
    /// Origin of the bus's frame from the target's centre of mass, inertial axes [m].
    pub position: Option<Sample<Vector3<f64>>>,
    /// Its velocity relative to the target's centre of mass, non-rotating axes [m/s].
    pub velocity: Option<Sample<Vector3<f64>>>,
    /// Bus to inertial axes.
    pub attitude: Option<Sample<Quaternion>>,
    /// Target body to inertial axes.
    pub target_attitude: Option<Sample<Quaternion>>,
    /// Inertial rate of the bus, bus axes [rad/s].
    pub bus_rate: Option<Sample<Vector3<f64>>>,
    /// Inertial rate of the target, its body axes [rad/s].
    pub target_rate: Option<Sample<Vector3<f64>>>,
    /// Joint angles [rad].
    pub joint_angle: Option<Sample<[f64; NL]>>,
    /// Joint rates [rad/s].
    pub joint_rate: Option<Sample<[f64; NL]>>,
    /// From the tip to the port, axes of the last link [m]; the newest in which the port was seen.
    pub wrist_camera: Option<Sample<Vector3<f64>>>,
}

/// When one sensor samples, and what it has not yet told.
#[derive(Clone, Debug)]
struct Channel<T> {
    ticker: Ticker,
    delay: f64,
    waiting: VecDeque<Sample<T>>,
    told: Option<Sample<T>>,
}

impl<T: Copy> Channel<T> {
    fn new(sampling: Sampling) -> Self {
        let ticker = Ticker::new(sampling.rate_hz);
        Self { ticker, delay: sampling.delay_s, waiting: VecDeque::new(), told: None }
    }

    /// Takes what `measure` gives, if it is time to.
    fn sample(&mut self, time: f64, measure: impl FnOnce() -> Option<T>) {
        if self.ticker.strikes(time)
            && let Some(value) = measure()
        {
            self.waiting.push_back(Sample { time, value });
        }
        while let Some(first) = self.waiting.front()
            && first.time + self.delay <= time + SAME
        {
            self.told = self.waiting.pop_front();
        }
    }

    /// The newest sample told by now.
    fn at(&self, time: f64) -> Option<Sample<T>> {
        let told = self.waiting.iter().rev().find(|s| s.time + self.delay <= time + SAME);
        told.copied().or(self.told)
    }
}

/// A Gauss-Markov process and when it was last looked at.
#[derive(Clone, Debug)]
pub(crate) struct Bias {
    pub drift: Drift,
    time: f64,
}

impl Bias {
    fn at(&mut self, time: f64) -> Vector3<f64> {
        self.drift.advance(time - self.time);
        self.time = time;
        *self.drift.value()
    }
}

/// All sensors.
#[derive(Clone, Debug)]
pub(crate) struct Sensors<const NL: usize> {
    position: Channel<Vector3<f64>>,
    velocity: Channel<Vector3<f64>>,
    attitude: Channel<Quaternion>,
    target_attitude: Channel<Quaternion>,
    bus_rate: Channel<Vector3<f64>>,
    target_rate: Channel<Vector3<f64>>,
    joint_angle: Channel<[f64; NL]>,
    joint_rate: Channel<[f64; NL]>,
    wrist_camera: Channel<Vector3<f64>>,
    pub biases: Biases,
    noises: Noises,
    errors: crate::errors::Errors,
    pub encoder_bias: [f64; NL],
}

/// Errors that drift or are constant.
#[derive(Clone, Debug)]
pub(crate) struct Biases {
    pub position: Bias,
    pub attitude: Bias,
    pub target_attitude: Bias,
    pub wrist_camera: Vector3<f64>,
}

/// White noises.
#[derive(Clone, Debug)]
struct Noises {
    position: Stream,
    velocity: Stream,
    bus_rate: Stream,
    target_rate: Stream,
    joint_angle: Stream,
    joint_rate: Stream,
    wrist_camera: Stream,
}

impl<const NL: usize> Sensors<NL> {
    pub fn new(dispersion: &Dispersion, encoder_bias: [f64; NL]) -> Self {
        let (s, n) = (&dispersion.errors.sensors, &dispersion.errors.navigation);
        let stream = |source| dispersion.stream(source);
        let bias = |source, deviation, time| Bias {
            drift: Drift::new(stream(source), deviation, time),
            time: 0.0,
        };
        Self {
            position: Channel::new(s.position),
            velocity: Channel::new(s.velocity),
            attitude: Channel::new(s.attitude),
            target_attitude: Channel::new(s.target_attitude),
            bus_rate: Channel::new(s.bus_rate),
            target_rate: Channel::new(s.target_rate),
            joint_angle: Channel::new(s.joint_angle),
            joint_rate: Channel::new(s.joint_rate),
            wrist_camera: Channel::new(s.wrist_camera),
            biases: Biases {
                position: bias(Source::PositionDrift, n.position_drift_m, n.position_drift_time_s),
                attitude: bias(
                    Source::AttitudeDrift,
                    n.attitude_drift_rad,
                    n.attitude_drift_time_s,
                ),
                target_attitude: bias(
                    Source::TargetAttitudeDrift,
                    n.target_attitude_drift_rad,
                    n.target_attitude_drift_time_s,
                ),
                wrist_camera: stream(Source::WristCamera)
                    .vector(dispersion.errors.geometry.wrist_camera_m),
            },
            noises: Noises {
                position: stream(Source::PositionNoise),
                velocity: stream(Source::VelocityNoise),
                bus_rate: stream(Source::BusRateNoise),
                target_rate: stream(Source::TargetRateNoise),
                joint_angle: stream(Source::EncoderNoise),
                joint_rate: stream(Source::JointRateNoise),
                wrist_camera: stream(Source::WristCameraNoise),
            },
            errors: dispersion.errors.clone(),
            encoder_bias,
        }
    }

    /// The next instant at which a sensor samples [s].
    pub fn next(&self) -> f64 {
        [
            &self.position.ticker,
            &self.velocity.ticker,
            &self.attitude.ticker,
            &self.target_attitude.ticker,
            &self.bus_rate.ticker,
            &self.target_rate.ticker,
            &self.joint_angle.ticker,
            &self.joint_rate.ticker,
            &self.wrist_camera.ticker,
        ]
        .iter()
        .fold(f64::INFINITY, |first, ticker| first.min(ticker.next()))
    }

    /// All sensors whose time it is look at the true state.
    pub fn sample(&mut self, view: &View<NL>) {
        let (n, time) = (&self.errors.navigation, view.time);
        let (noises, biases) = (&mut self.noises, &mut self.biases);
        self.position.sample(time, || {
            let range = length(&view.bus_position);
            let growth = (range / n.position_drift_range_m).max(1.0);
            let noise = noises.position.vector(n.position_noise_m);
            Some(view.bus_position + biases.position.at(time) * growth + noise)
        });
        self.velocity.sample(time, || {
            Some(view.bus_velocity + noises.velocity.vector(n.velocity_noise_m_s))
        });
        self.attitude.sample(time, || {
            let error = exponential(&biases.attitude.at(time));
            Some(normalized(&product(&error, &view.attitude)))
        });
        self.target_attitude.sample(time, || {
            let error = exponential(&biases.target_attitude.at(time));
            Some(normalized(&product(&error, &view.target.attitude)))
        });
        self.bus_rate.sample(time, || {
            let rate = matrix(&inverse(&view.attitude)) * view.bus_rate;
            Some(rate + noises.bus_rate.vector(n.bus_rate_noise_rad_s))
        });
        self.target_rate.sample(time, || {
            Some(view.target.rate + noises.target_rate.vector(n.target_rate_noise_rad_s))
        });
        self.sample_arm(view);
    }

    fn sample_arm(&mut self, view: &View<NL>) {
        let (j, time, noises) = (&self.errors.joints, view.time, &mut self.noises);
        let bias = &self.encoder_bias;
        self.joint_angle.sample(time, || {
            let noise = noises.joint_angle.normals::<NL>(j.angle_noise_rad);
            Some(core::array::from_fn(|i| view.joint_angle[i] + bias[i] + noise[i]))
        });
        self.joint_rate.sample(time, || {
            let noise = noises.joint_rate.normals::<NL>(j.rate_noise_rad_s);
            Some(core::array::from_fn(|i| view.joint_rate[i] + noise[i]))
        });
        let (deviation, bias) =
            (self.errors.navigation.wrist_camera_noise_m, &self.biases.wrist_camera);
        let farthest = self.errors.sensors.wrist_camera_range_m;
        self.wrist_camera.sample(time, || {
            let seen = view.port - view.tip;
            let faces = view.approach.dot(&view.port_normal) < 0.0;
            let noise = noises.wrist_camera.vector(deviation);
            (faces && length(&seen) <= farthest)
                .then(|| view.last_link.tr_mul(&seen) + bias + noise)
        });
    }

    /// The newest samples told by a time [s].
    pub fn measurement(&self, time: f64) -> Measurement<NL> {
        Measurement {
            position: self.position.at(time),
            velocity: self.velocity.at(time),
            attitude: self.attitude.at(time),
            target_attitude: self.target_attitude.at(time),
            bus_rate: self.bus_rate.at(time),
            target_rate: self.target_rate.at(time),
            joint_angle: self.joint_angle.at(time),
            joint_rate: self.joint_rate.at(time),
            wrist_camera: self.wrist_camera.at(time),
        }
    }
}
