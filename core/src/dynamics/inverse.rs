//! Inverse dynamics: the torques that given accelerations need (recursive Newton-Euler).
//!
//! A rigid body accelerates by an affine field: at a point `x` of it, by
//! `at + gradient (x - joint)`. The tide is linear in `x` as well, so that it needs no equations of
//! its own: one matrix a body holds angular acceleration, rate and orbit, and the force and moment
//! the body needs are that matrix against its mass moments.

use super::arm::{Arm, ArmLink, second_moments};
use super::multibody::BusFrame;
use super::{Acceleration, Control, Integrator, Multibody, State, Stepping};
use crate::math::{Mat3, Scalar, Vec3, quaternion};
use nalgebra::{Matrix3, SVector, Vector3};

/// Joint motion and bus angular acceleration, bus axes.
#[derive(Clone, Copy)]
pub(super) struct Motion<T, const NL: usize> {
    pub joint_rate: [T; NL],
    /// Derivative of the inertial rate, seen from inertial space [rad/s^2].
    pub bus_acceleration: Vec3<T>,
    pub joint_acceleration: [T; NL],
}

/// Moment on the bus (bus axes, about its centre of mass) and torques on the joints [N m].
#[derive(Clone, Copy)]
pub(super) struct GeneralizedForce<T, const NL: usize> {
    pub bus: Vec3<T>,
    pub joint: [T; NL],
}

/// How a body moves and what force its points need for it, per unit mass: inertial acceleration
/// less the tide. Bus axes.
#[derive(Clone, Copy)]
pub(super) struct Field<T> {
    /// Inertial angular velocity [rad/s].
    pub rate: Vec3<T>,
    /// `[angular acceleration x] + [rate x]^2 + n^2 (1 - 3 e_R e_R^T)` [1/s^2].
    pub gradient: Mat3<T>,
    /// At the body's joint [m/s^2].
    pub at: Vec3<T>,
}

/// Force, and moment about a joint, that a link and all beyond it need.
#[derive(Clone, Copy)]
pub(super) struct Wrench<T> {
    pub force: Vec3<T>,
    pub moment: Vec3<T>,
}

/// The inverse dynamics and all its intermediate results.
pub(super) struct Sweep<const NL: usize> {
    pub bus: Field<f64>,
    pub links: [Field<f64>; NL],
    pub wrenches: [Wrench<f64>; NL],
    pub needed: GeneralizedForce<f64, NL>,
}

impl<T: Scalar> Field<T> {
    pub(super) const ZERO: Self =
        Self { rate: Vec3::ZERO, gradient: Mat3([Vec3::ZERO; 3]), at: Vec3::ZERO };

    /// What `link` alone needs.
    #[inline]
    pub(super) fn wrench(&self, link: &ArmLink) -> Wrench<T> {
        let offset = link.offset.lift();
        let force = (self.at + self.gradient.apply(offset)).scaled(link.mass);
        let moment = self.moment(&link.second_moment) + offset.cross(force);
        Wrench { force, moment }
    }

    /// The integral of `s x (gradient s)` over a body with this second mass moment about its
    /// centre.
    #[inline]
    fn moment(&self, second: &Mat3<f64>) -> Vec3<T> {
        let a = |i: usize, k: usize| self.gradient.0[k].0[i];
        let product = |i: usize, j: usize| {
            let s = second.0[j].0;
            a(i, 0) * s[0] + a(i, 1) * s[1] + a(i, 2) * s[2]
        };
        let turn = |i: usize, j: usize| product(i, j) - product(j, i);
        Vec3([turn(2, 1), turn(0, 2), turn(1, 0)])
    }

    /// The same along principal axes: the moment the bus needs for itself.
    #[inline]
    pub(super) fn principal_moment(&self, inertia: &Vector3<f64>) -> Vec3<T> {
        let second = second_moments(inertia);
        let a = |i: usize, j: usize| self.gradient.0[j].0[i] * second[j];
        Vec3([a(2, 1) - a(1, 2), a(0, 2) - a(2, 0), a(1, 0) - a(0, 1)])
    }
}

