//! Subproblems between the core's fixed sizes and their files.

use super::{Bounds, FORMAT, QpAnswer, QpFile, QpInterval, QpNode, QpPoint, QpSize, Rows};
use crate::backend::Solve;
use crate::error::FieldError;
use crate::kkt;
use crate::method::Method;
use nalgebra::{SMatrix, SVector};
use remora_core::advanced::qp::{Qp, Solution};

/// Where a subproblem stands in its plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QpPlace<'a> {
    /// Id of the scenario.
    pub scenario: &'a str,
    /// 1 or 2.
    pub stage: u64,
    /// From 1.
    pub iteration: u64,
    /// From 1; 0 for the iteration's own.
    pub correction: u64,
}

impl QpFile {
    /// A subproblem with its answer.
    ///
    /// # Errors
    /// A number that is not finite, which the file could not hold.
    pub fn new<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        place: &QpPlace<'_>,
        method: &Method,
        solve: &Solve<'_, N, NX, NU, NG>,
    ) -> Result<Self, FieldError> {
        let Solve { qp, solution, outcome, .. } = *solve;
        let is_usable = outcome.status.is_usable();
        let file = Self {
            format: FORMAT.into(),
            scenario: place.scenario.into(),
            mode: method.mode,
            integrator: method.integrator,
            qp: method.qp.name().into(),
            stage: place.stage,
            iteration: place.iteration,
            correction: place.correction,
            size: QpSize { nodes: qp.nodes(), states: NX, controls: NU, rows: NG },
            constant: qp.constant,
            defect_weight: (qp.defect_penalty != f64::INFINITY).then_some(qp.defect_penalty),
            row_weight: qp.path_penalty,
            nodes: (0..qp.nodes()).map(|k| node(qp, k)).collect(),
            intervals: (0..qp.nodes() - 1).map(|k| interval(qp, k)).collect(),
            solution: QpAnswer {
                status: outcome.status,
                iterations: outcome.iterations.into(),
                point: is_usable.then(|| point(qp, solution)),
            },
        };
        file.validate()?;
        Ok(file)
    }

    /// The program, where it has the sizes asked for.
    ///
    /// # Errors
    /// `size`, where it has others.
    pub fn program<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &self,
    ) -> Result<Box<Qp<N, NX, NU, NG>>, FieldError> {
        self.check_size(QpSize { nodes: N, states: NX, controls: NU, rows: NG })?;
        let mut qp = Box::new(Qp::<N, NX, NU, NG>::ZERO);
        qp.unused = N - self.size.nodes;
        qp.constant = self.constant;
        qp.defect_penalty = self.defect_weight.unwrap_or(f64::INFINITY);
        qp.path_penalty = self.row_weight;
        for (stage, node) in qp.stages.iter_mut().zip(&self.nodes) {
            stage.hessian_xx = from_rows(&node.hessian_xx);
            stage.gradient_x.copy_from_slice(&node.gradient_x);
            stage.lower_x = from_bounds(&node.lower_x, f64::NEG_INFINITY);
            stage.upper_x = from_bounds(&node.upper_x, f64::INFINITY);
            stage.path_jacobian = from_rows(&node.row_x);
            stage.path_offset.copy_from_slice(&node.row_offset);
        }
        for (stage, interval) in qp.stages.iter_mut().zip(&self.intervals) {
            stage.hessian_ux = from_rows(&interval.hessian_ux);
            stage.hessian_uu = from_rows(&interval.hessian_uu);
            stage.gradient_u.copy_from_slice(&interval.gradient_u);
            stage.lower_u = from_bounds(&interval.lower_u, f64::NEG_INFINITY);
            stage.upper_u = from_bounds(&interval.upper_u, f64::INFINITY);
            stage.a = from_rows(&interval.a);
            stage.b = from_rows(&interval.b);
            stage.c.copy_from_slice(&interval.c);
        }
        Ok(qp)
    }

    /// The solution, where there is one and the program has the sizes asked for.
    ///
    /// # Errors
    /// `size`, where it has others; `solution.point`, where there is none.
    pub fn point<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &self,
    ) -> Result<Box<Solution<N, NX, NU, NG>>, FieldError> {
        self.check_size(QpSize { nodes: N, states: NX, controls: NU, rows: NG })?;
        let none = || FieldError::new("solution.point", "is null: there is no solution");
        let point = self.solution.point.as_ref().ok_or_else(none)?;
        let mut out = Box::new(Solution::<N, NX, NU, NG>::ZERO);
        fill(&mut out.x, &point.x);
        fill(&mut out.u, &point.u);
        fill(&mut out.defect_multiplier, &point.defect_multiplier);
        fill(&mut out.bound_multiplier_x, &point.bound_multiplier_x);
        fill(&mut out.bound_multiplier_u, &point.bound_multiplier_u);
        fill(&mut out.path_multiplier, &point.row_multiplier);
        Ok(out)
    }

    /// Refuses other sizes; fewer nodes have room.
    fn check_size(&self, wanted: QpSize) -> Result<(), FieldError> {
        let has_room = (2..=wanted.nodes).contains(&self.size.nodes);
        match has_room && (QpSize { nodes: wanted.nodes, ..self.size }) == wanted {
            true => Ok(()),
            false => Err(FieldError::new("size", format!("is {:?}, not {wanted:?}", self.size))),
        }
    }
}

