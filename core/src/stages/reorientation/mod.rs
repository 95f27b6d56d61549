//! Stage 2: bus attitude and arm (section 6).

mod linearise;
mod roll_out;

use super::TranslationTrajectory;
use super::heuristic::line_of_sight;
use super::size::NR;
use super::worse;
use crate::dynamics::{Control, Integrator, Multibody, State};
use crate::math::{clamp, quaternion};
use crate::model::{Mission, TargetState, initial_bus_attitude};
use crate::pair::{Pair, Sequential};
use crate::qp::{Qp, Solution, Stage, Sweep};
use crate::scp::{Problem, Residuals};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector4};
use roll_out::RateOffset;

/// Attitude and arm over the horizon, torques over the intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReorientationTrajectory<const N: usize, const NL: usize> {
    /// States at the nodes.
    pub states: [State<NL>; N],
    /// Controls over the intervals; the last is zero.
    pub controls: [Control<NL>; N],
}

impl<const N: usize, const NL: usize> ReorientationTrajectory<N, NL> {
    /// Placeholder for storage.
    pub const ZERO: Self = Self { states: [State::ZERO; N], controls: [Control::ZERO; N] };

    /// The same, all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self = Self {
        states: [State { attitude: Vector4::new(0.0, 0.0, 0.0, 0.0), ..State::ZERO }; N],
        controls: [Control::ZERO; N],
    };
}

/// What is asked of Stage 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Mode {
    /// Minimise the cost.
    #[default]
    Optimal,
    /// Stop at the first feasible iterate; no objective, steps as short as they can be.
    Feasible,
}

/// Stage 2 as a problem for the loop.
///
/// Steps live on the tangent space: `[dtheta, dalpha, drate, djoint_rate]`, `dtheta` a left
/// perturbation in RTN axes (at the last node, in axes whose first is the approach direction, so
/// that the terminal attitude constraint pins the other two).
///
/// `P` runs the two halves of the horizon wherever nodes do not depend on each other.
pub struct Reorientation<'a, P, const N: usize, const NL: usize, const NX: usize, const NU: usize> {
    mission: &'a Mission<NL>,
    pair: &'a P,
    body: Multibody<NL>,
    translation: &'a TranslationTrajectory<N>,
    integrator: Integrator,
    mode: Mode,
    dt: f64,
    preset: usize,
    sight: [Vector3<f64>; N],
    terminal_rate: Vector3<f64>,
    /// Direction that the end effector must point in at the last node.
    approach: Vector3<f64>,
    /// The end effector's direction in bus axes at capture.
    arm: Vector3<f64>,
    /// Axes of the last node's attitude step, as columns in RTN.
    terminal_axes: Matrix3<f64>,
    cos_field_of_view: f64,
    scale_x: SVector<f64, NX>,
    scale_u: SVector<f64, NU>,
    tolerance_x: SVector<f64, NX>,
}

/// Typical magnitudes by which steps are divided: attitude and joint angles [rad], bus rate and
/// joint rates [rad/s], torques relative to their limits.
const ANGLE_SCALE: f64 = 0.1;
const RATE_SCALE: f64 = 1e-3;
const JOINT_RATE_SCALE: f64 = 5e-3;
const TORQUE_SCALE: f64 = 0.1;
/// The same for the pointing row, in cosine.
const COSINE_SCALE: f64 = 0.1;

/// Share of each tolerance that the loop leaves to the verifier.
const MARGIN: f64 = 0.5;

/// Share of each tolerance below which defects do not count in the merit: second-order remainders
/// of this size mean nothing, yet would shrink steps.
const IGNORED: f64 = 0.2;

/// Curvature by which the first steps stay near the start's joint angles (scaled). Large moves in
/// the first linearisations end in poor basins: without it costs are 10 % higher in the mean.
const PROXIMITY: f64 = 3e-3;

/// Nodes that one core linearises while the other makes those after them convex.
const BATCH: usize = 12;

/// Roll-outs of a step: the second makes up for the pose that the first one missed.
const PASSES: usize = 2;

