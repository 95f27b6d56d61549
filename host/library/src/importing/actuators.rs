//! Force and torque of a bus whose URDF, as all of them, says nothing of thrusters and wheels.

use crate::formats::{Limits, MissionFile};
use remora_core::advanced::model::{Mission, Servicer};

/// The built-in mission's limits, larger in proportion to a larger mass and moment of inertia.
pub(super) fn scale<const NL: usize>(
    file: &mut MissionFile,
    mission: &Mission<NL>,
    decided: &mut Vec<String>,
) {
    let (own, usual) = (&mission.servicer, Servicer::default());
    let mass = own.total_mass() / usual.total_mass();
    let inertia = largest_moment(own) / largest_moment(&usual);
    let servicer = &mut file.servicer;
    if mass > 1.0 {
        let limit = rounded(usual.max_force.max() * mass);
        servicer.force_limit_n = Limits::Same(limit);
        decided
            .push(format!("thrusters of {limit} N: the built-in mission's, as the mass is larger"));
    }
    if inertia > 1.0 {
        let limit = rounded(usual.max_bus_torque.max() * inertia);
        servicer.bus_torque_limit_n_m = Limits::Same(limit);
        decided.push(format!(
            "wheels of {limit} N m: the built-in mission's, as the inertia is larger"
        ));
    }
}

/// Largest moment of inertia of bus and arm at the start [kg m^2].
fn largest_moment<const NL: usize>(servicer: &Servicer<NL>) -> f64 {
    servicer.system_inertia(&servicer.initial_joint_angle).symmetric_eigenvalues().max()
}

/// Two digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}
