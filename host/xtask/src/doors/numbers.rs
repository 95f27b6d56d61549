//! A plan's input as numbers in the order of `remora.h`, for doors that read no JSON: the members of
//! `RemoraMission` and `RemoraScenario` after their sizes, then mode, integrator and substeps.

use nalgebra::{Matrix3, SVector};
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::model::{
    Link, Mission, Roll, Scenario, Servicer, Start, Target, Typical,
};
use remora_core::advanced::stages::{LINKS, Mode};
use std::fmt;

/// A number as C has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// 32 bits.
    Integer(u32),
    /// A double.
    Float(f64),
}

/// Numbers in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers(pub Vec<Number>);

impl fmt::Display for Numbers {
    /// In one line; doubles have a point or an exponent, and the shortest text that means their bits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, number) in self.0.iter().enumerate() {
            f.write_str(if i == 0 { "" } else { " " })?;
            match number {
                Number::Integer(value) => write!(f, "{value}")?,
                Number::Float(value) => write!(f, "{value:?}")?,
            }
        }
        Ok(())
    }
}

impl Numbers {
    /// All as doubles, for images.
    pub fn floats(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|number| match number {
            Number::Integer(value) => f64::from(*value),
            Number::Float(value) => *value,
        })
    }

    fn count(mut self, value: u32) -> Self {
        self.0.push(Number::Integer(value));
        self
    }

    fn add<'a>(mut self, values: impl IntoIterator<Item = &'a f64>) -> Self {
        self.0.extend(values.into_iter().map(|value| Number::Float(*value)));
        self
    }

    /// A matrix, row by row.
    fn matrix(self, matrix: &Matrix3<f64>) -> Self {
        self.add(&matrix.transpose())
    }

    /// Of a mission.
    pub fn mission(mission: &Mission<LINKS>) -> Self {
        let Mission { orbit: o, approach: a, weights: w, margins: m, corridor: c, .. } = mission;
        let typical = mission.typical_magnitudes;
        let of_scale = |t: Typical| {
            let Typical { length, velocity, force, angle, rate, .. } = t;
            [length, velocity, force, angle, rate, t.joint_rate, t.bus_torque, t.joint_torque]
        };
        let directions = mission
            .roll
            .map_or([0.0; 6], |Roll { end_effector: e, port: p }| [e.x, e.y, e.z, p.x, p.y, p.z]);
        Self::default()
            .count(mission.target.gravity_gradient as u32)
            .add(&[o.gravitational_parameter, o.semi_major_axis, o.eccentricity, o.inclination])
            .target(&mission.target)
            .servicer(&mission.servicer)
            .add(&[a.duration])
            .count(a.nodes as u32)
            .count(a.clearance as u32)
            .count(a.between_nodes as u32)
            .count(u32::from(typical.is_some()))
            .add(&[a.keep_out_far, a.keep_out_near, a.keep_out_near_time])
            .add(&[a.field_of_view_half_angle, a.preset_time, a.recovery_time])
            .add(&[w.force, w.force_change, w.bus_torque, w.joint_torque])
            .add(&tolerances(mission))
            .add(&[m.joint_angle, m.joint_rate, m.keep_out, m.field_of_view, m.clearance])
            .add(&[c.half_angle, c.mouth_radius, c.end_effector_length])
            .add(&typical.map_or([0.0; 8], of_scale))
            .count(u32::from(mission.roll.is_some()))
            .count(0)
            .add(&directions)
    }

    fn target(self, target: &Target) -> Self {
        self.add(&target.half_extents)
            .add(&target.inertia)
            .add(&[target.mass])
            .add(&target.port_position)
            .add(&target.port_normal)
    }

    fn servicer(self, servicer: &Servicer<LINKS>) -> Self {
        let s = servicer;
        let bus = self.add(&[s.bus_mass]).matrix(&s.bus_inertia);
        let bus = bus.add(&s.bus_half_extents).add(&s.boresight).add(&s.arm_base);
        s.links
            .iter()
            .fold(bus, Self::link)
            .add(&s.min_joint_angle)
            .add(&s.max_joint_angle)
            .add(&s.max_joint_rate)
            .add(&s.initial_joint_angle)
            .add(&s.capture_joint_angle)
            .add(&s.max_force)
            .add(&s.max_bus_torque)
            .add(&s.max_joint_torque)
    }

    fn link(self, link: &Link) -> Self {
        let Link { tip, center_of_mass, mass, inertia, axis, armature, radius } = link;
        let so_far = self.add(tip).add(center_of_mass).add([mass]).matrix(inertia);
        so_far.add(axis).add([armature, radius])
    }

    /// Of a scenario.
    pub fn scenario(scenario: &Scenario<LINKS>) -> Self {
        let Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes } =
            scenario;
        let Start { bus_attitude, bus_rate, joint_angle, joint_rate } = start;
        Self::default()
            .count(nodes.unwrap_or(0) as u32)
            .add(target_attitude)
            .add(target_rate)
            .add(position)
            .add(velocity)
            .add(&[duration.unwrap_or(0.0)])
            .count(u32::from(bus_attitude.is_some()))
            .count(u32::from(joint_angle.is_some()))
            .add(&bus_attitude.unwrap_or_default())
            .add(bus_rate)
            .add(&joint_angle.unwrap_or_else(SVector::zeros))
            .add(joint_rate)
    }

    /// Of options.
    pub fn options(mode: Mode, integrator: Integrator) -> Self {
        let (code, substeps) = match integrator {
            Integrator::Rk4 { substeps } => (0, substeps),
            // Of no meaning, but in its range.
            Integrator::Euler => (1, Integrator::DEFAULT_SUBSTEPS),
        };
        let mode = match mode {
            Mode::Optimal => 0,
            Mode::Feasible => 1,
        };
        Self::default().count(mode).count(code).count(substeps as u32)
    }
}

fn tolerances(mission: &Mission<LINKS>) -> [f64; 11] {
    let t = &mission.tolerances;
    [
        t.dynamics,
        t.control,
        t.joint,
        t.joint_rate,
        t.pointing,
        t.preset,
        t.terminal_rate,
        t.keep_out,
        t.end_effector_position,
        t.end_effector_angle,
        t.clearance,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_capi::{RemoraMission, RemoraScenario};

    /// Bytes of a structure of these numbers, its size first; C leaves no gap between them.
    fn bytes(numbers: &Numbers) -> usize {
        let of = |number: &Number| match number {
            Number::Integer(_) => 4,
            Number::Float(_) => 8,
        };
        4 + numbers.0.iter().map(of).sum::<usize>()
    }

    #[test]
    fn numbers_fill_the_structures_of_the_header() {
        let mission = Mission::default();
        assert_eq!(bytes(&Numbers::mission(&mission)), size_of::<RemoraMission>());
        let scenario = Numbers::scenario(&Scenario::default());
        assert_eq!(bytes(&scenario), size_of::<RemoraScenario>());
    }

    #[test]
    fn text_tells_integers_from_doubles() {
        let numbers = Numbers::default().count(60).add(&[8.0, 1e-9, -0.5, 1e300]);
        assert_eq!(numbers.to_string(), "60 8.0 1e-9 -0.5 1e300");
        assert_eq!(numbers.floats().next(), Some(60.0));
    }
}