impl<'a, P: Pair, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'a, P, N, NL, NX, NU>
{
    /// The problem that follows from Stage 1's path; `target` the tumble at the nodes.
    pub fn new(
        mission: &'a Mission<NL>,
        translation: &'a TranslationTrajectory<N>,
        target: &[TargetState; N],
        integrator: Integrator,
        mode: Mode,
        pair: &'a P,
    ) -> Self {
        const { assert!(NX == 6 + 2 * NL && NU == 3 + NL, "sizes of state and control") };
        let servicer = &mission.servicer;
        let last = &target[N - 1];
        let approach = -(quaternion::rotation_matrix(&last.attitude) * mission.target.port_normal);
        let across = quaternion::any_normal(&approach);
        let t = &mission.tolerances;
        let (scale_x, scale_u) = Self::scales(mission);
        Self {
            mission,
            pair,
            body: Multibody::new(mission),
            translation,
            integrator,
            mode,
            dt: mission.approach.duration / (N - 1) as f64,
            preset: (N - 1).saturating_sub(mission.approach.preset_lead).max(1),
            sight: core::array::from_fn(|k| {
                line_of_sight(mission, &translation.position[k], &target[k])
            }),
            terminal_rate: last.rate,
            approach,
            arm: servicer.capture_geometry().direction,
            terminal_axes: Matrix3::from_columns(&[approach, across, approach.cross(&across)]),
            cos_field_of_view: libm::cos(mission.approach.field_of_view_half_angle),
            scale_x,
            scale_u,
            tolerance_x: Self::by_kind(1.0, 1.0, 1e-2, 1e-2) * t.dynamics,
        }
    }

    /// What the components of steps are divided by in the subproblem: states [rad, rad/s] and
    /// controls [N m].
    pub fn scales(mission: &Mission<NL>) -> (SVector<f64, NX>, SVector<f64, NU>) {
        (
            Self::by_kind(ANGLE_SCALE, ANGLE_SCALE, RATE_SCALE, JOINT_RATE_SCALE),
            SVector::from_fn(|i, _| TORQUE_SCALE * Self::max_torque(mission, i)),
        )
    }

    /// Cost of a torque profile, as section 6 defines it.
    pub fn cost(&self, controls: &[Control<NL>; N]) -> f64 {
        let (w, s) = (&self.mission.weights, &self.mission.servicer);
        controls[..N - 1]
            .iter()
            .map(|u| {
                w.bus_torque * (u.bus_torque / s.max_bus_torque).norm_squared()
                    + w.joint_torque * (u.joint_torque / s.max_joint_torque).norm_squared()
            })
            .sum()
    }

    fn by_kind(angle: f64, joint: f64, rate: f64, joint_rate: f64) -> SVector<f64, NX> {
        SVector::from_fn(|i, _| match i {
            i if i < 3 => angle,
            i if i < 3 + NL => joint,
            i if i < 6 + NL => rate,
            _ => joint_rate,
        })
    }

    fn max_torque(mission: &Mission<NL>, i: usize) -> f64 {
        if i < 3 { mission.servicer.max_bus_torque } else { mission.servicer.max_joint_torque }
    }

    fn weight(&self, i: usize) -> f64 {
        if i < 3 { self.mission.weights.bus_torque } else { self.mission.weights.joint_torque }
    }

    /// Axes in which attitude steps at node `k` are resolved, as columns in RTN.
    fn axes(&self, k: usize) -> Matrix3<f64> {
        if k + 1 == N { self.terminal_axes } else { Matrix3::identity() }
    }

    /// `F(x_k, u_k) - x_{k+1}`, scaled, in the axes of node `k + 1`.
    fn defect(&self, k: usize, next: &State<NL>, at: &State<NL>) -> SVector<f64, NX> {
        let turn = quaternion::difference(&next.attitude, &at.attitude);
        let turn = self.axes(k + 1).tr_mul(&turn);
        self.stack(
            turn,
            next.joint_angle - at.joint_angle,
            next.rate - at.rate,
            next.joint_rate - at.joint_rate,
        )
        .component_div(&self.scale_x)
    }

    fn stack(
        &self,
        turn: Vector3<f64>,
        angle: SVector<f64, NL>,
        rate: Vector3<f64>,
        joint_rate: SVector<f64, NL>,
    ) -> SVector<f64, NX> {
        SVector::from_fn(|i, _| match i {
            i if i < 3 => turn[i],
            i if i < 3 + NL => angle[i - 3],
            i if i < 6 + NL => rate[i - 3 - NL],
            _ => joint_rate[i - 6 - NL],
        })
    }

