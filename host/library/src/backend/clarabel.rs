//! The stage-structured program solved by Clarabel.
//!
//! Structure and symbolic factorisation are built at the first solve of a plan; later solves overwrite
//! numbers in place.

use super::sparse_program::{Assembly, Layout, Source, fill, is_sound};
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use remora_core::advanced::qp::{Qp, QpOutcome, QpSolver, QpStatus, Solution};
use remora_core::advanced::time::Deadline;

/// Clarabel behind the core's solver trait: single-threaded, presolve off, tolerances 1e-9.
///
/// Accuracy is absolute and relative 1e-9 in the scaled variables of the program. Memory: the
/// sparse factorisation, a few MiB for Stage 2.
pub struct ClarabelQp {
    built: Option<Built>,
    tolerance: f64,
}

impl ClarabelQp {
    /// A solver with another accuracy than 1e-9, to compare others with.
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { built: None, tolerance }
    }
}

impl Default for ClarabelQp {
    fn default() -> Self {
        Self::with_tolerance(1e-9)
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> QpSolver<N, NX, NU, NG>
    for ClarabelQp
{
    fn reset(&mut self) {
        self.built = None;
    }

    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        if deadline.has_passed() {
            return QpOutcome { status: QpStatus::TimeLimit, iterations: 0 };
        }
        if !is_sound(qp) {
            return QpOutcome::default();
        }
        let fits = self.built.as_ref().is_some_and(|built| built.layout.fits(qp));
        let updated = fits && self.built.as_mut().is_some_and(|built| built.update(qp).is_ok());
        if !updated {
            let Some(fresh) = Built::new(qp, self.tolerance) else { return QpOutcome::default() };
            self.built = Some(fresh);
        }
        let Some(built) = &mut self.built else { return QpOutcome::default() };
        built.solver.solve();
        built.read(solution);
        let status = map_status(built.solver.solution.status);
        let status = match status.is_usable() && !solution.is_finite() {
            true => QpStatus::NumericalFailure,
            false => status,
        };
        QpOutcome { status, iterations: built.solver.solution.iterations }
    }
}

fn map_status(status: SolverStatus) -> QpStatus {
    match status {
        SolverStatus::Solved => QpStatus::Solved,
        SolverStatus::AlmostSolved => QpStatus::ReducedAccuracy,
        SolverStatus::PrimalInfeasible => QpStatus::Infeasible,
        SolverStatus::AlmostPrimalInfeasible => QpStatus::AlmostInfeasible,
        SolverStatus::DualInfeasible => QpStatus::Unbounded,
        SolverStatus::AlmostDualInfeasible => QpStatus::AlmostUnbounded,
        SolverStatus::MaxIterations => QpStatus::IterationLimit,
        SolverStatus::MaxTime => QpStatus::TimeLimit,
        SolverStatus::InsufficientProgress => QpStatus::Stalled,
        SolverStatus::CallbackTerminated => QpStatus::Interrupted,
        SolverStatus::NumericalError | SolverStatus::Unsolved => QpStatus::NumericalFailure,
    }
}

fn settings(tolerance: f64) -> Option<DefaultSettings<f64>> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .presolve_enable(false)
        .input_sparse_dropzeros(false)
        // The program comes scaled; without equilibration an update in place is exactly a rebuild.
        .equilibrate_enable(false)
        .max_threads(1)
        .direct_solve_method("qdldl".to_string())
        .max_iter(100)
        .tol_gap_abs(tolerance)
        .tol_gap_rel(tolerance)
        .tol_feas(tolerance)
        .build()
        .ok()
}

struct Built {
    layout: Layout,
    solver: DefaultSolver<f64>,
    values: Vec<f64>,
}

impl Built {
    fn new<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
        tolerance: f64,
    ) -> Option<Self> {
        let mut assembly = Assembly::new(qp);
        assembly.objective();
        let equalities = assembly.equalities();
        assembly.inequalities();
        let variables = assembly.variables();
        let Assembly { pattern, bounds, soft, p, q, a, b, .. } = assembly;
        let cones = [
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(b.len() - equalities),
        ];
        let (mut p_matrix, p) = p.compress(variables);
        let (mut a_matrix, a) = a.compress(b.len());
        let layout = Layout { nodes: qp.nodes(), pattern, bounds, soft, p, q, a, b };
        fill(&layout.p, qp, &mut p_matrix.nzval);
        fill(&layout.a, qp, &mut a_matrix.nzval);
        let (mut q, mut b) = (Vec::new(), Vec::new());
        fill(&layout.q, qp, &mut q);
        fill(&layout.b, qp, &mut b);
        let solver =
            DefaultSolver::new(&p_matrix, &q, &a_matrix, &b, &cones, settings(tolerance)?).ok()?;
        Some(Self { layout, solver, values: Vec::new() })
    }

    fn update<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
    ) -> Result<(), clarabel::solver::DataUpdateError> {
        let Self { layout, solver, values } = self;
        fill(&layout.p, qp, values);
        solver.update_P(values)?;
        fill(&layout.q, qp, values);
        solver.update_q(values)?;
        fill(&layout.a, qp, values);
        solver.update_A(values)?;
        fill(&layout.b, qp, values);
        solver.update_b(values)
    }

    fn read<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &self,
        out: &mut Solution<N, NX, NU, NG>,
    ) {
        let (nz, nodes) = (NX + NU, self.layout.nodes);
        let solution = &self.solver.solution;
        *out = Solution::ZERO;
        for k in 0..nodes {
            out.x[k].copy_from_slice(&solution.x[k * nz..k * nz + NX]);
            if k + 1 < nodes {
                out.u[k].copy_from_slice(&solution.x[k * nz + NX..(k + 1) * nz]);
                // Clarabel's multiplier belongs to `x+ - A x - B u - xi - c`.
                for i in 0..NX {
                    out.defect_multiplier[k][i] = -solution.z[k * NX + i];
                }
            }
        }
        for (source, z) in self.layout.b.iter().zip(&solution.z) {
            let (k, i, multiplier) = match *source {
                Source::Upper(k, i) => (k, i, *z),
                Source::Lower(k, i) => (k, i, -*z),
                Source::RowOffset(k, i) => {
                    out.path_multiplier[k][i] = *z;
                    continue;
                }
                _ => continue,
            };
            if i < NX {
                out.bound_multiplier_x[k][i] += multiplier;
            } else {
                out.bound_multiplier_u[k][i - NX] += multiplier;
            }
        }
    }
}
