//! Checks of plan files from any planner. The core's independent verifier finds the residuals, with
//! which the file's claims must agree.

use crate::engine::verified;
use crate::error::Error;
use crate::formats::{
    Clearances, MadeFor, Mission, MissionFile, PlanFile, Scenario, ScenarioSet, Status, Verdict,
    checksum_of_mission, checksum_of_scenario,
};
use crate::method::{Integrator, Mode};
use crate::optimality::{Optimality, target_motion};
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::model::Tolerances;
use remora_core::advanced::stages::{Residuals, Verification};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A value that was read from a file, by which errors name it.
#[derive(Clone, Debug)]
pub struct FileValue<T> {
    /// The file.
    pub file: PathBuf,
    /// The value read from it.
    pub value: T,
}

/// Plans to be verified: the input of `remora check`.
#[derive(Clone, Debug)]
pub struct Check {
    /// Scenarios that those in the plans must agree with.
    pub scenarios: Option<FileValue<ScenarioSet>>,
    /// Mission that those in the plans must agree with.
    pub mission: Option<FileValue<MissionFile>>,
    /// The integrator to verify with; by default the one that a plan names.
    pub integrator: Option<Integrator>,
    /// The plan files.
    pub plans: Vec<PathBuf>,
}

/// Result of checking one plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanCheck {
    /// The file.
    pub file: PathBuf,
    /// The scenario it is for.
    pub scenario: String,
    /// The integrator it was verified with.
    pub integrator: Integrator,
    /// The status it claims.
    pub claimed: Status,
    /// Whether the residuals are within their tolerances, as recomputed here.
    pub is_verified: bool,
    /// Distance from a local optimum, found here if it is verified and an optimum was asked for.
    pub optimality: Option<Optimality>,
    /// Verdict, from what is found here, and no better than the plan claims.
    pub verdict: Verdict,
    /// Residual farthest beyond its tolerance, where the plan is not flyable.
    pub reason: Option<&'static str>,
    /// The residuals, recomputed.
    pub residuals: Residuals,
    /// How near bodies come to each other, recomputed.
    pub clearances: Clearances,
    /// Fields in which the file disagrees with the recomputed values.
    pub disagreements: Vec<Disagreement>,
    /// Tolerances of the residuals.
    #[serde(skip)]
    pub tolerances: Tolerances,
}

/// Results of all plans, as `remora check --json` prints them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Checks<'a> {
    /// `remora-check/1`.
    pub format: &'static str,
    /// One a plan, in the order they were given.
    pub plans: &'a [PlanCheck],
}

impl<'a> Checks<'a> {
    /// Wraps the results of checked plans.
    pub fn new(plans: &'a [PlanCheck]) -> Self {
        Self { format: "remora-check/1", plans }
    }
}

/// A plan with what it was made for.
struct PlanCase {
    plan: PlanFile,
    scenario: Scenario,
    mission: Mission,
}

/// A field of a plan that disagrees with its recomputed value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Disagreement {
    /// Path of the field.
    pub field: String,
    /// The claim of the file, and the value found.
    pub reason: String,
}

/// A recomputed residual agrees with a claimed one within this share of its tolerance.
const RESIDUAL_SHARE: f64 = 1e-3;
/// Costs and large residuals agree within this, relative.
const RELATIVE: f64 = 1e-6;
/// Clearances agree within this [m].
const DISTANCE: f64 = 1e-6;
/// Target attitudes agree within this, a component.
const ATTITUDE: f64 = 1e-8;
/// Target rates agree within this [rad/s].
const RATE: f64 = 1e-10;

impl Check {
    /// Reads all plans, then verifies each.
    ///
    /// # Errors
    /// The first file that cannot be read or understood, whose scenario is not in the set, or that
    /// was made for another scenario or mission than those given.
    pub fn run(&self) -> Result<Vec<PlanCheck>, Error> {
        let made = self.plans.iter().map(|file| self.read(file)).collect::<Result<Vec<_>, _>>()?;
        let files = self.plans.iter().cloned();
        Ok(files.zip(&made).map(|(file, made)| made.checked(file, self.integrator)).collect())
    }

    fn read(&self, file: &Path) -> Result<PlanCase, Error> {
        let plan = PlanFile::read(file)?;
        let MadeFor { mission, scenario } =
            plan.inputs.read(&plan.scenario).map_err(|error| error.at(file))?;
        let made = PlanCase { plan, scenario, mission };
        self.compare_scenario(file, &made)?;
        self.compare_mission(file, &mission)?;
        Ok(made)
    }

