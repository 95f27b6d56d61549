//! Stage 2: the reorientation of bus and arm (section 6).

mod limits;
mod linearise;
mod path_constraints;
mod rollout;

use super::clearance::Bodies;
use super::heuristic::line_of_sight;
use super::size::{self, NG};
use super::terminal::Terminal;
use super::worse;
use super::{Formulation, TranslationTrajectory, recovery};
use crate::dynamics::{Control, Integrator, Multibody, State, Stepping};
use crate::executor::{ForkJoin, Sequential};
use crate::math::quaternion;
use crate::model::{Grid, Margins, Mission, Recovery, TargetState};
use crate::scp::{Problem, Residuals};
use linearise::Inputs;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector4};
use remora_qp::dense::clamp;
use remora_qp::kept::nth;
use remora_qp::{Convexification, Qp, QpStage, Solution};
use rollout::RateOffset;

/// Trajectory of bus attitude and arm: states at the nodes, torques over the intervals.
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

    /// Placeholder with all bits zero: static memory then costs no room in an image.
    pub(crate) const BLANK: Self = Self {
        states: [State { attitude: Vector4::new(0.0, 0.0, 0.0, 0.0), ..State::ZERO }; N],
        controls: [Control::ZERO; N],
    };

    /// Sets all from node `first` on to [`Self::ZERO`]: what a plan of fewer nodes leaves open.
    pub(crate) fn clear_from(&mut self, first: usize) {
        self.states.iter_mut().skip(first).for_each(|state| *state = State::ZERO);
        self.controls.iter_mut().skip(first).for_each(|control| *control = Control::ZERO);
    }

    /// Number `element` of node `k`, for fault injection: attitude, joint angles, rates of bus and joints,
    /// torques of bus and joints.
    pub fn number(&mut self, k: usize, element: usize) -> Option<&mut f64> {
        let (state, control) = (self.states.get_mut(k)?, self.controls.get_mut(k)?);
        let numbers = [
            state.attitude.as_mut_slice(),
            state.joint_angle.as_mut_slice(),
            state.rate.as_mut_slice(),
            state.joint_rate.as_mut_slice(),
            control.bus_torque.as_mut_slice(),
            control.joint_torque.as_mut_slice(),
        ];
        nth(numbers, element)
    }
}

/// What Stage 2 computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Mode {
    /// Minimise the cost.
    #[default]
    Optimal,
    /// Stop at the first feasible iterate; no objective, shortest steps.
    Feasible,
}

impl Mode {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Feasible => "feasible",
        }
    }
}

/// Stage 2 as a problem for the SCP solver.
///
/// Steps live on the tangent space: `[dtheta, dalpha, drate, djoint_rate]`, `dtheta` a left
/// perturbation in RTN axes (at the last node, in axes whose first is the approach direction, so
/// that the terminal attitude constraint fixes the other two, and the first where the roll is given).
///
/// `P` runs the two halves of the horizon in parallel wherever nodes do not depend on each other.
pub struct Reorientation<'a, P, const N: usize, const NL: usize, const NX: usize, const NU: usize> {
    mission: &'a Mission<NL>,
    executor: &'a P,
    body: Multibody<'a, NL>,
    translation: &'a TranslationTrajectory<N>,
    margins: Margins,
    extra_clearance: f64,
    stepping: Stepping<'a>,
    grid: Grid,
    /// State at the first node.
    initial: State<NL>,
    /// Whether the scenario gives its start: margins fade in behind it.
    is_given: bool,
    recovery: Recovery<NL>,
    mode: Mode,
    preset: usize,
    sight: [Vector3<f64>; N],
    terminal_rate: Vector3<f64>,
    /// What fixes the attitude at the last node.
    terminal: Terminal,
    /// Axes of the last node's attitude step, as columns in RTN.
    terminal_axes: Matrix3<f64>,
    target: &'a [TargetState; N],
    bodies: Bodies<NL>,
    /// Clearance margin of planning [m]; `None` where clearance is not in force.
    clearance: Option<f64>,
    /// Whether the arm is held at its capture angles from the preset on.
    is_held: bool,
    /// Whether limits have margins.
    has_margins: bool,
    /// What torques are divided by in the cost [N m].
    cost_unit: SVector<f64, NU>,
    /// Scale of the cost: one interval's typical torque costs [`TYPICAL_COST`].
    cost_scale: f64,
    scale_x: SVector<f64, NX>,
    scale_u: SVector<f64, NU>,
    tolerance_x: SVector<f64, NX>,
}

