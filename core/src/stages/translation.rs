//! Stage 1: the translation of the system's centre of mass (section 5).

use crate::math::quaternion;
use crate::model::{Grid, HcwTransition, SignedDistance, TargetState, signed_distance_to_box};
use crate::scp::{Iterates, Problem, Residuals, Scratch};
use core::mem;
use nalgebra::{Matrix3, Matrix3x6, SMatrix, SVector, Vector3, Vector4};
use remora_qp::dense::{clamp, divisor};
use remora_qp::kept::nth;
use remora_qp::time::Deadline;
use remora_qp::{Qp, QpOutcome, QpSolver, QpStage, QpStatus, Solution};

use super::Formulation;
use super::detour::Detour;
use super::size::NG;
use super::worse;

/// Trajectory of the centre of mass: position and velocity at the nodes, force over the intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TranslationTrajectory<const N: usize> {
    /// Position in RTN [m].
    pub position: [Vector3<f64>; N],
    /// Velocity relative to RTN, in RTN [m/s].
    pub velocity: [Vector3<f64>; N],
    /// Force in RTN [N]; the last is zero.
    pub force: [Vector3<f64>; N],
}

impl<const N: usize> TranslationTrajectory<N> {
    /// Placeholder for storage.
    pub const ZERO: Self = Self {
        position: [Vector3::new(0.0, 0.0, 0.0); N],
        velocity: [Vector3::new(0.0, 0.0, 0.0); N],
        force: [Vector3::new(0.0, 0.0, 0.0); N],
    };

    /// Sets all from node `first` on to zero: what a plan of fewer nodes leaves open.
    pub(crate) fn clear_from(&mut self, first: usize) {
        let Self { position, velocity, force } = self;
        for values in [position, velocity, force] {
            values.iter_mut().skip(first).for_each(|value| *value = Vector3::zeros());
        }
    }

    /// Number `element` of node `k`, for fault injection: position, velocity, force.
    pub fn number(&mut self, k: usize, element: usize) -> Option<&mut f64> {
        let vectors = [&mut self.position, &mut self.velocity, &mut self.force];
        nth(vectors.into_iter().filter_map(|all| Some(all.get_mut(k)?.as_mut_slice())), element)
    }
}

/// Scaled cost of one interval's typical force: the whole is typically one.
const TYPICAL_COST: f64 = 0.064;

/// Penalty parameter of the initial guess: of a detour's distances.
const DETOUR_PENALTY: f64 = 1e4;

/// Share of a detour's merit by which another must be less to be taken instead.
const TIE: f64 = 1e-6;

/// Share of keep-out's curvature in subproblems that have it. All of it leaves some of them indefinite.
const CURVATURE_SHARE: f64 = 0.85;

/// Linearisations without keep-out's curvature where the initial guess has no detour: enough for most paths.
const FLAT: usize = 16;

/// Points of the interval before a node where keep-out holds too, as fractions back from the node.
const WITHIN: [f64; NG - 1] = [0.25, 0.5, 0.75];

/// Fraction of each tolerance that the SCP solver may use; the verifier has the rest.
const MARGIN: f64 = 0.5;

/// The target's surface seen from a point of the path.
struct Surface {
    /// Distance that is missing to the keep-out distance [m]; negative where the path keeps more.
    missing: f64,
    /// The target's axes in RTN.
    rotation: Matrix3<f64>,
    /// Distance of the point, in the target's axes.
    distance: SignedDistance,
}

impl Surface {
    /// Second derivative of the distance by the point in RTN [1/m]: of a sphere at a corner, of a cylinder at
    /// an edge, zero at a face.
    fn curvature(&self) -> Matrix3<f64> {
        let SignedDistance { value, gradient } = &self.distance;
        let beyond = gradient.map(|g| if g == 0.0 { 0.0 } else { 1.0 });
        let across = Matrix3::from_diagonal(&beyond) - gradient * gradient.transpose();
        self.rotation * (across / divisor(*value)) * self.rotation.transpose()
    }
}

