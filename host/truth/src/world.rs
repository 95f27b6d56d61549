//! The world in motion.

use crate::actuators::{Actuators, Command, JointCommand, Moment, limited};
use crate::dispersion::Dispersion;
use crate::dop853::{Dop853, Equation, IntegrationError, Tolerance, most_steps};
use crate::errors::ErrorsFault;
use crate::gravity::Environment;
use crate::multibody::{Multibody, Rates};
use crate::orbit::Rtn;
use crate::rotation::{inverse, matrix};
use crate::sensors::{Measurement, Sensors};
use crate::servicer::{Axes, Held, Motion, ServicerState};
use crate::setup::Setup;
use crate::target::{Target, TargetMotion, TargetState, Track};
use crate::ticker::SAME;
use crate::view::View;

/// Errors of a step of the servicer, in metres, radians and so on.
const TOLERANCE: Tolerance = Tolerance { absolute: 1e-13, relative: 1e-12 };

/// A world cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The errors make no sense.
    #[error(transparent)]
    Errors(#[from] ErrorsFault),
    /// The target's motion cannot be integrated.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
}

/// The tip went through the port's plane near the port; the world stands at that instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// When [s].
    pub time: f64,
    /// Distance of the tip from the port there [m].
    pub miss: f64,
}

/// Servicer and target in flight, with actuators and sensors.
///
/// A clone goes on like the original, random numbers included.
#[derive(Clone, Debug)]
pub struct World<const NL: usize> {
    pub(crate) body: Multibody<NL>,
    pub(crate) environment: Environment,
    pub(crate) target: Target,
    pub(crate) track: Track,
    pub(crate) actuators: Actuators<NL>,
    pub(crate) sensors: Sensors<NL>,
    integrator: Dop853<ServicerState<NL>>,
    /// Instants so far at which something changed.
    changes: u64,
    time: f64,
    pub(crate) state: ServicerState<NL>,
    contact_radius: f64,
    /// Height of the tip above the port's plane.
    height: f64,
}

impl<const NL: usize> World<NL> {
    /// The world of one draw of errors. The sensors have sampled at time zero.
    ///
    /// The start is taken as it is: it is the state of the truth, whatever the vehicle's errors.
    ///
    /// # Errors
    ///
    /// Errors that make no sense; a target whose motion cannot be integrated.
    pub fn new(nominal: &Setup<NL>, dispersion: &Dispersion) -> Result<Self, WorldError> {
        dispersion.errors.check(NL)?;
        let setup = dispersion.disperse(nominal);
        let actuators = Actuators::new(dispersion);
        let sensors = Sensors::new(dispersion, actuators.joints.encoder_bias);
        let body = Multibody::new(setup.vehicle);
        let mut world = Self {
            state: start(&body, &setup),
            body,
            environment: setup.environment,
            target: setup.target,
            track: track(&setup, dispersion),
            actuators,
            sensors,
            integrator: Dop853::new(TOLERANCE, f64::INFINITY),
            changes: 0,
            time: 0.0,
            contact_radius: setup.contact_radius,
            height: 0.0,
        };
        world.track.cover(0.0)?;
        let view = world.view();
        world.height = view.height();
        world.sensors.sample(&view);
        Ok(world)
    }

    /// Goes on until `until` [s] with the command held, or until the tip reaches the port's plane:
    /// then the world stands at that instant.
    ///
    /// Costs 12 evaluations of the dynamics for each instant at which something changes.
    ///
    /// # Errors
    ///
    /// [`IntegrationError`]; the world then stands where it got to.
    pub fn advance(
        &mut self,
        until: f64,
        command: &Command<NL>,
    ) -> Result<Option<Contact>, IntegrationError> {
        let commanded = self.time;
        while self.time < until {
            let held = self.hold(command, commanded);
            let end = self.next_instant(until);
            self.track.cover(end)?;
            self.changes += 1;
            self.integrator.allow(most_steps(end, self.changes));
            let before = (self.time, self.state);
            self.state = self.integrated(&held, before, end)?;
            self.time = end;
            let mut view = self.view();
            let passed = self.height > 0.0 && view.height() <= 0.0;
            let contact = passed && view.offset() <= self.contact_radius;
            if contact {
                self.find_plane(&held, before)?;
                view = self.view();
            }
            self.height = view.height();
            self.sensors.sample(&view);
            if contact {
                // Once through, the plane is not met again from the same side by rounding.
                self.height = self.height.min(0.0);
                return Ok(Some(Contact { time: self.time, miss: view.miss() }));
            }
        }
        Ok(None)
    }

    /// The newest samples that the sensors have told by now.
    pub fn measure(&self) -> Measurement<NL> {
        self.sensors.measurement(self.time)
    }

