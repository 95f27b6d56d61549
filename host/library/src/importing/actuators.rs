//! Force and torque of a bus whose URDF, as all of them, says nothing of thrusters and wheels.

use crate::formats::{Limits, MissionFile};
use remora_core::advanced::model::Servicer;

/// The built-in mission's limits, larger in proportion to a larger mass and moment of inertia.
pub(super) fn scale<const NL: usize>(
    file: &mut MissionFile,
    own: &Servicer<NL>,
    decided: &mut Vec<String>,
) {
    scale_to(file, [own.total_mass(), largest_moment(own)], decided);
}

/// The same for so much mass [kg] and such a moment of inertia [kg m^2].
fn scale_to(file: &mut MissionFile, [mass, inertia]: [f64; 2], decided: &mut Vec<String>) {
    let (usual, servicer) = (Servicer::default(), &mut file.servicer);
    let (mass, inertia) = (mass / usual.total_mass(), inertia / largest_moment(&usual));
    if mass > 1.0 {
        let limit = rounded(usual.force_limit_n.max() * mass);
        servicer.force_limit_n = Limits::Same(limit);
        decided
            .push(format!("thrusters of {limit} N: the built-in mission's, as the mass is larger"));
    }
    if inertia > 1.0 {
        let limit = rounded(usual.bus_torque_limit_n_m.max() * inertia);
        servicer.bus_torque_limit_n_m = Limits::Same(limit);
        decided.push(format!(
            "wheels of {limit} N m: the built-in mission's, as the inertia is larger"
        ));
    }
}

/// Largest moment of inertia of bus and arm at the start [kg m^2].
fn largest_moment<const NL: usize>(servicer: &Servicer<NL>) -> f64 {
    servicer.system_inertia(&servicer.initial_joint_angle_rad).symmetric_eigenvalues().max()
}

/// Two digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}
