//! Inverse dynamics: the torques that given accelerations need (recursive Newton-Euler, RNEA).
//!
//! The acceleration of a rigid body is affine: `at + gradient (x - joint)` at its point `x`. The tide is
//! linear in `x` too, so that one matrix a body holds angular acceleration, rate and orbit; force and
//! moment on the body are that matrix times its mass moments.

use super::kinematics::{Kinematics, LinkKinematics, second_moment};
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

/// Spatial acceleration of a body, inertial less the tide, as an affine field. Bus axes.
#[derive(Clone, Copy)]
pub(super) struct SpatialAcceleration<T> {
    /// Inertial angular velocity [rad/s].
    pub rate: Vec3<T>,
    /// `[angular acceleration x] + [rate x]^2 + n^2 (1 - 3 e_R e_R^T)` [1/s^2].
    pub gradient: Mat3<T>,
    /// Linear acceleration at the body's joint [m/s^2].
    pub at: Vec3<T>,
}

/// Force on a subtree, and moment about its joint.
#[derive(Clone, Copy)]
pub(super) struct Wrench<T> {
    pub force: Vec3<T>,
    pub moment: Vec3<T>,
}

/// Intermediate results of the RNEA.
pub(super) struct Rnea<const NL: usize> {
    pub bus: SpatialAcceleration<f64>,
    pub links: [SpatialAcceleration<f64>; NL],
    pub wrenches: [Wrench<f64>; NL],
}

impl<const NL: usize> Rnea<NL> {
    /// Spatial acceleration of the body before joint `i`.
    #[inline]
    pub(super) fn before(&self, i: usize) -> &SpatialAcceleration<f64> {
        if i == 0 { &self.bus } else { &self.links[i - 1] }
    }
}

impl<T: Scalar> SpatialAcceleration<T> {
    pub(super) const ZERO: Self =
        Self { rate: Vec3::ZERO, gradient: Mat3([Vec3::ZERO; 3]), at: Vec3::ZERO };

    /// Wrench on `link` alone.
    #[inline]
    pub(super) fn wrench(&self, link: &LinkKinematics) -> Wrench<T> {
        let offset = link.offset.lift();
        let force = (self.at + self.gradient.apply(offset)).scaled(link.mass);
        let moment = self.moment(&link.second_moment) + offset.cross(force);
        Wrench { force, moment }
    }

    /// The integral of `s x (gradient s)` over a body with this second mass moment about its
    /// centre.
    #[inline]
    pub(super) fn moment(&self, second: &Mat3<f64>) -> Vec3<T> {
        let a = |i: usize, k: usize| self.gradient.0[k].0[i];
        let product = |i: usize, j: usize| {
            let s = second.0[j].0;
            a(i, 0) * s[0] + a(i, 1) * s[1] + a(i, 2) * s[2]
        };
        let turn = |i: usize, j: usize| product(i, j) - product(j, i);
        Vec3([turn(2, 1), turn(0, 2), turn(1, 0)])
    }
}

impl SpatialAcceleration<f64> {
    /// Goes on from a body to the link after it.
    #[inline]
    fn turn(&mut self, link: &LinkKinematics, joint_rate: f64, joint_acceleration: f64) {
        self.at += self.gradient.apply(link.lever);
        let before = self.rate;
        self.rate += link.axis * joint_rate;
        let twice = (before + self.rate) * joint_rate;
        self.gradient += Mat3::cross_matrix(link.axis * joint_acceleration)
            + Mat3::double_cross(twice, link.axis);
    }
}

