//! How plans are flown, as a command line and files say it.

use crate::flight::{Controller, JointControl, Settings};
use crate::nominal::Surroundings;
use remora_core::advanced::guidance::{GuidanceSettings, Triggers};
use remora_core::advanced::model::{Body, Integrator, Orbit};
use remora_host::error::FieldError;
use remora_truth::{Environment, Oblateness};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Steps of guidance a second that may be asked for [Hz].
pub const RATES_HZ: RangeInclusive<f64> = 0.2..=20.0;

/// Options of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Steps of guidance a second [Hz].
    pub rate_hz: f64,
    /// Controller that flies.
    pub controller: Controller,
    /// How joints are driven.
    pub joints: JointControl,
    /// Time before capture from which the wrist camera is used [s]; zero: never.
    pub camera_s: f64,
    /// Age of a plan at which the controller that plans again does so [s].
    pub replan_every_s: f64,
    /// Whether the Earth's oblateness acts.
    pub j2: bool,
    /// Whether there is gravity at all.
    pub gravity: bool,
    /// Integrator of plans that are made in flight.
    pub integrator: Integrator,
    /// Whether histories have a row a step of guidance, not a row a second.
    pub every_step: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            rate_hz: 10.0,
            controller: Controller::Track,
            joints: JointControl::Torque,
            camera_s: 150.0,
            replan_every_s: 100.0,
            j2: false,
            gravity: true,
            integrator: Integrator::RK4,
            every_step: false,
        }
    }
}

impl Options {
    /// Refuses what cannot be flown.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check(&self) -> Result<(), FieldError> {
        let positive = self.replan_every_s > 0.0 && self.replan_every_s.is_finite();
        let not_negative = self.camera_s >= 0.0 && self.camera_s.is_finite();
        let checks = [
            ("rate_hz", RATES_HZ.contains(&self.rate_hz), "must lie between 0.2 and 20"),
            ("camera_s", not_negative, "must not be negative"),
            ("replan_every_s", positive, "must be positive"),
        ];
        match checks.into_iter().find(|(_, fits, _)| !fits) {
            Some((field, _, reason)) => Err(FieldError::new(field, reason)),
            None => Ok(()),
        }
    }

    /// Refuses effects that the body of a mission's orbit does not have.
    ///
    /// # Errors
    /// The field and why.
    pub fn check_orbit(&self, orbit: &Orbit) -> Result<(), FieldError> {
        if self.j2 && orbit.body.name != Body::EARTH.name {
            let reason = "is the Earth's, and the mission's orbit is not about it";
            return Err(FieldError::new("j2", reason));
        }
        Ok(())
    }

    /// The settings that they stand for.
    pub fn settings(&self) -> Settings {
        let usual = Settings::default();
        let triggers = Triggers { age: self.replan_every_s, ..usual.guidance.triggers };
        let earth = if self.gravity { Environment::EARTH } else { Environment::FREE };
        let environment = Environment { oblateness: self.j2.then_some(Oblateness::EARTH), ..earth };
        Settings {
            rate_hz: self.rate_hz,
            controller: self.controller,
            joints: self.joints,
            camera_s: self.camera_s,
            guidance: GuidanceSettings { triggers, ..usual.guidance },
            surroundings: Surroundings { environment, ..usual.surroundings },
            integrator: self.integrator,
            every_step: self.every_step,
            ..usual
        }
    }
}