/// States in use: position, velocity, previous force.
const STATES: usize = 9;
/// Controls in use: force.
const CONTROLS: usize = 3;

/// Stage 1 as a problem for the SCP solver.
///
/// The subproblem's state is `[r, v, f_previous]`: with the previous force in the state the smoothness
/// cost is a stage cost. The dynamics are linear and hard, and trajectories are rollouts of the forces,
/// so that only keep-out is non-convex. The other states and controls (see [`super::size`]) are padding:
/// controls are fixed at zero, states at the first stage only, from where the dynamics keep them zero.
pub struct Translation<'a, const N: usize> {
    target: &'a [TargetState; N],
    half_extents: Vector3<f64>,
    grid: Grid,
    /// Whether the start is within the keep-out distance, and led back.
    is_recovering: bool,
    /// Keep-out distance at the nodes, and within the intervals before them.
    keep_out: [[f64; 2]; N],
    /// Margin on the keep-out distance; `None` where it does not hold between nodes.
    margin: Option<f64>,
    /// Transitions from a node back to the points [`WITHIN`] the interval before it.
    back: [HcwTransition; NG - 1],
    dt: f64,
    /// Scales of position and velocity in the subproblem [m, m/s].
    scale: [f64; 2],
    /// Scale of force in the subproblem [N].
    force_scale: Vector3<f64>,
    cost_scale: f64,
    /// Unit of forces in the cost [N].
    cost_unit: Vector3<f64>,
    keep_out_tolerance: f64,
    end_tolerance: f64,
    transition: HcwTransition,
    mass: f64,
    max_force: Vector3<f64>,
    /// Bound of the rate of the line of sight [rad/s].
    sight_rate: f64,
    force_weight: f64,
    change_weight: f64,
    start: (Vector3<f64>, Vector3<f64>),
    end: (Vector3<f64>, Vector3<f64>),
    /// Whether keep-out is in force; it is not for the initial guess.
    constrained: bool,
    /// Detour of the initial guess around the target, if the straight one leads through it.
    detour: Option<Detour>,
    /// Number of linearisations left without keep-out's curvature.
    flat: usize,
}

impl<'a, const N: usize> Translation<'a, N> {
    /// The problem of one scenario; `target` is the target's motion at the nodes.
    // Not inlined: its temporaries are released before the problem is solved.
    #[inline(never)]
    pub fn new<const NL: usize>(
        formulation: &Formulation<'a, NL>,
        target: &'a [TargetState; N],
    ) -> Self {
        let Formulation { mission, scenario, integrator, margins, max_force, .. } = *formulation;
        let grid = formulation.grid();
        let last = grid.last().min(N - 1);
        let end = &target[last];
        let capture = mission.servicer.capture_geometry();
        let port = mission.target.port_position_m + mission.target.port_normal * capture.reach;
        let position = quaternion::rotation_matrix(&end.attitude) * port;
        let (approach, n) = (&mission.approach, mission.mean_motion());
        let dt = grid.interval();
        let (typical, cost_unit) = (mission.typical(), mission.cost_units().force);
        // The end lies at the reach from the port, whatever the near distance.
        let at_end = grid.keep_out(last).min(capture.reach);
        let keep_out = core::array::from_fn(|k| {
            let (at, before) = (grid.keep_out(k), grid.keep_out(k.max(1) - 1));
            [at, if k == last { at_end } else { at.min(before) }]
        });
        let limits = &mission.servicer.force_limit_n;
        let force_scale = limits.map(|limit| typical.force_n.min(limit));
        let inverse_unit = cost_unit.component_div(&force_scale).min();
        Self {
            is_recovering: mission.recovery(scenario, grid.keep_out(0)).keep_out,
            grid,
            margin: approach.between_nodes.is_on(integrator).then_some(margins.keep_out_m),
            back: WITHIN.map(|share| HcwTransition::new(n, -share * dt)),
            dt,
            scale: [typical.length_m, typical.velocity_m_s],
            force_scale,
            cost_unit,
            cost_scale: TYPICAL_COST * inverse_unit * inverse_unit,
            target,
            half_extents: mission.target.half_extents_m,
            keep_out,
            keep_out_tolerance: mission.tolerances.keep_out_m,
            end_tolerance: mission.tolerances.dynamics,
            transition: HcwTransition::new(n, dt),
            mass: mission.servicer.total_mass(),
            max_force: limits.map(|limit| limit.min(max_force)),
            sight_rate: formulation.sight_rate,
            force_weight: mission.weights.force,
            change_weight: mission.weights.force_change,
            start: (scenario.position, scenario.velocity),
            end: (position, end.rate.cross(&position)),
            constrained: true,
            detour: None,
            flat: FLAT,
        }
    }

