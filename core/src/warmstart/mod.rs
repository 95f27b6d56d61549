//! The learned initial guess of Stage 2: features of a node, actions, and their rollout through the
//! dynamics of Stage 2.
//!
//! - [`Scene`]: all that is known of an approach once Stage 1 is planned;
//! - [`Scene::features`]: what a node looks like, in the paper's inputs or in bus axes;
//! - [`Scene::apply`]: torques, or the rates to reach next, from which inverse dynamics make torques;
//! - [`roll_out`]: node by node, the state that was reached is the next thing the network sees.
//!
//! All of it is for an arm of any number of joints, known when the program is compiled; whether a policy is
//! for that number is asked of it. Who answers is a [`Policy`]: the quantised network in flight, anything else in tests.

mod action;
mod network;
mod rollout;
mod scene;
mod tokens;

pub use action::{ACTION, Action};
pub use network::{Meaning, NetworkPolicy, Unfit, check_model};
pub use rollout::{MAX_CHUNK, MAX_DEVIATION, Policy, is_known, rollout};
pub use scene::Scene;
pub use tokens::{Encoding, MAX_FEATURES, MAX_JOINTS};