    /// Refuses a set whose scenario is another than that in the plan.
    fn compare_scenario(&self, plan: &Path, made: &PlanCase) -> Result<(), Error> {
        let Some(set) = &self.scenarios else { return Ok(()) };
        let (id, mission) = (&made.plan.scenario, &made.mission);
        let Some(outside) = set.value.get(id) else {
            let reason = format!("{id:?} is not in the scenario set {}", set.file.display());
            return Err(Error::input(plan, "scenario", reason));
        };
        let value = checksum_of_scenario(mission, &outside.scenario());
        let outside = FileValue { file: set.file.clone(), value };
        agree(plan, "scenario", &checksum_of_scenario(mission, &made.scenario), &outside)
    }

    /// Refuses a mission other than that in the plan.
    fn compare_mission(&self, plan: &Path, inside: &Mission) -> Result<(), Error> {
        let Some(given) = &self.mission else { return Ok(()) };
        let outside = given.value.mission().map_err(|error| error.at(&given.file))?;
        let value = checksum_of_mission(&outside);
        let outside = FileValue { file: given.file.clone(), value };
        agree(plan, "mission", &checksum_of_mission(inside), &outside)
    }
}

/// Refuses a file whose checksum is not that of what a plan was made for.
fn agree(plan: &Path, what: &str, inside: &str, given: &FileValue<String>) -> Result<(), Error> {
    if inside == given.value {
        return Ok(());
    }
    let reason = format!(
        "the plan was made for a {what} of checksum {inside}; that of {} has checksum {}",
        given.file.display(),
        given.value,
    );
    Err(Error::input(plan, format!("inputs.{what}_checksum"), reason))
}

impl PlanCase {
    /// Verifies it, by another integrator than its own where one is given.
    fn checked(&self, file: PathBuf, integrator: Option<Integrator>) -> PlanCheck {
        let Self { plan, scenario, mission } = self;
        let integrator = integrator.unwrap_or(plan.integrator);
        let (translation, motion) = (plan.stage1.trajectory(), plan.stage2.trajectory());
        let Verification { residuals, clearances, .. } =
            verified(mission, scenario, integrator, &translation, &motion);
        let is_verified = residuals.are_within(&mission.tolerances);
        let is_optimum = is_verified && plan.mode == Mode::Optimal;
        let optimality = is_optimum
            .then(|| Optimality::of(mission, scenario, integrator, &translation, &motion));
        let is_converged = optimality.is_none_or(|found| found.is_converged);
        let mut found = Findings(Vec::new());
        // Under another integrator than its own, a plan cannot be what it says.
        if integrator == plan.integrator {
            self.compare_status(plan, is_verified, optimality.as_ref(), &mut found);
            // Where no time was left to verify, a plan says nothing that could be wrong.
            if plan.residuals != Residuals::UNFINISHED {
                self.compare_residuals(&plan.residuals, &residuals, &mut found);
                if let Some(said) = &plan.clearances {
                    compare_clearances(said, &clearances, &mut found);
                }
            }
        }
        self.compare_costs(plan, &mut found);
        self.compare_target(plan, &mut found);
        PlanCheck {
            file,
            scenario: plan.scenario.clone(),
            integrator,
            claimed: plan.status,
            is_verified,
            optimality,
            verdict: judged(is_verified, is_converged, plan.status),
            reason: residuals.worst(&mission.tolerances),
            residuals,
            clearances,
            disagreements: found.0,
            tolerances: mission.tolerances,
        }
    }

    fn compare_status(
        &self,
        plan: &PlanFile,
        is_verified: bool,
        optimality: Option<&Optimality>,
        found: &mut Findings,
    ) {
        let worse = plan.stage1.status.max(plan.stage2.status);
        if plan.status == Status::Solved && !is_verified {
            found.add("status", "says solved, is not flyable".into());
        } else if plan.status < worse {
            found.add("status", format!("says {}, a stage says {worse}", plan.status));
        }
        let beyond = optimality.filter(|found| !found.is_converged);
        if let (Some(by), Status::Solved) = (beyond, plan.status) {
            let reason = format!("says solved, is locally optimal to {} only", share(by.worst()));
            found.add("status", reason);
        }
        let is = judged(is_verified, beyond.is_none(), plan.status);
        if let Some(said) = plan.verdict.filter(|said| *said != is) {
            found.add("verdict", format!("says {said}, is {is}"));
        }
    }