    /// Writes the initial guess, the optimum without keep-out; where it leads through the target, the
    /// cheapest optimum that passes a side of it. One convex QP each. Returns the QPs' outcome, and their number.
    // Not inlined, as `new`.
    #[inline(never)]
    pub fn start<S: QpSolver<N, NX, NU, NG>, const NX: usize, const NU: usize>(
        &mut self,
        solver: &mut S,
        deadline: &Deadline,
        w: &mut Scratch<N, NX, NU, NG>,
        z: &mut Iterates<TranslationTrajectory<N>>,
    ) -> (QpOutcome, usize) {
        let (mut outcome, mut tries) = self.start_straight(solver, deadline, w, z);
        if !outcome.status.is_usable() {
            return (outcome, tries);
        }
        let positions = z.trajectory.position.get(..self.nodes()).unwrap_or_default();
        let detours = Detour::all(&self.half_extents, positions, self.target);
        let mut least: Option<(f64, Detour, QpStatus)> = None;
        for detour in detours.into_iter().flatten() {
            self.detour = Some(detour);
            solver.reset();
            let around = self.warm_start(solver, deadline, w, z);
            outcome = QpOutcome { iterations: outcome.iterations + around.iterations, ..around };
            tries += 1;
            let merit = self.detour_merit(&z.trajectory);
            // Prefers the first of sides that are equal but for rounding.
            let is_less = least.is_none_or(|(least, ..)| merit < (1.0 - TIE) * least);
            if around.status.is_usable() && is_less {
                least = Some((merit, detour, around.status));
                mem::swap(&mut z.trajectory, &mut z.best);
            }
        }
        if let Some((_, detour, status)) = least {
            (self.detour, self.flat, outcome.status) = (Some(detour), 0, status);
            mem::swap(&mut z.trajectory, &mut z.best);
        }
        (outcome, tries)
    }

    /// Scaled cost of an initial guess around the target, with the penalty of the distances that are missing.
    fn detour_merit(&self, trajectory: &TranslationTrajectory<N>) -> f64 {
        let missing = (0..self.nodes()).filter_map(|k| self.detour_constraint(k, 0, trajectory));
        let missing: f64 = missing.map(|(missing, _)| missing.max(0.0)).sum();
        self.cost_scale * self.cost(&trajectory.force) + DETOUR_PENALTY * missing
    }

    /// Writes the optimum without keep-out. It solves the QP again if it fails or does not lead to the end: a
    /// sound QP never does that, so memory may be damaged.
    fn start_straight<S: QpSolver<N, NX, NU, NG>, const NX: usize, const NU: usize>(
        &mut self,
        solver: &mut S,
        deadline: &Deadline,
        w: &mut Scratch<N, NX, NU, NG>,
        z: &mut Iterates<TranslationTrajectory<N>>,
    ) -> (QpOutcome, usize) {
        let first = self.warm_start(solver, deadline, w, z);
        let stopped = matches!(first.status, QpStatus::TimeLimit | QpStatus::Interrupted);
        if stopped || (first.status.is_usable() && self.comes_to_the_end(&z.trajectory)) {
            return (first, 1);
        }
        solver.reset();
        let mut second = self.warm_start(solver, deadline, w, z);
        second.iterations += first.iterations;
        (second, 2)
    }

