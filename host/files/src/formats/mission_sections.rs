//! The sections of mission files that give their values in another form than the core: horizon, orbit, approach.

use super::radius::Radius;
use crate::error::FieldError;
use remora_core::advanced::model::forms::degrees;
use remora_core::advanced::model::{self, Body, Switch};
use serde::{Deserialize, Serialize};

/// `[horizon]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Horizon {
    /// Number of nodes, from [`MIN_NODES`] to the compiled [`NODES`].
    pub nodes: usize,
    /// Time from the first node to the last [s].
    pub duration_s: f64,
}

/// `[orbit]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orbit {
    /// The body's gravitational parameter [m^3/s^2].
    pub gravitational_parameter_m3_s2: f64,
    /// Name of the body; left out, the Earth where the gravitational parameter is the Earth's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Radius of its surface [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_radius_m: Option<f64>,
    /// Semi-major axis [m].
    pub semi_major_axis_m: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination [rad].
    #[serde(rename = "inclination_deg", with = "degrees")]
    pub inclination_rad: f64,
}

/// `[approach]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Approach {
    /// Keep-out distance while far [m].
    pub keep_out_far_m: Radius,
    /// Keep-out distance afterwards [m].
    pub keep_out_near_m: Radius,
    /// Time before the end from which the near distance holds [s]; where it is not given 360, less on a
    /// horizon below 1200 s in proportion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_out_near_s: Option<f64>,
    /// Half angle of the field of view [rad].
    #[serde(rename = "field_of_view_half_angle_deg", with = "degrees")]
    pub field_of_view_half_angle_rad: f64,
    /// Time before the end from which the arm is in its capture configuration [s]; where it is not given
    /// 80, likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset_s: Option<f64>,
    /// Time within which a start beyond a limit is led back into it [s]; 80 where it is not given,
    /// likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery_s: Option<f64>,
    /// Whether bus and arm must stay clear of the target, and the arm of its own bus.
    pub clearance: Switch,
    /// Whether limits hold between the nodes too.
    pub between_nodes: Switch,
}

impl Orbit {
    pub(super) fn convert(&self) -> Result<model::Orbit, FieldError> {
        Ok(model::Orbit {
            gravitational_parameter_m3_s2: self.gravitational_parameter_m3_s2,
            semi_major_axis_m: self.semi_major_axis_m,
            eccentricity: self.eccentricity,
            inclination_rad: self.inclination_rad,
            body: self.body()?,
        })
    }

    /// The body, whose name, gravity and radius must fit each other.
    fn body(&self) -> Result<Body, FieldError> {
        let known = Body::with(self.gravitational_parameter_m3_s2);
        let Some(name) = &self.body else {
            return Ok(Body { radius_m: self.body_radius_m.unwrap_or(known.radius_m), ..known });
        };
        let mut body = Body::UNKNOWN;
        let plain = |c: char| c.is_ascii_graphic() || c == ' ';
        if name.trim().is_empty() || name.len() > body.name.len() || !name.chars().all(plain) {
            let reason = format!("expected 1 to {} printable characters", body.name.len());
            return Err(FieldError::new("orbit.body", reason));
        }
        body.name[..name.len()].copy_from_slice(name.to_ascii_uppercase().as_bytes());
        if (body.name == Body::EARTH.name) != (known == Body::EARTH) {
            let whose = if known == Body::EARTH { "is" } else { "is not" };
            let reason = format!("{whose} the Earth's, and orbit.body is {name}");
            return Err(FieldError::new("orbit.gravitational_parameter_m3_s2", reason));
        }
        let radius =
            self.body_radius_m.or_else(|| (known == Body::EARTH).then_some(known.radius_m));
        let Some(radius) = radius else {
            let reason = format!("is missing: the radius of {name}, which orbits must stay above");
            return Err(FieldError::new("orbit.body_radius_m", reason));
        };
        Ok(Body { radius_m: radius, ..body })
    }