/// Scaled cost of an interval's typical torque, over its weight.
const TYPICAL_COST: f64 = 0.01;
/// Least curvature of the controls relative to the largest: keeps steps finite where torques are
/// almost free.
const LEAST_CURVATURE: f64 = 1e-3;

/// Fraction of each tolerance that the SCP solver may use; the verifier has the rest.
const MARGIN: f64 = 0.5;

/// Fraction of each tolerance below which violations do not count in the merit: second-order
/// remainders of this size would only shrink steps.
const IGNORED: f64 = 0.2;

/// Weight of the proximal term on the joint angles (scaled) in the first iterations. Large first steps
/// end in poor local minima: without it costs are 10 % higher in the mean.
const PROXIMAL: f64 = 3e-3;

/// Nodes that one core linearises while the other convexifies those after them.
const BATCH: usize = 12;

/// Most rollouts of a step: the second corrects the terminal pose error of the first, where that counts.
const ROLLOUTS: usize = 2;

impl<'a, P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'a, P, N, NL, NX, NU>
{
    /// The problem along Stage 1's `translation`; `target` is the target's motion at the nodes.
    pub fn new(
        formulation: &Formulation<'a, NL>,
        translation: &'a TranslationTrajectory<N>,
        target: &'a [TargetState; N],
        mode: Mode,
        executor: &'a P,
    ) -> Self {
        const { assert!(NX == size::states(NL) && NU == size::controls(NL), "an arm's sizes") };
        let Formulation {
            mission, scenario, integrator, margins, extra_clearance, deadline, ..
        } = *formulation;
        let grid = formulation.grid();
        let last = &target[grid.last().min(N - 1)];
        let terminal = Terminal::new(mission, last);
        let approach = terminal.approach;
        let across = quaternion::any_normal(&approach);
        let t = &mission.tolerances;
        let (scale_x, scale_u) = Self::scales(mission);
        let switches = &mission.approach;
        let has_margins = switches.between_nodes.is_on(integrator);
        let units = mission.cost_units();
        let cost_unit = Self::stacked_torque(&units.bus_torque, &units.joint_torque);
        let largest = scale_u.component_div(&cost_unit).max();
        Self {
            mission,
            executor,
            body: Multibody::new(mission),
            translation,
            mode,
            margins,
            extra_clearance,
            stepping: Stepping { integrator, dt: grid.interval(), deadline },
            initial: State::at_start(mission, scenario),
            is_given: scenario.start.is_given(),
            recovery: recovery(formulation, translation, target),
            preset: grid.preset_node(),
            grid,
            sight: core::array::from_fn(|k| {
                line_of_sight(mission, &translation.position[k], &target[k])
            }),
            terminal_rate: last.rate,
            terminal,
            terminal_axes: Matrix3::from_columns(&[approach, across, approach.cross(&across)]),
            target,
            bodies: Bodies::new(mission),
            clearance: switches.clearance.is_on(integrator).then_some(margins.clearance),
            is_held: integrator.is_flown(),
            has_margins,
            cost_unit,
            cost_scale: TYPICAL_COST / (largest * largest),
            scale_x,
            scale_u,
            tolerance_x: Self::by_kind(1.0, 1.0, 1e-2, &SVector::repeat(1e-2)) * t.dynamics,
        }
    }

    /// Scales of states [rad, rad/s] and controls [N m] in the subproblem.
    pub fn scales(mission: &Mission<NL>) -> (SVector<f64, NX>, SVector<f64, NU>) {
        let t = mission.typical();
        let s = &mission.servicer;
        let joint_rate = s.max_joint_rate.map(|limit| t.joint_rate.min(limit));
        let bus_torque = s.max_bus_torque.map(|limit| t.bus_torque.min(limit));
        let joint_torque = s.max_joint_torque.map(|limit| t.joint_torque.min(limit));
        (
            Self::by_kind(t.angle, t.angle, t.rate, &joint_rate),
            Self::stacked_torque(&bus_torque, &joint_torque),
        )
    }

