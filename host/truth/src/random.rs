//! Random numbers: a ChaCha8 stream of its own for each (seed, run, source of error), so that a new
//! source changes no other's numbers. Normal numbers by Box and Muller, with libm.

use crate::rotation::{Quaternion, exponential};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Sources of error, each with its number for good: never reuse or renumber one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
#[allow(missing_docs, reason = "named as the errors they make")]
pub enum Source {
    ThrusterScale = 1,
    ThrusterDirection = 2,
    ThrusterNoise = 3,
    WheelScale = 4,
    WheelBias = 5,
    WheelNoise = 6,
    JointScale = 7,
    JointBias = 8,
    JointFriction = 9,
    EncoderBias = 10,
    EncoderNoise = 11,
    JointRateNoise = 12,
    BusMass = 13,
    BusInertia = 14,
    BusInertiaAxes = 15,
    BusCenter = 16,
    LinkMass = 17,
    LinkInertia = 18,
    LinkInertiaAxes = 19,
    LinkCenter = 20,
    TumbleRate = 21,
    TumbleDirection = 22,
    TargetAttitude = 23,
    InertiaRatio = 24,
    Port = 25,
    ArmBase = 26,
    WristCamera = 27,
    Eccentricity = 28,
    Drag = 29,
    Disturbance = 30,
    TargetDisturbance = 31,
    PositionDrift = 32,
    PositionNoise = 33,
    VelocityNoise = 34,
    AttitudeDrift = 35,
    TargetAttitudeDrift = 36,
    BusRateNoise = 37,
    TargetRateNoise = 38,
    WristCameraNoise = 39,
    FaultTime = 40,
}

/// Normal numbers of one source in one run.
#[derive(Clone, Debug)]
pub struct Stream {
    random: ChaCha8Rng,
    /// The second number of a pair, not yet given.
    spare: Option<f64>,
}

impl Stream {
    /// The stream of a source in run `run` of `seed`; runs count up to 2^48.
    pub fn new(seed: u64, run: u64, source: Source) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..13].copy_from_slice(b"truth");
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream((run << 16) | source as u64);
        Self { random, spare: None }
    }

    /// Uniform in (0, 1], from 53 bits.
    fn uniform(&mut self) -> f64 {
        ((self.random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// Normal, of mean zero and standard deviation one.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(self.uniform()));
        let angle = 2.0 * core::f64::consts::PI * self.uniform();
        self.spare = Some(radius * libm::sin(angle));
        radius * libm::cos(angle)
    }

    /// Normal numbers of a standard deviation. None is drawn where that is zero.
    pub fn normals<const N: usize>(&mut self, deviation: f64) -> [f64; N] {
        if deviation == 0.0 {
            return [0.0; N];
        }
        core::array::from_fn(|_| deviation * self.normal())
    }

    /// A vector of normal components.
    pub fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::from(self.normals::<3>(deviation))
    }

    /// A small random rotation: a normal rotation vector, the deviation about each axis [rad].
    pub fn rotation(&mut self, deviation: f64) -> Quaternion {
        exponential(&self.vector(deviation))
    }
}

/// First-order Gauss-Markov process of three components: stationary from the start, correlation
/// `exp(-t / time constant)`.
#[derive(Clone, Debug)]
pub struct Drift {
    stream: Stream,
    deviation: f64,
    time_constant: f64,
    value: Vector3<f64>,
}

impl Drift {
    /// A process of a standard deviation and a time constant [s].
    pub fn new(mut stream: Stream, deviation: f64, time_constant: f64) -> Self {
        let value = stream.vector(deviation);
        Self { stream, deviation, time_constant, value }
    }

    /// The value now.
    pub fn value(&self) -> &Vector3<f64> {
        &self.value
    }

    /// Goes on by a time [s], exactly in distribution whatever its length.
    pub fn advance(&mut self, time: f64) {
        if self.deviation == 0.0 || time == 0.0 {
            return;
        }
        let kept = libm::exp(-time / self.time_constant);
        let fresh = self.deviation * libm::sqrt(1.0 - kept * kept);
        self.value = self.value * kept + self.stream.vector(fresh);
    }
}
