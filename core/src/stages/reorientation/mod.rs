//! Stage 2: the reorientation of bus and arm (section 6).

mod limits;
mod linearise;
mod path_constraints;
mod problem;
mod rollout;
mod subproblem;
mod trajectory;

use super::clearance::Bodies;
use super::heuristic::line_of_sight;
use super::size::{self, NG};
use super::terminal::Terminal;
use super::{Formulation, TranslationTrajectory, recovery};
use crate::dynamics::{Control, Multibody, State, Stepping};
use crate::executor::ForkJoin;
use crate::math::quaternion;
use crate::model::{Grid, Margins, Mission, Recovery, TargetState};
use crate::scp::Residuals;
use nalgebra::{Matrix3, SVector, Vector3};
use remora_qp::QpStage;
use rollout::RateOffset;
pub use trajectory::ReorientationTrajectory;

/// Goal of Stage 2.
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
    /// Condition on the attitude at the last node.
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
    /// Units of torques in the cost [N m].
    cost_unit: SVector<f64, NU>,
    /// Scale of the cost: one interval's typical torque costs [`TYPICAL_COST`].
    cost_scale: f64,
    scale_x: SVector<f64, NX>,
    scale_u: SVector<f64, NU>,
    tolerance_x: SVector<f64, NX>,
}

/// Scaled cost of an interval's typical torque, over its weight.
const TYPICAL_COST: f64 = 0.01;

/// Fraction of each tolerance below which violations do not count in the merit: second-order
/// remainders of this size would only shrink steps.
const IGNORED: f64 = 0.2;

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
            clearance: switches.clearance.is_on(integrator).then_some(margins.clearance_m),
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
        let joint_rate = s.joint_rate_limit_rad_s.map(|limit| t.joint_rate_rad_s.min(limit));
        let bus_torque = s.bus_torque_limit_n_m.map(|limit| t.bus_torque_n_m.min(limit));
        let joint_torque = s.joint_torque_limit_n_m.map(|limit| t.joint_torque_n_m.min(limit));
        (
            Self::by_kind(t.angle_rad, t.angle_rad, t.rate_rad_s, &joint_rate),
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

    /// Cost of a trajectory, as section 6 defines it.
    pub fn cost(&self, z: &ReorientationTrajectory<N, NL>) -> f64 {
        let motion = if self.counts_motion() { self.motion_cost(z) } else { 0.0 };
        let w = &self.mission.weights;
        let bus = Vector3::from_fn(|i, _| self.cost_unit[i]);
        let joint = SVector::<f64, NL>::from_fn(|i, _| self.cost_unit[3 + i]);
        let torque: f64 = z.controls[..self.last()]
            .iter()
            .map(|u| {
                w.bus_torque * u.bus_torque.component_div(&bus).norm_squared()
                    + w.joint_torque * u.joint_torque.component_div(&joint).norm_squared()
            })
            .sum();
        torque + motion
    }

    /// Whether joint rates cost anything.
    fn counts_motion(&self) -> bool {
        self.mission.weights.joint_motion > 0.0
    }

    /// Cost of the joint rates, but for those of the last node, which are fixed.
    // Not inlined: most missions have none.
    #[inline(never)]
    fn motion_cost(&self, z: &ReorientationTrajectory<N, NL>) -> f64 {
        let unit = SVector::<f64, NL>::from_fn(|i, _| self.scale_x[6 + NL + i]);
        let states = z.states[..self.last()].iter();
        let squares: f64 = states.map(|x| x.joint_rate.component_div(&unit).norm_squared()).sum();
        self.mission.weights.joint_motion * squares
    }

    /// Adds the gradient and curvature of the joint rates' cost at a node.
    #[inline(never)]
    fn add_motion_cost(&self, state: &State<NL>, stage: &mut QpStage<NX, NU, NG>) {
        let factor = 2.0 * self.cost_scale * self.mission.weights.joint_motion;
        for (i, rate) in (6 + NL..).zip(state.joint_rate.iter()) {
            stage.gradient_x[i] += factor * rate / self.scale_x[i];
            stage.hessian_xx[(i, i)] += factor;
        }
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
        if i < 3 { s.bus_torque_limit_n_m[i] } else { s.joint_torque_limit_n_m[i - 3] }
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

    /// Writes the cost of a trajectory and what its merit ignores; no defects or path constraints yet.
    fn begin_residuals(&self, z: &ReorientationTrajectory<N, NL>, out: &mut Residuals<N, NX, NG>) {
        out.cost = match self.mode {
            Mode::Optimal => self.cost_scale * self.cost(z),
            Mode::Feasible => 0.0,
        };
        out.ignored_defect = self.tolerance_x.component_div(&self.scale_x) * IGNORED;
        out.ignored_path = self.path_tolerances(0) * IGNORED;
        out.clear();
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

    /// Whether the merit of `z`, cost plus `penalty_parameter` times its violations, is at least `merit`. The
    /// nodes are looked at one after the other, and none once it is: defects everywhere show in the first few.
    pub(crate) fn has_at_least_merit(
        &self,
        merit: f64,
        penalty_parameter: f64,
        z: &ReorientationTrajectory<N, NL>,
        scratch: &mut Residuals<N, NX, NG>,
    ) -> bool {
        self.begin_residuals(z, scratch);
        let mut violation = 0.0;
        for k in 0..self.nodes() {
            let Residuals { defect, path, .. } = &mut *scratch;
            if let (Some(defect), Some(path)) = (defect.get_mut(k..=k), path.get_mut(k..=k)) {
                self.residuals_from(k, z, defect, path);
            }
            violation = scratch.l1_violation_to(k, violation);
            if scratch.cost + penalty_parameter * violation >= merit {
                return true;
            }
        }
        false
    }

    /// Whether the merit ignores this error of a terminal pose.
    fn is_ignored(&self, gap: &RateOffset<NL>) -> bool {
        let within = |(error, tolerance): (&f64, &f64)| error.abs() <= IGNORED * tolerance;
        gap.turn.iter().chain(gap.joint.iter()).zip(&self.tolerance_x).all(within)
    }
}