    /// Nodes of the plan.
    fn nodes(&self) -> usize {
        self.last() + 1
    }

    /// The last node.
    fn last(&self) -> usize {
        self.grid.last().min(N - 1)
    }

    /// Cost of a torque profile, as section 6 defines it.
    pub fn cost(&self, controls: &[Control<NL>; N]) -> f64 {
        let w = &self.mission.weights;
        let bus = Vector3::from_fn(|i, _| self.cost_unit[i]);
        let joint = SVector::<f64, NL>::from_fn(|i, _| self.cost_unit[3 + i]);
        controls[..self.last()]
            .iter()
            .map(|u| {
                w.bus_torque * u.bus_torque.component_div(&bus).norm_squared()
                    + w.joint_torque * u.joint_torque.component_div(&joint).norm_squared()
            })
            .sum()
    }

    fn by_kind(
        angle: f64,
        joint: f64,
        rate: f64,
        joint_rate: &SVector<f64, NL>,
    ) -> SVector<f64, NX> {
        SVector::from_fn(|i, _| match i {
            i if i < 3 => angle,
            i if i < 3 + NL => joint,
            i if i < 6 + NL => rate,
            _ => joint_rate[i - 6 - NL],
        })
    }

    fn max_torque(mission: &Mission<NL>, i: usize) -> f64 {
        let s = &mission.servicer;
        if i < 3 { s.max_bus_torque[i] } else { s.max_joint_torque[i - 3] }
    }

    /// Derivative of the scaled cost by torque `i` [1/(N m)].
    fn marginal_cost(&self, i: usize, torque: f64) -> f64 {
        let unit = self.cost_unit[i];
        2.0 * self.cost_scale * self.weight(i) * torque / (unit * unit)
    }

    fn weight(&self, i: usize) -> f64 {
        if i < 3 { self.mission.weights.bus_torque } else { self.mission.weights.joint_torque }
    }

    /// Axes in which attitude steps at node `k` are resolved, as columns in RTN.
    fn axes(&self, k: usize) -> Matrix3<f64> {
        if k == self.last() { self.terminal_axes } else { Matrix3::identity() }
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
        Self::stacked_torque(&control.bus_torque, &control.joint_torque)
    }

    fn stacked_torque(bus: &Vector3<f64>, joint: &SVector<f64, NL>) -> SVector<f64, NU> {
        SVector::from_fn(|i, _| if i < 3 { bus[i] } else { joint[i - 3] })
    }

    /// Defects and path constraints of the nodes from `first` on.
    fn residuals_from(
        &self,
        first: usize,
        z: &ReorientationTrajectory<N, NL>,
        defects: &mut [SVector<f64, NX>],
        paths: &mut [SVector<f64, NG>],
    ) {
        for ((k, defect), row) in (first..N).zip(defects).zip(paths) {
            // The result is not used after the deadline.
            if k > self.last() || self.stepping.deadline.has_passed() {
                return;
            }
            self.path_values(k, &z.states[k], row);
            if k < self.last() {
                let (state, control) = (&z.states[k], &z.controls[k]);
                let force = &self.translation.force[k];
                let Stepping { integrator, dt, .. } = self.stepping;
                let next = self.body.step(integrator, dt, state, control, force);
                *defect = self.defect(k, &next, &z.states[k + 1]);
            }
        }
    }

    /// Whether the merit ignores this error of a terminal pose.
    fn is_ignored(&self, gap: &RateOffset<NL>) -> bool {
        let within = |(error, tolerance): (&f64, &f64)| error.abs() <= IGNORED * tolerance;
        gap.turn.iter().chain(gap.joint.iter()).zip(&self.tolerance_x).all(within)
    }

