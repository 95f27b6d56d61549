//! A mission's values as a mission file: the problem definition's, and those of any other.

use super::mission_capture::Roll;
use super::mission_file::{FORMAT, MissionFile};
use super::mission_sections::{
    Approach, Corridor, Horizon, Margins, Orbit, Scenarios, Target, Tolerances, Typical, Weights,
    radians,
};
use super::mission_servicer::Servicer;
use super::radius::Radius;
use remora_core::advanced::model::{self, Mission};
use remora_core::advanced::stages::LINKS;
use std::f64::consts::PI;

/// The degrees that a file's reader turns into exactly these radians, the shortest of those next to
/// the quotient; the quotient itself where there are none.
pub(super) fn degrees(angle: f64) -> f64 {
    let near = angle * 180.0 / PI;
    let (mut below, mut above) = (near, near);
    let mut candidates = vec![near];
    for _ in 0..4 {
        (below, above) = (below.next_down(), above.next_up());
        candidates.extend([below, above]);
    }
    let exact = candidates.into_iter().filter(|d| radians(*d).to_bits() == angle.to_bits());
    exact.min_by_key(|d| d.to_string().len()).unwrap_or(near)
}

impl MissionFile {
    /// The file of a mission with every number given: nothing is left to be derived but whether a
    /// part that is `auto` is in force.
    pub fn of<const NL: usize>(mission: &Mission<NL>) -> Self {
        let model::Approach { nodes, duration: duration_s, .. } = mission.approach;
        Self {
            format: FORMAT.into(),
            horizon: Horizon { nodes, duration_s },
            orbit: Orbit::from(&mission.orbit),
            target: Target::from(&mission.target),
            approach: Approach::from(&mission.approach),
            weights: Weights::from(&mission.weights),
            tolerances: Tolerances::from(&mission.tolerances),
            margins: Margins::from(&mission.margins),
            corridor: Corridor::from(&mission.corridor),
            scenarios: Scenarios::from(&mission.scenarios),
            typical: mission.typical_magnitudes.as_ref().map(Typical::from),
            roll: mission.roll.as_ref().map(Roll::from),
            servicer: Servicer::from(&mission.servicer),
        }
    }
}

impl Default for MissionFile {
    fn default() -> Self {
        let mut file = Self::of(&Mission::<LINKS>::default());
        // Its keep-out distances follow from the servicer.
        file.approach = Approach::default();
        file.servicer = Servicer::default();
        file
    }
}

impl From<&model::Orbit> for Orbit {
    /// The body is left out if its gravity implies it.
    fn from(o: &model::Orbit) -> Self {
        let is_told = o.body == model::Body::with(o.gravitational_parameter);
        let given = Some(o.body).filter(|_| !is_told);
        Self {
            gravitational_parameter_m3_s2: o.gravitational_parameter,
            body: given.and_then(|body| name_of(&body)),
            body_radius_m: given.map(|body| body.radius).filter(|radius| *radius > 0.0),
            semi_major_axis_m: o.semi_major_axis,
            eccentricity: o.eccentricity,
            inclination_deg: degrees(o.inclination),
        }
    }
}

/// Name of a body, where it has one.
pub fn name_of(body: &model::Body) -> Option<String> {
    let name = String::from_utf8_lossy(&body.name);
    Some(name.trim_end_matches('\0').to_string()).filter(|name| !name.is_empty())
}

impl From<&model::Target> for Target {
    fn from(t: &model::Target) -> Self {
        Self {
            half_extents_m: t.half_extents.into(),
            inertia_kg_m2: t.inertia.into(),
            mass_kg: t.mass,
            port_position_m: t.port_position.into(),
            port_normal: t.port_normal.into(),
            gravity_gradient: t.gravity_gradient,
        }
    }
}

impl From<&model::Approach> for Approach {
    fn from(a: &model::Approach) -> Self {
        Self {
            keep_out_far_m: Radius::Metres(a.keep_out_far),
            keep_out_near_m: Radius::Metres(a.keep_out_near),
            keep_out_near_s: Some(a.keep_out_near_time),
            field_of_view_half_angle_deg: degrees(a.field_of_view_half_angle),
            preset_s: Some(a.preset_time),
            recovery_s: Some(a.recovery_time),
            clearance: a.clearance,
            between_nodes: a.between_nodes,
        }
    }
}

impl From<&model::Weights> for Weights {
    fn from(w: &model::Weights) -> Self {
        Self {
            force: w.force,
            force_change: w.force_change,
            bus_torque: w.bus_torque,
            joint_torque: w.joint_torque,
        }
    }
}

impl From<&model::Tolerances> for Tolerances {
    fn from(t: &model::Tolerances) -> Self {
        Self {
            dynamics: t.dynamics,
            control: t.control,
            joint_rad: t.joint,
            joint_rate: t.joint_rate,
            pointing: t.pointing,
            preset: t.preset,
            terminal_rate: t.terminal_rate,
            keep_out_m: t.keep_out,
            ee_position_m: t.end_effector_position,
            ee_angle_rad: t.end_effector_angle,
            clearance_m: t.clearance,
        }
    }
}

impl From<&model::Margins> for Margins {
    fn from(m: &model::Margins) -> Self {
        Self {
            joint_angle_rad: m.joint_angle,
            joint_rate: m.joint_rate,
            keep_out_m: m.keep_out,
            field_of_view_deg: degrees(m.field_of_view),
            clearance_m: m.clearance,
        }
    }
}

impl From<&model::Corridor> for Corridor {
    fn from(c: &model::Corridor) -> Self {
        Self {
            half_angle_deg: degrees(c.half_angle),
            mouth_radius_m: c.mouth_radius,
            end_effector_length_m: c.end_effector_length,
        }
    }
}

impl From<&model::ScenarioRanges> for Scenarios {
    fn from(s: &model::ScenarioRanges) -> Self {
        Self {
            standoff_m: s.standoff,
            offset_m: s.offset.into(),
            rate_rad_s: s.rate,
            rate_norm_deg_s: s.rate_norm.map(degrees),
            velocity_m_s: s.velocity,
        }
    }
}

impl From<&model::Typical> for Typical {
    fn from(t: &model::Typical) -> Self {
        Self {
            length_m: t.length,
            velocity_m_s: t.velocity,
            force_n: t.force,
            angle_rad: t.angle,
            rate_rad_s: t.rate,
            joint_rate_rad_s: t.joint_rate,
            bus_torque_n_m: t.bus_torque,
            joint_torque_n_m: t.joint_torque,
        }
    }
}

/// What a file leaves out is the problem definition's.
macro_rules! default_is_the_problems {
    ($($section:ident: $core:ty),+) => {
        $(impl Default for $section {
            fn default() -> Self {
                Self::from(&<$core>::default())
            }
        })+
    };
}

default_is_the_problems!(
    Orbit: model::Orbit,
    Target: model::Target,
    Weights: model::Weights,
    Tolerances: model::Tolerances,
    Margins: model::Margins,
    Corridor: model::Corridor,
    Scenarios: model::ScenarioRanges
);

impl Default for Horizon {
    fn default() -> Self {
        let model::Approach { nodes, duration, .. } = model::Approach::default();
        Self { nodes, duration_s: duration }
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