impl<T: Scalar> Wrench<T> {
    pub(super) const ZERO: Self = Self { force: Vec3::ZERO, moment: Vec3::ZERO };

    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        self.force += other.force;
        self.moment += other.moment;
    }

    /// Refers the moment to a point that stands at `-lever`.
    #[inline]
    pub(super) fn shift(&mut self, lever: Vec3<f64>) {
        self.moment += lever.lift().cross(self.force);
    }
}

impl<const NL: usize> Multibody<NL> {
    /// Bus and joint torques that produce `acceleration` in `state` under actuator force `force`
    /// (RTN, N): the inverse of [`Multibody::acceleration`].
    /// Cost: O(NL), about 500 flops a link.
    pub fn torques(
        &self,
        state: &State<NL>,
        force: &Vector3<f64>,
        acceleration: &Acceleration<NL>,
    ) -> Control<NL> {
        let (r, frame) = self.bus_frame(state, force);
        let inertial = acceleration.bus + self.frame_rate().cross(&state.rate);
        let motion = Motion {
            joint_rate: Self::angles(&state.joint_rate),
            bus_acceleration: Vec3(r.tr_mul(&inertial).into()),
            joint_acceleration: Self::angles(&acceleration.joint),
        };
        let needed = self.sweep(&self.arm(state), &frame, &motion).needed;
        Control { bus_torque: needed.bus.to_vector(), joint_torque: SVector::from(needed.joint) }
    }

    /// Newton-Euler over the tree, outwards for accelerations, inwards for forces.
    #[inline]
    pub(super) fn sweep(
        &self,
        arm: &Arm<NL>,
        frame: &BusFrame<f64>,
        motion: &Motion<f64, NL>,
    ) -> Sweep<NL> {
        let n2 = self.mean_motion * self.mean_motion;
        let tide = Mat3::outer(frame.radial, frame.radial.scaled(-3.0 * n2))
            + Mat3::constant(&Matrix3::from_diagonal_element(n2));
        let gradient = Mat3::cross_matrix(motion.bus_acceleration)
            + Mat3::double_cross(frame.rate, frame.rate)
            + tide;
        // Relative to the bus centre of mass at first.
        let bus = Field { rate: frame.rate, gradient, at: Vec3::ZERO };
        let mut links = [Field::ZERO; NL];
        let mut field = bus;
        for (i, link) in arm.links.iter().enumerate() {
            field.at += field.gradient.apply(link.lever);
            let before = field.rate;
            field.rate += link.axis * motion.joint_rate[i];
            let twice = (before + field.rate) * motion.joint_rate[i];
            field.gradient += Mat3::cross_matrix(link.axis * motion.joint_acceleration[i])
                + Mat3::double_cross(twice, link.axis);
            links[i] = field;
        }

        let mut wrenches = [Wrench::ZERO; NL];
        let mut wrench = Wrench::ZERO;
        for (i, link) in arm.links.iter().enumerate().rev() {
            wrench.add(&links[i].wrench(link));
            wrenches[i] = wrench;
            wrench.shift(link.lever);
        }

        // Tides and inner forces cancel over the whole: the actuator force is all that moves the
        // centre of mass, and that says how the bus's own centre accelerates.
        let base = frame.specific_force - wrench.force.scaled(1.0 / self.total_mass);
        let mut joint = [0.0; NL];
        for (i, link) in arm.links.iter().enumerate() {
            links[i].at += base;
            wrenches[i].force += base.scaled(link.beyond.mass);
            wrenches[i].moment += link.beyond.first.cross(base);
            joint[i] = link.axis.dot(wrenches[i].moment);
        }
        let moment = wrench.moment + arm.whole.first.cross(base);
        let needed =
            GeneralizedForce { bus: bus.principal_moment(&self.bus_inertia) + moment, joint };
        Sweep { bus, links, wrenches, needed }
    }
}