    fn stacked_control(control: &Control<NL>) -> SVector<f64, NU> {
        SVector::from_fn(
            |i, _| {
                if i < 3 { control.bus_torque[i] } else { control.joint_torque[i - 3] }
            },
        )
    }

    /// Pointing row `cos(fov) - sight . R b` and its gradient by the attitude step.
    fn pointing_row(&self, k: usize, state: &State<NL>) -> (f64, Vector3<f64>) {
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let gradient = self.sight[k].cross(&boresight);
        (
            (self.cos_field_of_view - self.sight[k].dot(&boresight)) / COSINE_SCALE,
            gradient / COSINE_SCALE,
        )
    }

    /// Whether component `i` of the state at node `k` is fixed by a constraint.
    fn is_pinned(&self, k: usize, i: usize) -> bool {
        let joint_rate = i >= 6 + NL;
        k == 0
            || (k >= self.preset && joint_rate)
            || (k == self.preset && (3..3 + NL).contains(&i))
            || (k == N - 1 && (i == 1 || i == 2 || (3 + NL..6 + NL).contains(&i)))
    }

    /// Moves `state` at the last node onto what is fixed there; returns by how much it turned.
    fn pin_terminal(&self, state: &mut State<NL>) -> Vector3<f64> {
        state.rate = self.terminal_rate;
        let arm = quaternion::rotation_matrix(&state.attitude) * self.arm;
        let turn = quaternion::between(&arm, &self.approach);
        state.attitude = quaternion::normalized(&quaternion::product(&turn, &state.attitude));
        quaternion::log(&turn)
    }

    /// Defects and rows of the nodes from `first` on.
    fn residuals_from(
        &self,
        first: usize,
        z: &ReorientationTrajectory<N, NL>,
        defects: &mut [SVector<f64, NX>],
        rows: &mut [SVector<f64, NR>],
    ) {
        for ((k, defect), row) in (first..N).zip(defects).zip(rows) {
            row[0] = self.pointing_row(k, &z.states[k]).0;
            defect.fill(0.0);
            if k + 1 < N {
                let (state, control) = (&z.states[k], &z.controls[k]);
                let force = &self.translation.force[k];
                let next = self.body.step(self.integrator, self.dt, state, control, force);
                *defect = self.defect(k, &next, &z.states[k + 1]);
            }
        }
    }

    /// Fills the whole program, curvature included, and makes it convex.
    ///
    /// The sweep that makes it convex goes from the last node to the first, one after the other,
    /// and is quick but where it meets indefinite curvature. It runs on one core while the other
    /// linearises the nodes before, a batch at a time. What the sweep leaves of its core's time,
    /// counted in work so that no clock is needed, goes into linearisation too.
    fn linearise_convex(
        &self,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: &Solution<N, NX, NU, NR>,
        convex: &SVector<f64, NU>,
        qp: &mut Qp<N, NX, NU, NR>,
    ) {
        let linearise = |k, stage: &mut Stage<NX, NU, NR>| {
            self.linearise_at(k, z, Some(multipliers), convex, stage);
        };
        let Some((last, stages)) = qp.stages.split_last_mut() else { return };
        linearise(N - 1, last);
        let mut sweep = Sweep::new(last, convex);
        // Nodes from `filled` on are linearised, those from `swept` on convex too.
        let (mut filled, mut swept) = (stages.len(), stages.len());
        // Bound: constant, nodes in pieces.
        while swept > 0 {
            let from = filled.saturating_sub(BATCH);
            let parts = stages.get_disjoint_mut([0..from, from..filled, filled..swept]);
            let Ok([before, batch, ready]) = parts else { return };
            let budget = match filled - from {
                0 => usize::MAX,
                nodes => nodes * self.node_work(),
            };
            let sweep_and_help = || {
                let (done, work) = sweep.over(filled, ready, budget, |k, i| self.is_pinned(k, i));
                let help = budget.saturating_sub(work) / self.node_work();
                let helped = before.iter_mut().enumerate().rev().take(help);
                (done, helped.map(|(k, stage)| linearise(k, stage)).count())
            };
            let fill = || (from..).zip(batch).for_each(|(k, stage)| linearise(k, stage));
            let ((done, helped), ()) = self.pair.join(sweep_and_help, fill);
            filled = from.saturating_sub(helped);
            swept = swept.saturating_sub(done);
        }
        qp.constant += sweep.end().0;
    }

