//! The sections of mission files but for the servicer, and what they mean.

use super::radius::Radius;
use super::unit;
use crate::error::FieldError;
use nalgebra::Vector3;
use remora_core::advanced::model::{self, Body, Switch};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// `[margins]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Margins {
    /// From the joint stops [rad].
    pub joint_angle_rad: f64,
    /// Share of the joint rate limit left unused.
    pub joint_rate: f64,
    /// From the keep-out distances [m].
    pub keep_out_m: f64,
    /// From the edge of the field of view [deg].
    pub field_of_view_deg: f64,
    /// Between bodies [m].
    pub clearance_m: f64,
}

/// `[corridor]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Corridor {
    /// Half angle of the cone about the port's normal [deg].
    pub half_angle_deg: f64,
    /// Radius of the cone at the port [m].
    pub mouth_radius_m: f64,
    /// Length of the last link's end that only the corridor concerns [m].
    pub end_effector_length_m: f64,
}

/// `[typical]`: all keys or none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Typical {
    /// Position [m].
    pub length_m: f64,
    /// Velocity [m/s].
    pub velocity_m_s: f64,
    /// Force [N].
    pub force_n: f64,
    /// Attitude and joint angles [rad].
    pub angle_rad: f64,
    /// Bus rate [rad/s].
    pub rate_rad_s: f64,
    /// Joint rates [rad/s].
    pub joint_rate_rad_s: f64,
    /// Bus torque [N m].
    pub bus_torque_n_m: f64,
    /// Joint torques [N m].
    pub joint_torque_n_m: f64,
}

/// `[scenarios]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenarios {
    /// Distance in front of the port about which starts are drawn [m].
    pub standoff_m: f64,
    /// Half widths of the offset from there, RTN axes [m].
    pub offset_m: [f64; 3],
    /// Half width of each component of the target's rate [rad/s].
    pub rate_rad_s: f64,
    /// Norm of the target's rate, its direction then uniform [deg/s]; left out, the components are
    /// drawn one by one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_norm_deg_s: Option<f64>,
    /// Half width of each component of the servicer's velocity [m/s].
    pub velocity_m_s: f64,
}

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
    /// Inclination [deg].
    pub inclination_deg: f64,
}

/// `[target]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Target {
    /// Half edge lengths of its box [m].
    pub half_extents_m: [f64; 3],
    /// Principal moments of inertia [kg m^2].
    pub inertia_kg_m2: [f64; 3],
    /// Mass [kg].
    pub mass_kg: f64,
    /// Docking port, target body axes [m].
    pub port_position_m: [f64; 3],
    /// Outward unit normal of the port.
    pub port_normal: [f64; 3],
    /// Whether the gravity gradient turns it.
    pub gravity_gradient: Switch,
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
    /// Half angle of the field of view [deg].
    pub field_of_view_half_angle_deg: f64,
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

/// `[weights]`, on controls divided by their limits
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Weights {
    /// `W1`: force.
    pub force: f64,
    /// `W2`: change of force from node to node.
    pub force_change: f64,
    /// `W3`, first block: bus torque.
    pub bus_torque: f64,
    /// `W3`, second block: joint torque.
    pub joint_torque: f64,
}

/// `[tolerances]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tolerances {
    /// Dynamics defects, scaled.
    pub dynamics: f64,
    /// Control bounds, relative.
    pub control: f64,
    /// Joint limits [rad].
    pub joint_rad: f64,
    /// Joint rate limit, relative.
    pub joint_rate: f64,
    /// Pointing, in cosine.
    pub pointing: f64,
    /// Arm preset, scaled.
    pub preset: f64,
    /// Terminal bus rate, scaled.
    pub terminal_rate: f64,
    /// Keep-out distance [m].
    pub keep_out_m: f64,
    /// End effector at the port [m].
    pub ee_position_m: f64,
    /// Approach direction [rad].
    pub ee_angle_rad: f64,
    /// Overlap of bodies [m].
    pub clearance_m: f64,
}

impl Typical {
    pub(super) fn convert(&self) -> model::Typical {
        model::Typical {
            length: self.length_m,
            velocity: self.velocity_m_s,
            force: self.force_n,
            angle: self.angle_rad,
            rate: self.rate_rad_s,
            joint_rate: self.joint_rate_rad_s,
            bus_torque: self.bus_torque_n_m,
            joint_torque: self.joint_torque_n_m,
        }
    }
}

