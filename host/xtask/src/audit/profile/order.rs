//! Measurements and their order.

use remora_host::method::{Integrator, Method, Mode, Qp, WarmStart};
use serde::{Deserialize, Serialize};

/// One way to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Configuration {
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Start of Stage 2: the heuristic or the model.
    pub warm_start: WarmStart,
    /// Optimality or feasibility.
    pub mode: Mode,
}

impl Configuration {
    /// All of them: both integrators, both starts, both modes.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for integrator in [Integrator::Euler, Integrator::RK4] {
            for mode in [Mode::Optimal, Mode::Feasible] {
                for warm_start in [WarmStart::Heuristic, WarmStart::Model] {
                    all.push(Self { integrator, warm_start, mode });
                }
            }
        }
        all
    }

    /// Its name, such as `euler-optimal-model`.
    pub fn name(&self) -> String {
        format!("{}-{}-{}", self.integrator, self.mode.name(), self.warm_start.name())
    }

    /// The method it stands for.
    pub fn method(&self) -> Method {
        let Self { integrator, warm_start, mode } = *self;
        Method { mode, warm_start, qp: Qp::Embedded, integrator, ..Method::default() }
    }
}

/// How a configuration is put to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// One plan on the first core, the second left alone.
    OneCore,
    /// One plan, its linearisations shared between both cores.
    TwoCores,
    /// One plan on each core at the same time, both of one scenario.
    TwoPlans,
    /// One plan on the first core by a clock that counts instructions.
    Counted,
}

impl Case {
    /// All of them, in the order in which they take turns.
    pub const ALL: [Self; 4] = [Self::OneCore, Self::TwoCores, Self::TwoPlans, Self::Counted];
}

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// Round of the campaign.
    pub round: usize,
    /// Scenario, by its place in the set.
    pub scenario: usize,
    /// Configuration, by its place among those profiled.
    pub configuration: usize,
    /// How it is put to work.
    pub case: Case,
}

/// How often every scenario is planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rounds {
    /// With Euler on one core.
    pub euler: usize,
    /// With Euler in the cases of two cores.
    pub euler_second_core: usize,
    /// With RK4.
    pub rk4: usize,
}

impl Rounds {
    /// Rounds by default: with the 60 built-in scenarios a configuration of Euler is measured a
    /// thousand times on one core, and all takes less than four minutes.
    pub const DEFAULT: Self = Self::of(17);

    /// Rounds with Euler on one core, a quarter as many on two. RK4's plans take long and get
    /// a ninth. Parts of rounds are rounds.
    pub const fn of(euler: usize) -> Self {
        Self { euler, euler_second_core: euler.div_ceil(4), rk4: euler.div_ceil(9) }
    }

    /// Rounds in all.
    fn all(self) -> usize {
        self.euler.max(self.euler_second_core).max(self.rk4)
    }

    /// Whether a case takes part in a round. Those with fewer rounds than there are have them
    /// evenly spread, the first being the first. Instructions are counted once: they hardly vary.
    fn has(self, integrator: Integrator, case: Case, round: usize) -> bool {
        let own = match (integrator == Integrator::Euler, case) {
            (_, Case::Counted) => return round == 0,
            (true, Case::OneCore) => self.euler,
            (true, _) => self.euler_second_core,
            (false, _) => self.rk4,
        };
        round * own % self.all().max(1) < own
    }
}

/// All measurements in order: scenario by scenario every configuration takes its turn in every
/// case, then the next scenario, then the next round. Without a counter nothing `is_counted`.
pub(super) fn order(
    configurations: &[Configuration],
    scenarios: usize,
    rounds: Rounds,
    is_counted: bool,
) -> Vec<Job> {
    let mut jobs = Vec::new();
    for round in 0..rounds.all() {
        for scenario in 0..scenarios {
            for (number, configuration) in configurations.iter().enumerate() {
                let is_due = |case: &Case| {
                    (is_counted || *case != Case::Counted)
                        && rounds.has(configuration.integrator, *case, round)
                };
                let job = |case| Job { round, scenario, configuration: number, case };
                jobs.extend(Case::ALL.into_iter().filter(is_due).map(job));
            }
        }
    }
    jobs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_configurations_have_names_of_their_own() {
        let names: Vec<String> = Configuration::all().iter().map(Configuration::name).collect();
        assert_eq!(names.len(), 8);
        assert_eq!(names[0], "euler-optimal-heuristic");
        assert_eq!(names[7], "rk4-feasible-model");
        let unique: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(unique.len(), 8);
    }

    #[test]
    fn configurations_take_turns_scenario_by_scenario() {
        let all = Configuration::all();
        let two = [all[0], all[1]];
        let jobs = order(&two, 2, Rounds { euler: 2, euler_second_core: 2, rk4: 1 }, false);
        let turn: Vec<_> = jobs.iter().map(|job| (job.configuration, job.case)).collect();
        let expected = [
            (0, Case::OneCore),
            (0, Case::TwoCores),
            (0, Case::TwoPlans),
            (1, Case::OneCore),
            (1, Case::TwoCores),
            (1, Case::TwoPlans),
        ];
        assert_eq!(turn, [expected; 4].concat());
        let when: Vec<_> = jobs.iter().step_by(6).map(|job| (job.round, job.scenario)).collect();
        assert_eq!(when, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    }

    #[test]
    fn some_have_fewer_rounds_and_instructions_are_counted_once() {
        let all = Configuration::all();
        let jobs = order(&all, 3, Rounds { euler: 4, euler_second_core: 2, rk4: 1 }, true);
        let count = |case| {
            let is_euler = |job: &&&Job| all[job.configuration].integrator == Integrator::Euler;
            let jobs: Vec<&Job> = jobs.iter().filter(|job| job.case == case).collect();
            let euler = jobs.iter().filter(is_euler).count();
            (euler, jobs.len() - euler)
        };
        assert_eq!(Case::ALL.map(count), [(48, 12), (24, 12), (24, 12), (12, 12)]);
    }

    #[test]
    fn fewer_rounds_are_evenly_spread() {
        let due = |integrator, case| {
            let is_due = |round: &usize| Rounds::DEFAULT.has(integrator, case, *round);
            (0..Rounds::DEFAULT.all()).filter(is_due).collect::<Vec<_>>()
        };
        assert_eq!(due(Integrator::Euler, Case::OneCore).len(), 17);
        assert_eq!(due(Integrator::Euler, Case::TwoCores), [0, 4, 7, 11, 14]);
        assert_eq!(due(Integrator::RK4, Case::TwoPlans), [0, 9]);
        assert_eq!(due(Integrator::RK4, Case::Counted), [0]);
        assert_eq!(Rounds::of(1), Rounds { euler: 1, euler_second_core: 1, rk4: 1 });
    }
}
