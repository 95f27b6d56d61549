//! The target: its orbit and its tumbling, integrated with steps of their own.

use crate::dop853::{Dop853, Equation, IntegrationError, Segment, Tolerance, most_steps};
use crate::gravity::Environment;
use crate::rotation::{Quaternion, body_kinematics, matrix, normalized};
use nalgebra::{Matrix3, Vector3};

/// The target's data and its attitude motion at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Principal moments of inertia [kg m^2].
    pub inertia: Vector3<f64>,
    /// Port in body axes, from the centre of mass [m].
    pub port: Vector3<f64>,
    /// Outward unit normal of the port, body axes.
    pub normal: Vector3<f64>,
    /// Body to inertial axes, at the start.
    pub attitude: Quaternion,
    /// Inertial rate in body axes, at the start [rad/s].
    pub rate: Vector3<f64>,
    /// Constant disturbing moment, body axes [N m].
    pub disturbance: Vector3<f64>,
}

/// Motion of the target at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetState {
    /// Position from the body's centre, inertial axes [m].
    pub position: Vector3<f64>,
    /// Inertial [m/s].
    pub velocity: Vector3<f64>,
    /// Body to inertial axes, of norm one.
    pub attitude: Quaternion,
    /// Inertial rate in body axes [rad/s].
    pub rate: Vector3<f64>,
}

impl TargetState {
    pub(crate) fn unpacked(y: &[f64; 13]) -> Self {
        Self {
            position: Vector3::new(y[0], y[1], y[2]),
            velocity: Vector3::new(y[3], y[4], y[5]),
            attitude: normalized(&[y[6], y[7], y[8], y[9]]),
            rate: Vector3::new(y[10], y[11], y[12]),
        }
    }

    pub(crate) fn packed(&self) -> [f64; 13] {
        let mut y = [0.0; 13];
        y[..3].copy_from_slice(self.position.as_slice());
        y[3..6].copy_from_slice(self.velocity.as_slice());
        y[6..10].copy_from_slice(&self.attitude);
        y[10..].copy_from_slice(self.rate.as_slice());
        y
    }
}

/// Orbit by gravity alone; attitude by Euler's equations with gravity gradient and disturbance.
#[derive(Clone, Debug)]
pub(crate) struct TargetMotion {
    pub environment: Environment,
    pub inertia: Vector3<f64>,
    pub disturbance: Vector3<f64>,
}

impl Equation for TargetMotion {
    type State = [f64; 13];

    fn slope(&self, _: f64, y: &[f64; 13]) -> [f64; 13] {
        let position = Vector3::new(y[0], y[1], y[2]);
        let attitude = [y[6], y[7], y[8], y[9]];
        let rate = Vector3::new(y[10], y[11], y[12]);
        let mut moment = self.disturbance - rate.cross(&self.inertia.component_mul(&rate));
        if self.environment.target_gravity_gradient {
            let seen = matrix(&attitude).tr_mul(&position);
            let inertia = Matrix3::from_diagonal(&self.inertia);
            moment += self.environment.around(&seen).gradient_moment(&inertia);
        }
        let state = TargetState {
            position: Vector3::new(y[3], y[4], y[5]),
            velocity: self.environment.acceleration(&position),
            attitude: body_kinematics(&attitude, &rate),
            rate: moment.component_div(&self.inertia),
        };
        state.packed()
    }
}

/// A change of the target's rate: to `factor` times what it was, at `time` [s].
pub(crate) type RateChange = Option<(f64, f64)>;

/// The target's motion over time, as far as it has been asked for.
#[derive(Clone, Debug)]
pub struct Track {
    equation: TargetMotion,
    integrator: Dop853<[f64; 13]>,
    time: f64,
    state: [f64; 13],
    change: RateChange,
    segments: Vec<Segment<[f64; 13]>>,
}

/// Errors of a step: 1e-14 of 7e6 m and of 1e4 m/s; 1e-15 in attitude and rate.
const TOLERANCE: Tolerance = Tolerance { absolute: 1e-15, relative: 1e-14 };
/// Longest step [s]: dense output, of order seven, is then as good as the steps.
const LONGEST: f64 = 10.0;

impl Track {
    pub(crate) fn new(equation: TargetMotion, start: &TargetState, change: RateChange) -> Self {
        let integrator = Dop853::new(TOLERANCE, LONGEST);
        let (state, segments) = (start.packed(), Vec::new());
        let mut track = Self { equation, integrator, time: 0.0, state, change, segments };
        track.apply_change();
        track
    }

    /// Integrates until `time` [s] is covered.
    pub(crate) fn cover(&mut self, time: f64) -> Result<(), IntegrationError> {
        self.integrator.allow(most_steps(time, 0));
        while self.time <= time {
            let start = (self.time, self.state);
            let end = self.change.map_or(f64::INFINITY, |(_, at)| at).min(start.0 + LONGEST);
            let (reached, state) =
                self.integrator.advance(&self.equation, start.0, &start.1, end)?;
            let segment =
                self.integrator.segment(&self.equation, (start.0, &start.1), (reached, &state));
            self.segments.push(segment);
            (self.time, self.state) = (reached, state);
            self.apply_change();
        }
        Ok(())
    }

    /// Changes the rate where it is time to.
    fn apply_change(&mut self) {
        if let Some((factor, at)) = self.change
            && self.time >= at
        {
            for component in &mut self.state[10..] {
                *component *= factor;
            }
            self.change = None;
        }
    }

    #[inline]
    fn segment(&self, time: f64) -> &Segment<[f64; 13]> {
        let found = self.segments.iter().rev().find(|segment| segment.start <= time);
        found.unwrap_or(&self.segments[0])
    }

    /// The motion at a time [s] that has been covered.
    pub fn at(&self, time: f64) -> TargetState {
        TargetState::unpacked(&self.segment(time).at(time))
    }

    /// Position from the body's centre [m].
    #[inline]
    pub(crate) fn position(&self, time: f64) -> Vector3<f64> {
        Vector3::from(self.segment(time).part::<3>(0, time))
    }

    /// Position [m] and velocity [m/s].
    #[inline]
    pub(crate) fn orbit(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        let [x, y, z, u, v, w] = self.segment(time).part::<6>(0, time);
        (Vector3::new(x, y, z), Vector3::new(u, v, w))
    }

    /// Principal moments of inertia [kg m^2].
    pub fn inertia(&self) -> &Vector3<f64> {
        &self.equation.inertia
    }

    /// Constant disturbing moment, body axes [N m].
    pub fn disturbance(&self) -> &Vector3<f64> {
        &self.equation.disturbance
    }

    /// The change of rate still to come: (factor, time [s]).
    pub fn change(&self) -> Option<(f64, f64)> {
        self.change
    }
}