    /// Whether a path ends where it has to.
    fn comes_to_the_end(&self, trajectory: &TranslationTrajectory<N>) -> bool {
        let (r, v) = self.end_error(trajectory);
        r.iter().chain(&v).all(|error| error.abs() <= self.end_tolerance)
    }

    /// Writes the initial guess once; where that fails the drift, which it is linearised at.
    // Not inlined: it is called twice.
    #[inline(never)]
    fn warm_start<S: QpSolver<N, NX, NU, NG>, const NX: usize, const NU: usize>(
        &mut self,
        solver: &mut S,
        deadline: &Deadline,
        w: &mut Scratch<N, NX, NU, NG>,
        z: &mut Iterates<TranslationTrajectory<N>>,
    ) -> QpOutcome {
        const { assert!(NX >= STATES && NU >= CONTROLS, "Stage 1 needs two joints' room") };
        let Scratch { qp, step, .. } = w;
        let drift = &mut z.trial;
        drift.force = [Vector3::zeros(); N];
        self.rollout(drift);
        self.constrained = false;
        self.linearise(drift, None, qp);
        self.bound(drift, f64::INFINITY, qp);
        let path_penalty = if self.detour.is_some() { DETOUR_PENALTY } else { 1.0 };
        (qp.path_penalty, qp.complementarity) = (path_penalty, 0.0);
        let outcome = solver.solve(qp, step, deadline);
        self.constrained = true;
        if outcome.status.is_usable() {
            self.retract(drift, qp, step, &mut z.trajectory);
        } else {
            z.trajectory = *drift;
        }
        outcome
    }

    /// Cost of a force profile, as section 5 defines it.
    pub fn cost(&self, force: &[Vector3<f64>; N]) -> f64 {
        let scaled = |f: &Vector3<f64>| f.component_div(&self.cost_unit);
        let force = &force[..self.last()];
        let effort: f64 = force.iter().map(|f| scaled(f).norm_squared()).sum();
        let since = |(f, before)| (scaled(f) - scaled(before)).norm_squared();
        let change: f64 = force.iter().skip(1).zip(force).map(since).sum();
        self.force_weight * effort + self.change_weight * change
    }

    /// A force projected onto its limits.
    fn within_limits(&self, force: &Vector3<f64>) -> Vector3<f64> {
        force.zip_map(&self.max_force, |f, limit| clamp(f, -limit, limit))
    }

    /// Nodes of the plan.
    fn nodes(&self) -> usize {
        self.last() + 1
    }

    /// The last node.
    fn last(&self) -> usize {
        self.grid.last().min(N - 1)
    }

    /// Rolls the forces out to positions and velocities.
    fn rollout(&self, trajectory: &mut TranslationTrajectory<N>) {
        let (mut r, mut v) = self.start;
        for k in 0..self.nodes() {
            trajectory.position[k] = r;
            trajectory.velocity[k] = v;
            if k < self.last() {
                let specific_force = trajectory.force[k] / self.mass;
                (r, v) = self.transition.carry(&r, &v, &specific_force);
            }
        }
    }

    /// Keep-out constraint `i` of node `k`: `(keep_out - distance, -gradient in RTN)`. Constraint 0
    /// holds at the node itself, except the terminal one; the others at the points [`WITHIN`] the
    /// interval before.
    fn keep_out_constraint(
        &self,
        k: usize,
        i: usize,
        trajectory: &TranslationTrajectory<N>,
    ) -> (f64, Vector3<f64>) {
        const FREE: (f64, Vector3<f64>) = (-1.0, Vector3::new(0.0, 0.0, 0.0));
        if !self.constrained {
            return self.detour_constraint(k, i, trajectory).unwrap_or(FREE);
        }
        let Some(Surface { missing, rotation, distance }) = self.surface(k, i, trajectory) else {
            return FREE;
        };
        (missing, -(rotation * distance.gradient))
    }

