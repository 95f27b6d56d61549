//! Verifying plan files, whoever wrote them: residuals by the core's independent verifier, and
//! whether the file says of itself what is recomputed from its numbers.

use crate::error::Error;
use crate::formats::{
    PlanClearances, PlanFile, PlanResiduals, PlanStatus, PlanVerdict, ScenarioSet,
};
use crate::method::Integrator;
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::model::{Mission, Scenario, TargetState};
use remora_core::advanced::stages::{LINKS, NODES, Residuals, Verification, verify};
use remora_core::advanced::time::Deadline;
use std::path::{Path, PathBuf};

/// Plans to be verified: the input of `remora check`.
#[derive(Clone, Debug)]
pub struct Check {
    /// Where the plans' scenarios are.
    pub scenarios: ScenarioSet,
    /// The mission; valid.
    pub mission: Mission<LINKS>,
    /// The integrator to verify with; by default the one that a plan names.
    pub integrator: Option<Integrator>,
    /// The plan files.
    pub plans: Vec<PathBuf>,
}

/// What became of one plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The file.
    pub file: PathBuf,
    /// The scenario it is for.
    pub scenario: String,
    /// The integrator it was verified with.
    pub integrator: Integrator,
    /// The status it claims.
    pub claimed: PlanStatus,
    /// The residuals, recomputed.
    pub residuals: PlanResiduals,
    /// Whether all are within their tolerances.
    pub feasible: bool,
    /// How near bodies come to each other, recomputed.
    pub clearances: PlanClearances,
    /// Where the file says something else than what is recomputed.
    pub disagreements: Vec<Disagreement>,
}

