//! Discrete dynamics: one step of Euler or RK4 over an interval, and its exact derivatives.

use super::{Acceleration, AccelerationJacobian, Control, Integrator, Multibody, State};
use crate::math::quaternion;
use nalgebra::{Matrix3, SMatrix, Vector3, Vector4};
use remora_qp::time::Deadline;

/// Substeps with derivatives after which the deadline is looked at.
const LOOKS: usize = 64;

/// Turn of bus or joint in a step [rad] beyond which the dynamics diverge: soon their numbers overflow.
const DIVERGED: f64 = 100.0;

/// How an interval is integrated, and until when that is worth the while.
#[derive(Clone, Copy, Debug)]
pub struct Stepping<'a> {
    /// The method.
    pub integrator: Integrator,
    /// Duration of the interval [s].
    pub dt: f64,
    /// When work ends with what it has.
    pub deadline: Deadline<'a>,
}

impl Stepping<'static> {
    /// Without a deadline.
    pub const fn new(integrator: Integrator, dt: f64) -> Self {
        Self { integrator, dt, deadline: Deadline::never() }
    }
}

impl Stepping<'_> {
    /// Whether a state is not one that steps lead to while they converge.
    pub(crate) fn has_diverged<const NL: usize>(&self, state: &State<NL>) -> bool {
        let substeps = match self.integrator {
            Integrator::Euler => 1,
            Integrator::Rk4 { substeps } => substeps,
        };
        state.diverges(self.dt / substeps as f64)
    }
}

/// Derivatives of one step. State columns and rows are `[dtheta, alpha, rate, joint_rate]`,
/// `dtheta` a left perturbation in RTN axes at either end; control columns are
/// `[bus_torque, joint_torque]`. SI units.
#[derive(Clone, Copy, Debug)]
pub struct StepJacobian<const NX: usize, const NU: usize> {
    /// Successor by state.
    pub state: SMatrix<f64, NX, NX>,
    /// Successor by control.
    pub control: SMatrix<f64, NX, NU>,
}

/// Time derivative of a state, the quaternion's four components raw.
#[derive(Clone, Copy)]
struct Rates<const NL: usize> {
    attitude: Vector4<f64>,
    acceleration: Acceleration<NL>,
}

impl<const NL: usize> State<NL> {
    /// The state moved along `rates` for `h` seconds, the quaternion not renormalised; joints and
    /// their rates move with the velocities of `at`.
    fn advanced(&self, at: &Self, rates: &Rates<NL>, h: f64) -> Self {
        Self {
            attitude: self.attitude + rates.attitude * h,
            joint_angle: self.joint_angle + at.joint_rate * h,
            rate: self.rate + rates.acceleration.bus * h,
            joint_rate: self.joint_rate + rates.acceleration.joint * h,
        }
    }

    /// Where an Euler step of `dt` seconds with this acceleration leads.
    pub(super) fn after(&self, dt: f64, acceleration: Acceleration<NL>) -> Self {
        let attitude = quaternion::derivative(&self.attitude, &self.rate);
        self.advanced(self, &Rates { attitude, acceleration }, dt).renormalized()
    }

    /// Whether bus or joints turn so fast that steps of `h` seconds diverge, or are not numbers.
    fn diverges(&self, h: f64) -> bool {
        !(self.rate.amax() * h <= DIVERGED && self.joint_rate.amax() * h <= DIVERGED)
    }

    fn renormalized(mut self) -> Self {
        self.attitude = quaternion::normalized(&self.attitude);
        self
    }
}