impl<T: Scalar> Wrench<T> {
    pub(super) const ZERO: Self = Self { force: Vec3::ZERO, moment: Vec3::ZERO };

    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        self.force += other.force;
        self.moment += other.moment;
    }

    /// Refers the moment to a point at `-lever`.
    #[inline]
    pub(super) fn shift(&mut self, lever: Vec3<f64>) {
        self.moment += lever.lift().cross(self.force);
    }
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Bus and joint torques that produce `acceleration` in `state` under actuator force `force`
    /// (RTN, N), by the RNEA: the inverse of [`Multibody::acceleration`].
    /// Cost: O(NL), about 500 flops a link.
    #[doc(alias = "RNEA")]
    #[doc(alias = "inverse_dynamics")]
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
        let force = self.generalized_force(&self.kinematics(state), &frame, &motion);
        Control { bus_torque: force.bus.to_vector(), joint_torque: SVector::from(force.joint) }
    }

    /// The gradient of the bus's acceleration.
    #[inline]
    fn bus_gradient(&self, frame: &BusFrame<f64>, motion: &Motion<f64, NL>) -> Mat3<f64> {
        let n2 = self.mean_motion * self.mean_motion;
        let tide = Mat3::outer(frame.radial, frame.radial.scaled(-3.0 * n2))
            + Mat3::constant(&Matrix3::from_diagonal_element(n2));
        Mat3::cross_matrix(motion.bus_acceleration)
            + Mat3::double_cross(frame.rate, frame.rate)
            + tide
    }

    /// Result of the recursive Newton-Euler algorithm alone: what is between is not kept, and needs no memory.
    #[inline(never)]
    pub(super) fn generalized_force(
        &self,
        kinematics: &Kinematics<NL>,
        frame: &BusFrame<f64>,
        motion: &Motion<f64, NL>,
    ) -> GeneralizedForce<f64, NL> {
        let gradient = self.bus_gradient(frame, motion);
        let mut spatial = SpatialAcceleration { rate: frame.rate, gradient, at: Vec3::ZERO };
        let second = second_moment(&self.servicer.bus_inertia_kg_m2);
        let bus = spatial.moment(&second);
        let mut wrenches = [Wrench::ZERO; NL];
        for (i, link) in kinematics.links.iter().enumerate() {
            spatial.turn(link, motion.joint_rate[i], motion.joint_acceleration[i]);
            wrenches[i] = spatial.wrench(link);
        }
        let mut wrench = Wrench::ZERO;
        for (own, link) in wrenches.iter_mut().zip(&kinematics.links).rev() {
            wrench.add(own);
            *own = wrench;
            wrench.shift(link.lever);
        }
        let base = frame.specific_force - wrench.force.scaled(1.0 / self.total_mass);
        let mut joint = [0.0; NL];
        for (i, link) in kinematics.links.iter().enumerate() {
            let moment = wrenches[i].moment + link.subtree.first.cross(base);
            joint[i] = link.axis.dot(moment)
                + self.servicer.links[i].armature_kg_m2 * motion.joint_acceleration[i];
        }
        let moment = wrench.moment + kinematics.whole.first.cross(base);
        GeneralizedForce { bus: bus + moment, joint }
    }

    /// Recursive Newton-Euler algorithm: outwards for accelerations, inwards for forces. What is between.
    #[inline]
    pub(super) fn rnea(
        &self,
        kinematics: &Kinematics<NL>,
        frame: &BusFrame<f64>,
        motion: &Motion<f64, NL>,
    ) -> Rnea<NL> {
        let gradient = self.bus_gradient(frame, motion);
        // Relative to the bus centre of mass at first.
        let bus = SpatialAcceleration { rate: frame.rate, gradient, at: Vec3::ZERO };
        let mut links = [SpatialAcceleration::ZERO; NL];
        let mut spatial = bus;
        for (i, link) in kinematics.links.iter().enumerate() {
            spatial.turn(link, motion.joint_rate[i], motion.joint_acceleration[i]);
            links[i] = spatial;
        }

        let mut wrenches = [Wrench::ZERO; NL];
        let mut wrench = Wrench::ZERO;
        for (i, link) in kinematics.links.iter().enumerate().rev() {
            wrench.add(&links[i].wrench(link));
            wrenches[i] = wrench;
            wrench.shift(link.lever);
        }

        // Tides and internal forces cancel over the system: only the actuator force accelerates the
        // centre of mass, which gives the acceleration of the bus's centre.
        let base = frame.specific_force - wrench.force.scaled(1.0 / self.total_mass);
        for (i, link) in kinematics.links.iter().enumerate() {
            links[i].at += base;
            wrenches[i].force += base.scaled(link.subtree.mass);
            wrenches[i].moment += link.subtree.first.cross(base);
        }
        Rnea { bus, links, wrenches }
    }
}

