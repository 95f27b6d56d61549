//! Checks of a plan's constants against their checksums between iterations.

use super::{InitialGuess, PlanSettings, Solver, input_checksum, record};
use crate::model::{Mission, Refusal, Scenario, Tolerances};
use crate::stages::{NODES, Verification, size::NG};
use nalgebra::SMatrix;
use remora_qp::kept::Kept;
use remora_qp::time::Deadline;
use remora_qp::{Checksum, Qp, QpOutcome, QpSolver, QpStatus, Solution};

/// Checksum of options, horizon and solver with their settings.
pub fn settings_checksum<S: Solver<NX, NU>, const NL: usize, const NX: usize, const NU: usize>(
    options: &PlanSettings,
    guess: &InitialGuess<'_, NL>,
    solver: &S,
) -> u64 {
    let mut sum = Checksum::new();
    record::add_options(&mut sum, options);
    guess.identify(&mut sum);
    solver.identify(&mut sum);
    sum.value()
}

/// Constants of a plan, and their checksums when the plan began.
#[derive(Clone, Copy)]
pub(super) struct Constants<'a, const NL: usize> {
    pub mission: &'a Mission<NL>,
    pub scenario: &'a Scenario<NL>,
    pub options: &'a PlanSettings,
    pub guess: &'a InitialGuess<'a, NL>,
    /// Of mission and scenario.
    pub input: u64,
    /// Of the rest.
    pub settings: u64,
}

/// A solver that holds constants against their checksums before it solves, where that is asked for.
pub(super) struct Scrubbed<'s, 'a, S, const NL: usize> {
    pub solver: &'s mut S,
    /// None where nothing is scrubbed.
    pub constants: Option<&'s Constants<'a, NL>>,
    /// Name of the part that was first found damaged.
    pub damaged: Option<&'static str>,
}

impl<'s, S, const NL: usize> Scrubbed<'s, '_, S, NL> {
    /// A solver without anything to scrub.
    pub fn off(solver: &'s mut S) -> Self {
        Self { solver, constants: None, damaged: None }
    }

    /// Whether anything is scrubbed.
    pub fn is_on(&self) -> bool {
        self.constants.is_some()
    }

    /// The refusal of a plan for what was found.
    pub fn refusal(&self) -> Option<Refusal> {
        self.damaged.map(|what| Refusal::Damaged { what })
    }

    /// Notes that something is not what it was.
    fn find(&mut self, is_damaged: bool, what: &'static str) {
        if is_damaged {
            self.damaged.get_or_insert(what);
        }
    }

    /// Holds two runs of the verifier on the same plan against each other. One that did not come to its end
    /// has found nothing.
    #[inline(never)]
    pub fn compare(
        &mut self,
        first: &Verification,
        second: &Verification,
        deadline: &Deadline<'_>,
    ) {
        self.find(sum(first) != sum(second) && !deadline.has_passed(), "verifier");
    }

    /// Holds the learned model against its checksum.
    #[inline(never)]
    pub fn look_at_model(&mut self) {
        let Some(&Constants { guess, .. }) = self.constants else { return };
        if let InitialGuess::Learned { policy, .. } = guess {
            self.find(!policy.is_intact(), "model");
        }
    }
}

/// Checksum of what the verifier found.
fn sum(found: &Verification) -> u64 {
    let Verification { residuals, clearances, arm } = found;
    let mut sum = Checksum::new();
    sum.numbers(&residuals.against(&Tolerances::default()).map(|(_, value, _)| value));
    let arm = [arm.links, arm.end_effector];
    for closest in clearances.named().into_iter().map(|(_, closest)| closest).chain(arm) {
        sum.numbers([&closest.distance, &closest.time_s]);
        sum.integer(closest.body.into());
    }
    sum.value()
}