    /// Time since the start [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The true state.
    pub fn view(&self) -> View<NL> {
        let target = (&self.target, self.track.at(self.time));
        View::new(self.time, &self.body, &self.state, &self.locked(), target)
    }

    /// The target's RTN axes.
    pub fn rtn(&self) -> Rtn {
        let (r, v) = self.track.orbit(self.time);
        Rtn::of(&r, &v)
    }

    /// Steps taken and refused by the servicer's integrator.
    pub fn steps(&self) -> (u64, u64) {
        self.integrator.steps()
    }

    /// One evaluation of the dynamics at this instant: the derivative of the servicer's state under
    /// a command. For measuring its time.
    #[doc(hidden)]
    pub fn slope(&mut self, command: &Command<NL>) -> ServicerState<NL> {
        let held = self.hold(command, self.time);
        let motion =
            Motion { body: &self.body, environment: &self.environment, track: &self.track, held };
        motion.slope(self.time, &self.state)
    }

    pub(crate) fn locked(&self) -> [bool; NL] {
        self.actuators.locked(self.time)
    }

    /// Computes the forces and torques that act from now on.
    fn hold(&mut self, command: &Command<NL>, commanded: f64) -> Held<NL> {
        let felt = match command.joints {
            JointCommand::Torque(_) => [0.0; NL],
            JointCommand::Servo { .. } => {
                self.body.instant(&self.state, &self.locked()).matrix.felt()
            }
        };
        let force = limited(&command.force, &self.body.vehicle.limits.force);
        let to_bus = || matrix(&inverse(&self.state.attitude()));
        let moment = Moment {
            time: self.time,
            commanded,
            force: match command.axes {
                Axes::Bus => force,
                Axes::Inertial => to_bus() * force,
                Axes::Rtn => to_bus() * (self.rtn().axes * force),
            },
            wheels: self.state.wheels(),
            felt: &felt,
        };
        self.actuators.hold(&self.body.vehicle, command, &moment)
    }

    /// The next instant at which something changes, `until` at the latest [s].
    fn next_instant(&self, until: f64) -> f64 {
        let faults = &self.actuators.faults;
        let instants = [
            self.actuators.next(),
            self.sensors.next(),
            faults.thruster_lost.map_or(f64::INFINITY, |fault| fault.time_s),
            faults.joint_stuck.map_or(f64::INFINITY, |fault| fault.time_s),
        ];
        let later = instants.into_iter().filter(|&t| t > self.time + SAME && t < until - SAME);
        later.fold(until, f64::min)
    }

    fn integrated(
        &mut self,
        held: &Held<NL>,
        (time, state): (f64, ServicerState<NL>),
        end: f64,
    ) -> Result<ServicerState<NL>, IntegrationError> {
        // Named field by field: the integrator is lent for writing at the same time.
        let motion = Motion {
            body: &self.body,
            environment: &self.environment,
            track: &self.track,
            held: *held,
        };
        self.integrator.integrate(&motion, time, &state, end)
    }

    /// Goes back to where the tip is in the port's plane, by bisection from the state before: 50
    /// halvings bring any step below rounding.
    fn find_plane(
        &mut self,
        held: &Held<NL>,
        before: (f64, ServicerState<NL>),
    ) -> Result<(), IntegrationError> {
        let (mut low, mut high) = (before.0, self.time);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if !(middle > low && middle < high) {
                break;
            }
            self.state = self.integrated(held, before, middle)?;
            self.time = middle;
            if self.view().height() > 0.0 { low = middle } else { high = middle }
        }
        self.state = self.integrated(held, before, high)?;
        self.time = high;
        Ok(())
    }
}

/// The servicer's state at the start.
fn start<const NL: usize>(body: &Multibody<NL>, setup: &Setup<NL>) -> ServicerState<NL> {
    let s = &setup.start;
    let pose = body.pose(&s.attitude, &s.joint_angle);
    let rates = Rates { bus: s.rate, joints: s.joint_rate };
    let velocity = body.velocities(&pose, &rates).bus_origin;
    let momenta = body.mass_matrix(&pose).momenta(&rates);
    ServicerState::new(
        &(s.position - pose.bus_origin),
        &(s.velocity - velocity),
        &s.attitude,
        s.joint_angle,
        &momenta,
        &s.wheel_momentum,
    )
}

/// The target's motion from the start.
fn track<const NL: usize>(setup: &Setup<NL>, dispersion: &Dispersion) -> Track {
    let (position, velocity) = setup.orbit.state(setup.environment.mu);
    let target = &setup.target;
    let (attitude, rate) = (target.attitude, target.rate);
    let state = TargetState { position, velocity, attitude, rate };
    let change = dispersion.faults().target_rate.map(|fault| (fault.factor, fault.time_s));
    let motion = TargetMotion {
        environment: setup.environment,
        inertia: target.inertia,
        disturbance: target.disturbance,
    };
    Track::new(motion, &state, change)
}