    /// What the linearisation of a node takes of time, where the sweep takes 1.
    fn node_work(&self) -> usize {
        match self.integrator {
            Integrator::Euler => 3,
            Integrator::Rk4 { substeps } => substeps.saturating_mul(6).max(1),
        }
    }

    /// Fills `stage`, that of node `k`, with everything but curvature that is handed from node to
    /// node.
    fn linearise_at(
        &self,
        k: usize,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: Option<&Solution<N, NX, NU, NR>>,
        convex: &SVector<f64, NU>,
        stage: &mut Stage<NX, NU, NR>,
    ) {
        *stage = Stage::ZERO;
        let (Some(state), Some(control)) = (z.states.get(k), z.controls.get(k)) else { return };
        let (offset, gradient) = self.pointing_row(k, state);
        let gradient = self.axes(k).tr_mul(&gradient) * ANGLE_SCALE;
        stage.row_offset[0] = offset;
        for i in 0..3 {
            stage.row_x[(0, i)] = gradient[i];
        }
        if let Some(last) = multipliers {
            self.add_pointing_curvature(k, state, last.row_multiplier[k][0], stage);
            self.stiffen(k, state, last, stage);
        }
        let Some(at) = z.states.get(k + 1) else { return };
        let held = (control, &self.translation.force[k]);
        let next = self.linearise_interval(k, state, held, at, stage);
        if let Some(last) = multipliers {
            self.add_curvature(k, (state, &next), held, &last.defect_multiplier[k], stage);
        }
        self.apply_chart(k, &next, at, stage);
        let control = Self::stacked_control(control);
        for i in 0..NU {
            if self.mode == Mode::Optimal {
                stage.gradient_u[i] = convex[i] * control[i] / self.scale_u[i];
            }
        }
    }
}

impl<P: Pair, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Problem<N, NX, NU, NR> for Reorientation<'_, P, N, NL, NX, NU>
{
    type Trajectory = ReorientationTrajectory<N, NL>;

    fn clip(&self, z: &mut Self::Trajectory) {
        let servicer = &self.mission.servicer;
        for (k, state) in z.states.iter_mut().enumerate() {
            for i in 0..NL {
                let limit = servicer.max_joint_angle[i];
                state.joint_angle[i] = clamp(state.joint_angle[i], -limit, limit);
                let limit = servicer.max_joint_rate;
                state.joint_rate[i] = clamp(state.joint_rate[i], -limit, limit);
            }
            if k >= self.preset {
                state.joint_rate.fill(0.0);
            }
            state.attitude = quaternion::normalized(&state.attitude);
        }
        if let Some(state) = z.states.get_mut(self.preset) {
            state.joint_angle = servicer.capture_joint_angle;
        }
        z.states[0] = State {
            attitude: initial_bus_attitude(&self.translation.position[0]),
            joint_angle: servicer.initial_joint_angle,
            rate: Vector3::zeros(),
            joint_rate: SVector::zeros(),
        };
        self.pin_terminal(&mut z.states[N - 1]);
        for control in &mut z.controls {
            *control = control.within_limits(servicer);
        }
        z.controls[N - 1] = Control::ZERO;
    }

    fn linearise(
        &mut self,
        z: &Self::Trajectory,
        multipliers: Option<&Solution<N, NX, NU, NR>>,
        qp: &mut Qp<N, NX, NU, NR>,
    ) {
        qp.defect_weight = 1.0;
        qp.constant = 0.0;
        let convex = SVector::<f64, NU>::from_fn(|i, _| {
            let unit = self.scale_u[i] / Self::max_torque(self.mission, i);
            2.0 * self.weight(i) * unit * unit
        });
        if let Some(multipliers) = multipliers
            && self.mode == Mode::Optimal
        {
            return self.linearise_convex(z, multipliers, &convex, qp);
        }
        let (early, late) = qp.stages.split_at_mut(N / 2);
        let half = |first: usize, stages: &mut [Stage<NX, NU, NR>]| {
            for (k, stage) in (first..N).zip(stages) {
                self.linearise_at(k, z, None, &convex, stage);
                stage.hessian_uu = SMatrix::from_diagonal(&convex);
                for i in 3..3 + NL {
                    stage.hessian_xx[(i, i)] = PROXIMITY;
                }
            }
        };
        self.pair.join(|| half(0, early), || half(N / 2, late));
    }

