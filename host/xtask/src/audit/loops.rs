//! Loops whose length depends on data: their bounds, and how far plans go towards them.

use remora_core::advanced::bounds::LOOPS;
use remora_host::error::Error;
use remora_host::formats::{Mission, NamedScenario};
use remora_host::method::{Integrator, Method, Qp, WarmStart};
use remora_host::planning::{Planner, Subproblem, WallClock};
use remora_host::pool;
use remora_host::progress::Progress;
use remora_host::report::{Page, Table};
use remora_host::request::PlanRequest;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// The most turns that plans of a corpus took.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Loops {
    /// A row a way of planning.
    pub observed: Vec<Observed>,
}

/// The most turns with one way of planning.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Observed {
    /// Integrator and start.
    pub method: String,
    /// Plans looked at.
    pub plans: u64,
    /// Most iterations of Stage 1, its start's subproblem counted.
    pub stage1_iterations: u64,
    /// Most iterations of Stage 2, those of both tries together.
    pub stage2_iterations: u64,
    /// The scenario of that.
    pub hardest: String,
    /// Most corrections in an iteration.
    pub corrections: u64,
    /// Most iterations of the solver a subproblem.
    pub solver_iterations: u64,
}

/// Methods of planning: every integrator from every start.
const METHODS: [(Integrator, WarmStart); 4] = [
    (Integrator::Euler, WarmStart::Heuristic),
    (Integrator::Euler, WarmStart::Model),
    (Integrator::RK4, WarmStart::Heuristic),
    (Integrator::RK4, WarmStart::Model),
];

impl Loops {
    /// Plans every scenario in every way. The result does not depend on the machine.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn observe(
        scenarios: &[NamedScenario],
        mission: &Mission,
        jobs: NonZeroUsize,
        progress: &mut dyn Progress,
    ) -> Result<Self, Error> {
        let mut observed = METHODS.map(|(integrator, start)| Observed {
            method: format!("{integrator}, {}", start.name()),
            ..Observed::default()
        });
        let scenario_and_method = |i: usize| (&scenarios[i / METHODS.len()], i % METHODS.len());
        let all: Vec<usize> = (0..scenarios.len() * METHODS.len()).collect();
        progress.begin(all.len(), 0);
        let plan = |planner: &mut Planner, i: usize| {
            let (scenario, method) = scenario_and_method(i);
            one(planner, mission, scenario, METHODS[method])
        };
        let finish = |i: usize, one: Observed| {
            progress.done(true);
            observed[scenario_and_method(i).1].add(one);
            Ok(())
        };
        let outcome = pool::plan_all(jobs, &all, plan, finish);
        progress.end();
        outcome.map(|()| Self { observed: observed.into() })
    }

    /// The section: bounds from the code's constants, and turns that were observed.
    pub fn page(&self) -> Page {
        let mut page = Page::new("loops", "Loops");
        page.text(
            "These loops depend on data, outermost first. All others run over arrays whose size is part of their \
             type. Brackets hold the bound for any settings, where it differs from that for the default ones. A \
             test compares the table, `remora_core::advanced::bounds::LOOPS`, with the code. Stage 2 runs at \
             most twice a try; all tries share `max_iterations`.",
        );
        page.table(bounds());
        page.heading("Observed turns")
            .text("The largest counts over public and hard scenarios. An observation is no bound.");
        page.table(self.table());
        page
    }

    /// Table of the observations.
    pub fn table(&self) -> Table {
        let mut table = Table::new(
            "method | >Stage 1 iterations | >Stage 2 iterations | of | >corrections | >solver iterations",
        );
        for row in &self.observed {
            table.row([
                row.method.clone(),
                row.stage1_iterations.to_string(),
                row.stage2_iterations.to_string(),
                row.hardest.clone(),
                row.corrections.to_string(),
                row.solver_iterations.to_string(),
            ]);
        }
        table
    }
}

impl Observed {
    /// Takes the larger of both; of equals the scenario that comes first by its name, so that the
    /// order of the workers does not matter.
    fn add(&mut self, one: Self) {
        self.plans += one.plans;
        self.stage1_iterations = self.stage1_iterations.max(one.stage1_iterations);
        self.corrections = self.corrections.max(one.corrections);
        self.solver_iterations = self.solver_iterations.max(one.solver_iterations);
        let harder = one.stage2_iterations > self.stage2_iterations
            || (one.stage2_iterations == self.stage2_iterations && one.hardest < self.hardest);
        if harder || self.hardest.is_empty() {
            self.stage2_iterations = one.stage2_iterations;
            self.hardest = one.hardest;
        }
    }
}

/// The turns of one plan.
fn one(
    planner: &mut Planner,
    mission: &Mission,
    scenario: &NamedScenario,
    (integrator, warm_start): (Integrator, WarmStart),
) -> Result<Observed, Error> {
    let method = Method { warm_start, integrator, qp: Qp::Embedded, ..Method::default() };
    let request = PlanRequest::new(*mission, method, None)?;
    let mut solver_iterations = 0;
    let mut watch = |solve: Subproblem<'_>| {
        solver_iterations = solver_iterations.max(u64::from(solve.outcome.iterations));
    };
    let planned = planner.plan_watched(&WallClock::start(), &request, scenario, &mut watch);
    let corrections = planned.logs.iter().flatten().map(|record| u64::from(record.corrections));
    Ok(Observed {
        method: String::new(),
        plans: 1,
        stage1_iterations: planned.file.stage1.iterations,
        stage2_iterations: planned.file.stage2.iterations,
        hardest: scenario.id.clone(),
        corrections: corrections.max().unwrap_or(0),
        solver_iterations,
    })
}

/// The bounds that the code has.
fn bounds() -> Table {
    let mut table = Table::new("loop | >most turns");
    let bound = |bound: Option<u64>| bound.map_or("argument".into(), |turns| turns.to_string());
    for row in &LOOPS {
        let turns = match row.default == row.most {
            true => bound(row.most),
            false => format!("{} ({})", bound(row.default), bound(row.most)),
        };
        table.row([row.name.into(), turns]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::formats::ScenarioSet;

    #[test]
    fn what_is_observed_is_within_the_bounds_whoever_plans() {
        let scenarios = &ScenarioSet::built_in().unwrap().scenarios[..2];
        let observe = |jobs: usize| {
            let jobs = NonZeroUsize::new(jobs).unwrap();
            Loops::observe(scenarios, &Mission::default(), jobs, &mut ()).unwrap()
        };
        let loops = observe(1);
        assert_eq!(loops, observe(2));
        let bound = |name: &str| {
            let row = LOOPS.iter().find(|row| row.name == name).unwrap();
            row.default.unwrap()
        };
        for row in &loops.observed {
            assert_eq!(row.plans, 2);
            assert!((1..=2 * bound("iterations")).contains(&row.stage2_iterations), "{row:?}");
            assert!(row.corrections <= bound("corrections"), "{row:?}");
            assert!((1..=bound("solver_iterations")).contains(&row.solver_iterations), "{row:?}");
        }
        let page = loops.page().markdown();
        assert!(
            page.contains("## Observed turns") && page.contains("| solver_iterations |"),
            "{page}"
        );
    }
}
