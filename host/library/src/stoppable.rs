//! Two starts at once: the heuristic on one core, the model on the other, and the first plan that
//! is solved wins.
//!
//! The other is told to stop by its clock, at which its deadline then passes: it ends within the
//! longest piece of work that is not interrupted, an iteration of the solver, a linearisation or
//! the model's roll-out. What is asked of the core is nothing new.

use crate::formats::NamedScenario;
use crate::learned::Learned;
use crate::method::{Deadline, Method, WarmStart};
use crate::planning::{Planned, Planner, WallClock};
use crate::threads::Threads;
use remora_core::advanced::executor::ForkJoin;
use remora_core::advanced::model::Mission;
use remora_core::advanced::time::Clock;
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Instant;

/// A deadline that only a clock that was stopped reaches [s].
pub const FAR_S: f64 = Deadline::FAR.seconds();

/// Two planners with their memory.
#[derive(Default)]
pub struct Portfolio {
    heuristic: Planner,
    model: Planner,
}

/// What came of the two.
#[derive(Clone, Debug)]
pub struct Race {
    /// Whose plan it is: the one solved first; where none was, the one with the better status, or
    /// with the same status and the lower cost.
    pub winner: WarmStart,
    /// Whether that plan is solved: verified, and settled where that was asked for.
    pub is_won: bool,
    /// The plan, with the bits of a plan by that start alone under a deadline that does not strike.
    pub planned: Planned,
    /// When the heuristic's plan ended, solved or stopped [s].
    pub heuristic_s: f64,
    /// When the model's plan ended, solved or stopped [s].
    pub model_s: f64,
}

impl Race {
    /// When the plan was there [s].
    pub fn time_s(&self) -> f64 {
        match self.winner {
            WarmStart::Heuristic => self.heuristic_s,
            _ => self.model_s,
        }
    }

    /// How long the loser went on after the plan was there [s]; none where it had ended before.
    pub fn stop_s(&self) -> Option<f64> {
        let last = self.heuristic_s.max(self.model_s);
        (self.is_won && last > self.time_s()).then(|| last - self.time_s())
    }
}

impl Portfolio {
    /// A portfolio that has planned nothing yet. To be called with
    /// [`STACK_BYTES`](crate::memory::STACK_BYTES) of stack.
    pub fn new() -> Self {
        Self::default()
    }

    /// Plans one scenario from both starts, the heuristic on the calling thread and `model` on its
    /// helper. Where that cannot come in time the two are one after the other.
    ///
    /// The method's warm start is not looked at. Its deadline holds for both.
    pub fn plan<const NL: usize>(
        &mut self,
        mission: &Mission<NL>,
        scenario: &NamedScenario,
        method: &Method,
        model: &Learned,
    ) -> Race {
        let deadline = method.deadline.or(Deadline::try_from(FAR_S).ok());
        let (is_over, started) = (AtomicBool::new(false), Instant::now());
        let run = |planner: &mut Planner, warm_start, model: Option<&Learned>| {
            let method = Method { warm_start, deadline, ..*method };
            let clock = Stoppable::new(&is_over);
            let planned = planner.plan_by(&clock, mission, scenario, &method, model);
            let is_first = is_solved(&planned) && !is_over.swap(true, Ordering::Relaxed);
            (planned, is_first, started.elapsed().as_secs_f64())
        };
        let (first, second) = Threads::Two.join(
            || run(&mut self.heuristic, WarmStart::Heuristic, None),
            || run(&mut self.model, WarmStart::Model, Some(model)),
        );
        let ((heuristic, heuristic_won, heuristic_s), (model, model_won, model_s)) =
            (first, second);
        let is_won = heuristic_won || model_won;
        let (winner, planned) = match model_won || (!is_won && is_better(&model, &heuristic)) {
            true => (WarmStart::Model, model),
            false => (WarmStart::Heuristic, heuristic),
        };
        Race { winner, is_won, planned, heuristic_s, model_s }
    }
}

fn is_solved(planned: &Planned) -> bool {
    planned.file.status == crate::formats::Status::Solved
}

/// Whether `a` has the better verdict; or the same and the better status, or the same and the
/// lower cost.
fn is_better(a: &Planned, b: &Planned) -> bool {
    let rank = |planned: &Planned| (planned.file.verdict, planned.file.status);
    let (of_a, of_b) = (rank(a), rank(b));
    of_a < of_b || (of_a == of_b && a.file.stage2.cost < b.file.stage2.cost)
}