impl Orbit {
    pub(super) fn convert(&self) -> Result<model::Orbit, FieldError> {
        Ok(model::Orbit {
            gravitational_parameter: self.gravitational_parameter_m3_s2,
            semi_major_axis: self.semi_major_axis_m,
            eccentricity: self.eccentricity,
            inclination: radians(self.inclination_deg),
            body: self.body()?,
        })
    }

    /// The body, whose name, gravity and radius must fit each other.
    fn body(&self) -> Result<Body, FieldError> {
        let known = Body::with(self.gravitational_parameter_m3_s2);
        let Some(name) = &self.body else {
            return Ok(Body { radius: self.body_radius_m.unwrap_or(known.radius), ..known });
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
        let radius = self.body_radius_m.or_else(|| (known == Body::EARTH).then_some(known.radius));
        let Some(radius) = radius else {
            let reason = format!("is missing: the radius of {name}, which orbits must stay above");
            return Err(FieldError::new("orbit.body_radius_m", reason));
        };
        Ok(Body { radius, ..body })
    }

    /// Refuses an orbit whose perigee is below the body's surface.
    pub(super) fn check_perigee(orbit: &model::Orbit) -> Result<(), FieldError> {
        let (a, e, radius) = (orbit.semi_major_axis, orbit.eccentricity, orbit.body.radius);
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

impl Approach {
    /// The approach without its keep-out distances, which follow from the servicer. On a horizon shorter
    /// than the usual one, phases that are not given are shorter too.
    pub(super) fn convert(&self, horizon: &Horizon) -> model::Approach {
        let Horizon { nodes, duration_s: duration } = *horizon;
        let usual = model::Approach::default();
        let shorter = (duration / usual.duration).min(1.0);
        let given = |time: Option<f64>, usual: f64| time.unwrap_or(usual * shorter);
        model::Approach {
            duration,
            nodes,
            keep_out_far: 0.0,
            keep_out_near: 0.0,
            keep_out_near_time: given(self.keep_out_near_s, usual.keep_out_near_time),
            field_of_view_half_angle: radians(self.field_of_view_half_angle_deg),
            preset_time: given(self.preset_s, usual.preset_time),
            recovery_time: given(self.recovery_s, usual.recovery_time),
            clearance: self.clearance,
            between_nodes: self.between_nodes,
        }
    }
}

impl Weights {
    pub(super) fn convert(&self) -> model::Weights {
        model::Weights {
            force: self.force,
            force_change: self.force_change,
            bus_torque: self.bus_torque,
            joint_torque: self.joint_torque,
        }
    }
}

impl Tolerances {
    pub(super) fn convert(&self) -> model::Tolerances {
        model::Tolerances {
            dynamics: self.dynamics,
            control: self.control,
            joint: self.joint_rad,
            joint_rate: self.joint_rate,
            pointing: self.pointing,
            preset: self.preset,
            terminal_rate: self.terminal_rate,
            keep_out: self.keep_out_m,
            end_effector_position: self.ee_position_m,
            end_effector_angle: self.ee_angle_rad,
            clearance: self.clearance_m,
        }
    }
}

impl Margins {
    pub(super) fn convert(&self) -> model::Margins {
        model::Margins {
            joint_angle: self.joint_angle_rad,
            joint_rate: self.joint_rate,
            keep_out: self.keep_out_m,
            field_of_view: radians(self.field_of_view_deg),
            clearance: self.clearance_m,
        }
    }
}

impl Corridor {
    pub(super) fn convert(&self) -> model::Corridor {
        model::Corridor {
            half_angle: radians(self.half_angle_deg),
            mouth_radius: self.mouth_radius_m,
            end_effector_length: self.end_effector_length_m,
        }
    }
}

impl Scenarios {
    pub(super) fn convert(&self) -> model::ScenarioRanges {
        model::ScenarioRanges {
            standoff: self.standoff_m,
            offset: Vector3::from(self.offset_m),
            rate: self.rate_rad_s,
            rate_norm: self.rate_norm_deg_s.map(radians),
            velocity: self.velocity_m_s,
        }
    }
}

impl Target {
    pub(super) fn convert(&self) -> Result<model::Target, FieldError> {
        let port_normal = unit::direction(&self.port_normal, || "target.port_normal".into())?;
        Ok(model::Target {
            half_extents: Vector3::from(self.half_extents_m),
            inertia: Vector3::from(self.inertia_kg_m2),
            mass: self.mass_kg,
            port_position: Vector3::from(self.port_position_m),
            port_normal: port_normal.into(),
            gravity_gradient: self.gravity_gradient,
        })
    }
}

/// Radians of degrees.
pub(super) fn radians(degrees: f64) -> f64 {
    degrees * PI / 180.0
}
