//! Names that planning needs, by one `use`.

pub use crate::dynamics::{Control, State};
pub use crate::executor::{ForkJoin, Sequential};
pub use crate::guidance::{
    Command, Estimate, FlightMode, FlightPlan, Guidance, GuidanceSettings, Limits, Triggers,
};
pub use crate::model::{Integrator, Refusal, Scenario, Start};
pub use crate::nalgebra::{Vector3, Vector4};
pub use crate::plan::{ArmPlan, ArmPlanner, Plan, Planner};
pub use crate::planner::memory::NetworkMemory;
pub use crate::planner::{
    GuessRecord, InitialGuess, Nominal, Options, OptionsBuilder, Report, SolveRecord, StageReport,
    Verdict,
};
pub use crate::scp::Status;
pub use crate::stages::{Mode, Verification};
pub use crate::warmstart::NetworkPolicy;
pub use remora_nn::{Model, Network};
pub use remora_qp::time::{Clock, NoClock};
pub use remora_qp::{InvalidSetting, Valid, Validate};

/// A mission for the arm that this build plans for.
pub type Mission = crate::model::Mission<{ crate::stages::LINKS }>;
