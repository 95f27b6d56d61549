//! Settings of the SCP solver.

use super::MAX_ITERATIONS;
use remora_qp::{InvalidSetting, Valid, Validate};

/// Largest value of [`Settings::max_corrections`].
pub const MAX_CORRECTIONS: u32 = 8;

/// Settings of the SCP solver; each with its default and range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Most iterations, rejected steps included. Default 50; 1 to [`MAX_ITERATIONS`].
    pub max_iterations: usize,
    /// Whether to stop at the first feasible iterate instead of at convergence.
    pub stop_when_feasible: bool,
    /// Relative tolerance of the cost: a change below this times the merit does not count. Default 1e-3; not
    /// negative.
    pub cost_tolerance: f64,
    /// Absolute tolerance of the cost; the larger of the two holds. Default 0; not negative, and one of the two
    /// positive.
    pub absolute_cost_tolerance: f64,
    /// Initial trust-region radius, in the problem's unit. Default 1; positive.
    pub radius: f64,
    /// Least radius, at which the solver stops. Default 1e-6; positive.
    pub min_radius: f64,
    /// Largest radius. Default 10; at least the initial one.
    pub max_radius: f64,
    /// Least `rho` (actual over predicted reduction) of an accepted step. Default 0.01; `[0, 1)`.
    pub eta_0: f64,
    /// `rho` below which the radius shrinks. Default 0.25; `(eta_0, 1)`.
    pub eta_1: f64,
    /// `rho` from which the radius grows, if the step reached it. Default 0.7; `[eta_1, 1)`.
    pub eta_2: f64,
    /// Factor by which the radius shrinks. Default 0.5; `(0, 1)`.
    pub shrink: f64,
    /// Factor by which the radius grows. Default 3; above 1.
    pub grow: f64,
    /// Initial penalty parameter of the exact (L1) penalty. Default 10; positive.
    pub penalty_parameter: f64,
    /// Largest penalty parameter. Default 1e6; at least the initial one.
    pub max_penalty_parameter: f64,
    /// Factor by which the penalty parameter grows where a subproblem keeps violations that its trust
    /// region would let it remove. Default 4; above 1.
    pub penalty_growth: f64,
    /// The Lagrangian's Hessian is used once penalty times violation is below this multiple of the
    /// cost; before, the multipliers say little about the optimum. Default 100; not negative.
    pub curvature_below: f64,
    /// `rho` below which a second-order correction may be tried. Default 0.3; `[0, 1]`.
    pub correct_below: f64,
    /// Most second-order corrections an iteration. Default 2; at most [`MAX_CORRECTIONS`].
    pub max_corrections: u32,
}

impl Settings {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        max_iterations: 50,
        stop_when_feasible: false,
        cost_tolerance: 1e-3,
        absolute_cost_tolerance: 0.0,
        radius: 1.0,
        min_radius: 1e-6,
        max_radius: 10.0,
        eta_0: 0.01,
        eta_1: 0.25,
        eta_2: 0.7,
        shrink: 0.5,
        grow: 3.0,
        penalty_parameter: 10.0,
        max_penalty_parameter: 1e6,
        penalty_growth: 4.0,
        curvature_below: 100.0,
        correct_below: 0.3,
        max_corrections: 2,
    };
}

impl Default for Settings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Settings {
    /// A copy with another limit of iterations, clamped to its range.
    pub fn with_max_iterations(settings: &Valid<Self>, iterations: usize) -> Valid<Self> {
        let max_iterations = iterations.clamp(1, MAX_ITERATIONS);
        Valid::of_constant(Self { max_iterations, ..**settings })
    }

    /// A copy that stops at the first feasible iterate.
    pub fn stopping_when_feasible(settings: &Valid<Self>) -> Valid<Self> {
        Valid::of_constant(Self { stop_when_feasible: true, ..**settings })
    }
}

impl Validate for Settings {
    type Error = InvalidSetting;

