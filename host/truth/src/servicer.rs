//! The servicer's motion under what its actuators do: the differential equation that is integrated.

use crate::dop853::{Equation, State, Tolerance};
use crate::gravity::Environment;
use crate::joints::JointDrive;
use crate::multibody::{MassMatrix, Momenta, Multibody, Pose, Rates, Wrench};
use crate::orbit::Rtn;
use crate::rotation::{Quaternion, kinematics};
use crate::target::Track;
use nalgebra::{Matrix3, Vector3};

/// State of the servicer: position and velocity of the centre of mass relative to the target's,
/// inertial axes [m], [m/s]; attitude of the bus; angular momentum, inertial axes, and momentum of
/// the wheels, bus axes [N m s]; joint angles [rad] and joint momenta [N m s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServicerState<const NL: usize> {
    /// Position, velocity, attitude, angular momentum, wheels.
    base: [f64; 16],
    /// Joint angles.
    angles: [f64; NL],
    /// Joint momenta.
    momenta: [f64; NL],
}

impl<const NL: usize> ServicerState<NL> {
    pub(crate) fn new(
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        attitude: &Quaternion,
        angles: [f64; NL],
        momenta: &Momenta<NL>,
        wheels: &Vector3<f64>,
    ) -> Self {
        let mut base = [0.0; 16];
        base[..3].copy_from_slice(position.as_slice());
        base[3..6].copy_from_slice(velocity.as_slice());
        base[6..10].copy_from_slice(attitude);
        base[10..13].copy_from_slice(momenta.system.as_slice());
        base[13..].copy_from_slice(wheels.as_slice());
        Self { base, angles, momenta: momenta.joints }
    }

    /// Centre of mass from the target's [m].
    pub fn position(&self) -> Vector3<f64> {
        Vector3::new(self.base[0], self.base[1], self.base[2])
    }

    /// Its velocity [m/s].
    pub fn velocity(&self) -> Vector3<f64> {
        Vector3::new(self.base[3], self.base[4], self.base[5])
    }

    /// Bus to inertial axes; of norm one but for rounding.
    pub fn attitude(&self) -> Quaternion {
        [self.base[6], self.base[7], self.base[8], self.base[9]]
    }

    /// Momentum of the wheels, bus axes [N m s].
    pub fn wheels(&self) -> Vector3<f64> {
        Vector3::new(self.base[13], self.base[14], self.base[15])
    }

    /// Joint angles [rad].
    pub fn angles(&self) -> &[f64; NL] {
        &self.angles
    }

    /// Momenta of bodies and joints [N m s].
    pub fn momenta(&self) -> Momenta<NL> {
        let system = Vector3::new(self.base[10], self.base[11], self.base[12]);
        Momenta { system, joints: self.momenta }
    }
}

impl<const NL: usize> State for ServicerState<NL> {
    const ZERO: Self = Self { base: [0.0; 16], angles: [0.0; NL], momenta: [0.0; NL] };
    const SIZE: usize = 16 + 2 * NL;

    #[inline]
    fn moved(&self, scale: f64, row: &[(usize, f64)], slopes: &[Self]) -> Self {
        let mut sum = Self::ZERO;
        for &(stage, weight) in row {
            let slope = &slopes[stage];
            for i in 0..16 {
                sum.base[i] += weight * slope.base[i];
            }
            for j in 0..NL {
                sum.angles[j] += weight * slope.angles[j];
                sum.momenta[j] += weight * slope.momenta[j];
            }
        }
        for i in 0..16 {
            sum.base[i] = self.base[i] + scale * sum.base[i];
        }
        for j in 0..NL {
            sum.angles[j] = self.angles[j] + scale * sum.angles[j];
            sum.momenta[j] = self.momenta[j] + scale * sum.momenta[j];
        }
        sum
    }

    #[inline]
    fn squares(&self, before: &Self, after: &Self, tolerance: &Tolerance) -> f64 {
        self.base.squares(&before.base, &after.base, tolerance)
            + self.angles.squares(&before.angles, &after.angles, tolerance)
            + self.momenta.squares(&before.momenta, &after.momenta, tolerance)
    }
}

/// Axes in which a force stays constant while it is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// Non-rotating.
    Inertial,
    /// The target's radial, along-track and normal axes.
    #[default]
    Rtn,
    /// The bus's.
    Bus,
}

/// Actuation and disturbances, constant from one instant to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held<const NL: usize> {
    /// Commanded force [N] that thrusters give while they fire, in `axes`.
    pub force: Vector3<f64>,
    /// Its axes.
    pub axes: Axes,
    /// From commanded to given force, in bus axes.
    pub thrusters: Matrix3<f64>,
    /// Torque of the wheels on the bus, bus axes [N m].
    pub bus_torque: Vector3<f64>,
    /// Disturbing moment on the bus, bus axes [N m].
    pub disturbance: Vector3<f64>,
    /// Acceleration along track, relative to the target [m/s^2].
    pub drag: f64,
    /// The joints.
    pub joints: [JointDrive; NL],
    /// Joints whose brake holds them.
    pub locked: [bool; NL],
}

