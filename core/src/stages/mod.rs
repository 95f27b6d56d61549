//! The two stages as problems for the loop, the heuristic start, and the independent verifier.

pub mod heuristic;
mod reorientation;
mod translation;
mod verifier;

pub use reorientation::{Mode, Reorientation, ReorientationTrajectory};
pub use translation::{Translation, TranslationTrajectory};
pub use verifier::{Residuals, verify, verify_translation};

/// Nodes of the mission's horizon.
pub const NODES: usize = 60;
/// Links of the mission's arm.
pub const LINKS: usize = 3;

/// States, controls and soft rows a node of Stage 1's subproblem: position, velocity and the
/// force of the interval before; force; keep-out.
pub mod translation_size {
    /// States.
    pub const NX: usize = 9;
    /// Controls.
    pub const NU: usize = 3;
    /// Soft rows.
    pub const NR: usize = 1;
}

/// States, controls and soft rows a node of Stage 2's subproblem for the mission's arm: attitude
/// and joints with their rates; torques; pointing.
pub mod reorientation_size {
    use super::LINKS;
    /// States.
    pub const NX: usize = 6 + 2 * LINKS;
    /// Controls.
    pub const NU: usize = 3 + LINKS;
    /// Soft rows.
    pub const NR: usize = 1;
}