    /// Bound of the line of sight's rate at node `k`: the distance that is missing for the velocity across it,
    /// and its derivatives by position and velocity. `None` where keep-out is `keep_out` and misses more.
    fn sight_constraint(
        &self,
        k: usize,
        keep_out: f64,
        trajectory: &TranslationTrajectory<N>,
    ) -> Option<(f64, [Vector3<f64>; 2])> {
        if !self.constrained || !self.sight_rate.is_finite() || k == 0 || k == self.last() {
            return None;
        }
        let (r, v) = (trajectory.position.get(k)?, trajectory.velocity.get(k)?);
        let momentum = r.cross(v);
        let (size, distance) = (libm::sqrt(momentum.dot(&momentum)), libm::sqrt(r.dot(r)));
        let (axis, along) = (momentum / divisor(size), r / divisor(distance));
        let inverse = 1.0 / divisor(self.sight_rate * distance);
        let needed = size * inverse;
        let by_position = v.cross(&axis) * inverse - along * (1.0 + needed / divisor(distance));
        let missing = needed - distance;
        (missing > keep_out).then_some((missing, [by_position, axis.cross(r) * inverse]))
    }

    /// The initial guess's constraint `i` of node `k`: on the detour's side of the target.
    fn detour_constraint(
        &self,
        k: usize,
        i: usize,
        trajectory: &TranslationTrajectory<N>,
    ) -> Option<(f64, Vector3<f64>)> {
        let detour = self.detour.filter(|_| i == 0 && k > 0 && k != self.last())?;
        let (target, [radius, _]) = (self.target.get(k)?, self.keep_out.get(k)?);
        detour.constraint(k, *radius, trajectory.position.get(k)?, target)
    }

    /// The target's surface as constraint `i` of node `k` sees it; `None` where keep-out does not hold.
    fn surface(
        &self,
        k: usize,
        i: usize,
        trajectory: &TranslationTrajectory<N>,
    ) -> Option<Surface> {
        let exempt = if i == 0 { k == self.last() } else { k == 0 || self.margin.is_none() };
        if exempt {
            return None;
        }
        // All indices are in range; `get` keeps panics out of the image.
        let before = k.saturating_sub(1);
        let (target, last) = (self.target.get(k)?, self.target.get(before)?);
        let [mut radius, radius_within] = *self.keep_out.get(k)?;
        let (mut time, mut position) = (k as f64 * self.dt, *trajectory.position.get(k)?);
        let (velocity, force) = (trajectory.velocity.get(k)?, trajectory.force.get(before)?);
        let mut attitude = target.attitude;
        let within = i.checked_sub(1).and_then(|i| WITHIN.get(i).zip(self.back.get(i)));
        if let Some((share, back)) = within {
            time -= share * self.dt;
            radius = radius_within;
            let (by_state, by_force) = self.position_within(back);
            position = by_state.fixed_columns::<3>(0) * position
                + by_state.fixed_columns::<3>(3) * velocity
                + by_force * force;
            attitude = self.attitude_within(target, last, *share);
        }
        if self.is_recovering && self.grid.is_recovering(time) {
            return None;
        }
        let margin = self.margin.unwrap_or(0.0) * self.grid.margin_share(time);
        let rotation = quaternion::rotation_matrix(&attitude);
        let local = rotation.tr_mul(&position);
        let distance = signed_distance_to_box(&self.half_extents, &local);
        Some(Surface { missing: radius + margin - distance.value, rotation, distance })
    }

