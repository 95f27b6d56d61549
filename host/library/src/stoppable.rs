//! A clock by which plans are stopped. At the flag their deadline passes: a plan ends within the
//! longest piece of work that is not interrupted, an iteration of the solver, a linearisation or the
//! model's rollout. The core needs no other means.

use crate::method::Deadline;
use crate::planning::WallClock;
use remora_core::advanced::time::Clock;
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// A deadline that only a clock that was stopped reaches [s].
pub const FAR_S: f64 = Deadline::FAR.seconds();

/// A wall clock that runs away once its flag is set: each reading is farther from the one before
/// than any deadline, so that one that was set before passes, and so does one that is set after,
/// whatever else is timed first.
pub struct Stoppable<F> {
    clock: WallClock,
    is_stopped: F,
    /// Readings since the flag was set.
    since: AtomicU32,
}

impl<F> Stoppable<F> {
    /// A clock that begins now; the flag may be borrowed or shared.
    pub fn new(is_stopped: F) -> Self {
        Self { clock: WallClock::start(), is_stopped, since: AtomicU32::new(0) }
    }
}

impl<F: Deref<Target = AtomicBool> + Sync> Clock for Stoppable<F> {
    fn seconds(&self) -> f64 {
        if !self.is_stopped.load(Ordering::Relaxed) {
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
    use crate::method::{Integrator, Method};
    use crate::planning::Planner;
    use crate::request::PlanRequest;
    use remora_core::advanced::time::Deadline as CoreDeadline;

    #[test]
    fn a_stopped_clock_ends_a_plan_that_has_begun_and_one_that_begins() {
        let is_stopped = AtomicBool::new(false);
        let clock = Stoppable::new(&is_stopped);
        let deadline = CoreDeadline::after(&clock, FAR_S);
        assert!(!deadline.has_passed());
        is_stopped.store(true, Ordering::Relaxed);
        assert!(deadline.has_passed());
        let late = Stoppable::new(&is_stopped);
        // Plans look at the clock before they set their deadline, too.
        assert!(late.seconds() < late.seconds());
        assert!(CoreDeadline::after(&late, FAR_S).has_passed());

        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let method = Method {
            integrator: Integrator::Euler,
            deadline: Deadline::try_from(FAR_S).ok(),
            ..Method::default()
        };
        let stopped = PlanRequest { method, ..PlanRequest::default() };
        let planned = on_large_stack(|| {
            Planner::new().plan_by(&Stoppable::new(&is_stopped), &stopped, scenario)
        });
        let planned = planned.unwrap();
        assert_eq!(planned.file.status, Status::Deadline);
        assert_eq!(planned.file.stage2.iterations, 0);
    }
}