    fn bound(&self, z: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NR>) {
        let servicer = &self.mission.servicer;
        for (k, stage) in qp.stages.iter_mut().enumerate() {
            let state = &z.states[k];
            for i in 0..NX {
                let reach = radius / ANGLE_SCALE;
                let (lower, upper) = match i {
                    _ if self.is_pinned(k, i) => (0.0, 0.0),
                    i if i < 3 => (-reach, reach),
                    i if i < 3 + NL => {
                        let (at, limit) =
                            (state.joint_angle[i - 3], servicer.max_joint_angle[i - 3]);
                        (
                            ((-limit - at) / ANGLE_SCALE).max(-reach),
                            ((limit - at) / ANGLE_SCALE).min(reach),
                        )
                    }
                    i if i < 6 + NL => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => {
                        let (at, limit) = (state.joint_rate[i - 6 - NL], servicer.max_joint_rate);
                        ((-limit - at) / JOINT_RATE_SCALE, (limit - at) / JOINT_RATE_SCALE)
                    }
                };
                stage.lower_x[i] = lower;
                stage.upper_x[i] = upper;
            }
            let control = Self::stacked_control(&z.controls[k]);
            for i in 0..NU {
                let limit = Self::max_torque(self.mission, i);
                stage.lower_u[i] = (-limit - control[i]) / self.scale_u[i];
                stage.upper_u[i] = (limit - control[i]) / self.scale_u[i];
            }
        }
    }

    fn retract(
        &self,
        from: &Self::Trajectory,
        qp: &Qp<N, NX, NU, NR>,
        step: &Solution<N, NX, NU, NR>,
        to: &mut Self::Trajectory,
    ) {
        // Each roll-out starts from the controls of the last.
        *to = *from;
        let mut offset = RateOffset::<NL>::ZERO;
        for _ in 0..PASSES {
            let gap = self.roll_out(from, qp, step, &offset, to);
            offset.turn -= gap.turn;
            offset.joint -= gap.joint;
        }
    }

    fn residuals(&self, z: &Self::Trajectory, out: &mut Residuals<N, NX, NR>) {
        out.cost = if self.mode == Mode::Optimal { self.cost(&z.controls) } else { 0.0 };
        out.ignored_defect = self.tolerance_x.component_div(&self.scale_x) * IGNORED;
        out.ignored_row.fill(IGNORED * self.mission.tolerances.pointing / COSINE_SCALE);
        let (early_defects, late_defects) = out.defect.split_at_mut(N / 2);
        let (early_rows, late_rows) = out.row.split_at_mut(N / 2);
        let early = || self.residuals_from(0, z, early_defects, early_rows);
        let late = || self.residuals_from(N / 2, z, late_defects, late_rows);
        match self.integrator {
            // Too little work to hand over.
            Integrator::Euler => Sequential.join(early, late),
            Integrator::Rk4 { .. } => self.pair.join(early, late),
        };
    }

    fn violation(&self, residuals: &Residuals<N, NX, NR>) -> f64 {
        let mut worst = 0.0;
        for (row, defect) in residuals.row.iter().zip(&residuals.defect) {
            worst = worse(worst, row[0] * COSINE_SCALE / self.mission.tolerances.pointing);
            let defect = defect.component_mul(&self.scale_x).component_div(&self.tolerance_x);
            worst = defect.iter().fold(worst, |worst, d| worse(worst, d.abs()));
        }
        worst / MARGIN
    }

    fn step_length(&self, step: &Solution<N, NX, NU, NR>) -> f64 {
        let angles =
            |x: &SVector<f64, NX>| x.iter().take(3 + NL).fold(0.0f64, |m, v| m.max(v.abs()));
        step.x.iter().map(angles).fold(0.0, f64::max) * ANGLE_SCALE
    }
}
