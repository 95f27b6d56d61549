//! Plans of format `remora-plan/1`: they name their scenario, and hold neither it nor the mission.

use super::plan_file::{FORMAT, PlanFile, PlanStage1, PlanStage2, PlanTarget};
use super::{Clearances, Residuals, Status, Verdict, json};
use crate::error::FieldError;
use crate::method::{Integrator, Mode};
use remora_core::advanced::stages::LINKS;
use serde::{Deserialize, Serialize};

/// The `format` of these plans.
pub(super) const FIRST_FORMAT: &str = "remora-plan/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a plan")]
struct FirstPlan {
    format: String,
    scenario: String,
    status: Status,
    mode: Mode,
    warm_start: String,
    qp: String,
    integrator: Integrator,
    stage1: FirstStage1,
    stage2: FirstStage2,
    target: FirstTarget,
    residuals: Residuals,
    verdict: Option<Verdict>,
    clearances: Option<Clearances>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 1")]
struct FirstStage1 {
    status: Status,
    iterations: u64,
    cost: f64,
    time_s: f64,
    position: Vec<[f64; 3]>,
    velocity: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the results of stage 2")]
struct FirstStage2 {
    status: Status,
    iterations: u64,
    cost: f64,
    time_s: f64,
    inference_s: f64,
    attitude: Vec<[f64; 4]>,
    joint_angle: Vec<[f64; LINKS]>,
    rate: Vec<[f64; 3]>,
    joint_rate: Vec<[f64; LINKS]>,
    bus_torque: Vec<[f64; 3]>,
    joint_torque: Vec<[f64; LINKS]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the target's attitude and rate")]
struct FirstTarget {
    attitude: Vec<[f64; 4]>,
    rate: Vec<[f64; 3]>,
}

/// Rows of the built-in mission's arm, which plans of the first format are for.
fn rows(of: Vec<[f64; LINKS]>) -> Vec<Vec<f64>> {
    of.into_iter().map(Vec::from).collect()
}

/// Parses a plan of the first format as one of today's without inputs.
pub(super) fn parse(text: &str) -> Result<PlanFile, FieldError> {
    let first: FirstPlan = json::parse(text, FIRST_FORMAT)?;
    let (one, two) = (first.stage1, first.stage2);
    Ok(PlanFile {
        format: FORMAT.into(),
        program: None,
        scenario: first.scenario,
        inputs: None,
        grid: None,
        frames: None,
        status: first.status,
        verdict: first.verdict,
        mode: first.mode,
        warm_start: first.warm_start,
        qp: first.qp,
        integrator: first.integrator,
        time_s: None,
        cpu_time_s: None,
        stage1: PlanStage1 {
            status: one.status,
            iterations: one.iterations,
            cost: one.cost,
            time_s: one.time_s,
            position: one.position,
            velocity: one.velocity,
            force: one.force,
        },
        stage2: PlanStage2 {
            status: two.status,
            iterations: two.iterations,
            cost: two.cost,
            time_s: two.time_s,
            inference_s: two.inference_s,
            attitude: two.attitude,
            joint_angle: rows(two.joint_angle),
            rate: two.rate,
            joint_rate: rows(two.joint_rate),
            bus_torque: two.bus_torque,
            joint_torque: rows(two.joint_torque),
        },
        target: PlanTarget { attitude: first.target.attitude, rate: first.target.rate },
        residuals: first.residuals,
        clearances: first.clearances,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ScenarioSet;

    const FIRST: &str = include_str!("../../../../fixtures/plans/first-format.plan.json");

    #[test]
    fn a_plan_of_the_first_format_is_read() {
        let plan = PlanFile::parse(FIRST).unwrap();
        assert_eq!((plan.scenario.as_str(), plan.inputs.is_none()), ("pub-000", true));
        assert_eq!((plan.status, plan.verdict), (Status::Solved, Some(Verdict::Optimal)));
        let set = ScenarioSet::built_in().unwrap();
        let start = &set.get("pub-000").unwrap().servicer;
        assert_eq!(plan.stage1.position[0], start.position);
        assert_eq!((plan.stage2.rate.len(), plan.stage2.joint_torque.len()), (60, 59));
    }

    /// Keys of one format are unknown to the other.
    #[test]
    fn formats_are_not_mixed() {
        let field = |text: &str| PlanFile::parse(text).unwrap_err().field;
        assert_eq!(field(&FIRST.replace("\"force\"", "\"force_rtn_n\"")), "stage1.force_rtn_n");
        assert_eq!(field(&FIRST.replace(FIRST_FORMAT, FORMAT)), "stage1.position");
        assert_eq!(field(&FIRST.replace(FIRST_FORMAT, "remora-plan/9")), "format");
    }

    /// Older plans say neither what they are good for nor how near bodies come to each other.
    #[test]
    fn a_plan_of_an_older_version_is_read() {
        let mut old: serde_json::Value = serde_json::from_str(FIRST).unwrap();
        let fields = old.as_object_mut().unwrap();
        assert!(fields.remove("verdict").is_some() && fields.remove("clearances").is_some());
        fields["residuals"].as_object_mut().unwrap().remove("clearance");
        let read = PlanFile::parse(&old.to_string()).unwrap();
        let whole = PlanFile::parse(FIRST).unwrap();
        assert_eq!(read, PlanFile { verdict: None, clearances: None, ..whole });
    }
}