    /// Derivatives of the position at the end of `back` by the node's state and the previous force.
    // One copy of it makes images smaller.
    #[inline(never)]
    fn position_within(&self, back: &HcwTransition) -> (Matrix3x6<f64>, Matrix3<f64>) {
        let by_force = back.input.fixed_rows::<3>(0) / self.mass;
        (back.state.fixed_rows::<3>(0).into_owned(), by_force)
    }

    /// The target's attitude a fraction `share` of the interval before `node`, propagated at the rate of
    /// the nearer of `node` and `last`.
    fn attitude_within(&self, node: &TargetState, last: &TargetState, share: f64) -> Vector4<f64> {
        let (from, ahead) = if share <= 0.5 { (node, -share) } else { (last, 1.0 - share) };
        let TargetState { attitude, rate } = from;
        quaternion::product(&quaternion::exp(&(rate * (ahead * self.dt))), attitude)
    }

    /// Fills the path constraints of node `k`: keep-out, at the node or the line of sight's rate.
    fn keep_out_constraints<const NX: usize, const NU: usize>(
        &self,
        k: usize,
        trajectory: &TranslationTrajectory<N>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let ([r, v], f) = (self.scale, &self.force_scale);
        for i in 0..NG {
            let (offset, normal) = self.keep_out_constraint(k, i, trajectory);
            stage.path_offset[i] = offset;
            let Some(back) = i.checked_sub(1).and_then(|i| self.back.get(i)) else {
                let (offset, [by_position, by_velocity]) = self
                    .sight_constraint(k, offset, trajectory)
                    .unwrap_or((offset, [normal, Vector3::zeros()]));
                stage.path_offset[i] = offset;
                for j in 0..3 {
                    stage.path_jacobian[(i, j)] = by_position[j] * r;
                    stage.path_jacobian[(i, 3 + j)] = by_velocity[j] * v;
                }
                continue;
            };
            let (by_state, by_force) = self.position_within(back);
            let (by_state, by_force) = (by_state.tr_mul(&normal), by_force.tr_mul(&normal));
            for j in 0..3 {
                stage.path_jacobian[(i, j)] = by_state[j] * r;
                stage.path_jacobian[(i, 3 + j)] = by_state[3 + j] * v;
                stage.path_jacobian[(i, 6 + j)] = by_force[j] * f[j];
            }
        }
    }

    /// Adds [`CURVATURE_SHARE`] of keep-out's curvature to a program whose forces have the convex curvature
    /// `effort`. Without it, a path that bends over an edge of the box converges slowly.
    fn add_curvature<const NX: usize, const NU: usize>(
        &self,
        trajectory: &TranslationTrajectory<N>,
        multipliers: &Solution<N, NX, NU, NG>,
        effort: &Vector3<f64>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        let stages = qp.stages.iter_mut().zip(&multipliers.path_multiplier).enumerate();
        for (k, (stage, multipliers)) in stages.take(self.nodes()) {
            if k < self.last() {
                for i in 0..CONTROLS {
                    stage.hessian_uu[(i, i)] -= effort[i];
                }
            }
            for (i, multiplier) in multipliers.iter().enumerate() {
                if *multiplier > 0.0 {
                    self.add_curvature_at(k, i, trajectory, CURVATURE_SHARE * multiplier, stage);
                }
            }
        }
        let last = self.last();
        let convex = SVector::from_fn(|i, _| effort.get(i).copied().unwrap_or(effort.max()));
        qp.convexify(&convex, |k, i| k == last && i < STATES - CONTROLS);
    }

