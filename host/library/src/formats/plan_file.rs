//! Plans: `*.plan.json`.

use super::{PlanClearances, PlanVerdict, check_id, check_quaternion, json};
use crate::error::{Error, FieldError};
use crate::method::{Integrator, Mode};
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{LINKS, NODES, Residuals};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::path::Path;

/// The `format` of the plans this version reads and writes.
pub const FORMAT: &str = "remora-plan/1";

/// A plan, as in its file. States have `NODES` rows, controls one less.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a plan")]
pub struct PlanFile {
    /// [`FORMAT`].
    pub format: String,
    /// Id of the scenario.
    pub scenario: String,
    /// The worse of the stages'.
    pub status: PlanStatus,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Start of Stage 2. Any name: a plan may come from another planner.
    pub warm_start: String,
    /// Solver of the subproblems. Any name.
    pub qp: String,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Path of the system centre of mass.
    pub stage1: PlanStage1,
    /// Bus attitude and arm.
    pub stage2: PlanStage2,
    /// The target at the nodes.
    pub target: PlanTarget,
    /// Residuals by the verifier.
    pub residuals: PlanResiduals,
    /// What the plan is good for; plans of older versions and of other planners do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<PlanVerdict>,
    /// How near bodies come to each other, by the verifier; likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearances: Option<PlanClearances>,
}

/// How a stage or a plan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanStatus {
    /// Feasible, and settled where that was asked for.
    Solved,
    /// The iteration limit was reached first.
    IterationLimit,
    /// The convex subproblem has no feasible point.
    Infeasible,
    /// Time ran out first.
    Deadline,
    /// Arithmetic or the subproblem's solver broke down.
    NumericalFailure,
}

/// Stage 1: the system centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 1")]
pub struct PlanStage1 {
    /// How it ended.
    pub status: PlanStatus,
    /// Iterations.
    pub iterations: u64,
    /// Cost.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
    /// Position in RTN [m].
    pub position: Vec<[f64; 3]>,
    /// Velocity relative to RTN, in RTN [m/s].
    pub velocity: Vec<[f64; 3]>,
    /// Force in RTN [N].
    pub force: Vec<[f64; 3]>,
}

/// Stage 2: bus attitude and arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 2")]
pub struct PlanStage2 {
    /// How it ended.
    pub status: PlanStatus,
    /// Iterations.
    pub iterations: u64,
    /// Cost.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
    /// Part of it spent in a learned warm start [s].
    pub inference_s: f64,
    /// Bus attitude, body to RTN, `[x, y, z, w]`.
    pub attitude: Vec<[f64; 4]>,
    /// Joint angles [rad].
    pub joint_angle: Vec<[f64; LINKS]>,
    /// Bus rate relative to RTN, in RTN [rad/s].
    pub rate: Vec<[f64; 3]>,
    /// Joint rates [rad/s].
    pub joint_rate: Vec<[f64; LINKS]>,
    /// Bus torque, bus body axes [N m].
    pub bus_torque: Vec<[f64; 3]>,
    /// Joint torques [N m].
    pub joint_torque: Vec<[f64; LINKS]>,
}

/// The target's tumble at the nodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the target's attitude and rate")]
pub struct PlanTarget {
    /// Attitude, body to RTN, `[x, y, z, w]`.
    pub attitude: Vec<[f64; 4]>,
    /// Angular velocity relative to RTN, in RTN [rad/s].
    pub rate: Vec<[f64; 3]>,
}

/// Residuals of a plan, each zero or positive, in the units of the problem definition; infinite, and
/// `null` in the file, where the deadline passed before the verifier had finished.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the residuals")]
pub struct PlanResiduals {
    /// Stage 1 dynamics, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub dynamics1: f64,
    /// Keep-out [m].
    #[serde(deserialize_with = "null_is_infinity")]
    pub keep_out: f64,
    /// Stage 2 dynamics, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub dynamics2: f64,
    /// Control bounds, relative.
    #[serde(deserialize_with = "null_is_infinity")]
    pub control: f64,
    /// Joint limits [rad].
    #[serde(deserialize_with = "null_is_infinity")]
    pub joint: f64,
    /// Joint rates, relative.
    #[serde(deserialize_with = "null_is_infinity")]
    pub joint_rate: f64,
    /// Pointing, in cosine.
    #[serde(deserialize_with = "null_is_infinity")]
    pub pointing: f64,
    /// Arm preset, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub preset: f64,
    /// Terminal bus rate, scaled.
    #[serde(deserialize_with = "null_is_infinity")]
    pub terminal_rate: f64,
    /// End effector from the port [m].
    #[serde(deserialize_with = "null_is_infinity")]
    pub ee_position: f64,
    /// Approach direction [rad].
    #[serde(deserialize_with = "null_is_infinity")]
    pub ee_angle: f64,
    /// Overlap of bodies [m]; plans of older versions have none.
    #[serde(default, deserialize_with = "null_is_infinity")]
    pub clearance: f64,
}

