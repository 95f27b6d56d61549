//! How a plan is flown.

use crate::judge::Criteria;
use crate::navigation::Filters;
use crate::nominal::Surroundings;
use remora_core::advanced::guidance::{GuidanceSettings, Triggers};
use remora_core::advanced::model::Integrator;
use remora_host::choice::choices;
use serde::{Deserialize, Serialize};

choices! {
    /// Controller of a flight.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Controller {
        /// Guidance tracks the plan.
        Track = "track",
        /// Guidance tracks the plan, and plans again.
        Replan = "replan",
    }
}

choices! {
    /// Drive of the joints.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum JointControl {
        /// By torques.
        Torque = "torque",
        /// By angle and rate references that loops of their own follow.
        Servo = "servo",
    }
}

/// A way out of an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The abort that guidance flies.
    Escape,
    /// No control at all, for one orbit.
    Drift,
}

/// How a plan is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Steps of guidance a second [Hz].
    pub rate_hz: f64,
    /// Controller of a flight.
    pub controller: Controller,
    /// Drive of the joints.
    pub joints: JointControl,
    /// Time before capture from which the wrist camera is used [s]; zero: never.
    pub camera_s: f64,
    /// Time that planning again takes [s].
    pub lead_s: f64,
    /// Guidance's own settings; its triggers count where the controller plans again.
    pub guidance: GuidanceSettings,
    /// Navigation's filters.
    pub filters: Filters,
    /// Gravity and what follows from it.
    pub surroundings: Surroundings,
    /// Criteria of a capture.
    pub criteria: Criteria,
    /// Integrator of plans that are made in flight.
    pub integrator: Integrator,
    /// Whether the watcher sees every step of guidance, not one a second.
    pub every_step: bool,
    /// When the approach is left, and by which way [s]; how near it came to limits then counts from
    /// there.
    pub leaving: Option<(f64, Way)>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rate_hz: 10.0,
            controller: Controller::Track,
            joints: JointControl::Torque,
            camera_s: 150.0,
            lead_s: 5.0,
            guidance: GuidanceSettings {
                triggers: Triggers { age: 100.0, last: 150.0, ..Triggers::NEVER },
                ..GuidanceSettings::DEFAULT
            },
            filters: Filters::default(),
            surroundings: Surroundings::default(),
            criteria: Criteria::default(),
            integrator: Integrator::RK4,
            every_step: false,
            leaving: None,
        }
    }
}