impl<const NL: usize> Multibody<'_, NL> {
    /// The state `dt` seconds after `state`, with `control` (body axes) and `force` (RTN, N) held.
    ///
    /// Cost: one evaluation of the dynamics (Euler) or four a substep (RK4).
    pub fn step(
        &self,
        integrator: Integrator,
        dt: f64,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> State<NL> {
        match integrator {
            Integrator::Euler => state.after(dt, self.acceleration(state, control, force)),
            Integrator::Rk4 { substeps } => {
                let mut x = *state;
                self.rk4(substeps, dt, &mut x, control, force);
                x
            }
        }
    }

    /// Takes the step of [`Multibody::step`] with its exact derivatives. Past the deadline the result
    /// is of no use.
    ///
    /// Cost: one (Euler) or `4 M` (RK4) evaluations of [`Multibody::acceleration_jacobian`], and
    /// for RK4 `8 M` products of `NX / 2 x NX` with `NX x (NX + NU)`.
    pub fn step_jacobian<const NX: usize, const NU: usize>(
        &self,
        stepping: &Stepping<'_>,
        state: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> (State<NL>, StepJacobian<NX, NU>) {
        let Stepping { integrator, dt, deadline } = *stepping;
        match integrator {
            Integrator::Euler => self.euler_jacobian(dt, state, control, force),
            Integrator::Rk4 { substeps } => {
                let h = dt / substeps as f64;
                let mut x = *state;
                let mut by_state = Sensitivity::<NL, NX>::identity(state);
                let mut by_control = Sensitivity::<NL, NU>::ZERO;
                // Bound: substeps.
                for i in 0..substeps {
                    if i % LOOKS == LOOKS - 1 && deadline.has_passed() {
                        break;
                    }
                    x = self.rk4_substep_jacobian(
                        &x,
                        control,
                        force,
                        h,
                        &mut by_state,
                        &mut by_control,
                    );
                }
                let jacobian = StepJacobian {
                    state: by_state.tangent(&x.attitude),
                    control: by_control.tangent(&x.attitude),
                };
                (x, jacobian)
            }
        }
    }

    #[inline]
    fn rates(&self, x: &State<NL>, control: &Control<NL>, force: &Vector3<f64>) -> Rates<NL> {
        Rates {
            attitude: quaternion::derivative(&x.attitude, &x.rate),
            acceleration: self.acceleration(x, control, force),
        }
    }

    /// RK4 in so many substeps, where the state lies. A state that diverges stays where it is then.
    #[inline(never)]
    pub(crate) fn rk4(
        &self,
        substeps: usize,
        dt: f64,
        x: &mut State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) {
        let h = dt / substeps as f64;
        // Weight of each stage in the sum, and how far ahead the next stage stands.
        let stages = [(h / 6.0, 0.5 * h), (h / 3.0, 0.5 * h), (h / 3.0, h), (h / 6.0, 0.0)];
        // Bound: substeps.
        for _ in 0..substeps {
            if x.diverges(h) {
                break;
            }
            let (mut stage, mut sum) = (*x, *x);
            for (weight, ahead) in stages {
                let rates = self.rates(&stage, control, force);
                sum = sum.advanced(&stage, &rates, weight);
                stage = x.advanced(&stage, &rates, ahead);
            }
            *x = sum.renormalized();
        }
    }

    #[inline(never)]
    fn euler_jacobian<const NX: usize, const NU: usize>(
        &self,
        dt: f64,
        x: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> (State<NL>, StepJacobian<NX, NU>) {
        let (acceleration, by) = self.acceleration_jacobian::<NX, NU>(x, control, force);
        let next = x.after(dt, acceleration);

        // The attitude turns by the quaternion (dt/2 w, 1), which need not be of unit length.
        let half = x.rate * (0.5 * dt);
        let turn = quaternion::rotation_matrix(&Vector4::new(half.x, half.y, half.z, 1.0));
        let by_rate = (Matrix3::identity() + half.cross_matrix()) * (dt / (1.0 + half.dot(&half)));
        let mut state = SMatrix::<f64, NX, NX>::identity();
        state.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        state.fixed_view_mut::<3, 3>(0, 3 + NL).copy_from(&by_rate);
        for i in 0..NL {
            state[(3 + i, 6 + NL + i)] = dt;
        }
        let mut control = SMatrix::<f64, NX, NU>::zeros();
        for j in 0..NX {
            for i in 0..3 {
                state[(3 + NL + i, j)] += dt * by.bus_state[(i, j)];
            }
            for i in 0..NL {
                state[(6 + NL + i, j)] += dt * by.joint_state[(i, j)];
            }
        }
        for j in 0..NU {
            for i in 0..3 {
                control[(3 + NL + i, j)] = dt * by.bus_control[(i, j)];
            }
            for i in 0..NL {
                control[(6 + NL + i, j)] = dt * by.joint_control[(i, j)];
            }
        }
        (next, StepJacobian { state, control })
    }

    #[inline(never)]
    fn rk4_substep_jacobian<const NX: usize, const NU: usize>(
        &self,
        x: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
        h: f64,
        by_state: &mut Sensitivity<NL, NX>,
        by_control: &mut Sensitivity<NL, NU>,
    ) -> State<NL> {
        let (start_state, start_control) = (*by_state, *by_control);
        let (mut stage_state, mut stage_control) = (*by_state, *by_control);
        let (mut stage, mut sum) = (*x, *x);
        // Weight of each stage in the sum, and how far ahead the next stage stands.
        for (weight, ahead) in
            [(h / 6.0, 0.5 * h), (h / 3.0, 0.5 * h), (h / 3.0, h), (h / 6.0, 0.0)]
        {
            // Not taken apart: that would copy it.
            let evaluated = self.acceleration_jacobian::<NX, NU>(&stage, control, force);
            let (acceleration, by) = (evaluated.0, &evaluated.1);
            let attitude = quaternion::derivative(&stage.attitude, &stage.rate);
            let rates = Rates { attitude, acceleration };
            let rate_state = stage_state.rates(&stage, by);
            let mut rate_control = stage_control.rates(&stage, by);
            rate_control.rate += by.bus_control;
            rate_control.joint_rate += by.joint_control;

            sum = sum.advanced(&stage, &rates, weight);
            by_state.add_scaled(&rate_state, weight);
            by_control.add_scaled(&rate_control, weight);
            if ahead > 0.0 {
                stage_state = start_state;
                stage_state.add_scaled(&rate_state, ahead);
                stage_control = start_control;
                stage_control.add_scaled(&rate_control, ahead);
                stage = x.advanced(&stage, &rates, ahead);
            }
        }
        by_state.renormalize(&sum.attitude);
        by_control.renormalize(&sum.attitude);
        sum.renormalized()
    }
}

/// Derivatives of a state (the quaternion's four components raw) along `C` directions.
#[derive(Clone, Copy)]
struct Sensitivity<const NL: usize, const C: usize> {
    attitude: SMatrix<f64, 4, C>,
    joint_angle: SMatrix<f64, NL, C>,
    rate: SMatrix<f64, 3, C>,
    joint_rate: SMatrix<f64, NL, C>,
}

impl<const NL: usize, const C: usize> Sensitivity<NL, C> {
    const ZERO: Self = Self {
        attitude: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 4]; C])),
        joint_angle: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]; C])),
        rate: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; C])),
        joint_rate: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]; C])),
    };

    /// Derivatives of a state with respect to itself, columns `[dtheta, alpha, rate, joint_rate]`.
    fn identity(x: &State<NL>) -> Self {
        let mut s = Self::ZERO;
        for j in 0..3 {
            let column = quaternion::derivative(&x.attitude, &Vector3::ith(j, 1.0));
            s.attitude.set_column(j, &column);
            s.rate[(j, 3 + NL + j)] = 1.0;
        }
        for j in 0..NL {
            s.joint_angle[(j, 3 + j)] = 1.0;
            s.joint_rate[(j, 6 + NL + j)] = 1.0;
        }
        s
    }

    /// Derivatives of the state's time derivative; those of the control come on top.
    // Separate function: its frame is off the stack while the accelerations are computed.
    #[inline(never)]
    fn rates<const NX: usize, const NU: usize>(
        &self,
        x: &State<NL>,
        by: &AccelerationJacobian<NL, NX, NU>,
    ) -> Self {
        let spin = Vector4::new(x.rate.x, x.rate.y, x.rate.z, 0.0);
        let tangent: SMatrix<f64, NX, C> = self.tangent(&x.attitude);
        let mut attitude = SMatrix::<f64, 4, C>::zeros();
        for j in 0..C {
            let dq = self.attitude.column(j).into_owned();
            let dw = self.rate.column(j).into_owned();
            let column =
                quaternion::product(&spin, &dq) * 0.5 + quaternion::derivative(&x.attitude, &dw);
            attitude.set_column(j, &column);
        }
        Self {
            attitude,
            joint_angle: self.joint_rate,
            rate: by.bus_state * tangent,
            joint_rate: by.joint_state * tangent,
        }
    }

    fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.attitude += other.attitude * factor;
        self.joint_angle += other.joint_angle * factor;
        self.rate += other.rate * factor;
        self.joint_rate += other.joint_rate * factor;
    }

    /// Follows `q <- q / |q|`.
    fn renormalize(&mut self, q: &Vector4<f64>) {
        let norm = quaternion::norm(q);
        let unit = q / norm;
        for j in 0..C {
            let dq = self.attitude.column(j).into_owned();
            let tangential = (dq - unit * unit.dot(&dq)) / norm;
            self.attitude.set_column(j, &tangential);
        }
    }

    /// As rows `[dtheta, alpha, rate, joint_rate]` at attitude `q` (of any length).
    fn tangent<const NX: usize>(&self, q: &Vector4<f64>) -> SMatrix<f64, NX, C> {
        let mut out = SMatrix::<f64, NX, C>::zeros();
        let inverse = quaternion::conjugate(q) / q.dot(q);
        for j in 0..C {
            let dq = self.attitude.column(j).into_owned();
            let d = quaternion::product(&dq, &inverse);
            for i in 0..3 {
                out[(i, j)] = 2.0 * d[i];
                out[(3 + NL + i, j)] = self.rate[(i, j)];
            }
            for i in 0..NL {
                out[(3 + i, j)] = self.joint_angle[(i, j)];
                out[(6 + NL + i, j)] = self.joint_rate[(i, j)];
            }
        }
        out
    }
}