/// JSON has no infinity, which is the residual of a verifier that did not finish: it is written as
/// null.
fn null_is_infinity<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl PlanStatus {
    /// All of them, best first.
    pub const ALL: [Self; 5] = [
        Self::Solved,
        Self::IterationLimit,
        Self::Infeasible,
        Self::Deadline,
        Self::NumericalFailure,
    ];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::IterationLimit => "iteration_limit",
            Self::Infeasible => "infeasible",
            Self::Deadline => "deadline",
            Self::NumericalFailure => "numerical_failure",
        }
    }
}

impl fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl From<Status> for PlanStatus {
    fn from(status: Status) -> Self {
        match status {
            Status::Solved => Self::Solved,
            Status::IterationLimit => Self::IterationLimit,
            Status::Infeasible => Self::Infeasible,
            Status::Deadline => Self::Deadline,
            _ => Self::NumericalFailure,
        }
    }
}

impl PlanFile {
    /// Parses and validates a plan.
    ///
    /// # Errors
    /// The first field found wrong: unknown format or field, numbers that are not, numbers of
    /// rows that do not fit the horizon, quaternions not of unit length.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let plan: Self = json::parse(text, FORMAT)?;
        plan.validate()?;
        Ok(plan)
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// As [`PlanFile::parse`], with the file.
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(&json::read_text(file)?).map_err(|error| error.at(file))
    }

    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// The file with the reason why it cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let text = json::to_text(self).map_err(|error| Error::output(file, &error.into()))?;
        super::write_atomically(file, text.as_bytes())
    }

    fn validate(&self) -> Result<(), FieldError> {
        check_id(&self.scenario, || "scenario".into())?;
        let (one, two, target) = (&self.stage1, &self.stage2, &self.target);
        for (field, found, expected) in [
            ("stage1.position", one.position.len(), NODES),
            ("stage1.velocity", one.velocity.len(), NODES),
            ("stage1.force", one.force.len(), NODES - 1),
            ("stage2.attitude", two.attitude.len(), NODES),
            ("stage2.joint_angle", two.joint_angle.len(), NODES),
            ("stage2.rate", two.rate.len(), NODES),
            ("stage2.joint_rate", two.joint_rate.len(), NODES),
            ("stage2.bus_torque", two.bus_torque.len(), NODES - 1),
            ("stage2.joint_torque", two.joint_torque.len(), NODES - 1),
            ("target.attitude", target.attitude.len(), NODES),
            ("target.rate", target.rate.len(), NODES),
        ] {
            if found != expected {
                let reason = format!("has {found} rows; the horizon has {expected}");
                return Err(FieldError::new(field, reason));
            }
        }
        for (k, q) in two.attitude.iter().enumerate() {
            check_quaternion(q, || format!("stage2.attitude[{k}]"))?;
        }
        for (k, q) in target.attitude.iter().enumerate() {
            check_quaternion(q, || format!("target.attitude[{k}]"))?;
        }
        for (field, value) in [
            ("stage1.cost", one.cost),
            ("stage1.time_s", one.time_s),
            ("stage2.cost", two.cost),
            ("stage2.time_s", two.time_s),
            ("stage2.inference_s", two.inference_s),
        ] {
            if value < 0.0 {
                return Err(FieldError::new(field, format!("must not be negative, is {value}")));
            }
        }
        self.residuals.validate()
    }
}