/// All that follows from a state at one instant.
pub struct Instant<const NL: usize> {
    /// Where the bodies are.
    pub pose: Pose<NL>,
    /// The mass matrix there.
    pub matrix: MassMatrix<NL>,
    /// How they turn.
    pub rates: Rates<NL>,
}

impl<const NL: usize> Multibody<NL> {
    /// Pose, mass matrix and rates of a state.
    #[inline]
    pub fn instant(&self, state: &ServicerState<NL>, locked: &[bool; NL]) -> Instant<NL> {
        let pose = self.pose(&state.attitude(), &state.angles);
        let matrix = self.mass_matrix(&pose);
        let rates = matrix.rates(&state.momenta(), locked);
        Instant { pose, matrix, rates }
    }
}

/// The equation of motion while `held` acts.
pub(crate) struct Motion<'a, const NL: usize> {
    pub body: &'a Multibody<NL>,
    pub environment: &'a Environment,
    pub track: &'a Track,
    pub held: Held<NL>,
}

impl<const NL: usize> Motion<'_, NL> {
    /// External forces on bus and links, without what actuators and disturbances do.
    #[inline]
    fn gravity(
        &self,
        center: &Vector3<f64>,
        state: &ServicerState<NL>,
        pose: &Pose<NL>,
        matrix: &MassMatrix<NL>,
    ) -> (Wrench, [Wrench; NL]) {
        let zero = Wrench { force: Vector3::zeros(), moment: Vector3::zeros() };
        if !self.environment.has_gravity {
            return (zero, [zero; NL]);
        }
        let (field, position) = (self.environment.around(center), state.position());
        let vehicle = &self.body.vehicle;
        let wrench = |mass: f64, place: &Vector3<f64>, inertia| Wrench {
            force: field.difference(&(position + place)) * mass,
            moment: field.gradient_moment(inertia),
        };
        let bus = wrench(vehicle.bus.mass, &pose.bus_center, &matrix.bus);
        let mut links = [zero; NL];
        for j in 0..NL {
            let mass = vehicle.joints[j].link.mass;
            links[j] = wrench(mass, &pose.centers[j], &matrix.links[j]);
        }
        (bus, links)
    }

    /// The thrusters' force, inertial axes [N].
    #[inline]
    fn thrust(&self, time: f64, bus: &Matrix3<f64>) -> Vector3<f64> {
        let held = &self.held;
        let command = match held.axes {
            Axes::Bus => held.force,
            Axes::Inertial => bus.tr_mul(&held.force),
            Axes::Rtn => {
                let (r, v) = self.track.orbit(time);
                bus.tr_mul(&(Rtn::of(&r, &v).axes * held.force))
            }
        };
        bus * (held.thrusters * command)
    }

    /// Acceleration by differential drag, inertial axes [m/s^2].
    #[inline]
    fn drag(&self, time: f64) -> Vector3<f64> {
        if self.held.drag == 0.0 {
            return Vector3::zeros();
        }
        crate::rotation::unit(&self.track.orbit(time).1) * self.held.drag
    }
}

impl<const NL: usize> Equation for Motion<'_, NL> {
    type State = ServicerState<NL>;

    #[inline]
    fn slope(&self, time: f64, state: &ServicerState<NL>) -> ServicerState<NL> {
        let held = &self.held;
        // Not as an `Instant`: that would be copied, some hundred instructions.
        let pose = self.body.pose(&state.attitude(), &state.angles);
        let matrix = self.body.mass_matrix(&pose);
        let rates = matrix.rates(&state.momenta(), &held.locked);
        let bus_axes = &pose.bus_rotation;
        let (mut bus, links) = self.gravity(&self.track.position(time), state, &pose, &matrix);
        let force = self.thrust(time, bus_axes);
        let arm = bus_axes * (self.body.vehicle.force_point - self.body.vehicle.bus.center);
        bus.force += force;
        bus.moment += arm.cross(&force) + bus_axes * (held.bus_torque + held.disturbance);
        if self.environment.wheel_momentum {
            bus.moment -= rates.bus.cross(&(bus_axes * state.wheels()));
        }
        let (mut momenta, acceleration) =
            self.body.momentum_rates(&pose, &matrix, &rates, (&bus, &links));
        for j in 0..NL {
            momenta.joints[j] += held.joints[j].torque(time, state.angles[j], rates.joints[j]);
            if held.locked[j] {
                momenta.joints[j] = 0.0;
            }
        }
        ServicerState::new(
            &state.velocity(),
            &(acceleration + self.drag(time)),
            &kinematics(&state.attitude(), &rates.bus),
            rates.joints,
            &momenta,
            &-held.bus_torque,
        )
    }
}
