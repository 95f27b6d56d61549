//! Force and torque of a bus whose URDF, as all of them, says nothing of thrusters and wheels.

use crate::formats::{Limits, Mission, MissionFile};

/// The built-in mission's limits, larger in proportion to a larger mass and moment of inertia.
pub(super) fn scale(file: &mut MissionFile, own: &Mission, decided: &mut Vec<String>) {
    let (usual, servicer) = (Mission::default(), &mut file.servicer);
    let mass = own.servicer.total_mass() / usual.servicer.total_mass();
    let inertia = largest_moment(own) / largest_moment(&usual);
    let usual = &usual.servicer;
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
fn largest_moment(mission: &Mission) -> f64 {
    let servicer = &mission.servicer;
    servicer.system_inertia(&servicer.initial_joint_angle_rad).symmetric_eigenvalues().max()
}

/// Two digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}