    fn validate(&self) -> Result<(), InvalidSetting> {
        let finite = |x: f64| x > 0.0 && x < f64::INFINITY;
        let tolerance = |x: f64| (0.0..f64::INFINITY).contains(&x);
        let checks = [
            (
                (1..=MAX_ITERATIONS).contains(&self.max_iterations),
                "max_iterations",
                "from 1 to MAX_ITERATIONS",
            ),
            (tolerance(self.cost_tolerance), "cost_tolerance", "not negative"),
            (tolerance(self.absolute_cost_tolerance), "absolute_cost_tolerance", "not negative"),
            (
                self.cost_tolerance + self.absolute_cost_tolerance > 0.0,
                "cost_tolerance",
                "positive where absolute_cost_tolerance is zero",
            ),
            (finite(self.radius), "radius", "positive"),
            (finite(self.min_radius), "min_radius", "positive"),
            (
                self.max_radius >= self.radius && finite(self.max_radius),
                "max_radius",
                "finite and at least radius",
            ),
            ((0.0..1.0).contains(&self.eta_0), "eta_0", "in [0, 1)"),
            (self.eta_1 > self.eta_0 && self.eta_1 < 1.0, "eta_1", "in (eta_0, 1)"),
            (self.eta_2 >= self.eta_1 && self.eta_2 < 1.0, "eta_2", "in [eta_1, 1)"),
            (self.shrink > 0.0 && self.shrink < 1.0, "shrink", "in (0, 1)"),
            (self.grow > 1.0 && finite(self.grow), "grow", "above 1"),
            (finite(self.penalty_parameter), "penalty_parameter", "positive"),
            (
                self.max_penalty_parameter >= self.penalty_parameter
                    && finite(self.max_penalty_parameter),
                "max_penalty_parameter",
                "finite and at least penalty_parameter",
            ),
            (self.penalty_growth > 1.0 && finite(self.penalty_growth), "penalty_growth", "above 1"),
            (self.curvature_below >= 0.0, "curvature_below", "not negative"),
            ((0.0..=1.0).contains(&self.correct_below), "correct_below", "in [0, 1]"),
            (self.max_corrections <= MAX_CORRECTIONS, "max_corrections", "at most MAX_CORRECTIONS"),
        ];
        match checks.into_iter().find(|(ok, _, _)| !ok) {
            Some((_, setting, range)) => Err(InvalidSetting { setting, range }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_named() {
        Settings::default().validate().unwrap();
        let named = |change: fn(&mut Settings)| {
            let mut settings = Settings::default();
            change(&mut settings);
            settings.validate().unwrap_err().setting
        };
        assert_eq!(named(|s| s.max_iterations = 0), "max_iterations");
        assert_eq!(named(|s| s.max_iterations = 1000), "max_iterations");
        assert_eq!(named(|s| s.cost_tolerance = f64::NAN), "cost_tolerance");
        assert_eq!(named(|s| s.absolute_cost_tolerance = -1.0), "absolute_cost_tolerance");
        assert_eq!(named(|s| s.cost_tolerance = 0.0), "cost_tolerance");
        assert_eq!(named(|s| s.radius = -1.0), "radius");
        assert_eq!(named(|s| s.max_radius = 0.1), "max_radius");
        assert_eq!(named(|s| s.eta_0 = 1.0), "eta_0");
        assert_eq!(named(|s| s.eta_1 = 0.001), "eta_1");
        assert_eq!(named(|s| s.eta_2 = 0.1), "eta_2");
        assert_eq!(named(|s| s.shrink = 1.0), "shrink");
        assert_eq!(named(|s| s.grow = 1.0), "grow");
        assert_eq!(named(|s| s.penalty_parameter = 0.0), "penalty_parameter");
        assert_eq!(named(|s| s.max_penalty_parameter = 1.0), "max_penalty_parameter");
        assert_eq!(named(|s| s.penalty_growth = 0.5), "penalty_growth");
        assert_eq!(named(|s| s.curvature_below = f64::NAN), "curvature_below");
        assert_eq!(named(|s| s.correct_below = 2.0), "correct_below");
        assert_eq!(named(|s| s.max_corrections = 9), "max_corrections");
    }
}
