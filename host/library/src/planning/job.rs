//! Plans that are made and written, and scenarios that are refused before.

use super::planner::{PlanOutcome, Planner};
use crate::error::Error;
use crate::formats::{self, Mission, NamedScenario};
use crate::learned::Learned;
use crate::memory::on_large_stack;
use crate::method::Method;
use crate::threads::Threads;
use remora_core::advanced::model::Refusal;
use remora_core::advanced::stages::NODES;
use std::path::PathBuf;

/// Reason why a scenario cannot be planned, as far as that is known before planning.
///
/// # Errors
/// A scenario that is no input at all, by its id.
pub fn refusal(
    mission: &Mission,
    scenario: &NamedScenario,
    method: &Method,
) -> Result<Option<Refusal>, Error> {
    scenario.check_joints(mission.joints()).map_err(|error| {
        let reason = format!("{}: {}", error.field, error.reason);
        Error::Scenario { id: scenario.id.clone(), reason }
    })?;
    match mission.check::<NODES>(&scenario.scenario(), method.integrator) {
        Ok(()) => Ok(None),
        Err(refusal) if refusal.is_invalid_input() => {
            Err(Error::Scenario { id: scenario.id.clone(), reason: refusal.to_string() })
        }
        Err(refusal) => Ok(Some(refusal)),
    }
}

/// One plan to be made and written: the input of `remora plan`.
#[derive(Clone, Debug)]
pub struct PlanJob {
    /// The scenario.
    pub scenario: NamedScenario,
    /// The mission; valid.
    pub mission: Mission,
    /// How to plan.
    pub method: Method,
    /// Model of a learned start; none is the heuristic.
    pub model: Option<Learned>,
    /// How many threads work on it; the plan stays the same.
    pub threads: Threads,
    /// Whether planning holds constant data against checksums; the plan stays the same.
    pub is_scrubbed: bool,
    /// Where to write the plan.
    pub out: PathBuf,
}

impl PlanJob {
    /// Reason why the plan is impossible, if it is; then there is nothing to run.
    ///
    /// # Errors
    /// A scenario that is no input at all.
    pub fn refusal(&self) -> Result<Option<Refusal>, Error> {
        refusal(&self.mission, &self.scenario, &self.method)
    }

    /// Makes the plan and writes its file, whatever its status, and its evidence beside it; nothing of a plan
    /// that was refused because something was damaged.
    ///
    /// # Errors
    /// Where a file cannot be written; that is found out before planning.
    pub fn run(&self) -> Result<PlanOutcome, Error> {
        self.check_writable()?;
        let planned = self.plan()?;
        self.write(&planned)?;
        Ok(planned)
    }

    /// Finds out before planning whether plan and evidence could be written.
    ///
    /// # Errors
    /// The file that cannot be, with the reason.
    pub fn check_writable(&self) -> Result<(), Error> {
        formats::check_writable(&self.out)?;
        formats::check_writable(&formats::evidence_path(&self.out))
    }

    /// Writes what [`Self::plan`] made, as [`Self::run`] does.
    ///
    /// # Errors
    /// The file that cannot be written, with the reason; then neither is.
    pub fn write(&self, planned: &PlanOutcome) -> Result<(), Error> {
        match planned.refusal {
            Some(_) => Ok(()),
            None => planned.evidence.write_with(&planned.file, &self.out),
        }
    }

    /// Makes the plan and writes nothing.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn plan(&self) -> Result<PlanOutcome, Error> {
        on_large_stack(|| {
            let planner = Planner::new().with_threads(self.threads);
            let mut planner = planner.scrubbing(self.is_scrubbed);
            planner.plan(&self.mission, &self.scenario, &self.method, self.model.as_ref())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::draw;
    use crate::formats::{ScenarioSet, Verdict};
    use crate::method::Integrator;

    #[test]
    fn nothing_that_can_be_planned_is_refused() {
        let mission = Mission::default();
        let public = ScenarioSet::built_in().unwrap().scenarios;
        let drawn = draw(300, 1, &mission).unwrap().scenarios;
        for integrator in [Integrator::Euler, Integrator::RK4] {
            let method = Method { integrator, ..Method::default() };
            for scenario in public.iter().chain(&drawn) {
                let refusal = refusal(&mission, scenario, &method).unwrap();
                assert_eq!(refusal, None, "{}", scenario.id);
            }
        }
    }

    /// Missions a little beyond a bound are refused, and the planner does not solve them either.
    #[test]
    fn what_is_refused_is_not_solved() {
        let scenario = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let euler = Method { integrator: Integrator::Euler, ..Method::default() };
        let integrator = euler.integrator;
        let needs = Mission::default().needs::<NODES>(&scenario.scenario(), integrator).unwrap();
        let time =
            Mission::default().time_to_preset(euler.integrator, &Mission::default().own_grid());
        let travel = 0.877_268_9;
        type Change<'a> = &'a dyn Fn(&mut Mission);
        let cases: [(&str, Change<'_>); 4] = [
            ("joint_rate", &|m| m.servicer.joint_rate_limit_rad_s.fill(0.98 * travel / time)),
            ("force", &|m| m.servicer.force_limit_n.fill(0.98 * needs.force)),
            ("keep_out", &|m| m.approach.keep_out_far_m = 9.0),
            // Angles that the pointing tolerance lets pass are not refused.
            ("field_of_view", &|m| {
                m.approach.field_of_view_half_angle_rad = 1e-3;
                m.tolerances.pointing = 1e-9;
            }),
        ];
        for (name, change) in cases {
            let mut mission = Mission::default();
            change(&mut mission);
            let refusal = refusal(&mission, &scenario, &euler).unwrap().expect(name);
            assert!([name, "capture_view"].contains(&refusal.name()), "{refusal}");
            let plan = || Planner::new().plan(&mission, &scenario, &euler, None);
            let planned = on_large_stack(plan).unwrap();
            assert_eq!(planned.file.verdict, Some(Verdict::NotFlyable), "{refusal}");
            assert!(planned.reason.is_some());
        }
    }
}
