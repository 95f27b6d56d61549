//! An arm in a build with room for more joints.

use super::{Link, Mission, Scenario, Servicer, Start};
use nalgebra::{Matrix3, SVector, Vector3};

/// The first `M` of `values`; `rest` where there are no more.
fn resized<const NL: usize, const M: usize>(
    values: &SVector<f64, NL>,
    rest: f64,
) -> SVector<f64, M> {
    SVector::from_fn(|i, _| values.iter().nth(i).copied().unwrap_or(rest))
}

impl Link {
    /// A link that is not there: without mass, length or radius, on a rotor of this inertia [kg m^2] that
    /// no other body feels.
    const fn absent(armature: f64) -> Self {
        Self {
            tip: Vector3::new(0.0, 0.0, 0.0),
            center_of_mass: Vector3::new(0.0, 0.0, 0.0),
            mass: 0.0,
            inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            axis: Vector3::new(0.0, 0.0, 1.0),
            armature,
            radius: 0.0,
        }
    }
}

impl<const NL: usize> Servicer<NL> {
    /// The same servicer for a build with room for `M` joints. Those beyond its own are at the tip, turn
    /// nothing, and stand at zero from start to capture, with the limits of its first; where `M` is
    /// smaller, the joints beyond it are cut off.
    pub fn resized<const M: usize>(&self) -> Servicer<M> {
        let first = |limits: &SVector<f64, NL>| limits.iter().next().copied().unwrap_or(1.0);
        let (rate, torque) = (first(&self.max_joint_rate), first(&self.max_joint_torque));
        let absent = Link::absent(self.inertia_beyond(0));
        Servicer {
            bus_mass: self.bus_mass,
            bus_inertia: self.bus_inertia,
            bus_half_extents: self.bus_half_extents,
            boresight: self.boresight,
            arm_base: self.arm_base,
            links: core::array::from_fn(|i| self.links.get(i).copied().unwrap_or(absent)),
            min_joint_angle: resized(&self.min_joint_angle, -1.0),
            max_joint_angle: resized(&self.max_joint_angle, 1.0),
            max_joint_rate: resized(&self.max_joint_rate, rate),
            initial_joint_angle: resized(&self.initial_joint_angle, 0.0),
            capture_joint_angle: resized(&self.capture_joint_angle, 0.0),
            max_force: self.max_force,
            max_bus_torque: self.max_bus_torque,
            max_joint_torque: resized(&self.max_joint_torque, torque),
        }
    }
}

impl<const NL: usize> Mission<NL> {
    /// The same mission for a build with room for `M` joints: see [`Servicer::resized`].
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
    /// The same scenario for a build with room for `M` joints: see [`Servicer::resized`].
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
