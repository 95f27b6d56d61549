//! Settings of the interior-point method.

/// Settings of the interior-point method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteriorPointSettings {
    /// Most iterations. Default 50.
    pub max_iterations: u32,
    /// KKT residuals and complementarity of a solved program, in its own (scaled) units. Default
    /// 1e-9; positive.
    pub tolerance: f64,
    /// What still counts as solved to a reduced accuracy. Default 1e-6; at least `tolerance`.
    pub reduced_tolerance: f64,
    /// Whether to start from the last subproblem's multipliers. Default true.
    pub warm_start: bool,
    /// Exactly this many iterations, whatever the residuals, for those who need constant time.
    /// Default none.
    pub fixed_iterations: Option<u32>,
}

impl InteriorPointSettings {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        max_iterations: 50,
        tolerance: 1e-9,
        reduced_tolerance: 1e-6,
        warm_start: true,
        fixed_iterations: None,
    };
}

impl Default for InteriorPointSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}