    /// Adds the curvature of keep-out constraint `i` of node `k`, times `weight`.
    // Not inlined: its frame is released before the program is made convex.
    #[inline(never)]
    fn add_curvature_at<const NX: usize, const NU: usize>(
        &self,
        k: usize,
        i: usize,
        trajectory: &TranslationTrajectory<N>,
        weight: f64,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let Some(surface) = self.surface(k, i, trajectory) else { return };
        if i == 0 && self.sight_constraint(k, surface.missing, trajectory).is_some() {
            return;
        }
        let ([r, v], f) = (self.scale, &self.force_scale);
        let mut by = SMatrix::<f64, 3, STATES>::zeros();
        by.fixed_columns_mut::<3>(0).fill_diagonal(r);
        if let Some(back) = i.checked_sub(1).and_then(|i| self.back.get(i)) {
            let (by_state, by_force) = self.position_within(back);
            by.fixed_columns_mut::<3>(0).copy_from(&(by_state.fixed_columns::<3>(0) * r));
            by.fixed_columns_mut::<3>(3).copy_from(&(by_state.fixed_columns::<3>(3) * v));
            by.fixed_columns_mut::<3>(6).copy_from(&(by_force * Matrix3::from_diagonal(f)));
        }
        let curvature = by.tr_mul(&(surface.curvature() * weight * by));
        let mut hessian = stage.hessian_xx.fixed_view_mut::<STATES, STATES>(0, 0);
        hessian -= curvature;
    }

    /// End state error over its scale.
    fn end_error(&self, trajectory: &TranslationTrajectory<N>) -> (Vector3<f64>, Vector3<f64>) {
        let r = self.end.0 - trajectory.position[self.last()];
        let v = self.end.1 - trajectory.velocity[self.last()];
        (r / self.scale[0], v / self.scale[1])
    }
}

