//! Tables of profile and injection, for terminal and pages.

mod inject;
mod profile;

pub use inject::{injection_report, replay_report};
pub use profile::{profile_preamble, profile_report};
