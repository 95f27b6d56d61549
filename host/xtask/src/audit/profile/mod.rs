//! How long plans take on pinned cores, phase by phase: the work of `cargo xtask profile`.
//!
//! Every configuration (integrator, warm start, mode) plans every scenario in three cases: on one
//! core, with its linearisations shared between two, and with a second core that plans the same at
//! the same time. Scenario by scenario all of them take their turn, so that they are measured under the same load. How it is
//! measured, and what the words mean, is told in `docs/evidence/verification.md`.

mod counter;
mod journal;
mod machine;
mod order;
mod pin;
mod report;
mod results;
mod run;
mod sample;
mod spread;

pub use counter::Instructions;
pub use machine::Machine;
pub use order::{Case, Configuration, Job, Rounds};
pub use pin::{Pinning, pin_pair};
pub use report::{profile_preamble, profile_report};
pub use results::{Bar, CaseProfile, ConfigurationProfile, PHASES, PhaseSpread, Profile};
pub use run::Profiler;
pub use sample::WARM_UP_PLANS;
pub use spread::{ENOUGH_FOR_P999, Spread};
