//! Options of a plan: settings, initial guess, platform.

use super::InitialGuess;
use crate::dynamics::Integrator;
use crate::executor::{ForkJoin, Sequential};
use crate::scp::Settings;
use crate::stages::{LINKS, Mode};
use core::fmt;
use remora_qp::time::{Clock, NoClock};
use remora_qp::{InvalidSetting, Valid, Validate};

/// Settings of a plan: all that it depends on besides mission, scenario and initial guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanSettings {
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time for the whole plan, verification included [s]. Infinite by default.
    pub deadline_s: f64,
    /// SCP settings of Stage 1.
    pub translation: Valid<Settings>,
    /// SCP settings of Stage 2 from the heuristic guess.
    pub reorientation: Valid<Settings>,
    /// SCP settings of Stage 2 from a learned guess or the user's.
    pub learned: Valid<Settings>,
}

/// Settings of Stage 1.
const TRANSLATION: Settings =
    Settings { cost_tolerance: 1e-6, penalty_parameter: 100.0, ..Settings::DEFAULT };

/// Settings of Stage 2. For the same mean cost over many plans the fewest iterations are those that all gain as
/// much, whatever the plan costs; of a dear plan a share of the cost is enough.
const fn reorientation(stop_when_feasible: bool) -> Settings {
    Settings {
        stop_when_feasible,
        cost_tolerance: 8e-4,
        absolute_cost_tolerance: 1.2e-4,
        ..Settings::DEFAULT
    }
}

/// Settings of Stage 2 from a learned guess. Its rollout satisfies the dynamics and ends near the
/// optimum, so that a larger penalty is possible; a small radius keeps it in that optimum's basin.
const fn learned(stop_when_feasible: bool) -> Settings {
    Settings { penalty_parameter: 30.0, radius: 0.2, ..reorientation(stop_when_feasible) }
}

impl PlanSettings {
    /// The tuned settings for a mode and an integrator.
    pub fn new(mode: Mode, integrator: Integrator) -> Self {
        let is_feasible = mode == Mode::Feasible;
        Self {
            mode,
            integrator,
            deadline_s: f64::INFINITY,
            translation: Valid::of_constant(TRANSLATION),
            reorientation: Valid::of_constant(reorientation(is_feasible)),
            learned: Valid::of_constant(learned(is_feasible)),
        }
    }
}

/// The platform: clock and executor of the machine. It does not change a plan that ends before its
/// deadline.
pub struct Platform<'a, P> {
    /// Clock for phase timings and the deadline.
    pub clock: &'a dyn Clock,
    /// Fork-join executor: the second core, where there is one.
    pub executor: &'a P,
}

impl<P> Clone for Platform<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P> Copy for Platform<'_, P> {}

impl Platform<'static, Sequential> {
    /// No clock, so that no deadline passes, and one core.
    pub const BARE: Self = Self { clock: &NoClock, executor: &Sequential };
}

/// Options of a plan: settings, initial guess and platform. Built by [`Options::builder`].
///
/// ```
/// use remora_core::prelude::*;
///
/// let options = Options::builder().mode(Mode::Feasible).integrator(Integrator::RK4).build()?;
/// assert_eq!(options.settings().mode, Mode::Feasible);
/// let error = Options::builder().integrator(Integrator::Rk4 { substeps: 1 }).build();
/// assert_eq!(error.unwrap_err().to_string(), "integrator must be euler, or rk4 with 4 to 1000 substeps");
/// # Ok::<(), InvalidSetting>(())
/// ```
#[derive(Clone, Copy)]
pub struct Options<'a, P = Sequential, const NL: usize = LINKS> {
    settings: PlanSettings,
    guess: InitialGuess<'a, NL>,
    platform: Platform<'a, P>,
    is_scrubbed: bool,
}

impl Options<'static> {
    /// A builder with the defaults: optimality, RK4 with eight substeps a node, the heuristic guess, no
    /// deadline, one core.
    pub fn builder() -> OptionsBuilder<'static> {
        Self::for_arm()
    }
}

