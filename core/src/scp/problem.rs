//! The trait of a problem for the SCP solver.

use nalgebra::{SMatrix, SVector};
use remora_qp::{Qp, Solution};

/// Cost and constraint residuals of a trajectory, in the problem's scaled units.
#[derive(Clone, Debug)]
pub struct Residuals<const N: usize, const NX: usize, const NG: usize> {
    /// The objective.
    pub cost: f64,
    /// `F(x_k, u_k) - x_{k+1}`, scaled; zero at the last node and beyond.
    pub defect: [SVector<f64, NX>; N],
    /// Values of the path constraints `h(x_k) <= 0`, scaled; zero beyond the last node.
    pub path: [SVector<f64, NG>; N],
    /// Defects up to these do not count in the merit: a fraction of their tolerances.
    pub ignored_defect: SVector<f64, NX>,
    /// Path violations up to these do not count in the merit: a fraction of their tolerances.
    pub ignored_path: SVector<f64, NG>,
}

impl<const N: usize, const NX: usize, const NG: usize> Residuals<N, NX, NG> {
    /// Storage, to be filled.
    pub const ZERO: Self = Self {
        cost: 0.0,
        defect: [SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NX]; 1])); N],
        path: [SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NG]; 1])); N],
        ignored_defect: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NX]; 1])),
        ignored_path: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; NG]; 1])),
    };

    /// Sets defects and path constraints to zero.
    pub fn clear(&mut self) {
        self.defect.iter_mut().for_each(|defect| defect.fill(0.0));
        self.path.iter_mut().for_each(|row| row.fill(0.0));
    }

    /// L1 norm of defects and path violations beyond the ignored ones. NaN where any of them is.
    pub fn l1_violation(&self) -> f64 {
        (0..N).fold(0.0, |sum, k| self.l1_violation_to(k, sum))
    }

    /// Adds the violations at node `k` to `sum`, those of the nodes before it.
    pub(crate) fn l1_violation_to(&self, k: usize, mut sum: f64) -> f64 {
        // `f64::max` would drop a NaN.
        let beyond = |value: f64, ignored: f64| {
            if value <= ignored { 0.0 } else { value - ignored }
        };
        let (Some(defect), Some(path)) = (self.defect.get(k), self.path.get(k)) else { return sum };
        for i in 0..NX {
            sum += beyond(defect[i].abs(), self.ignored_defect[i]);
        }
        for i in 0..NG {
            sum += beyond(path[i], self.ignored_path[i]);
        }
        sum
    }
}

/// A non-convex optimal-control problem of fixed horizon.
///
/// The subproblem's variables are scaled steps from the current trajectory (the nominal trajectory).
/// A step may live on a manifold (attitude), and [`Problem::retract`] may follow the constraints'
/// curvature, as long as it agrees with the linearisation to first order.
pub trait Problem<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// States and controls over the horizon.
    type Trajectory;

    /// Projects an initial guess onto the bounds and the fixed values, so that every subproblem has a
    /// feasible point whatever the radius.
    fn project(&self, trajectory: &mut Self::Trajectory);

    /// Fills `qp` (cost, dynamics, path constraints; not the bounds) with the subproblem at
    /// `trajectory`. `multipliers` are those of the last subproblem once the trajectory is near enough
    /// to feasible for the Lagrangian's Hessian, `None` before.
    fn linearise(
        &mut self,
        trajectory: &Self::Trajectory,
        multipliers: Option<&Solution<N, NX, NU, NG>>,
        qp: &mut Qp<N, NX, NU, NG>,
    );

    /// Sets the bounds of `qp`: the tighter of limits and trust region of `radius`.
    fn bound(&self, trajectory: &Self::Trajectory, radius: f64, qp: &mut Qp<N, NX, NU, NG>);

    /// The trajectory that `step` leads to.
    fn retract(
        &self,
        from: &Self::Trajectory,
        qp: &Qp<N, NX, NU, NG>,
        step: &Solution<N, NX, NU, NG>,
        to: &mut Self::Trajectory,
    );

    /// Cost and residuals of a trajectory by the non-linear model. Overwrites every field of `out`.
    fn residuals(&self, trajectory: &Self::Trajectory, out: &mut Residuals<N, NX, NG>);

    /// Largest violation over its tolerance: feasible where it is at most one.
    fn violation(&self, residuals: &Residuals<N, NX, NG>) -> f64;

    /// Length of a step in units of the trust-region radius: one on its border.
    fn step_length(&self, step: &Solution<N, NX, NU, NG>) -> f64;

    /// Number `element` of a trajectory at a node, for fault injection; none where there is none.
    fn number(trajectory: &mut Self::Trajectory, node: usize, element: usize) -> Option<&mut f64> {
        let _ = (trajectory, node, element);
        None
    }
}
