//! Scenarios that no plan can serve: there is no path within the force limit.

use crate::formats::NamedScenario;
use crate::method::{Deadline, Method, Qp};
use crate::planning::{Planner, Subproblem};
use crate::request::{Guess, PlanRequest};
use crate::stoppable::{FAR_S, Stoppable};
use remora_core::advanced::model::Refusal;
use remora_core::advanced::planner::Report;
use remora_core::advanced::qp::QpStatus;
use remora_core::advanced::stages::NODES;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the force was refused, or Stage 1 did not get beyond its first program. That one is convex: dynamics, force limit,
/// both ends, and nothing else.
pub(super) fn is_without_path(report: &Report) -> bool {
    let outcome = &report.translation.outcome;
    matches!(report.refusal, Some(Refusal::Force { .. }))
        || (outcome.iterations == 1 && outcome.violation == f64::INFINITY)
}

/// Whether that program is infeasible: because the planner refuses the force before it solves
/// anything, or by a certificate of Clarabel's, for the embedded solver may end without one. The
/// plan ends with the program.
pub(super) fn is_proved(
    planner: &mut Planner,
    request: PlanRequest,
    scenario: &NamedScenario,
) -> bool {
    let (mission, method) = (&request.mission, request.method);
    // The planner refuses a force that is too small, so that there may be no program to look at.
    let needs = mission.needs::<NODES>(&scenario.scenario(), method.integrator);
    if needs.is_ok_and(|needs| needs.force > 1.01 * mission.servicer.force_limit_n.max()) {
        return true;
    }
    let is_over = AtomicBool::new(false);
    let mut first = None;
    let mut watch = |solve: Subproblem<'_>| {
        first.get_or_insert(solve.outcome.status);
        is_over.store(true, Ordering::Relaxed);
    };
    let deadline = Deadline::try_from(FAR_S).ok();
    let method = Method { qp: Qp::Clarabel, deadline, ..method };
    let request = PlanRequest { method, guess: Guess::Heuristic, ..request };
    planner.plan_watched(&Stoppable::new(&is_over), &request, scenario, &mut watch);
    first == Some(QpStatus::Infeasible)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::draw_one;
    use crate::memory::on_large_stack;

    #[test]
    fn a_force_that_is_too_small_is_proved_to_be() {
        let is_out_of_reach = |force: f64| {
            let mut request = PlanRequest::default();
            request.mission.approach.duration_s = 120.0;
            request.mission.scenarios.standoff_m = 30.0;
            request.mission.servicer.force_limit_n.fill(force);
            let scenario = draw_one(1, 0, &request.mission).unwrap();
            on_large_stack(|| is_proved(&mut Planner::new(), request, &scenario)).unwrap()
        };
        // From rest to rest 25 m in 120 s take 530 kg at least 3.7 N in one direction.
        assert!(is_out_of_reach(1.0));
        assert!(!is_out_of_reach(20.0));
    }
}
