//! Stage 1: the path of the system's centre of mass (section 5).

use crate::math::{clamp, quaternion};
use crate::model::{HcwTransition, Mission, Scenario, TargetState, signed_distance_to_box};
use crate::qp::{Qp, QpOutcome, QpSolver, Solution};
use crate::scp::{Problem, Residuals};
use crate::time::Deadline;
use nalgebra::{SVector, Vector3};

use super::size::{NR, NU, NX};
use super::worse;

/// Path of the centre of mass: position and velocity at the nodes, force over the intervals.
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
}

/// What positions, velocities and forces are divided by in the subproblem: typical magnitudes
/// [m, m/s, N].
const SCALE: [f64; 3] = [1.0, 1e-2, 2e-2];

/// Factor on the cost in the loop: its typical value is 1e-3.
const COST_SCALE: f64 = 1e3;

/// Share of each tolerance that the loop leaves to the verifier.
const MARGIN: f64 = 0.5;

/// States that mean something: position, velocity, force before.
const STATES: usize = 9;
/// Controls that mean something: force.
const CONTROLS: usize = 3;

/// Stage 1 as a problem for the loop.
///
/// The subproblem's state is `[r, v, f_before]`: carrying the force of the interval before makes
/// the smoothness cost a cost of one node. The dynamics are linear and hard, and trajectories are
/// rolled out from the forces, so that only keep-out is left to the loop. States and controls
/// beyond these (see [`super::size`]) are padding that nothing else depends on: the controls are
/// pinned to zero, and so are the states at the first node, from where their dynamics keep them
/// there. (Pins at every node would say the same twice, which some solvers do not like.)
pub struct Translation<'a, const N: usize> {
    target: &'a [TargetState; N],
    half_extents: Vector3<f64>,
    keep_out: [f64; N],
    keep_out_tolerance: f64,
    end_tolerance: f64,
    transition: HcwTransition,
    mass: f64,
    max_force: f64,
    force_weight: f64,
    change_weight: f64,
    start: (Vector3<f64>, Vector3<f64>),
    end: (Vector3<f64>, Vector3<f64>),
    /// Whether the keep-out rows are in force; they are not while the start is computed.
    constrained: bool,
}

impl<'a, const N: usize> Translation<'a, N> {
    /// The problem of one scenario; `target` its tumble at the nodes.
    pub fn new<const NL: usize>(
        mission: &Mission<NL>,
        scenario: &Scenario,
        target: &'a [TargetState; N],
    ) -> Self {
        const { assert!(NX >= STATES && NU >= CONTROLS, "Stage 1 needs more") };
        let end = &target[N - 1];
        let capture = mission.servicer.capture_geometry();
        let port = mission.target.port_position + mission.target.port_normal * capture.reach;
        let position = quaternion::rotation_matrix(&end.attitude) * port;
        let dt = mission.approach.duration / (N - 1) as f64;
        Self {
            target,
            half_extents: mission.target.half_extents,
            keep_out: core::array::from_fn(|k| mission.approach.keep_out(k, N)),
            keep_out_tolerance: mission.tolerances.keep_out,
            end_tolerance: mission.tolerances.dynamics,
            transition: HcwTransition::new(mission.mean_motion(), dt),
            mass: mission.servicer.total_mass(),
            max_force: mission.servicer.max_force,
            force_weight: mission.weights.force,
            change_weight: mission.weights.force_change,
            start: (scenario.position, scenario.velocity),
            end: (position, end.rate.cross(&position)),
            constrained: true,
        }
    }

