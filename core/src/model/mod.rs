//! The world as data: orbit, target, servicer, limits and weights, and what one scenario adds.
//!
//! Nothing here moves except the target's tumble and the orbit's exact transition; the coupled
//! dynamics of bus and arm are in [`crate::dynamics`]. Defaults are exactly those of the problem
//! definition (docs/concepts/problem.md, sections 1-3 and 5-7).

mod capture;
mod feasibility;
mod fields;
#[cfg(feature = "serde")]
pub mod forms;
mod formulation;
mod grid;
mod keep_out;
mod mission;
mod orbit;
mod padding;
mod recovery;
mod refusal;
mod scenario;
mod segment;
mod servicer;
mod target;
mod typical;

pub use capture::{CAPTURE_ALIGNMENT, CaptureFailure, CaptureSearch, CaptureViolation};
pub use feasibility::{MAX_ECCENTRICITY_STEPS, MAX_NODE_TURN, MIN_NODES, Needs};
pub use fields::{Field, FieldVisitor, InvalidField, Range};
pub use formulation::{Integrator, InvalidIntegrator, Switch};
pub use grid::Grid;
pub use keep_out::{SignedDistance, signed_distance_to_box};
pub use mission::{
    Approach, Corridor, Margins, Mission, Roll, ScenarioRanges, Tolerances, Weights,
};
pub use orbit::{Body, HcwTransition, Orbit, hcw_acceleration};
pub use recovery::{RECOVERY_NAMES, Recovery};
pub use refusal::Refusal;
pub use scenario::{Scenario, Start, initial_bus_attitude};
pub use segment::{SegmentDistance, segment_to_box};
pub use servicer::{CaptureGeometry, Link, Servicer, principal_inertia};
use servicer::{largest_and_shares, moment_bounds};
pub use target::{MAX_TUMBLE_SUBSTEPS, Target, TargetState};
pub use typical::{CostUnits, Typical};
