//! How a plan is to be made, from which initial guess, and on what machine.

use super::InitialGuess;
use crate::dynamics::Integrator;
use crate::pair::{Pair, Sequential};
use crate::scp::Settings;
use crate::stages::Mode;
use core::fmt;
use remora_qp::time::{Clock, NoClock};
use remora_qp::{InvalidSetting, Valid, Validate};

/// How a plan is to be made: all that its bits depend on beside mission, scenario and initial guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanSettings {
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time for the whole plan, verification included [s]. Infinite by default.
    pub deadline_s: f64,
    /// The solver's settings for Stage 1.
    pub translation: Valid<Settings>,
    /// The solver's settings for Stage 2.
    pub reorientation: Valid<Settings>,
    /// The same from a learned guess, or the user's.
    pub learned: Valid<Settings>,
}

/// Settings of Stage 1.
const TRANSLATION: Settings =
    Settings { cost_tolerance: 1e-6, penalty_parameter: 100.0, ..Settings::DEFAULT };

/// Settings of Stage 2.
const fn reorientation(stop_when_feasible: bool) -> Settings {
    Settings { stop_when_feasible, ..Settings::DEFAULT }
}

/// Settings of Stage 2 from a learned guess: its rollout follows the dynamics and ends near the
/// optimum. Infeasibility need not be bought, and a long first step would leave for another optimum.
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

/// What the planner is given by the machine it runs on. Nothing of it changes a bit of a plan that
/// ends before its deadline.
#[derive(Clone, Copy)]
pub struct Environment<'a, P> {
    /// For phase timings and the deadline.
    pub clock: &'a dyn Clock,
    /// The second core, where there is one.
    pub pair: &'a P,
}

impl Environment<'static, Sequential> {
    /// No clock, so that no deadline ever passes, and no second core.
    pub const BARE: Self = Self { clock: &NoClock, pair: &Sequential };
}

/// Everything about a plan that is neither mission nor scenario. Made by [`Options::builder`].
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
pub struct Options<'a, P = Sequential> {
    settings: PlanSettings,
    guess: InitialGuess<'a>,
    environment: Environment<'a, P>,
}

impl Options<'static> {
    /// The defaults, to be changed: optimality, RK4 with eight substeps a node, the heuristic guess,
    /// no deadline, no second core.
    pub fn builder() -> OptionsBuilder<'static> {
        OptionsBuilder {
            mode: Mode::Optimal,
            integrator: Integrator::RK4,
            deadline_s: f64::INFINITY,
            loops: [None; 3],
            guess: InitialGuess::Heuristic,
            environment: Environment::BARE,
        }
    }
}

impl<'a, P> Options<'a, P> {
    /// What the bits of the plan depend on.
    pub fn settings(&self) -> &PlanSettings {
        &self.settings
    }

    /// What Stage 2 starts from.
    pub fn initial_guess(&self) -> &InitialGuess<'a> {
        &self.guess
    }

    pub(crate) fn environment(&self) -> &Environment<'a, P> {
        &self.environment
    }
}

impl<P> fmt::Debug for Options<'_, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options").field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// Options in the making; see [`Options`].
#[derive(Clone, Copy)]
#[must_use = "nothing is built before build()"]
pub struct OptionsBuilder<'a, P = Sequential> {
    mode: Mode,
    integrator: Integrator,
    deadline_s: f64,
    /// Of Stage 1, Stage 2 and Stage 2 from a learned guess, where they are not the tuned ones.
    loops: [Option<Settings>; 3],
    guess: InitialGuess<'a>,
    environment: Environment<'a, P>,
}

impl<'a, P: Pair> OptionsBuilder<'a, P> {
    /// Optimality or feasibility.
    pub fn mode(self, mode: Mode) -> Self {
        Self { mode, ..self }
    }

    /// Discretisation of Stage 2: RK4, whose plans can be flown, or the paper's explicit Euler.
    pub fn integrator(self, integrator: Integrator) -> Self {
        Self { integrator, ..self }
    }

    /// What Stage 2 starts from.
    pub fn initial_guess<'b>(self, guess: InitialGuess<'b>) -> OptionsBuilder<'b, P>
    where
        'a: 'b,
    {
        OptionsBuilder { guess, ..self }
    }

    /// A clock, for times in the report and for the deadline: time for the whole plan, verification
    /// included [s], infinite for none.
    pub fn clock<'b>(self, clock: &'b dyn Clock, deadline_s: f64) -> OptionsBuilder<'b, P>
    where
        'a: 'b,
    {
        let environment = Environment { clock, pair: self.environment.pair };
        OptionsBuilder { deadline_s, environment, ..self }
    }

    /// A second core; the plan's bits stay the same.
    pub fn second_core<'b, Q: Pair>(self, pair: &'b Q) -> OptionsBuilder<'b, Q>
    where
        'a: 'b,
    {
        let Self { mode, integrator, deadline_s, loops, guess, environment } = self;
        let environment = Environment { clock: environment.clock, pair };
        OptionsBuilder { mode, integrator, deadline_s, loops, guess, environment }
    }

    /// Settings of the SCP solver for Stage 1 in place of the tuned ones.
    pub fn translation(self, settings: Settings) -> Self {
        Self { loops: [Some(settings), self.loops[1], self.loops[2]], ..self }
    }

    /// Settings of the SCP solver for Stage 2 in place of the tuned ones, from the heuristic guess and
    /// from another.
    pub fn reorientation(self, heuristic: Settings, other: Settings) -> Self {
        Self { loops: [self.loops[0], Some(heuristic), Some(other)], ..self }
    }

    /// The options.
    ///
    /// # Errors
    /// The first setting out of its range: substeps other than 4 to 1000, a deadline that is not
    /// positive, a setting of the SCP solver.
    pub fn build(self) -> Result<Options<'a, P>, InvalidSetting> {
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
        Ok(Options { settings, guess: self.guess, environment: self.environment })
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