    /// Writes the start of the loop: the optimum without keep-out, one convex program.
    pub fn warm_start<S: QpSolver<N, NX, NU, NR>>(
        &mut self,
        solver: &mut S,
        deadline: &Deadline,
        qp: &mut Qp<N, NX, NU, NR>,
        step: &mut Solution<N, NX, NU, NR>,
        trajectory: &mut TranslationTrajectory<N>,
    ) -> QpOutcome {
        trajectory.force = [Vector3::zeros(); N];
        self.roll_out(trajectory);
        self.constrained = false;
        self.linearise(trajectory, None, qp);
        self.bound(trajectory, f64::INFINITY, qp);
        qp.row_weight = 1.0;
        // Memory may be that of an earlier plan, of which no solver may see anything.
        step.clear_multipliers();
        let outcome = solver.solve(qp, step, deadline);
        self.constrained = true;
        if outcome.status.is_usable() {
            let drift = *trajectory;
            self.retract(&drift, qp, step, trajectory);
        }
        outcome
    }

    /// Cost of a force profile, as section 5 defines it.
    pub fn cost(&self, force: &[Vector3<f64>; N]) -> f64 {
        let scaled = |k: usize| force[k] / self.max_force;
        let effort: f64 = (0..N - 1).map(|k| scaled(k).norm_squared()).sum();
        let change: f64 = (0..N - 2).map(|k| (scaled(k + 1) - scaled(k)).norm_squared()).sum();
        self.force_weight * effort + self.change_weight * change
    }

    /// Positions and velocities that follow from the forces.
    fn roll_out(&self, trajectory: &mut TranslationTrajectory<N>) {
        let (mut r, mut v) = self.start;
        for k in 0..N {
            trajectory.position[k] = r;
            trajectory.velocity[k] = v;
            if k + 1 < N {
                let mut x = SVector::<f64, 6>::zeros();
                x.fixed_rows_mut::<3>(0).copy_from(&r);
                x.fixed_rows_mut::<3>(3).copy_from(&v);
                let next = self.transition.state * x
                    + self.transition.input * (trajectory.force[k] / self.mass);
                r = next.fixed_rows::<3>(0).into_owned();
                v = next.fixed_rows::<3>(3).into_owned();
            }
        }
    }

    /// Keep-out row at node `k`: `(keep_out - distance, -gradient in RTN)`; the terminal node has
    /// none.
    fn keep_out_row(&self, k: usize, position: &Vector3<f64>) -> (f64, Vector3<f64>) {
        if k + 1 == N || !self.constrained {
            return (-1.0, Vector3::zeros());
        }
        let rotation = quaternion::rotation_matrix(&self.target[k].attitude);
        let local = rotation.tr_mul(position);
        let distance = signed_distance_to_box(&self.half_extents, &local);
        (self.keep_out[k] - distance.value, -(rotation * distance.gradient))
    }

    /// End state error over its scale.
    fn end_error(&self, trajectory: &TranslationTrajectory<N>) -> (Vector3<f64>, Vector3<f64>) {
        let r = self.end.0 - trajectory.position[N - 1];
        let v = self.end.1 - trajectory.velocity[N - 1];
        (r / SCALE[0], v / SCALE[1])
    }
}