impl<const N: usize, const NX: usize, const NU: usize> Problem<N, NX, NU, NG>
    for Translation<'_, N>
{
    type Trajectory = TranslationTrajectory<N>;

    fn project(&self, trajectory: &mut Self::Trajectory) {
        for force in &mut trajectory.force {
            *force = self.within_limits(force);
        }
        self.rollout(trajectory);
    }

    fn linearise(
        &mut self,
        trajectory: &Self::Trajectory,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        qp: &mut Qp<N, NX, NU, NG>,
    ) {
        qp.defect_penalty = f64::INFINITY;
        qp.constant = 0.0;
        let ([r, v], f) = (self.scale, &self.force_scale);
        let unit = f.component_div(&self.cost_unit);
        let effort = unit.map(|unit| 2.0 * self.cost_scale * self.force_weight * unit * unit);
        let change = unit.map(|unit| 2.0 * self.cost_scale * self.change_weight * unit * unit);
        qp.unused = N - self.nodes();
        for k in 0..self.nodes() {
            let stage = &mut qp.stages[k];
            *stage = QpStage::ZERO;
            self.keep_out_constraints(k, trajectory, stage);
            if k == self.last() {
                continue;
            }
            for j in 0..6 {
                let column = if j < 3 { r } else { v };
                for i in 0..6 {
                    let row = if i < 3 { r } else { v };
                    stage.a[(i, j)] = self.transition.state[(i, j)] * column / row;
                }
            }
            for j in 0..3 {
                for i in 0..6 {
                    let row = if i < 3 { r } else { v };
                    stage.b[(i, j)] = self.transition.input[(i, j)] * f[j] / (self.mass * row);
                }
                stage.b[(6 + j, j)] = 1.0;
            }
            let force = trajectory.force[k].component_div(f);
            for i in 0..3 {
                stage.hessian_uu[(i, i)] = effort[i];
                stage.gradient_u[i] = force[i] * effort[i];
            }
            if k > 0 {
                // |u - u_before|^2 in the steps of both.
                let before = trajectory.force[k - 1].component_div(f);
                let since = (force - before).component_mul(&change);
                for i in 0..3 {
                    stage.hessian_uu[(i, i)] += change[i];
                    stage.gradient_u[i] += since[i];
                    stage.hessian_xx[(6 + i, 6 + i)] = change[i];
                    stage.hessian_ux[(i, 6 + i)] = -change[i];
                    stage.gradient_x[6 + i] = -since[i];
                }
            }
        }
        match multipliers {
            Some(multipliers) if self.flat == 0 => {
                self.add_curvature(trajectory, multipliers, &effort, qp);
            }
            _ => self.flat = self.flat.saturating_sub(1),
        }
    }

    fn bound(&self, trajectory: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NG>) {
        let (r, v) = self.end_error(trajectory);
        let [r_scale, _] = self.scale;
        for (k, stage) in qp.stages.iter_mut().enumerate().take(self.nodes()) {
            stage.lower_x.fill(f64::NEG_INFINITY);
            stage.upper_x.fill(f64::INFINITY);
            if k == 0 {
                stage.lower_x.fill(0.0);
                stage.upper_x.fill(0.0);
            } else if k == self.last() {
                for i in 0..3 {
                    (stage.lower_x[i], stage.upper_x[i]) = (r[i], r[i]);
                    (stage.lower_x[3 + i], stage.upper_x[3 + i]) = (v[i], v[i]);
                }
            } else if radius.is_finite() {
                stage.lower_x.fixed_rows_mut::<3>(0).fill(-radius / r_scale);
                stage.upper_x.fixed_rows_mut::<3>(0).fill(radius / r_scale);
            }
            stage.lower_u.fill(0.0);
            stage.upper_u.fill(0.0);
            for i in 0..CONTROLS {
                let (force, limit) = (trajectory.force[k][i], self.max_force[i]);
                stage.lower_u[i] = (-limit - force) / self.force_scale[i];
                stage.upper_u[i] = (limit - force) / self.force_scale[i];
            }
        }
    }

    fn retract(
        &self,
        from: &Self::Trajectory,
        _qp: &Qp<N, NX, NU, NG>,
        step: &Solution<N, NX, NU, NG>,
        to: &mut Self::Trajectory,
    ) {
        for k in 0..self.last() {
            let change = step.u[k].fixed_rows::<3>(0).component_mul(&self.force_scale);
            let force = from.force[k] + change;
            to.force[k] = self.within_limits(&force);
        }
        to.force[self.last()] = Vector3::zeros();
        self.rollout(to);
    }

    fn residuals(&self, trajectory: &Self::Trajectory, out: &mut Residuals<N, NX, NG>) {
        out.cost = self.cost_scale * self.cost(&trajectory.force);
        out.ignored_defect.fill(0.0);
        out.ignored_path.fill(0.0);
        out.clear();
        for (k, row) in out.path.iter_mut().enumerate().take(self.nodes()) {
            *row = SVector::from_fn(|i, _| {
                let keep_out = self.keep_out_constraint(k, i, trajectory).0;
                let sight = self.sight_constraint(k, keep_out, trajectory).filter(|_| i == 0);
                sight.map_or(keep_out, |(missing, _)| missing)
            });
        }
        // A rollout's only defect is against the fixed terminal state.
        let (r, v) = self.end_error(trajectory);
        let Some(end) = out.defect.get_mut(self.last().saturating_sub(1)) else { return };
        for i in 0..3 {
            end[i] = r[i];
            end[3 + i] = v[i];
        }
    }

    fn violation(&self, residuals: &Residuals<N, NX, NG>) -> f64 {
        let keep_out = residuals
            .path
            .iter()
            .fold(0.0, |worst, row| row.iter().fold(worst, |worst, r| worse(worst, *r)));
        let end = residuals.defect[self.last().saturating_sub(1)]
            .iter()
            .fold(0.0, |worst, d| worse(worst, d.abs()));
        worse(keep_out / self.keep_out_tolerance, end / self.end_tolerance) / MARGIN
    }

    fn step_length(&self, step: &Solution<N, NX, NU, NG>) -> f64 {
        step.x[..self.last()]
            .iter()
            .skip(1)
            .map(|x| x.fixed_rows::<3>(0).amax())
            .fold(0.0, f64::max)
            * self.scale[0]
    }

    fn number(path: &mut Self::Trajectory, k: usize, element: usize) -> Option<&mut f64> {
        path.number(k, element)
    }
}