/// A control with the states before and after its interval: initial guess of [`Multibody::track_rates`].
#[derive(Clone, Copy, Debug)]
pub struct Transition<'a, const NL: usize> {
    /// State before the interval.
    pub state: &'a State<NL>,
    /// Control over the interval.
    pub control: &'a Control<NL>,
    /// State after the interval.
    pub reached: &'a State<NL>,
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Inverse-dynamics tracking: the control that takes the rates of `state` to `goal` over one step of
    /// the integrator, to 1e-8 rad/s, and the state it leads to. `known` is a near transition under the
    /// same force.
    ///
    /// Exact for Euler by inverse dynamics, which need no step to know where they lead. For RK4 the known control
    /// is changed by the difference of the inverse dynamics at the midpoints, repeatedly until the tolerance is met
    /// or the deadline has passed. `None` where that diverges. Cost: a step and two inverse dynamics a round, one or
    /// two rounds.
    pub fn track_rates(
        &self,
        stepping: &Stepping<'_>,
        state: &State<NL>,
        goal: (&Vector3<f64>, &SVector<f64, NL>),
        known: Transition<NL>,
        force: &Vector3<f64>,
    ) -> Option<(Control<NL>, State<NL>)> {
        let Stepping { integrator, dt, deadline } = *stepping;
        let mean =
            |from: &State<NL>, rate: &Vector3<f64>, joint_rate: &SVector<f64, NL>| Acceleration {
                bus: (rate - from.rate) / dt,
                joint: (joint_rate - from.joint_rate) / dt,
            };
        let wanted = mean(state, goal.0, goal.1);
        if integrator == Integrator::Euler {
            return Some((self.torques(state, force, &wanted), state.after(dt, wanted)));
        }
        // Torques to or from such a state would overflow.
        let expected = known.expected(dt, state, goal);
        let near = [&expected, known.state, known.reached];
        if near.iter().any(|state| stepping.has_diverged(state)) {
            return None;
        }
        let better = |known: Transition<NL>| {
            let Transition { state: from, reached: to, .. } = known;
            let spent = mean(from, &to.rate, &to.joint_rate);
            let spent = self.torques(&from.midpoint(to), force, &spent);
            let expected = known.expected(dt, state, goal);
            let needed = self.torques(&state.midpoint(&expected), force, &wanted);
            known.control.changed(&needed, &spent)
        };
        let mut control = better(known);
        let mut reached = self.step(integrator, dt, state, &control, force);
        // Bound: rate_tracking.
        for _ in 0..TRACKING_ITERATIONS {
            let error = (goal.0 - reached.rate).amax().max((goal.1 - reached.joint_rate).amax());
            if stepping.has_diverged(&reached) {
                return None;
            }
            if error <= TRACKING_TOLERANCE || deadline.has_passed() {
                break;
            }
            control = better(Transition { state, control: &control, reached: &reached });
            reached = self.step(integrator, dt, state, &control, force);
        }
        Some((control, reached))
    }
}

impl<const NL: usize> Transition<'_, NL> {
    /// Predicts the state after a transition from `state` to the rates `goal`.
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
    /// This control plus `needed` less `spent`.
    fn changed(&self, needed: &Self, spent: &Self) -> Self {
        Self {
            bus_torque: self.bus_torque + (needed.bus_torque - spent.bus_torque),
            joint_torque: self.joint_torque + (needed.joint_torque - spent.joint_torque),
        }
    }
}

/// Most rounds of [`Multibody::steer`] after the first.
pub const TRACKING_ITERATIONS: usize = 4;

/// Error of a rate at which [`Multibody::steer`] stops [rad/s].
const TRACKING_TOLERANCE: f64 = 1e-8;
