//! How a plan is to be made, and on what machine.

use crate::dynamics::Integrator;
use crate::pair::Sequential;
use crate::scp::Settings;
use crate::stages::Mode;
use crate::time::{Clock, NoClock};

/// How a plan is to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Time for the whole plan, verification included [s]. Infinite by default.
    pub deadline_s: f64,
    /// The loop's settings for Stage 1.
    pub translation: Settings,
    /// The loop's settings for Stage 2.
    pub reorientation: Settings,
    /// The same from a learned start, or one handed in.
    pub learned: Settings,
}

impl Options {
    /// The tuned settings for a mode and an integrator.
    pub fn new(mode: Mode, integrator: Integrator) -> Self {
        let reorientation =
            Settings { stop_when_feasible: mode == Mode::Feasible, ..Settings::default() };
        Self {
            mode,
            integrator,
            deadline_s: f64::INFINITY,
            translation: Settings { settle: 1e-6, weight: 100.0, ..Settings::default() },
            reorientation,
            // The roll-out follows the dynamics and ends near the optimum: infeasibility need not
            // be bought, and a long first step would leave for another optimum.
            learned: Settings { weight: 30.0, radius: 0.2, ..reorientation },
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