impl<const N: usize> Problem<N, NX, NU, NR> for Translation<'_, N> {
    type Trajectory = TranslationTrajectory<N>;

    fn clip(&self, trajectory: &mut Self::Trajectory) {
        for force in &mut trajectory.force {
            *force = force.map(|f| clamp(f, -self.max_force, self.max_force));
        }
        self.roll_out(trajectory);
    }

    fn linearise(
        &mut self,
        trajectory: &Self::Trajectory,
        _multipliers: Option<&Solution<N, NX, NU, NR>>,
        qp: &mut Qp<N, NX, NU, NR>,
    ) {
        qp.defect_weight = f64::INFINITY;
        qp.constant = 0.0;
        let [r, v, f] = SCALE;
        let unit = f / self.max_force;
        let effort = 2.0 * COST_SCALE * self.force_weight * unit * unit;
        let change = 2.0 * COST_SCALE * self.change_weight * unit * unit;
        for k in 0..N {
            let stage = &mut qp.stages[k];
            *stage = crate::qp::Stage::ZERO;
            let (offset, normal) = self.keep_out_row(k, &trajectory.position[k]);
            stage.row_offset[0] = offset;
            stage.row_x.fixed_columns_mut::<3>(0).copy_from(&(normal * r).transpose());
            if k + 1 == N {
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
                    stage.b[(i, j)] = self.transition.input[(i, j)] * f / (self.mass * row);
                }
                stage.b[(6 + j, j)] = 1.0;
            }
            let force = trajectory.force[k] / f;
            for i in 0..3 {
                stage.hessian_uu[(i, i)] = effort;
                stage.gradient_u[i] = force[i] * effort;
            }
            if k > 0 {
                // |u - u_before|^2 in the steps of both.
                let since = (force - trajectory.force[k - 1] / f) * change;
                for i in 0..3 {
                    stage.hessian_uu[(i, i)] += change;
                    stage.gradient_u[i] += since[i];
                    stage.hessian_xx[(6 + i, 6 + i)] = change;
                    stage.hessian_ux[(i, 6 + i)] = -change;
                    stage.gradient_x[6 + i] = -since[i];
                }
            }
        }
    }

    fn bound(&self, trajectory: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NR>) {
        let (r, v) = self.end_error(trajectory);
        for (k, stage) in qp.stages.iter_mut().enumerate() {
            stage.lower_x.fill(f64::NEG_INFINITY);
            stage.upper_x.fill(f64::INFINITY);
            if k == 0 {
                stage.lower_x.fill(0.0);
                stage.upper_x.fill(0.0);
            } else if k + 1 == N {
                for i in 0..3 {
                    (stage.lower_x[i], stage.upper_x[i]) = (r[i], r[i]);
                    (stage.lower_x[3 + i], stage.upper_x[3 + i]) = (v[i], v[i]);
                }
            } else if radius.is_finite() {
                stage.lower_x.fixed_rows_mut::<3>(0).fill(-radius / SCALE[0]);
                stage.upper_x.fixed_rows_mut::<3>(0).fill(radius / SCALE[0]);
            }
            stage.lower_u.fill(0.0);
            stage.upper_u.fill(0.0);
            for i in 0..CONTROLS {
                let force = trajectory.force[k][i];
                stage.lower_u[i] = (-self.max_force - force) / SCALE[2];
                stage.upper_u[i] = (self.max_force - force) / SCALE[2];
            }
        }
    }

    fn retract(
        &self,
        from: &Self::Trajectory,
        _qp: &Qp<N, NX, NU, NR>,
        step: &Solution<N, NX, NU, NR>,
        to: &mut Self::Trajectory,
    ) {
        for k in 0..N - 1 {
            let force = from.force[k] + step.u[k].fixed_rows::<3>(0) * SCALE[2];
            to.force[k] = force.map(|f| clamp(f, -self.max_force, self.max_force));
        }
        to.force[N - 1] = Vector3::zeros();
        self.roll_out(to);
    }

    fn residuals(&self, trajectory: &Self::Trajectory, out: &mut Residuals<N, NX, NR>) {
        out.cost = COST_SCALE * self.cost(&trajectory.force);
        out.ignored_defect.fill(0.0);
        out.ignored_row.fill(0.0);
        for k in 0..N {
            out.defect[k].fill(0.0);
            out.row[k][0] = self.keep_out_row(k, &trajectory.position[k]).0;
        }
        // The roll-out leaves the only defect at the end, against the pinned terminal state.
        let (r, v) = self.end_error(trajectory);
        for i in 0..3 {
            out.defect[N - 2][i] = r[i];
            out.defect[N - 2][3 + i] = v[i];
        }
    }

    fn violation(&self, residuals: &Residuals<N, NX, NR>) -> f64 {
        let keep_out = residuals.row.iter().fold(0.0, |worst, row| worse(worst, row[0]));
        let end = residuals.defect[N - 2].iter().fold(0.0, |worst, d| worse(worst, d.abs()));
        worse(keep_out / self.keep_out_tolerance, end / self.end_tolerance) / MARGIN
    }

    fn step_length(&self, step: &Solution<N, NX, NU, NR>) -> f64 {
        step.x[1..N - 1].iter().map(|x| x.fixed_rows::<3>(0).amax()).fold(0.0, f64::max) * SCALE[0]
    }
}