impl<S, const NL: usize> Scrubbed<'_, '_, S, NL> {
    /// Holds mission, scenario and options against their checksums.
    // Not inlined, as what a plan without it does not need.
    #[inline(never)]
    pub fn look<const NX: usize, const NU: usize>(&mut self)
    where
        S: Solver<NX, NU>,
    {
        let Some(&Constants { mission, scenario, options, guess, input, settings }) =
            self.constants
        else {
            return;
        };
        self.find(input_checksum(mission, scenario) != input, "mission or scenario");
        let now = settings_checksum(options, guess, &*self.solver);
        self.find(now != settings, "options, guess or solver");
    }
}

impl<S: Solver<NX, NU>, const NL: usize, const NX: usize, const NU: usize>
    QpSolver<NODES, NX, NU, NG> for Scrubbed<'_, '_, S, NL>
{
    fn reset(&mut self) {
        self.look_at_model();
        self.solver.reset();
    }

    fn solve(
        &mut self,
        qp: &Qp<NODES, NX, NU, NG>,
        solution: &mut Solution<NODES, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.look::<NX, NU>();
        if self.damaged.is_some() {
            return QpOutcome { status: QpStatus::Interrupted, iterations: 0 };
        }
        self.solver.solve(qp, solution, deadline)
    }

    fn solve_again(
        &mut self,
        qp: &Qp<NODES, NX, NU, NG>,
        solution: &mut Solution<NODES, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.solver.solve_again(qp, solution, deadline)
    }

    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        self.solver.gain(k)
    }

    fn identify(&self, checksum: &mut Checksum) {
        self.solver.identify(checksum);
    }

    #[inline]
    fn show(&mut self, kept: &mut dyn Kept) {
        self.solver.show(kept);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::dynamics::Integrator;
    use crate::planner::{EmbeddedSolver, Options, Platform, Report, Workspace, plan};
    use crate::stages::{ArmClearances, Clearances, LINKS, Mode, Residuals};
    use crate::warmstart::{Action, Encoding, Policy};
    use core::cell::Cell;
    use nalgebra::Vector3;
    use std::boxed::Box;

    const EULER: Integrator = Integrator::Euler;

    fn scenario() -> Scenario<LINKS> {
        let target_rate = Vector3::new(0.0, 0.0, 1.0e-3);
        Scenario { target_rate, position: Vector3::new(8.0, 0.0, 0.0), ..Scenario::default() }
    }

    fn planned(guess: InitialGuess<'_>, is_scrubbed: bool) -> (Box<Workspace>, Report) {
        let (mut workspace, mut solver) =
            (Box::new(Workspace::new()), Box::new(EmbeddedSolver::new()));
        let settings = PlanSettings::new(Mode::Optimal, EULER);
        let options = Options::from_parts(settings, guess, Platform::BARE).scrubbing(is_scrubbed);
        let report = plan(&Mission::default(), &scenario(), &options, &mut *solver, &mut workspace);
        (workspace, report)
    }

    // Verifies REM-SAF-005.
    #[test]
    fn a_sound_plan_keeps_its_bits() {
        let [off, on] = [false, true].map(|on| planned(InitialGuess::Heuristic, on));
        assert_eq!(off.1, on.1);
        assert!(off.1.is_verified() && off.1.refusal.is_none());
    }

    /// A policy that predicts nothing, and whose weights change after so many looks.
    struct Fading(Cell<u32>);

    impl Policy for Fading {
        fn encoding(&self) -> Encoding {
            Encoding::Body
        }

        fn action(&self) -> Action {
            Action::Rate
        }

        fn nodes(&self) -> usize {
            NODES
        }

        fn joints(&self) -> usize {
            LINKS
        }

        fn deviation(&self, _: &[f32]) -> f32 {
            0.0
        }

        fn chunk(&self) -> usize {
            1
        }

        fn executed(&self) -> usize {
            1
        }

        fn identify(&self, _: &mut Checksum) {}

        fn is_intact(&self) -> bool {
            self.0.set(self.0.get().saturating_sub(1));
            self.0.get() > 0
        }

        fn begin(&self, _: u64) {}

        fn act(&self, _: &[f32], _: &mut [f32], _: &Deadline<'_>) -> bool {
            false
        }

        fn observe(&self, _: &[f32]) -> bool {
            false
        }
    }

    /// Before Stage 1, after the roll-out, at the end: a damaged model is found, and the plan refused by name.
    // Verifies REM-SAF-005.
    #[test]
    fn a_damaged_model_is_found_whenever_it_is_damaged() {
        let after = |looks| {
            let policy = Fading(Cell::new(looks));
            planned(InitialGuess::Learned { policy: &policy, seed: 0 }, true)
        };
        for looks in 1..=3 {
            let (workspace, report) = after(looks);
            assert_eq!(report.refusal, Some(Refusal::Damaged { what: "model" }), "{looks}");
            assert!(!report.is_verified() && report.status != crate::scp::Status::Solved);
            // Nothing of the plan is left to be used.
            assert!(workspace.translation().force.iter().all(|force| *force == Vector3::zeros()));
        }
        assert_eq!(after(100).1.refusal, None);
        let policy = Fading(Cell::new(1));
        let unscrubbed = planned(InitialGuess::Learned { policy: &policy, seed: 0 }, false).1;
        assert_eq!(unscrubbed.refusal, None);
    }

    /// Refusal of a plan whose mission, scenario or options changed after their checksums.
    fn found(
        change: fn(&mut Mission<LINKS>, &mut Scenario<LINKS>, &mut PlanSettings),
    ) -> Option<Refusal> {
        let (mut mission, mut scenario) = (Mission::default(), scenario());
        let mut options = PlanSettings::new(Mode::Optimal, EULER);
        let (guess, mut solver) = (InitialGuess::Heuristic, Box::new(EmbeddedSolver::new()));
        let input = input_checksum(&mission, &scenario);
        let settings = settings_checksum(&options, &guess, &*solver);
        change(&mut mission, &mut scenario, &mut options);
        let (mission, scenario, options, guess) = (&mission, &scenario, &options, &guess);
        let constants = Constants { mission, scenario, options, guess, input, settings };
        let mut scrubbed = Scrubbed { constants: Some(&constants), ..Scrubbed::off(&mut *solver) };
        let (mut qp, mut solution) = (Box::new(Qp::ZERO), Box::new(Solution::ZERO));
        qp.unused = NODES - 2;
        let solved = scrubbed.solve(&qp, &mut solution, &Deadline::never());
        let stopped = solved.status == QpStatus::Interrupted;
        assert_eq!(stopped, scrubbed.damaged.is_some());
        scrubbed.refusal()
    }

    // Verifies REM-SAF-005.
    #[test]
    fn every_constant_is_looked_at_before_each_program() {
        let damaged = |what| Some(Refusal::Damaged { what });
        assert_eq!(found(|_, _, _| ()), None);
        let input = damaged("mission or scenario");
        assert_eq!(found(|mission, _, _| mission.servicer.joint_rate_limit_rad_s[1] *= 1.5), input);
        assert_eq!(found(|mission, _, _| mission.tolerances.clearance_m *= 2.0), input);
        assert_eq!(found(|_, scenario, _| scenario.velocity.z = 1e-300), input);
        let other = damaged("options, guess or solver");
        assert_eq!(found(|_, _, options| options.deadline_s = 1.0), other);
    }

    // Verifies REM-SAF-005.
    #[test]
    fn the_verifier_must_find_the_same_bits_twice() {
        let mut solver = Box::new(EmbeddedSolver::new());
        let (residuals, clearances) = (Residuals::default(), Clearances::NONE);
        let one = Verification { residuals, clearances, arm: ArmClearances::NONE };
        let compared = |second: Verification, solver: &mut EmbeddedSolver| {
            let mut scrubbed: Scrubbed<'_, '_, _, LINKS> = Scrubbed::off(solver);
            scrubbed.compare(&one, &second, &Deadline::never());
            scrubbed.refusal()
        };
        assert_eq!(compared(one, &mut solver), None);
        let mut other = one;
        other.residuals.pointing = -0.0;
        let damaged = Some(Refusal::Damaged { what: "verifier" });
        assert_eq!(compared(other, &mut solver), damaged);
        let mut other = one;
        other.clearances.own.body = 2;
        assert_eq!(compared(other, &mut solver), damaged);
    }
}