    /// Fills the whole subproblem with the Lagrangian's Hessian and convexifies it.
    ///
    /// The convexification runs from the last node to the first on one core, while the other linearises
    /// the nodes before, a batch at a time. It is fast except at indefinite curvature; the first core's
    /// spare time, counted in units of work rather than read from a clock, goes into linearisation too.
    fn linearise_convex(
        &self,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: &Solution<N, NX, NU, NG>,
        convex: &SVector<f64, NU>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        let linearise =
            |k, stage: &mut QpStage<NX, NU, NG>| self.linearise_at(k, z, Some(multipliers), stage);
        let Some((last, stages)) = qp.used_mut().split_last_mut() else { return };
        linearise(self.last(), last);
        let mut convexification = Convexification::new(last, convex);
        // Nodes from `filled` on are linearised, those from `swept` on also convexified.
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
                let (done, work) =
                    convexification.advance(filled, ready, budget, |k, i| self.is_fixed(k, i));
                let help = budget.saturating_sub(work) / self.node_work();
                let helped = before.iter_mut().enumerate().rev().take(help);
                (
                    done,
                    helped.map(|(k, stage)| linearise(k, stage)).take_while(|done| *done).count(),
                )
            };
            let fill = || {
                (from..).zip(batch).all(|(k, stage)| linearise(k, stage));
            };
            let ((done, helped), ()) = self.executor.join(sweep_and_help, fill);
            filled = from.saturating_sub(helped);
            swept = swept.saturating_sub(done);
        }
        qp.constant += convexification.finish().0;
    }

    /// Time of a node's linearisation, where its convexification takes 1.
    fn node_work(&self) -> usize {
        match self.stepping.integrator {
            Integrator::Euler => 3,
            Integrator::Rk4 { substeps } => substeps.saturating_mul(6).max(1),
        }
    }

    /// Fills `stage` of node `k`, without convexification. Returns false once the deadline has passed;
    /// the stage is then not used.
    fn linearise_at(
        &self,
        k: usize,
        z: &ReorientationTrajectory<N, NL>,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        stage: &mut QpStage<NX, NU, NG>,
    ) -> bool {
        *stage = QpStage::ZERO;
        if self.stepping.deadline.has_passed() {
            return false;
        }
        let (Some(state), Some(control)) = (z.states.get(k), z.controls.get(k)) else {
            return true;
        };
        self.fill_path_constraints(k, state, stage);
        if let Some(last) = multipliers {
            self.add_pointing_curvature(k, state, last.path_multiplier[k][0], stage);
            self.regularise_active_set(k, state, last, stage);
        }
        let Some(at) = z.states.get(k + 1).filter(|_| k < self.last()) else { return true };
        let inputs = Inputs { state, control, force: &self.translation.force[k] };
        let next = self.linearise_interval(k, inputs, at, stage);
        if let Some(last) = multipliers {
            self.add_curvature(k, inputs, &next, &last.defect_multiplier[k], stage);
        }
        self.apply_chart(k, &next, at, stage);
        let control = Self::stacked_control(control);
        for i in 0..NU {
            if self.mode == Mode::Optimal {
                stage.gradient_u[i] = self.marginal_cost(i, control[i]) * self.scale_u[i];
            }
        }
        true
    }
}

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Problem<N, NX, NU, NG> for Reorientation<'_, P, N, NL, NX, NU>
{
    type Trajectory = ReorientationTrajectory<N, NL>;

    fn project(&self, z: &mut Self::Trajectory) {
        let servicer = &self.mission.servicer;
        for (k, state) in z.states.iter_mut().enumerate().take(self.nodes()) {
            for i in 0..NL {
                let (lower, upper) = self.joint_limits(k, i);
                state.joint_angle[i] = clamp(state.joint_angle[i], lower, upper);
                let limit = self.joint_rate_limit(k, i);
                state.joint_rate[i] = clamp(state.joint_rate[i], -limit, limit);
            }
            self.fix_arm(k, state);
            state.attitude = quaternion::normalized(&state.attitude);
        }
        z.states[0] = self.initial;
        self.fix_terminal(&mut z.states[self.last()]);
        for control in &mut z.controls {
            *control = control.within_limits(servicer);
        }
        z.controls[self.last()] = Control::ZERO;
    }

    fn linearise(
        &mut self,
        z: &Self::Trajectory,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        qp.defect_penalty = 1.0;
        qp.constant = 0.0;
        qp.unused = N - self.nodes();
        let own = SVector::<f64, NU>::from_fn(|i, _| {
            let unit = self.scale_u[i] / self.cost_unit[i];
            2.0 * self.cost_scale * self.weight(i) * unit * unit
        });
        let convex = own.map(|c| c.max(LEAST_CURVATURE * own.max()));
        if let Some(multipliers) = multipliers
            && self.mode == Mode::Optimal
        {
            return self.linearise_convex(z, multipliers, &convex, qp);
        }
        let middle = self.nodes() / 2;
        let (early, late) = qp.stages[..self.nodes()].split_at_mut(middle);
        let half = |first: usize, stages: &mut [QpStage<NX, NU, NG>]| {
            for (k, stage) in (first..).zip(stages) {
                if !self.linearise_at(k, z, None, stage) {
                    return;
                }
                stage.hessian_uu = SMatrix::from_diagonal(&convex);
                for i in 3..3 + NL {
                    stage.hessian_xx[(i, i)] = PROXIMAL;
                }
            }
        };
        self.executor.join(|| half(0, early), || half(middle, late));
    }

    fn bound(&self, z: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NG>) {
        for (k, stage) in qp.stages.iter_mut().enumerate().take(self.nodes()) {
            let state = &z.states[k];
            for i in 0..NX {
                let (angle, reach) = (self.scale_x[0], radius / self.scale_x[0]);
                let (lower, upper) = match i {
                    _ if self.is_fixed(k, i) => (0.0, 0.0),
                    i if i < 3 => (-reach, reach),
                    i if i < 3 + NL => {
                        let at = state.joint_angle[i - 3];
                        let (lower, upper) = self.joint_limits(k, i - 3);
                        (((lower - at) / angle).max(-reach), ((upper - at) / angle).min(reach))
                    }
                    i if i < 6 + NL => (f64::NEG_INFINITY, f64::INFINITY),
                    _ => {
                        let (at, limit) =
                            (state.joint_rate[i - 6 - NL], self.joint_rate_limit(k, i - 6 - NL));
                        let scale = self.scale_x[i];
                        ((-limit - at) / scale, (limit - at) / scale)
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
        qp: &Qp<N, NX, NU, NG>,
        step: &Solution<N, NX, NU, NG>,
        to: &mut Self::Trajectory,
    ) {
        // Each rollout starts from the controls of the last.
        *to = *from;
        let mut offset = RateOffset::<NL>::ZERO;
        for _ in 0..ROLLOUTS {
            let gap = self.rollout(from, qp, step, &offset, to);
            if self.is_ignored(&gap) {
                break;
            }
            offset.turn -= gap.turn;
            offset.joint -= gap.joint;
        }
    }

    fn residuals(&self, z: &Self::Trajectory, out: &mut Residuals<N, NX, NG>) {
        out.cost = match self.mode {
            Mode::Optimal => self.cost_scale * self.cost(&z.controls),
            Mode::Feasible => 0.0,
        };
        out.ignored_defect = self.tolerance_x.component_div(&self.scale_x) * IGNORED;
        out.ignored_path = self.path_tolerances(0) * IGNORED;
        out.clear();
        let middle = self.nodes() / 2;
        let (early_defects, late_defects) = out.defect.split_at_mut(middle);
        let (early_paths, late_paths) = out.path.split_at_mut(middle);
        let early = || self.residuals_from(0, z, early_defects, early_paths);
        let late = || self.residuals_from(middle, z, late_defects, late_paths);
        match self.stepping.integrator {
            // Too little work for two cores.
            Integrator::Euler => Sequential.join(early, late),
            Integrator::Rk4 { .. } => self.executor.join(early, late),
        };
    }

    fn violation(&self, residuals: &Residuals<N, NX, NG>) -> f64 {
        let mut worst = 0.0;
        for (k, (row, defect)) in residuals.path.iter().zip(&residuals.defect).enumerate() {
            let row = row.component_div(&self.path_tolerances(k));
            worst = row.iter().fold(worst, |worst, r| worse(worst, *r));
            let defect = defect.component_mul(&self.scale_x).component_div(&self.tolerance_x);
            worst = defect.iter().fold(worst, |worst, d| worse(worst, d.abs()));
        }
        worst / MARGIN
    }

    fn step_length(&self, step: &Solution<N, NX, NU, NG>) -> f64 {
        let angles =
            |x: &SVector<f64, NX>| x.iter().take(3 + NL).fold(0.0f64, |m, v| m.max(v.abs()));
        step.x.iter().map(angles).fold(0.0, f64::max) * self.scale_x[0]
    }

    fn number(motion: &mut Self::Trajectory, k: usize, element: usize) -> Option<&mut f64> {
        motion.number(k, element)
    }
}