    /// Refuses an orbit whose perigee is below the body's surface.
    pub(super) fn check_perigee(orbit: &model::Orbit) -> Result<(), FieldError> {
        let (a, e, radius) = (orbit.semi_major_axis_m, orbit.eccentricity, orbit.body.radius_m);
        let perigee = a * (1.0 - e);
        if perigee >= radius {
            return Ok(());
        }
        let key = if a < radius { "orbit.semi_major_axis_m" } else { "orbit.eccentricity" };
        let reason = format!(
            "the perigee is {perigee:.0} m from the body's centre, its radius is {radius:.0} m"
        );
        Err(FieldError::new(key, reason))
    }
}

impl From<&model::Orbit> for Orbit {
    /// The body is left out if its gravity implies it.
    fn from(o: &model::Orbit) -> Self {
        let is_told = o.body == Body::with(o.gravitational_parameter_m3_s2);
        let given = Some(o.body).filter(|_| !is_told);
        Self {
            gravitational_parameter_m3_s2: o.gravitational_parameter_m3_s2,
            body: given.and_then(|body| name_of(&body)),
            body_radius_m: given.map(|body| body.radius_m).filter(|radius| *radius > 0.0),
            semi_major_axis_m: o.semi_major_axis_m,
            eccentricity: o.eccentricity,
            inclination_rad: o.inclination_rad,
        }
    }
}

/// Name of a body, where it has one.
pub fn name_of(body: &Body) -> Option<String> {
    let name = String::from_utf8_lossy(&body.name);
    Some(name.trim_end_matches('\0').to_string()).filter(|name| !name.is_empty())
}

impl Approach {
    /// The approach without its keep-out distances, which follow from the servicer. On a horizon shorter
    /// than the usual one, phases that are not given are shorter too.
    pub(super) fn convert(&self, horizon: &Horizon) -> model::Approach {
        let Horizon { nodes, duration_s } = *horizon;
        let usual = model::Approach::default();
        let shorter = (duration_s / usual.duration_s).min(1.0);
        let given = |value: Option<f64>, usual: f64| value.unwrap_or(usual * shorter);
        model::Approach {
            duration_s,
            nodes,
            keep_out_far_m: 0.0,
            keep_out_near_m: 0.0,
            keep_out_near_s: given(self.keep_out_near_s, usual.keep_out_near_s),
            field_of_view_half_angle_rad: self.field_of_view_half_angle_rad,
            preset_s: given(self.preset_s, usual.preset_s),
            recovery_s: given(self.recovery_s, usual.recovery_s),
            clearance: self.clearance,
            between_nodes: self.between_nodes,
        }
    }
}

impl From<&model::Approach> for Approach {
    fn from(a: &model::Approach) -> Self {
        Self {
            keep_out_far_m: Radius::Metres(a.keep_out_far_m),
            keep_out_near_m: Radius::Metres(a.keep_out_near_m),
            keep_out_near_s: Some(a.keep_out_near_s),
            field_of_view_half_angle_rad: a.field_of_view_half_angle_rad,
            preset_s: Some(a.preset_s),
            recovery_s: Some(a.recovery_s),
            clearance: a.clearance,
            between_nodes: a.between_nodes,
        }
    }
}

impl Default for Orbit {
    fn default() -> Self {
        Self::from(&model::Orbit::default())
    }
}

impl Default for Horizon {
    fn default() -> Self {
        let model::Approach { nodes, duration_s, .. } = model::Approach::default();
        Self { nodes, duration_s }
    }
}

impl Default for Approach {
    /// Its keep-out distances follow from the servicer.
    fn default() -> Self {
        let given = Self::from(&model::Approach::default());
        Self {
            keep_out_far_m: Radius::Auto,
            keep_out_near_m: Radius::Auto,
            keep_out_near_s: None,
            preset_s: None,
            recovery_s: None,
            ..given
        }
    }
}
