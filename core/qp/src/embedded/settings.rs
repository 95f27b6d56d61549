//! Settings of the interior-point method.

use crate::{Checksum, InvalidSetting, Validate};

/// Largest value of [`InteriorPointSettings::max_iterations`].
pub const MAX_SOLVER_ITERATIONS: u32 = 1000;

/// Settings of the interior-point method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteriorPointSettings {
    /// Most iterations, restarts counted. Default 100; at most [`MAX_SOLVER_ITERATIONS`].
    pub max_iterations: u32,
    /// Largest KKT residual of a solved QP: gradient of the Lagrangian, violation of dynamics and path
    /// constraints. In the QP's own (scaled) units, times the largest state or control where that is
    /// from one to ten. Default 5e-10; positive. A QP may ask for less by its own
    /// [`complementarity`](crate::Qp::complementarity), of which a hundredth is then enough.
    pub tolerance: f64,
    /// Largest complementarity `s z` of a solved QP, in the same units. A weakly active variable is
    /// off by its square root, hence the small default, 1e-13; positive. A QP may ask for less.
    pub complementarity: f64,
    /// Largest of both for a QP solved to reduced accuracy. Default 1e-6; at least the
    /// other two.
    pub reduced: f64,
    /// Fixed number of iterations whatever the residuals, for constant time: 20 suffice for nearly
    /// every QP of the planner. Default none; at most
    /// [`MAX_SOLVER_ITERATIONS`].
    pub fixed_iterations: Option<u32>,
}

impl InteriorPointSettings {
    /// All bits zero: storage for settings.
    pub(super) const BLANK: Self = Self {
        max_iterations: 0,
        tolerance: 0.0,
        complementarity: 0.0,
        reduced: 0.0,
        fixed_iterations: None,
    };

    /// The defaults.
    pub const DEFAULT: Self = Self {
        max_iterations: 100,
        tolerance: 5e-10,
        complementarity: 1e-13,
        reduced: 1e-6,
        fixed_iterations: None,
    };

    /// Adds all settings to a checksum.
    pub(super) fn identify(&self, checksum: &mut Checksum) {
        checksum.integer(u64::from(self.max_iterations));
        checksum.numbers(&[self.tolerance, self.complementarity, self.reduced]);
        // No count of iterations is as large as the first of these.
        checksum.integer(self.fixed_iterations.map_or(u64::MAX, u64::from));
    }
}

impl Validate for InteriorPointSettings {
    type Error = InvalidSetting;

    fn validate(&self) -> Result<(), InvalidSetting> {
        let positive = |v: f64| v > 0.0 && v < f64::INFINITY;
        let few = |count: u32| count <= MAX_SOLVER_ITERATIONS;
        let checks = [
            (few(self.max_iterations), "max_iterations", "at most MAX_SOLVER_ITERATIONS"),
            (
                self.fixed_iterations.is_none_or(few),
                "fixed_iterations",
                "at most MAX_SOLVER_ITERATIONS",
            ),
            (positive(self.tolerance), "tolerance", "positive"),
            (positive(self.complementarity), "complementarity", "positive"),
            (
                positive(self.reduced)
                    && self.reduced >= self.tolerance
                    && self.reduced >= self.complementarity,
                "reduced",
                "at least tolerance and complementarity",
            ),
        ];
        match checks.into_iter().find(|(sound, _, _)| !sound) {
            Some((_, setting, range)) => Err(InvalidSetting { setting, range }),
            None => Ok(()),
        }
    }
}

impl Default for InteriorPointSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_named() {
        let default = InteriorPointSettings::DEFAULT;
        let named = |of: InteriorPointSettings| of.validate().unwrap_err().setting;
        assert_eq!(default.validate(), Ok(()));
        assert_eq!(named(InteriorPointSettings { tolerance: 0.0, ..default }), "tolerance");
        let nan = InteriorPointSettings { complementarity: f64::NAN, ..default };
        assert_eq!(named(nan), "complementarity");
        let long = InteriorPointSettings { max_iterations: 1001, ..default };
        assert_eq!(named(long), "max_iterations");
        let fixed = InteriorPointSettings { fixed_iterations: Some(1001), ..default };
        assert_eq!(named(fixed), "fixed_iterations");
        assert_eq!(named(InteriorPointSettings { reduced: 1e-12, ..default }), "reduced");
    }

    #[test]
    fn ranges_include_their_ends() {
        let default = InteriorPointSettings::DEFAULT;
        let most = MAX_SOLVER_ITERATIONS;
        for sound in [
            InteriorPointSettings { max_iterations: most, ..default },
            InteriorPointSettings { max_iterations: 0, ..default },
            InteriorPointSettings { fixed_iterations: Some(most), ..default },
            InteriorPointSettings { fixed_iterations: Some(0), ..default },
            InteriorPointSettings { tolerance: 1e-300, complementarity: 1e-300, ..default },
            InteriorPointSettings { reduced: default.tolerance, ..default },
            InteriorPointSettings { complementarity: default.reduced, ..default },
            InteriorPointSettings { tolerance: 0.5, complementarity: 1.0, reduced: 1.0, ..default },
        ] {
            assert_eq!(sound.validate(), Ok(()), "{sound:?}");
        }
    }

    #[test]
    fn what_is_not_positive_or_not_finite_is_refused() {
        let default = InteriorPointSettings::DEFAULT;
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let bad = [
                InteriorPointSettings { tolerance: value, ..default },
                InteriorPointSettings { complementarity: value, ..default },
                InteriorPointSettings { reduced: value, ..default },
            ];
            let named = bad.map(|settings| settings.validate().unwrap_err().setting);
            assert_eq!(named, ["tolerance", "complementarity", "reduced"], "{value}");
        }
        // Reduced accuracy is no better than either.
        for worse in [
            InteriorPointSettings { tolerance: 2e-6, ..default },
            InteriorPointSettings { complementarity: 2e-6, ..default },
        ] {
            assert_eq!(worse.validate().unwrap_err().setting, "reduced");
        }
    }
}