impl<const NL: usize> Options<'static, Sequential, NL> {
    /// [`Options::builder`] for an arm of `NL` joints.
    pub fn for_arm() -> OptionsBuilder<'static, Sequential, NL> {
        OptionsBuilder {
            mode: Mode::Optimal,
            integrator: Integrator::RK4,
            deadline_s: f64::INFINITY,
            loops: [None; 3],
            guess: InitialGuess::Heuristic,
            platform: Platform::BARE,
            is_scrubbed: false,
        }
    }
}

impl<'a, P, const NL: usize> Options<'a, P, NL> {
    /// The settings.
    pub fn settings(&self) -> &PlanSettings {
        &self.settings
    }

    /// The initial guess of Stage 2.
    pub fn initial_guess(&self) -> &InitialGuess<'a, NL> {
        &self.guess
    }

    /// Options from settings that are already chosen; nothing is validated again.
    pub fn from_parts(
        settings: PlanSettings,
        guess: InitialGuess<'a, NL>,
        platform: Platform<'a, P>,
    ) -> Self {
        Self { settings, guess, platform, is_scrubbed: false }
    }

    /// Sets whether planning checks its constants against their checksums and runs the verifier twice:
    /// [`OptionsBuilder::scrub`].
    pub fn scrubbing(self, is_scrubbed: bool) -> Self {
        Self { is_scrubbed, ..self }
    }

    /// Whether planning checks its constants against their checksums.
    pub(crate) fn is_scrubbed(&self) -> bool {
        self.is_scrubbed
    }

    /// The platform.
    pub(crate) fn platform(&self) -> &Platform<'a, P> {
        &self.platform
    }
}

impl<P, const NL: usize> fmt::Debug for Options<'_, P, NL> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options").field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// Builder of [`Options`].
#[derive(Clone, Copy)]
#[must_use = "call build()"]
pub struct OptionsBuilder<'a, P = Sequential, const NL: usize = LINKS> {
    mode: Mode,
    integrator: Integrator,
    deadline_s: f64,
    /// SCP settings of Stage 1, Stage 2 and Stage 2 from a learned guess, where not the tuned ones.
    loops: [Option<Settings>; 3],
    guess: InitialGuess<'a, NL>,
    platform: Platform<'a, P>,
    is_scrubbed: bool,
}

impl<'a, P: ForkJoin, const NL: usize> OptionsBuilder<'a, P, NL> {
    /// Sets optimality or feasibility.
    pub fn mode(self, mode: Mode) -> Self {
        Self { mode, ..self }
    }

    /// Sets the discretisation of Stage 2: RK4, whose plans can be flown, or the paper's explicit Euler.
    pub fn integrator(self, integrator: Integrator) -> Self {
        Self { integrator, ..self }
    }