/// A field of a plan that is not what is recomputed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Disagreement {
    /// Path of the field.
    pub field: String,
    /// What it says and what was found.
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
    /// The first file that cannot be read or understood, or whose scenario is not in the set.
    pub fn run(&self) -> Result<Vec<Verdict>, Error> {
        let plans =
            self.plans.iter().map(|file| self.read(file)).collect::<Result<Vec<_>, Error>>()?;
        let judge = |(file, (plan, scenario)): (&PathBuf, &(PlanFile, Scenario))| {
            self.verdict(file.clone(), plan, scenario)
        };
        Ok(self.plans.iter().zip(&plans).map(judge).collect())
    }

    fn read(&self, file: &Path) -> Result<(PlanFile, Scenario), Error> {
        let plan = PlanFile::read(file)?;
        let scenario = self.scenarios.get(&plan.scenario).ok_or_else(|| {
            let reason = format!("{:?} is not in the scenario set", plan.scenario);
            Error::input(file, "scenario", reason)
        })?;
        let scenario = scenario.scenario();
        Ok((plan, scenario))
    }

    fn verdict(&self, file: PathBuf, plan: &PlanFile, scenario: &Scenario) -> Verdict {
        let integrator = self.integrator.unwrap_or(plan.integrator);
        let Verification { residuals, clearances } = verify(
            &self.mission,
            scenario,
            integrator.core(),
            &plan.stage1.trajectory(),
            &plan.stage2.trajectory(),
            &Deadline::never(),
        );
        let clearances = PlanClearances::from(clearances);
        let feasible = residuals.are_within(&self.mission.tolerances);
        let mut found = Findings(Vec::new());
        // Under another integrator than its own, a plan cannot be what it says.
        if integrator == plan.integrator {
            self.compare_status(plan, feasible, &mut found);
            // Where no time was left to verify, a plan says nothing that could be wrong.
            if Residuals::from(plan.residuals) != Residuals::UNFINISHED {
                self.compare_residuals(&plan.residuals, &residuals, &mut found);
                if let Some(said) = &plan.clearances {
                    compare_clearances(said, &clearances, &mut found);
                }
            }
        }
        self.compare_costs(plan, &mut found);
        self.compare_target(plan, scenario, &mut found);
        Verdict {
            file,
            scenario: plan.scenario.clone(),
            integrator,
            claimed: plan.status,
            residuals: residuals.into(),
            feasible,
            clearances,
            disagreements: found.0,
        }
    }

    fn compare_status(&self, plan: &PlanFile, feasible: bool, found: &mut Findings) {
        let worse = plan.stage1.status.max(plan.stage2.status);
        if plan.status == PlanStatus::Solved && !feasible {
            found.add("status", "says solved, is not feasible".into());
        } else if plan.status < worse {
            found.add("status", format!("says {}, a stage says {worse}", plan.status));
        }
        let is = PlanVerdict::of(feasible, plan.status);
        if let Some(said) = plan.verdict.filter(|said| *said != is) {
            found.add("verdict", format!("says {said}, is {is}"));
        }
    }

    fn compare_residuals(&self, said: &PlanResiduals, is: &Residuals, found: &mut Findings) {
        let tolerances = &self.mission.tolerances;
        let said = Residuals::from(*said).against(tolerances);
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
        let squares = |rows: &[[f64; 3]], limit: f64| -> f64 {
            rows.iter().flatten().map(|u| (u / limit) * (u / limit)).sum()
        };
        let force = &plan.stage1.force;
        let changes: Vec<[f64; 3]> =
            force.windows(2).map(|pair| std::array::from_fn(|i| pair[1][i] - pair[0][i])).collect();
        let one =
            w.force * squares(force, units.force) + w.force_change * squares(&changes, units.force);
        let two = w.bus_torque * squares(&plan.stage2.bus_torque, units.bus_torque)
            + w.joint_torque * squares(&plan.stage2.joint_torque, units.joint_torque);
        for (field, said, is) in
            [("stage1.cost", plan.stage1.cost, one), ("stage2.cost", plan.stage2.cost, two)]
        {
            if !within(said - is, RELATIVE * is.abs() + 1e-12) {
                found.add(field, format!("says {said:.6e}, is {is:.6e}"));
            }
        }
    }

    fn compare_target(&self, plan: &PlanFile, scenario: &Scenario, found: &mut Findings) {
        let mut nodes = [TargetState::ZERO; NODES];
        let dt = self.mission.approach.duration / (NODES - 1) as f64;
        self.mission.target.tumble(
            plan.integrator.core(),
            self.mission.mean_motion(),
            &scenario.target_attitude,
            &scenario.target_rate,
            dt,
            &mut nodes,
        );
        let attitude = |k: usize| {
            let (said, is) = (Vector4::from(plan.target.attitude[k]), nodes[k].attitude);
            // Either sign is the same attitude.
            (said - is).amax().min((said + is).amax())
        };
        let rate = |k: usize| (Vector3::from(plan.target.rate[k]) - nodes[k].rate).amax();
        if let Some(k) = (0..NODES).find(|k| !within(attitude(*k), ATTITUDE)) {
            found.add(&format!("target.attitude[{k}]"), format!("is off by {:.1e}", attitude(k)));
        }
        if let Some(k) = (0..NODES).find(|k| !within(rate(*k), RATE)) {
            found.add(&format!("target.rate[{k}]"), format!("is off by {:.1e} rad/s", rate(k)));
        }
    }
}

/// Distances; when they are smallest may hang on a rounding, and is not compared.
fn compare_clearances(said: &PlanClearances, is: &PlanClearances, found: &mut Findings) {
    for ((name, said), (_, is)) in said.named().into_iter().zip(is.named()) {
        let agree = match (said.distance_m, is.distance_m) {
            (Some(said), Some(is)) => within(said - is, DISTANCE),
            (said, is) => said == is,
        };
        if !agree {
            let number = |x: Option<f64>| x.map_or("nothing".into(), |x| format!("{x:.6}"));
            let reason = format!("says {}, is {}", number(said.distance_m), number(is.distance_m));
            found.add(&format!("clearances.{name}.distance_m"), reason);
        }
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