fn node<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    k: usize,
) -> QpNode {
    let stage = &qp.stages[k];
    QpNode {
        hessian_xx: rows(&stage.hessian_xx),
        gradient_x: stage.gradient_x.as_slice().into(),
        lower_x: bounds(&stage.lower_x, f64::NEG_INFINITY),
        upper_x: bounds(&stage.upper_x, f64::INFINITY),
        row_x: rows(&stage.path_jacobian),
        row_offset: stage.path_offset.as_slice().into(),
    }
}

fn interval<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    k: usize,
) -> QpInterval {
    let stage = &qp.stages[k];
    QpInterval {
        hessian_ux: rows(&stage.hessian_ux),
        hessian_uu: rows(&stage.hessian_uu),
        gradient_u: stage.gradient_u.as_slice().into(),
        lower_u: bounds(&stage.lower_u, f64::NEG_INFINITY),
        upper_u: bounds(&stage.upper_u, f64::INFINITY),
        a: rows(&stage.a),
        b: rows(&stage.b),
        c: stage.c.as_slice().into(),
    }
}

fn point<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    solution: &Solution<N, NX, NU, NG>,
) -> QpPoint {
    let nodes = qp.nodes();
    QpPoint {
        objective: kkt::objective(qp, solution),
        x: vectors(&solution.x[..nodes]),
        u: vectors(&solution.u[..nodes - 1]),
        defect_multiplier: vectors(&solution.defect_multiplier[..nodes - 1]),
        bound_multiplier_x: vectors(&solution.bound_multiplier_x[..nodes]),
        bound_multiplier_u: vectors(&solution.bound_multiplier_u[..nodes - 1]),
        row_multiplier: vectors(&solution.path_multiplier[..nodes]),
    }
}

