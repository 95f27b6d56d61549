//! Plans of any number of nodes, over any time: the number is data, the memory is the same.

use remora_core::advanced::executor::Sequential;
use remora_core::advanced::model::{Integrator, MIN_NODES, Mission, Scenario};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::stages::{Mode, NODES, ReorientationTrajectory, TranslationTrajectory};
use remora_core::prelude::Status;
use remora_host::formats::ScenarioSet;
use remora_host::memory::on_heap;
use remora_host::planning::WallClock;

const RK4: Integrator = Integrator::Rk4 { substeps: 4 };

struct Bench {
    workspace: Box<Workspace>,
    solver: Box<EmbeddedSolver>,
}

impl Bench {
    fn new() -> Self {
        Self { workspace: on_heap(Workspace::new), solver: on_heap(EmbeddedSolver::new) }
    }

    fn plan(&mut self, mission: &Mission<3>, scenario: &Scenario, of: Integrator) -> Report {
        let settings = PlanSettings::new(Mode::Optimal, of);
        let platform = Platform { clock: &WallClock::start(), executor: &Sequential };
        let options = Options::from_parts(settings, InitialGuess::Heuristic, platform);
        plan(mission, scenario, &options, &mut *self.solver, &mut self.workspace)
    }
}

/// A public scenario with another horizon.
fn scenario(k: usize, duration: f64, nodes: usize) -> Scenario {
    let scenario = ScenarioSet::built_in().unwrap().scenarios[k].scenario().resized();
    Scenario { duration: Some(duration), nodes: Some(nodes), ..scenario }
}

// Verifies REM-PLN-019.
#[test]
fn horizons_of_any_length_and_number_of_nodes_are_planned() {
    let (mission, mut bench) = (Mission::default(), Bench::new());
    for integrator in [Integrator::Euler, RK4] {
        for (duration, nodes) in
            [(480.0, 20), (600.0, 30), (600.0, 20), (1200.0, 20), (1200.0, 41), (2400.0, 60)]
        {
            for k in [0, 17, 35] {
                let scenario = scenario(k, duration, nodes);
                let report = bench.plan(&mission, &scenario, integrator);
                let place = format!("{k}: {duration} s, {nodes} nodes, {integrator}");
                assert!(report.is_verified(), "{place}: {:?}", report.residuals);
                let two = bench.workspace.reorientation();
                assert!(two.states[nodes - 1].rate.norm() > 0.0, "{place}");
                assert_eq!(
                    two.states[nodes..],
                    ReorientationTrajectory::<NODES, 3>::ZERO.states[nodes..]
                );
                let one = bench.workspace.translation();
                assert_eq!(
                    one.position[nodes..],
                    TranslationTrajectory::<NODES>::ZERO.position[nodes..]
                );
            }
        }
    }
}

/// Nothing of a longer plan is left where a shorter one is made.
// Verifies REM-PLN-019.
#[test]
fn what_was_planned_before_changes_no_bit_of_a_shorter_plan() {
    let mission = Mission::default();
    for integrator in [Integrator::Euler, RK4] {
        let short = scenario(3, 600.0, 24);
        let mut fresh = Bench::new();
        let alone = fresh.plan(&mission, &short, integrator).record;
        let mut used = Bench::new();
        used.plan(&mission, &scenario(4, 1200.0, NODES), integrator);
        let after = used.plan(&mission, &short, integrator).record;
        assert_eq!(alone, after);
        assert_eq!(fresh.workspace.translation(), used.workspace.translation());
        assert_eq!(fresh.workspace.reorientation(), used.workspace.reorientation());
    }
}

/// The mission's number of nodes and the scenario's mean the same.
#[test]
fn nodes_are_the_missions_unless_the_scenario_gives_them() {
    let (mut mission, mut bench) = (Mission::default(), Bench::new());
    let given = Scenario { duration: None, ..scenario(5, 1200.0, 30) };
    bench.plan(&mission, &given, Integrator::Euler);
    let by_scenario = *bench.workspace.reorientation();
    mission.approach.nodes = 30;
    bench.plan(&mission, &Scenario { nodes: None, ..given }, Integrator::Euler);
    assert_eq!(by_scenario, *bench.workspace.reorientation());
}

// Verifies REM-PLN-019.
#[test]
fn too_few_nodes_and_more_than_there_is_room_for_are_refused() {
    let (mission, mut bench) = (Mission::default(), Bench::new());
    for nodes in [0, 1, MIN_NODES - 1, NODES + 1, usize::MAX] {
        let report = bench.plan(&mission, &scenario(0, 1200.0, nodes), Integrator::Euler);
        let refusal = report.refusal.unwrap();
        assert_eq!((report.status, refusal.name()), (Status::Infeasible, "nodes"));
        assert!(refusal.is_invalid_input());
        let text = refusal.to_string();
        assert!(text.ends_with(&format!("from {MIN_NODES} to {NODES}")), "{text}");
    }
}
