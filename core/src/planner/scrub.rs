//! What a plan is made from and must not change meanwhile, held against its checksums between iterations.

use super::{InitialGuess, PlanSettings, Solver, input_checksum, record};
use crate::model::{Mission, Refusal, Scenario, Tolerances};
use crate::stages::{NODES, Verification, size::NG};
use nalgebra::SMatrix;
use remora_qp::kept::Kept;
use remora_qp::time::Deadline;
use remora_qp::{Checksum, Qp, QpOutcome, QpSolver, QpStatus, Solution};

/// Checksum of options, horizon and solver with their settings.
pub(super) fn settings_checksum<
    S: Solver<NX, NU>,
    const NL: usize,
    const NX: usize,
    const NU: usize,
>(
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

/// What a plan is made from, and its checksums when the plan began.
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
    pub constants: Option<Constants<'a, NL>>,
    /// What was found damaged first.
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

    /// Holds two runs of the verifier on the same plan against each other; returns the second. One that
    /// did not come to its end has found nothing.
    #[inline(never)]
    pub fn compare(
        &mut self,
        first: &Verification,
        second: Verification,
        deadline: &Deadline<'_>,
    ) -> Verification {
        self.find(sum(first) != sum(&second) && !deadline.has_passed(), "verifier");
        second
    }

    /// Holds the learned model against its checksum.
    #[inline(never)]
    pub fn look_at_model(&mut self) {
        let Some(Constants { guess, .. }) = self.constants else { return };
        if let InitialGuess::Learned { policy, .. } = guess {
            self.find(!policy.is_intact(), "model");
        }
    }
}

/// Checksum of what the verifier found.
fn sum(found: &Verification) -> u64 {
    let Verification { residuals, clearances } = found;
    let mut sum = Checksum::new();
    sum.numbers(&residuals.against(&Tolerances::default()).map(|(_, value, _)| value));
    for (_, closest) in clearances.named() {
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
        let Some(Constants { mission, scenario, options, guess, input, settings }) = self.constants
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
