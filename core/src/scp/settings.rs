//! Settings of the loop.

use super::MAX_ITERATIONS;
use remora_qp::{InvalidSetting, Valid, Validate};

/// Most corrections an iteration that can be asked for.
pub const MAX_CORRECTIONS: u32 = 8;

/// Settings of the loop; each with its default and range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Most iterations, rejected steps counted. Default 50; 1 to [`MAX_ITERATIONS`].
    pub max_iterations: usize,
    /// Stop at the first feasible iterate instead of waiting for the cost to settle.
    pub stop_when_feasible: bool,
    /// The cost has settled when actual and predicted relative change of the merit are below
    /// this. Default 1e-3; positive.
    pub settle: f64,
    /// Initial trust-region radius, in the problem's unit. Positive.
    pub radius: f64,
    /// Least radius: a loop that reaches it stops. Positive.
    pub min_radius: f64,
    /// Largest radius. At least the initial one.
    pub max_radius: f64,
    /// Steps with a ratio below this are rejected. Default 0.01; `[0, 1)`.
    pub accept: f64,
    /// Below this ratio the radius shrinks. Default 0.25; `(accept, 1)`.
    pub shrink_below: f64,
    /// Above this ratio the radius grows, if the step reached it. Default 0.7.
    pub grow_above: f64,
    /// The radius shrinks by this factor. Default 0.5; `(0, 1)`.
    pub shrink: f64,
    /// The radius grows by this factor. Default 3; above 1.
    pub grow: f64,
    /// Initial penalty weight. Positive.
    pub weight: f64,
    /// Largest penalty weight. At least the initial one.
    pub max_weight: f64,
    /// The weight grows by this factor where a subproblem pays for violations that its trust
    /// region would let it remove. Default 4; above 1.
    pub weight_growth: f64,
    /// Curvature enters once the weighted penalty is below this multiple of the cost: before, the
    /// multipliers say more about the penalty than about the optimum. Default 100; not negative.
    pub curvature_below: f64,
    /// Below this ratio a second-order correction may be tried. Default 0.3; `[0, 1]`.
    pub correct_below: f64,
    /// Most corrections an iteration. Default 2; at most [`MAX_CORRECTIONS`].
    pub max_corrections: u32,
}

impl Settings {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        max_iterations: 50,
        stop_when_feasible: false,
        settle: 1e-3,
        radius: 1.0,
        min_radius: 1e-6,
        max_radius: 10.0,
        accept: 0.01,
        shrink_below: 0.25,
        grow_above: 0.7,
        shrink: 0.5,
        grow: 3.0,
        weight: 10.0,
        max_weight: 1e6,
        weight_growth: 4.0,
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
    /// The same with another limit of iterations, within its range.
    pub fn with_max_iterations(settings: &Valid<Self>, iterations: usize) -> Valid<Self> {
        let max_iterations = iterations.clamp(1, MAX_ITERATIONS);
        Valid::of_constant(Self { max_iterations, ..**settings })
    }
}

impl Validate for Settings {
    type Error = InvalidSetting;

    fn validate(&self) -> Result<(), InvalidSetting> {
        let finite = |x: f64| x > 0.0 && x < f64::INFINITY;
        let checks = [
            (
                (1..=MAX_ITERATIONS).contains(&self.max_iterations),
                "max_iterations",
                "from 1 to MAX_ITERATIONS",
            ),
            (finite(self.settle), "settle", "positive"),
            (finite(self.radius), "radius", "positive"),
            (finite(self.min_radius), "min_radius", "positive"),
            (
                self.max_radius >= self.radius && finite(self.max_radius),
                "max_radius",
                "finite and at least radius",
            ),
            ((0.0..1.0).contains(&self.accept), "accept", "in [0, 1)"),
            (
                self.shrink_below > self.accept && self.shrink_below < 1.0,
                "shrink_below",
                "in (accept, 1)",
            ),
            (
                self.grow_above >= self.shrink_below && self.grow_above < 1.0,
                "grow_above",
                "in [shrink_below, 1)",
            ),
            (self.shrink > 0.0 && self.shrink < 1.0, "shrink", "in (0, 1)"),
            (self.grow > 1.0 && finite(self.grow), "grow", "above 1"),
            (finite(self.weight), "weight", "positive"),
            (
                self.max_weight >= self.weight && finite(self.max_weight),
                "max_weight",
                "finite and at least weight",
            ),
            (self.weight_growth > 1.0 && finite(self.weight_growth), "weight_growth", "above 1"),
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
        assert_eq!(named(|s| s.settle = f64::NAN), "settle");
        assert_eq!(named(|s| s.radius = -1.0), "radius");
        assert_eq!(named(|s| s.max_radius = 0.1), "max_radius");
        assert_eq!(named(|s| s.accept = 1.0), "accept");
        assert_eq!(named(|s| s.shrink_below = 0.001), "shrink_below");
        assert_eq!(named(|s| s.grow_above = 0.1), "grow_above");
        assert_eq!(named(|s| s.shrink = 1.0), "shrink");
        assert_eq!(named(|s| s.grow = 1.0), "grow");
        assert_eq!(named(|s| s.weight = 0.0), "weight");
        assert_eq!(named(|s| s.max_weight = 1.0), "max_weight");
        assert_eq!(named(|s| s.weight_growth = 0.5), "weight_growth");
        assert_eq!(named(|s| s.curvature_below = f64::NAN), "curvature_below");
        assert_eq!(named(|s| s.correct_below = 2.0), "correct_below");
        assert_eq!(named(|s| s.max_corrections = 9), "max_corrections");
    }
}