    fn compare_residuals(&self, said: &Residuals, is: &Residuals, found: &mut Findings) {
        let tolerances = &self.mission.tolerances;
        let said = said.against(tolerances);
        for ((name, said, tolerance), (_, is, _)) in said.into_iter().zip(is.against(tolerances)) {
            let slack = RESIDUAL_SHARE * tolerance + RELATIVE * is.abs();
            if !within(said - is, slack) {
                found.add(&format!("residuals.{name}"), format!("says {said:.3e}, is {is:.3e}"));
            }
        }
    }

    /// Costs by the problem definition, from the file's controls.
    fn compare_costs(&self, plan: &PlanFile, found: &mut Findings) {
        let (w, units) = (&self.mission.weights, self.mission.cost_units());
        fn squares<R: AsRef<[f64]>>(rows: &[R], limits: &[f64]) -> f64 {
            let scaled = |row: &R| -> f64 {
                row.as_ref().iter().zip(limits).map(|(u, limit)| (u / limit) * (u / limit)).sum()
            };
            rows.iter().map(scaled).sum()
        }
        let (force_unit, bus_unit, joint_unit) =
            (units.force.as_slice(), units.bus_torque.as_slice(), units.joint_torque.as_slice());
        let force = &plan.stage1.force;
        // The last node's rates are given.
        let moving = plan.stage2.joint_rate.split_last().map_or(&[][..], |(_, before)| before);
        let changes: Vec<[f64; 3]> =
            force.windows(2).map(|pair| std::array::from_fn(|i| pair[1][i] - pair[0][i])).collect();
        let translation =
            w.force * squares(force, force_unit) + w.force_change * squares(&changes, force_unit);
        let reorientation = w.bus_torque * squares(&plan.stage2.bus_torque, bus_unit)
            + w.joint_torque * squares(&plan.stage2.joint_torque, joint_unit)
            + w.joint_motion * squares(moving, units.joint_rate.as_slice());
        for (field, said, is) in [
            ("stage1.cost", plan.stage1.cost, translation),
            ("stage2.cost", plan.stage2.cost, reorientation),
        ] {
            if !within(said - is, RELATIVE * is.abs() + 1e-12) {
                found.add(field, format!("says {said:.6e}, is {is:.6e}"));
            }
        }
    }

    fn compare_target(&self, plan: &PlanFile, found: &mut Findings) {
        let grid = self.mission.grid(&self.scenario);
        let nodes = target_motion(&self.mission, &self.scenario, plan.integrator);
        let attitude = |k: usize| {
            let (said, is) = (Vector4::from(plan.target.attitude[k]), nodes[k].attitude);
            // Either sign is the same attitude.
            (said - is).amax().min((said + is).amax())
        };
        let rate = |k: usize| (Vector3::from(plan.target.rate[k]) - nodes[k].rate).amax();
        if let Some(k) = (0..grid.nodes).find(|k| !within(attitude(*k), ATTITUDE)) {
            let field = format!("target.attitude_body_to_rtn[{k}]");
            found.add(&field, format!("is off by {:.1e}", attitude(k)));
        }
        if let Some(k) = (0..grid.nodes).find(|k| !within(rate(*k), RATE)) {
            let field = format!("target.rate_rtn_rad_s[{k}]");
            found.add(&field, format!("is off by {:.1e} rad/s", rate(k)));
        }
    }
}

/// Distances; when they are smallest may hang on a rounding, and is not compared.
fn compare_clearances(said: &Clearances, is: &Clearances, found: &mut Findings) {
    for ((name, said), (_, is)) in said.named().into_iter().zip(is.named()) {
        let (said, is) = (said.distance, is.distance);
        if !(said == is || within(said - is, DISTANCE)) {
            let number =
                |x: f64| if x.is_finite() { format!("{x:.6}") } else { "nothing".to_string() };
            let reason = format!("says {}, is {}", number(said), number(is));
            found.add(&format!("clearances.{name}.distance_m"), reason);
        }
    }
}

/// The verdict on a plan that claims a status: no better than the claim, nor than the findings.
fn judged(is_verified: bool, is_converged: bool, claimed: Status) -> Verdict {
    match Verdict::of(is_verified, claimed) {
        Verdict::Optimal if !is_converged => Verdict::Verified,
        verdict => verdict,
    }
}

/// A share as text for people.
pub fn share(share: f64) -> String {
    match share {
        _ if !share.is_finite() => "an unknown share of the cost".into(),
        _ => format!("{:.1e} of the cost", share),
    }
}

/// Whether a difference is small; that of a NaN is not.
fn within(difference: f64, slack: f64) -> bool {
    difference.abs() <= slack
}

struct Findings(Vec<Disagreement>);

impl Findings {
    fn add(&mut self, field: &str, reason: String) {
        self.0.push(Disagreement { field: field.to_string(), reason });
    }
}