    /// Sets the initial guess of Stage 2.
    pub fn initial_guess<'b>(self, guess: InitialGuess<'b, NL>) -> OptionsBuilder<'b, P, NL>
    where
        'a: 'b,
    {
        OptionsBuilder { guess, ..self }
    }

    /// Sets the clock, for times in the report, and the time for the whole plan, verification included
    /// [s]; infinite for none.
    pub fn clock<'b>(self, clock: &'b dyn Clock, deadline_s: f64) -> OptionsBuilder<'b, P, NL>
    where
        'a: 'b,
    {
        let platform = Platform { clock, executor: self.platform.executor };
        OptionsBuilder { deadline_s, platform, ..self }
    }

    /// Sets the executor of a second core; the plan keeps its bits.
    pub fn second_core<'b, Q: ForkJoin>(self, executor: &'b Q) -> OptionsBuilder<'b, Q, NL>
    where
        'a: 'b,
    {
        let Self { mode, integrator, deadline_s, loops, guess, platform, is_scrubbed } = self;
        let platform = Platform { clock: platform.clock, executor };
        OptionsBuilder { mode, integrator, deadline_s, loops, guess, platform, is_scrubbed }
    }

    /// Sets whether mission, scenario, options and guess are held against their checksums before each
    /// iteration, a learned model before and after its roll-out and at the end, and whether the verifier
    /// runs twice and must find the same bits: for memories and processors that may be damaged meanwhile.
    /// Off by default. The plan keeps its bits; one in which damage is found is refused
    /// ([`Refusal::Damaged`](crate::model::Refusal)). Cost: the verifier's time again, a pass over the model
    /// a stage, some 10,000 instructions an iteration.
    pub fn scrub(self, is_scrubbed: bool) -> Self {
        Self { is_scrubbed, ..self }
    }

    /// Replaces the tuned SCP settings of Stage 1.
    pub fn translation(self, settings: Settings) -> Self {
        Self { loops: [Some(settings), self.loops[1], self.loops[2]], ..self }
    }

    /// Replaces the tuned SCP settings of Stage 2, from the heuristic guess and from another one.
    pub fn reorientation(self, heuristic: Settings, other: Settings) -> Self {
        Self { loops: [self.loops[0], Some(heuristic), Some(other)], ..self }
    }

    /// Validates and builds the options.
    ///
    /// # Errors
    /// The first setting out of its range: substeps other than 4 to 1000, a deadline that is not
    /// positive, a setting of the SCP solver.
    pub fn build(self) -> Result<Options<'a, P, NL>, InvalidSetting> {
        let tuned = PlanSettings::new(self.mode, self.integrator);
        let invalid = |setting, range| Err(InvalidSetting { setting, range });
        if let Integrator::Rk4 { substeps } = self.integrator
            && !(Integrator::MIN_SUBSTEPS..=Integrator::MAX_SUBSTEPS).contains(&substeps)
        {
            return invalid("integrator", "euler, or rk4 with 4 to 1000 substeps");
        }
        // NaN is no deadline either.
        if !(self.deadline_s > 0.0) {
            return invalid("deadline_s", "positive");
        }
        let chosen = |settings: Option<Settings>, tuned| match settings {
            Some(settings) => settings.validated(),
            None => Ok(tuned),
        };
        let settings = PlanSettings {
            deadline_s: self.deadline_s,
            translation: chosen(self.loops[0], tuned.translation)?,
            reorientation: chosen(self.loops[1], tuned.reorientation)?,
            learned: chosen(self.loops[2], tuned.learned)?,
            ..tuned
        };
        let Self { guess, platform, is_scrubbed, .. } = self;
        Ok(Options { settings, guess, platform, is_scrubbed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_cannot_be_built() {
        for settings in
            [TRANSLATION, reorientation(true), learned(true), reorientation(false), learned(false)]
        {
            settings.validate().unwrap();
        }
        let builder = Options::builder();
        let setting = |built: Result<Options<'_>, InvalidSetting>| built.unwrap_err().setting;
        let short = Integrator::Rk4 { substeps: 3 };
        assert_eq!(setting(builder.integrator(short).build()), "integrator");
        assert_eq!(setting(builder.clock(&NoClock, f64::NAN).build()), "deadline_s");
        assert_eq!(setting(builder.clock(&NoClock, 0.0).build()), "deadline_s");
        let long = Settings { max_iterations: 65, ..Settings::DEFAULT };
        assert_eq!(setting(builder.translation(long).build()), "max_iterations");
        assert_eq!(
            setting(builder.reorientation(Settings::DEFAULT, long).build()),
            "max_iterations"
        );
        let built = builder.integrator(Integrator::Euler).clock(&NoClock, 2.0).build().unwrap();
        let expected = PlanSettings::new(Mode::Optimal, Integrator::Euler);
        assert_eq!(*built.settings(), PlanSettings { deadline_s: 2.0, ..expected });
    }
}