impl PlanResiduals {
    fn validate(&self) -> Result<(), FieldError> {
        for (name, value, _) in Residuals::from(*self).against(&Default::default()) {
            if value < 0.0 {
                let reason = format!("must not be negative, is {value}");
                return Err(FieldError::new(format!("residuals.{name}"), reason));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::StageEnd;
    use remora_core::advanced::model::TargetState;
    use remora_core::advanced::stages::{
        Clearances, Closest, ReorientationTrajectory, TranslationTrajectory,
    };

    fn plan() -> PlanFile {
        let residuals = Residuals { dynamics1: 1e-9, ee_angle: 2e-9, ..Default::default() };
        let status = PlanStatus::Solved;
        let arm = Closest { distance: -0.01, time_s: 612.5, body: 3 };
        let clearances = Clearances { arm, bus: Closest::NONE, own: Closest::NONE };
        let end = StageEnd { status, iterations: 9, cost: 0.2, time_s: 0.1 };
        PlanFile {
            format: FORMAT.into(),
            scenario: "a".into(),
            status,
            mode: Mode::Optimal,
            warm_start: "heuristic".into(),
            qp: "clarabel".into(),
            integrator: Integrator::RK4,
            stage1: PlanStage1::new(end, &TranslationTrajectory::ZERO),
            stage2: PlanStage2::new(end, 0.0, &ReorientationTrajectory::ZERO),
            target: PlanTarget::from(&[TargetState::ZERO; NODES]),
            residuals: residuals.into(),
            verdict: Some(PlanVerdict::Optimal),
            clearances: Some(clearances.into()),
        }
    }

    #[test]
    fn plans_survive_a_round_trip_and_have_the_contracts_rows() {
        let plan = plan();
        let text = json::to_text(&plan).unwrap();
        assert_eq!(PlanFile::parse(&text).unwrap(), plan);
        assert_eq!((plan.stage1.position.len(), plan.stage1.force.len()), (60, 59));
        assert_eq!((plan.stage2.attitude.len(), plan.stage2.joint_torque.len()), (60, 59));
        let two = plan.stage2.trajectory();
        assert_eq!(two, ReorientationTrajectory::ZERO);
    }

    #[test]
    fn a_plan_of_an_older_version_is_read() {
        let mut old = serde_json::to_value(plan()).unwrap();
        let fields = old.as_object_mut().unwrap();
        assert_eq!(fields["verdict"], "optimal");
        assert_eq!(fields["clearances"]["arm"]["body"], 3);
        assert!(fields["clearances"]["bus"]["distance_m"].is_null());
        assert!(fields.remove("verdict").is_some() && fields.remove("clearances").is_some());
        fields["residuals"].as_object_mut().unwrap().remove("clearance");
        let read = PlanFile::parse(&old.to_string()).unwrap();
        assert_eq!(read, PlanFile { verdict: None, clearances: None, ..plan() });
    }

    #[test]
    fn what_was_not_verified_in_time_is_infinite_and_null_in_the_file() {
        let unfinished = PlanFile { residuals: Residuals::UNFINISHED.into(), ..plan() };
        let text = json::to_text(&unfinished).unwrap();
        let mut fields: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(fields["residuals"]["dynamics1"].is_null());
        assert_eq!(PlanFile::parse(&text).unwrap(), unfinished);
        fields["residuals"].as_object_mut().unwrap().remove("dynamics1");
        assert_eq!(PlanFile::parse(&fields.to_string()).unwrap_err().field, "residuals");
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |change: fn(&mut PlanFile)| {
            let mut plan = plan();
            change(&mut plan);
            PlanFile::parse(&json::to_text(&plan).unwrap()).unwrap_err().field
        };
        assert_eq!(field(|p| p.format = "remora-plan/2".into()), "format");
        assert_eq!(field(|p| p.scenario = "a/b".into()), "scenario");
        assert_eq!(field(|p| p.stage1.force.truncate(58)), "stage1.force");
        assert_eq!(field(|p| p.stage2.joint_rate.clear()), "stage2.joint_rate");
        assert_eq!(field(|p| p.stage1.position[7][1] = f64::NAN), "stage1.position[7][1]");
        assert_eq!(field(|p| p.stage2.attitude[5][0] = 0.01), "stage2.attitude[5]");
        assert_eq!(field(|p| p.target.attitude[59] = [0.0; 4]), "target.attitude[59]");
        assert_eq!(field(|p| p.stage2.time_s = -1.0), "stage2.time_s");
        assert_eq!(field(|p| p.residuals.preset = -1.0), "residuals.preset");
        let text = json::to_text(&plan()).unwrap();
        let field =
            |from: &str, to: &str| PlanFile::parse(&text.replace(from, to)).unwrap_err().field;
        assert_eq!(field("\"rk4\"", "\"rk4:2\""), "integrator");
        assert_eq!(field("\"keep_out\"", "\"keepout\""), "residuals.keepout");
        assert_eq!(field("\"status\": \"solved\"", "\"status\": \"fine\""), "status");
        assert_eq!(
            field("\"optimal\",\n  \"clearances\"", "\"good\",\n  \"clearances\""),
            "verdict"
        );
        assert_eq!(field("\"body\": 3", "\"body\": -1"), "clearances.arm.body");
    }
}