/// A wall clock that runs away once somebody has won: each reading is farther from the one before
/// than any deadline, so that one that was set before passes, and so does one that is set after,
/// whatever else is timed first.
pub struct Stoppable<F> {
    clock: WallClock,
    is_over: F,
    /// Readings since.
    since: AtomicU32,
}

impl<F> Stoppable<F> {
    /// A clock that begins now; the flag may be borrowed or shared.
    pub fn new(is_over: F) -> Self {
        Self { clock: WallClock::start(), is_over, since: AtomicU32::new(0) }
    }
}

impl<F: Deref<Target = AtomicBool> + Sync> Clock for Stoppable<F> {
    fn seconds(&self) -> f64 {
        if !self.is_over.load(Ordering::Relaxed) {
            return self.clock.seconds();
        }
        let before = self.since.fetch_add(1, Ordering::Relaxed);
        2.0 * FAR_S * (1.0 + f64::from(before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{ScenarioSet, Status};
    use crate::memory::on_large_stack;
    use crate::method::Integrator;
    use remora_core::advanced::time::Deadline as CoreDeadline;

    fn method() -> Method {
        Method { integrator: Integrator::Euler, ..Method::default() }
    }

    fn race(method: &Method, index: usize) -> (NamedScenario, Race) {
        let scenario = ScenarioSet::built_in().unwrap().scenarios[index].clone();
        let model = Learned::built_in(Integrator::Euler);
        let race = on_large_stack(|| {
            Portfolio::new().plan(&Mission::default(), &scenario, method, &model)
        });
        (scenario, race.unwrap())
    }

    #[test]
    fn the_winner_is_what_its_start_alone_would_be() {
        for index in 0..4 {
            let (scenario, race) = race(&method(), index);
            assert!(race.is_won);
            let deadline = Deadline::try_from(FAR_S).ok();
            let alone = Method { warm_start: race.winner, deadline, ..method() };
            let model = Learned::built_in(Integrator::Euler);
            let model = (race.winner == WarmStart::Model).then_some(&model);
            let planned = on_large_stack(|| {
                Planner::new().plan(&Mission::default(), &scenario, &alone, model)
            });
            assert_eq!(race.planned.evidence.output, planned.unwrap().evidence.output);
            assert!(race.time_s() > 0.0 && race.stop_s().is_none_or(|seconds| seconds > 0.0));
        }
    }

    #[test]
    fn where_both_fail_the_better_is_kept() {
        let deadline = Deadline::try_from(1e-9).ok();
        let (_, race) = race(&Method { deadline, ..method() }, 0);
        assert!(!race.is_won && race.stop_s().is_none());
        assert_eq!(race.planned.file.status, Status::Deadline);
        let mut worse = race.planned.clone();
        worse.file.stage2.cost += 1.0;
        assert!(is_better(&race.planned, &worse) && !is_better(&worse, &race.planned));
        worse.file.stage2.cost = -1.0;
        worse.file.status = Status::NumericalFailure;
        assert!(is_better(&race.planned, &worse) && !is_better(&worse, &race.planned));
        worse = race.planned.clone();
        worse.file.stage2.cost = f64::NAN;
        assert!(!is_better(&worse, &race.planned));
    }

    #[test]
    fn a_stopped_clock_ends_a_plan_that_has_begun_and_one_that_begins() {
        let is_over = AtomicBool::new(false);
        let clock = Stoppable::new(&is_over);
        let deadline = CoreDeadline::after(&clock, FAR_S);
        assert!(!deadline.has_passed());
        is_over.store(true, Ordering::Relaxed);
        assert!(deadline.has_passed());
        let late = Stoppable::new(&is_over);
        // Plans look at the clock before they set their deadline, too.
        assert!(late.seconds() < late.seconds());
        assert!(CoreDeadline::after(&late, FAR_S).has_passed());

        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let stopped = Method { deadline: Deadline::try_from(FAR_S).ok(), ..method() };
        let planned = on_large_stack(|| {
            let mission = Mission::default();
            let clock = Stoppable::new(&is_over);
            Planner::new().plan_by(&clock, &mission, scenario, &stopped, None)
        });
        let planned = planned.unwrap();
        assert_eq!(planned.file.status, Status::Deadline);
        assert_eq!(planned.file.stage2.iterations, 0);
    }
}
