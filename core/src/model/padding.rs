//! An arm in a build with room for more joints.

use super::{Link, Mission, Scenario, Servicer, Start};
use nalgebra::SVector;

/// The first `M` of `values`; `rest` where there are no more.
fn resized<const NL: usize, const M: usize>(
    values: &SVector<f64, NL>,
    rest: f64,
) -> SVector<f64, M> {
    SVector::from_fn(|i, _| values.iter().nth(i).copied().unwrap_or(rest))
}

impl<const NL: usize> Servicer<NL> {
    /// This servicer for a build with room for `M` joints. Those beyond its own are at the tip, turn
    /// nothing, and stand at zero from start to capture, with the limits of its first; where `M` is
    /// smaller, the joints beyond it are cut off.
    pub fn resized<const M: usize>(&self) -> Servicer<M> {
        let first = |limits: &SVector<f64, NL>| limits.iter().next().copied().unwrap_or(1.0);
        let (rate, torque) =
            (first(&self.joint_rate_limit_rad_s), first(&self.joint_torque_limit_n_m));
        // Its rotor is felt by no other body.
        let absent = Link { armature_kg_m2: self.inertia_beyond(0), ..Link::default() };
        Servicer {
            bus_mass_kg: self.bus_mass_kg,
            bus_inertia_kg_m2: self.bus_inertia_kg_m2,
            bus_half_extents_m: self.bus_half_extents_m,
            boresight: self.boresight,
            arm_base_m: self.arm_base_m,
            links: core::array::from_fn(|i| self.links.get(i).copied().unwrap_or(absent)),
            min_joint_angle_rad: resized(&self.min_joint_angle_rad, -1.0),
            max_joint_angle_rad: resized(&self.max_joint_angle_rad, 1.0),
            joint_rate_limit_rad_s: resized(&self.joint_rate_limit_rad_s, rate),
            initial_joint_angle_rad: resized(&self.initial_joint_angle_rad, 0.0),
            capture_joint_angle_rad: resized(&self.capture_joint_angle_rad, 0.0),
            force_limit_n: self.force_limit_n,
            bus_torque_limit_n_m: self.bus_torque_limit_n_m,
            joint_torque_limit_n_m: resized(&self.joint_torque_limit_n_m, torque),
        }
    }
}

impl<const NL: usize> Mission<NL> {
    /// This mission for a build with room for `M` joints: see [`Servicer::resized`].
    ///
    /// ```
    /// use remora_core::prelude::*;
    ///
    /// let mission = Mission::default();
    /// let roomy = mission.resized::<7>();
    /// assert_eq!(roomy.servicer.total_mass(), mission.servicer.total_mass());
    /// assert_eq!(roomy.resized::<3>(), mission);
    /// ```
    pub fn resized<const M: usize>(&self) -> Mission<M> {
        self.with(self.servicer.resized())
    }
}

impl<const NL: usize> Scenario<NL> {
    /// This scenario for a build with room for `M` joints: see [`Servicer::resized`].
    pub fn resized<const M: usize>(&self) -> Scenario<M> {
        let Self { target_attitude, target_rate, position, velocity, start, duration, nodes } =
            *self;
        let Start { bus_attitude, bus_rate, joint_angle, joint_rate } = start;
        let joint_angle = joint_angle.map(|angle| resized(&angle, 0.0));
        let joint_rate = resized(&joint_rate, 0.0);
        let start = Start { bus_attitude, bus_rate, joint_angle, joint_rate };
        Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes }
    }
}