fn rows<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> Rows {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn vectors<const R: usize>(vectors: &[SVector<f64, R>]) -> Rows {
    vectors.iter().map(|vector| vector.as_slice().into()).collect()
}

/// Bounds with `none` left out; what is not a number, or the wrong infinity, stays to be refused.
fn bounds<const R: usize>(vector: &SVector<f64, R>, none: f64) -> Bounds {
    vector.iter().map(|bound| (*bound != none).then_some(*bound)).collect()
}

fn from_rows<const R: usize, const C: usize>(rows: &Rows) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

fn from_bounds<const R: usize>(bounds: &Bounds, none: f64) -> SVector<f64, R> {
    SVector::from_fn(|i, _| bounds[i].unwrap_or(none))
}

fn fill<const R: usize>(vectors: &mut [SVector<f64, R>], rows: &Rows) {
    for (vector, row) in vectors.iter_mut().zip(rows) {
        vector.copy_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::json;
    use crate::method::Method;
    use remora_core::advanced::qp::{QpOutcome, QpStatus};

    type Program = Qp<3, 2, 1, 1>;
    const PLACE: QpPlace<'_> = QpPlace { scenario: "a", stage: 2, iteration: 7, correction: 0 };

    /// A program in which no two numbers are the same.
    fn program() -> Box<Program> {
        let mut qp = Box::new(Program::ZERO);
        let mut count = 0.0;
        let mut next = || {
            count += 0.1;
            count
        };
        qp.constant = next();
        qp.defect_penalty = f64::INFINITY;
        qp.path_penalty = next();
        for (k, stage) in qp.stages.iter_mut().enumerate() {
            stage.hessian_xx = SMatrix::from_fn(|_, _| next());
            stage.hessian_xx.fill_upper_triangle_with_lower_triangle();
            stage.gradient_x = SVector::from_fn(|_, _| next());
            stage.lower_x = SVector::from([f64::NEG_INFINITY, -next()]);
            stage.upper_x = SVector::from([next(), f64::INFINITY]);
            stage.path_jacobian = SMatrix::from_fn(|_, _| next());
            stage.path_offset[0] = next();
            if k < 2 {
                stage.hessian_ux = SMatrix::from_fn(|_, _| next());
                stage.hessian_uu[0] = next();
                stage.gradient_u[0] = next();
                stage.lower_u[0] = f64::NEG_INFINITY;
                stage.upper_u[0] = f64::INFINITY;
                stage.a = SMatrix::from_fn(|_, _| next());
                stage.b = SMatrix::from_fn(|_, _| next());
                stage.c = SVector::from_fn(|_, _| next());
            }
        }
        qp
    }

    fn file(qp: &Program, status: QpStatus) -> Result<QpFile, FieldError> {
        let mut solution = Solution::<3, 2, 1, 1>::ZERO;
        for k in 0..3 {
            solution.x[k].fill(0.3 + k as f64);
            solution.path_multiplier[k].fill(0.7 + k as f64);
        }
        let outcome = QpOutcome { status, iterations: 9 };
        let solve = Solve { qp, solution: &solution, outcome, is_correction: false, stage: 2 };
        QpFile::new(&PLACE, &Method::default(), &solve)
    }

    #[test]
    fn a_program_comes_back_bit_for_bit() {
        for weight in [f64::INFINITY, 10.0] {
            let mut qp = program();
            qp.defect_penalty = weight;
            let text = json::to_text(&file(&qp, QpStatus::Solved).unwrap()).unwrap();
            let back = QpFile::parse(&text).unwrap();
            assert_eq!(back.name(), "stage2-007.qp.json");
            let again = back.program::<3, 2, 1, 1>().unwrap();
            assert_eq!(format!("{qp:?}"), format!("{again:?}"));
            let point = back.point::<3, 2, 1, 1>().unwrap();
            assert_eq!((point.x[2][1], point.path_multiplier[1][0]), (2.3, 1.7));
            let roomy = back.program::<4, 2, 1, 1>().unwrap();
            assert_eq!((roomy.unused, roomy.nodes()), (1, 3));
            assert_eq!(format!("{:?}", roomy.used()), format!("{:?}", qp.used()));
            assert_eq!(back.program::<2, 2, 1, 1>().unwrap_err().field, "size");
            assert_eq!(back.point::<3, 2, 1, 2>().unwrap_err().field, "size");
        }
    }

    #[test]
    fn without_a_solution_there_is_no_point() {
        let back = file(&program(), QpStatus::Infeasible).unwrap();
        let back = QpFile::parse(&json::to_text(&back).unwrap()).unwrap();
        assert_eq!(back.solution.status, QpStatus::Infeasible);
        assert_eq!(back.point::<3, 2, 1, 1>().unwrap_err().field, "solution.point");
    }

    #[test]
    fn what_a_file_cannot_hold_is_not_written() {
        let field = |change: fn(&mut Program)| {
            let mut qp = program();
            change(&mut qp);
            file(&qp, QpStatus::Solved).unwrap_err().field
        };
        assert_eq!(field(|qp| qp.stages[1].a[(1, 0)] = f64::NAN), "intervals[1].a[1][0]");
        assert_eq!(field(|qp| qp.stages[2].lower_x[0] = f64::INFINITY), "nodes[2].lower_x[0]");
        assert_eq!(field(|qp| qp.stages[2].upper_x[1] = f64::NAN), "nodes[2].upper_x[1]");
        assert_eq!(field(|qp| qp.defect_penalty = f64::NAN), "defect_weight");
        assert_eq!(field(|qp| qp.path_penalty = f64::INFINITY), "row_weight");
        assert_eq!(field(|qp| qp.constant = f64::NAN), "constant");
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let good = serde_json::to_value(file(&program(), QpStatus::Solved).unwrap()).unwrap();
        let field = |path: &str, value: serde_json::Value| {
            let mut bad = good.clone();
            *bad.pointer_mut(path).unwrap() = value;
            QpFile::parse(&bad.to_string()).unwrap_err().field
        };
        let null = serde_json::Value::Null;
        assert_eq!(field("/format", "remora-qp/2".into()), "format");
        assert_eq!(field("/scenario", "../a".into()), "scenario");
        assert_eq!(field("/stage", 3.into()), "stage");
        assert_eq!(field("/iteration", 0.into()), "iteration");
        assert_eq!(field("/size/nodes", 1.into()), "size.nodes");
        assert_eq!(field("/size/nodes", 4.into()), "nodes");
        assert_eq!(field("/size/states", 3.into()), "nodes[0].hessian_xx");
        assert_eq!(field("/size/rows", 0.into()), "nodes[0].row_x");
        assert_eq!(field("/size/controls", 2.into()), "intervals[0].hessian_ux");
        assert_eq!(field("/defect_weight", 0.into()), "defect_weight");
        assert_eq!(field("/row_weight", (-1).into()), "row_weight");
        assert_eq!(field("/row_weight", null.clone()), "row_weight");
        assert_eq!(field("/nodes/1/gradient_x/1", null), "nodes[1].gradient_x[1]");
        assert_eq!(field("/nodes/1/hessian_xx/1/0", 9.into()), "nodes[1].hessian_xx[1][0]");
        assert_eq!(field("/intervals/1/b/1", serde_json::json!([])), "intervals[1].b[1]");
        assert_eq!(field("/intervals/1", serde_json::json!({"b": 7})), "intervals[1].b");
        assert_eq!(field("/solution/status", "done".into()), "solution.status");
        assert_eq!(field("/solution/point/u", serde_json::json!([])), "solution.point.u");
    }

    #[test]
    fn names_are_told_from_others() {
        for name in ["stage1-001.qp.json", "stage2-1234.qp.json", "stage2-003-correction-2.qp.json"]
        {
            assert!(QpFile::is_name(name), "{name}");
        }
        for name in [
            "stage3-001.qp.json",
            "stage1-.qp.json",
            "stage1-001.json",
            "a.plan.json",
            "stage1-001-correction-.qp.json",
            ".stage1-001.qp.json",
        ] {
            assert!(!QpFile::is_name(name), "{name}");
        }
    }
}
