//! Which of the two problems is solved: the paper's at the nodes, or the one to fly.

/// How an interval of Stage 2 is integrated; controls are held over it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// One explicit Euler step, the quaternion renormalised: the paper's.
    Euler,
    /// Classical RK4 in so many equal substeps, the quaternion renormalised after each: the one
    /// to fly.
    Rk4 {
        /// Number of substeps, at least one.
        substeps: usize,
    },
}

impl Integrator {
    /// RK4 with [`Integrator::DEFAULT_SUBSTEPS`].
    pub const RK4: Self = Self::Rk4 { substeps: Self::DEFAULT_SUBSTEPS };
    /// Substeps a node of plain `rk4`.
    pub const DEFAULT_SUBSTEPS: usize = 8;
    /// Fewest substeps a node of a plan: with fewer, plans miss the port when they are flown.
    pub const MIN_SUBSTEPS: usize = 4;
    /// Most substeps a node of a plan.
    pub const MAX_SUBSTEPS: usize = 1000;

    /// Whether its plans are made to be flown: RK4's are, Euler's follow the paper.
    pub fn is_flown(self) -> bool {
        matches!(self, Self::Rk4 { .. })
    }
}

/// Whether a part of the problem that the paper does not have is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum Switch {
    /// In force where the plan is made to be flown: with RK4, not with Euler.
    #[default]
    Auto = 0,
    /// In force.
    On = 1,
    /// Not in force.
    Off = 2,
}

impl Switch {
    /// Whether it is in force under `integrator`.
    pub fn is_on(self, integrator: Integrator) -> bool {
        match self {
            Self::Auto => integrator.is_flown(),
            Self::On => true,
            Self::Off => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_is_on_for_what_is_flown() {
        let (euler, rk4) = (Integrator::Euler, Integrator::Rk4 { substeps: 4 });
        assert!(Switch::Auto.is_on(rk4) && !Switch::Auto.is_on(euler));
        assert!(Switch::On.is_on(euler) && !Switch::Off.is_on(rk4));
    }
}