/// A control and the states between which it leads, at least nearly: where to start from when
/// looking for another.
#[derive(Clone, Copy, Debug)]
pub struct Leg<'a, const NL: usize> {
    /// Where it starts.
    pub state: &'a State<NL>,
    /// The control held.
    pub control: &'a Control<NL>,
    /// Where it ends.
    pub reached: &'a State<NL>,
}

impl<const NL: usize> Multibody<NL> {
    /// The control that moves the rates of `state` to `goal` (bus rate and joint rates) over one
    /// step of `integrator`, to 1e-8 rad/s, and the state it leads to. `known` is a leg nearby,
    /// under the same force.
    ///
    /// Exact for Euler, where it is inverse dynamics. For RK4 the known control is changed by as
    /// much as inverse dynamics half way change, and again from the leg found until it is near
    /// enough, or the deadline has passed. Cost: a step and two inverse dynamics a round, one or two rounds.
    pub fn steer(
        &self,
        stepping: &Stepping<'_>,
        state: &State<NL>,
        goal: (&Vector3<f64>, &SVector<f64, NL>),
        known: Leg<NL>,
        force: &Vector3<f64>,
    ) -> (Control<NL>, State<NL>) {
        let Stepping { integrator, dt, deadline } = *stepping;
        let mean =
            |from: &State<NL>, rate: &Vector3<f64>, joint_rate: &SVector<f64, NL>| Acceleration {
                bus: (rate - from.rate) / dt,
                joint: (joint_rate - from.joint_rate) / dt,
            };
        let wanted = mean(state, goal.0, goal.1);
        if integrator == Integrator::Euler {
            let control = self.torques(state, force, &wanted);
            return (control, self.step(integrator, dt, state, &control, force));
        }
        let better = |known: Leg<NL>| {
            let Leg { state: from, reached: to, .. } = known;
            let spent = mean(from, &to.rate, &to.joint_rate);
            let spent = self.torques(&from.midway(to), force, &spent);
            let expected = known.expected(dt, state, goal);
            let needed = self.torques(&state.midway(&expected), force, &wanted);
            known.control.changed(&needed, &spent)
        };
        let mut control = better(known);
        let mut reached = self.step(integrator, dt, state, &control, force);
        // Bound: steering.
        for _ in 0..STEERING_ITERATIONS {
            let error = (goal.0 - reached.rate).amax().max((goal.1 - reached.joint_rate).amax());
            if error <= STEERING_ERROR || deadline.has_passed() {
                break;
            }
            control = better(Leg { state, control: &control, reached: &reached });
            reached = self.step(integrator, dt, state, &control, force);
        }
        (control, reached)
    }
}

impl<const NL: usize> Leg<'_, NL> {
    /// Where a leg from `state` with the rates `goal` at its end probably ends.
    fn expected(
        &self,
        dt: f64,
        state: &State<NL>,
        goal: (&Vector3<f64>, &SVector<f64, NL>),
    ) -> State<NL> {
        let (from, to) = (self.state, self.reached);
        let turn = (state.rate - from.rate + goal.0 - to.rate) * (0.5 * dt)
            + quaternion::difference(&state.attitude, &from.attitude);
        let bend = (state.joint_rate - from.joint_rate + goal.1 - to.joint_rate) * (0.5 * dt);
        State {
            attitude: quaternion::product(&quaternion::exp(&turn), &to.attitude),
            joint_angle: to.joint_angle + (state.joint_angle - from.joint_angle) + bend,
            rate: *goal.0,
            joint_rate: *goal.1,
        }
    }
}

impl<const NL: usize> Control<NL> {
    /// This control and what `needed` has more than `spent`.
    fn changed(&self, needed: &Self, spent: &Self) -> Self {
        Self {
            bus_torque: self.bus_torque + (needed.bus_torque - spent.bus_torque),
            joint_torque: self.joint_torque + (needed.joint_torque - spent.joint_torque),
        }
    }
}

/// Most rounds of [`Multibody::steer`] after the first.
pub const STEERING_ITERATIONS: usize = 4;

/// Error of a rate at which [`Multibody::steer`] stops [rad/s].
const STEERING_ERROR: f64 = 1e-8;
