//! The planner of the host: one plan after the other.

use super::PlanOutcome;
use crate::approach::Approach;
use crate::engine::{AnyArmEngine, ArmSubproblem, Build, DefaultArmEngine, Engine};
use crate::formats::NamedScenario;
use crate::memory::on_heap;
use crate::request::PlanRequest;
use remora_core::advanced::model::Refusal;
use remora_core::advanced::planner::Report;
use remora_core::advanced::stages::{LINKS, size};
use remora_core::advanced::time::Clock;
use std::time::Instant;

/// The clock of a desktop: seconds since it was made.
#[derive(Clone, Copy, Debug)]
pub struct WallClock(Instant);

impl WallClock {
    /// A clock that starts now.
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for WallClock {
    fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// One subproblem of a plan for the built-in mission's arm with its solver's answer.
pub type Subproblem<'a> = ArmSubproblem<'a, { size::NX }, { size::NU }>;

/// A planner with its memory, for one plan after the other and arms of one to seven joints.
#[derive(Default)]
pub struct Planner {
    usual: DefaultArmEngine,
    /// For arms of other numbers of joints, once there was one.
    roomy: Option<Box<AnyArmEngine>>,
}

impl Planner {
    /// A planner that has planned nothing yet. To be called with [`STACK_BYTES`](crate::memory::STACK_BYTES) of stack.
    pub fn new() -> Self {
        Self::default()
    }

    /// Plans one scenario. The result does not depend on what was planned before.
    ///
    /// Where the status is other than solved, the file holds the best iterate.
    pub fn plan(&mut self, request: &PlanRequest, scenario: &NamedScenario) -> PlanOutcome {
        self.plan_by(&WallClock::start(), request, scenario)
    }

    /// Plans by another clock, which may count what it likes, and end the plan's time when it
    /// likes. The first it is asked is when the plan begins.
    pub fn plan_by(
        &mut self,
        clock: &dyn Clock,
        request: &PlanRequest,
        scenario: &NamedScenario,
    ) -> PlanOutcome {
        match request.mission.joints() {
            LINKS => PlanOutcome::make(&mut self.usual, clock, request, scenario, &mut |_| ()),
            _ => PlanOutcome::make(self.room(), clock, request, scenario, &mut |_| ()),
        }
    }

    /// Plans for the built-in mission's arm by another clock; `watch` sees each subproblem once it is
    /// solved.
    ///
    /// # Panics
    /// An arm of another number of joints: callers refuse it before.
    pub fn plan_watched(
        &mut self,
        clock: &dyn Clock,
        request: &PlanRequest,
        scenario: &NamedScenario,
        watch: &mut dyn FnMut(Subproblem<'_>),
    ) -> PlanOutcome {
        let joints = request.mission.joints();
        assert_eq!(joints, LINKS, "subproblems are watched for the built-in arm alone");
        PlanOutcome::make(&mut self.usual, clock, request, scenario, watch)
    }

    /// Plans and leaves the plan where it is: what flies, and nothing else. No memory is asked for
    /// once the embedded solver has planned by the same method before.
    pub fn plan_in_place(&mut self, request: &PlanRequest, scenario: &NamedScenario) -> Report {
        let (clock, scenario) = (&WallClock::start(), &scenario.scenario());
        match request.mission.joints() {
            LINKS => self.usual.run(clock, request, scenario, &mut |_| ()),
            _ => self.room().run(clock, request, scenario, &mut |_| ()),
        }
    }

    /// Plans Stage 1 alone: the approach as a guess of Stage 2 sees it.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    pub fn approach(
        &mut self,
        request: &PlanRequest,
        scenario: &NamedScenario,
    ) -> Result<Approach, Refusal> {
        match request.mission.joints() {
            LINKS => Approach::plan(&mut self.usual, request, scenario.scenario()),
            _ => Approach::plan(self.room(), request, scenario.scenario()),
        }
    }

    /// The engine with room for any arm, made where there was no need of it yet.
    fn room(&mut self) -> &mut AnyArmEngine {
        self.roomy.get_or_insert_with(|| on_heap(Engine::default))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::draw;
    use crate::formats::{Mission, ScenarioSet, Verdict};
    use crate::memory::on_large_stack;
    use crate::method::{Integrator, Method};
    use remora_core::advanced::stages::NODES;

    #[test]
    fn nothing_that_can_be_planned_is_refused() {
        let mission = Mission::default();
        let public = ScenarioSet::built_in().unwrap().scenarios;
        let drawn = draw(300, 1, &mission).unwrap().scenarios;
        for integrator in [Integrator::Euler, Integrator::RK4] {
            let method = Method { integrator, ..Method::default() };
            let request = PlanRequest { mission, method, ..PlanRequest::default() };
            for scenario in public.iter().chain(&drawn) {
                assert_eq!(request.refusal(scenario).unwrap(), None, "{}", scenario.id);
            }
        }
    }

    /// Missions a little beyond a bound are refused, and the planner does not solve them either.
    #[test]
    fn what_is_refused_is_not_solved() {
        let scenario = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let integrator = Integrator::Euler;
        let method = Method { integrator, ..Method::default() };
        let needs = Mission::default().needs::<NODES>(&scenario.scenario(), integrator).unwrap();
        let time = Mission::default().time_to_preset(integrator, &Mission::default().own_grid());
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
            let mut request = PlanRequest { method, ..PlanRequest::default() };
            change(&mut request.mission);
            let refusal = request.refusal(&scenario).unwrap().expect(name);
            assert!([name, "capture_view"].contains(&refusal.name()), "{refusal}");
            let planned = on_large_stack(|| Planner::new().plan(&request, &scenario)).unwrap();
            assert_eq!(planned.file.verdict, Some(Verdict::NotFlyable), "{refusal}");
            assert!(planned.reason.is_some());
        }
    }
}
