//! A mission as C has it.
#![allow(unsafe_code, reason = "says what a structure begins with")]

use crate::RemoraStatus;
use crate::abi::REMORA_JOINTS;
use crate::pointers::Sized32;
use remora_core::advanced::model::{
    Approach, Corridor, Link, Margins, Orbit, Roll, Servicer, Switch, Target, Tolerances, Typical,
    Weights,
};
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::nalgebra::{Matrix3, Vector3};
use remora_core::prelude::Mission;

/// One link of the arm, in axes that are parallel to the bus's while all joints are at zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraLink {
    /// From its joint to the next one, for the last link to the end effector [m].
    pub tip: [f64; 3],
    /// Centre of mass from its joint [m].
    pub center_of_mass: [f64; 3],
    /// Mass [kg].
    pub mass: f64,
    /// Inertia about the centre of mass [kg m^2]; symmetric.
    pub inertia: [[f64; 3]; 3],
    /// Unit joint axis.
    pub axis: [f64; 3],
    /// Inertia of the joint's rotor, times the gear ratio squared [kg m^2].
    pub armature: f64,
    /// Radius of the capsule that holds the link [m].
    pub radius: f64,
}

/// Everything that is the same for every approach: orbit, target, servicer, limits, tolerances. What each
/// number means is told in docs/problem.md; remora_defaults fills in the mission of that page.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraMission {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Whether the gravity gradient turns the target: 0 with RK4 only, 1 yes, 2 no.
    pub gravity_gradient: u32,
    /// Earth's gravitational parameter [m^3/s^2].
    pub gravitational_parameter: f64,
    /// Semi-major axis of the target's orbit [m].
    pub semi_major_axis: f64,
    /// Its eccentricity.
    pub eccentricity: f64,
    /// Its inclination [rad].
    pub inclination: f64,

    /// Half edge lengths of the target's box [m].
    pub target_half_extents: [f64; 3],
    /// Principal moments of inertia of the target [kg m^2].
    pub target_inertia: [f64; 3],
    /// Mass of the target [kg].
    pub target_mass: f64,
    /// Docking port, target axes [m].
    pub port_position: [f64; 3],
    /// Its outward unit normal.
    pub port_normal: [f64; 3],

    /// Mass of the bus [kg].
    pub bus_mass: f64,
    /// Inertia of the bus about its centre of mass [kg m^2]; symmetric.
    pub bus_inertia: [[f64; 3]; 3],
    /// Half edge lengths of the box about the bus's centre of mass [m].
    pub bus_half_extents: [f64; 3],
    /// Unit boresight of the camera, bus axes.
    pub boresight: [f64; 3],
    /// First joint from the bus's centre of mass, bus axes [m].
    pub arm_base: [f64; 3],
    /// The arm, from the bus outwards.
    pub links: [RemoraLink; REMORA_JOINTS],
    /// Lower stops [rad].
    pub min_joint_angle: [f64; REMORA_JOINTS],
    /// Upper stops [rad].
    pub max_joint_angle: [f64; REMORA_JOINTS],
    /// Limits of the joint rates [rad/s].
    pub max_joint_rate: [f64; REMORA_JOINTS],
    /// Joint angles at the start, unless a scenario gives others [rad].
    pub initial_joint_angle: [f64; REMORA_JOINTS],
    /// Joint angles at capture [rad].
    pub capture_joint_angle: [f64; REMORA_JOINTS],
    /// Largest force along each axis, RTN [N].
    pub max_force: [f64; 3],
    /// Largest bus torque about each axis, bus axes [N m].
    pub max_bus_torque: [f64; 3],
    /// Largest joint torques [N m].
    pub max_joint_torque: [f64; REMORA_JOINTS],

    /// Time from the first node to the last [s].
    pub duration: f64,
    /// Nodes of a plan, at most REMORA_NODES.
    pub nodes: u32,
    /// Whether bodies must stay clear of each other: 0 with RK4 only, 1 yes, 2 no.
    pub clearance: u32,
    /// Whether limits hold between nodes too: 0 with RK4 only, 1 yes, 2 no.
    pub between_nodes: u32,
    /// Whether `typical` is given; otherwise it follows from the rest.
    pub has_typical: u32,
    /// Keep-out distance of the system's centre of mass from the target's box while far [m].
    pub keep_out_far: f64,
    /// The same later [m].
    pub keep_out_near: f64,
    /// Time before the end from which the near distance holds [s].
    pub keep_out_near_time: f64,
    /// Half angle of the camera's cone [rad].
    pub field_of_view_half_angle: f64,
    /// Time before the end from which the arm has its capture angles [s].
    pub preset_time: f64,
    /// Time within which a start beyond a limit is led back [s].
    pub recovery_time: f64,

    /// Weights of the cost: force, change of force, bus torque, joint torque.
    pub weights: [f64; 4],
    /// Tolerances in the order of RemoraVerification's residuals from `dynamics`: of the dynamics of both
    /// stages, control, joint, joint rate, pointing, preset, terminal rate, keep-out, end effector's
    /// position, its angle, clearance.
    pub tolerances: [f64; 11],
    /// Margins: joint angle, joint rate, keep-out, field of view, clearance.
    pub margins: [f64; 5],
    /// The end effector's corridor: half angle [rad], radius at the port [m], length of the end effector [m].
    pub corridor: [f64; 3],
    /// What steps are divided by: length, velocity, force, angle, rate, joint rate, bus torque, joint torque.
    pub typical: [f64; 8],
    /// Whether the roll at capture is given by the two directions below.
    pub has_roll: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Unit vector in the last link's axes ...
    pub roll_end_effector: [f64; 3],
    /// ... which is along this one of the target at capture.
    pub roll_port: [f64; 3],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraMission {}

fn switch(code: u32) -> Result<Switch, RemoraStatus> {
    match code {
        0 => Ok(Switch::Auto),
        1 => Ok(Switch::On),
        2 => Ok(Switch::Off),
        _ => Err(RemoraStatus::InvalidMission),
    }
}

/// A yes or no of the caller's.
pub(crate) fn flag(code: u32, otherwise: RemoraStatus) -> Result<bool, RemoraStatus> {
    match code {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(otherwise),
    }
}

/// The matrix of these rows.
fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from(*rows).transpose()
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    matrix.transpose().into()
}

impl RemoraLink {
    fn of(link: &Link) -> Self {
        let Link { tip, center_of_mass, mass, inertia, axis, armature, radius } = *link;
        let (tip, center_of_mass, axis) = (tip.into(), center_of_mass.into(), axis.into());
        Self { tip, center_of_mass, mass, inertia: rows(&inertia), axis, armature, radius }
    }

    fn link(&self) -> Link {
        let Self { tip, center_of_mass, mass, ref inertia, axis, armature, radius } = *self;
        let [tip, center_of_mass, axis] = [tip, center_of_mass, axis].map(Vector3::from);
        Link { tip, center_of_mass, mass, inertia: matrix(inertia), axis, armature, radius }
    }
}

impl RemoraMission {
    /// What C is told of a mission.
    pub(crate) fn of(mission: &Mission) -> Self {
        let Mission { orbit: o, target: t, servicer: s, approach: a, weights: w, .. } = mission;
        let Mission { tolerances: e, margins: m, corridor: c, .. } = mission;
        let typical = mission.typical_magnitudes.map(|t| {
            let Typical { length, velocity, force, angle, rate, .. } = t;
            [length, velocity, force, angle, rate, t.joint_rate, t.bus_torque, t.joint_torque]
        });
        let roll = mission.roll;
        Self {
            size: size_of::<Self>() as u32,
            gravity_gradient: t.gravity_gradient as u32,
            gravitational_parameter: o.gravitational_parameter,
            semi_major_axis: o.semi_major_axis,
            eccentricity: o.eccentricity,
            inclination: o.inclination,
            target_half_extents: t.half_extents.into(),
            target_inertia: t.inertia.into(),
            target_mass: t.mass,
            port_position: t.port_position.into(),
            port_normal: t.port_normal.into(),
            bus_mass: s.bus_mass,
            bus_inertia: rows(&s.bus_inertia),
            bus_half_extents: s.bus_half_extents.into(),
            boresight: s.boresight.into(),
            arm_base: s.arm_base.into(),
            links: s.links.each_ref().map(RemoraLink::of),
            min_joint_angle: s.min_joint_angle.into(),
            max_joint_angle: s.max_joint_angle.into(),
            max_joint_rate: s.max_joint_rate.into(),
            initial_joint_angle: s.initial_joint_angle.into(),
            capture_joint_angle: s.capture_joint_angle.into(),
            max_force: s.max_force.into(),
            max_bus_torque: s.max_bus_torque.into(),
            max_joint_torque: s.max_joint_torque.into(),
            duration: a.duration,
            nodes: a.nodes as u32,
            clearance: a.clearance as u32,
            between_nodes: a.between_nodes as u32,
            has_typical: u32::from(typical.is_some()),
            keep_out_far: a.keep_out_far,
            keep_out_near: a.keep_out_near,
            keep_out_near_time: a.keep_out_near_time,
            field_of_view_half_angle: a.field_of_view_half_angle,
            preset_time: a.preset_time,
            recovery_time: a.recovery_time,
            weights: [w.force, w.force_change, w.bus_torque, w.joint_torque],
            tolerances: tolerances(e),
            margins: [m.joint_angle, m.joint_rate, m.keep_out, m.field_of_view, m.clearance],
            corridor: [c.half_angle, c.mouth_radius, c.end_effector_length],
            typical: typical.unwrap_or_default(),
            has_roll: u32::from(roll.is_some()),
            reserved: 0,
            roll_end_effector: roll.map_or([0.0; 3], |roll| roll.end_effector.into()),
            roll_port: roll.map_or([0.0; 3], |roll| roll.port.into()),
        }
    }

    /// The mission that C tells of, where every number is in its range.
    #[inline(never)]
    pub(crate) fn validated(&self) -> Result<Valid<Mission>, RemoraStatus> {
        let invalid = RemoraStatus::InvalidMission;
        let [force, force_change, bus_torque, joint_torque] = self.weights;
        let [joint_angle, joint_rate, keep_out, field_of_view, clearance] = self.margins;
        let [half_angle, mouth_radius, end_effector_length] = self.corridor;
        let roll =
            Roll { end_effector: self.roll_end_effector.into(), port: self.roll_port.into() };
        let mission = Mission {
            orbit: self.orbit(),
            target: self.target()?,
            servicer: self.servicer(),
            approach: self.approach()?,
            weights: Weights { force, force_change, bus_torque, joint_torque },
            tolerances: self.tolerances(),
            margins: Margins { joint_angle, joint_rate, keep_out, field_of_view, clearance },
            corridor: Corridor { half_angle, mouth_radius, end_effector_length },
            typical_magnitudes: flag(self.has_typical, invalid)?.then(|| self.typical()),
            roll: flag(self.has_roll, invalid)?.then_some(roll),
            ..Mission::default()
        };
        mission.validated().map_err(|_| invalid)
    }

    fn orbit(&self) -> Orbit {
        let Self { gravitational_parameter, semi_major_axis, .. } = *self;
        let Self { eccentricity, inclination, .. } = *self;
        Orbit { gravitational_parameter, semi_major_axis, eccentricity, inclination }
    }

    fn target(&self) -> Result<Target, RemoraStatus> {
        Ok(Target {
            half_extents: self.target_half_extents.into(),
            inertia: self.target_inertia.into(),
            mass: self.target_mass,
            port_position: self.port_position.into(),
            port_normal: self.port_normal.into(),
            gravity_gradient: switch(self.gravity_gradient)?,
        })
    }

    fn servicer(&self) -> Servicer<REMORA_JOINTS> {
        Servicer {
            bus_mass: self.bus_mass,
            bus_inertia: matrix(&self.bus_inertia),
            bus_half_extents: self.bus_half_extents.into(),
            boresight: self.boresight.into(),
            arm_base: self.arm_base.into(),
            links: self.links.each_ref().map(RemoraLink::link),
            min_joint_angle: self.min_joint_angle.into(),
            max_joint_angle: self.max_joint_angle.into(),
            max_joint_rate: self.max_joint_rate.into(),
            initial_joint_angle: self.initial_joint_angle.into(),
            capture_joint_angle: self.capture_joint_angle.into(),
            max_force: self.max_force.into(),
            max_bus_torque: self.max_bus_torque.into(),
            max_joint_torque: self.max_joint_torque.into(),
        }
    }

    fn approach(&self) -> Result<Approach, RemoraStatus> {
        Ok(Approach {
            duration: self.duration,
            nodes: self.nodes as usize,
            keep_out_far: self.keep_out_far,
            keep_out_near: self.keep_out_near,
            keep_out_near_time: self.keep_out_near_time,
            field_of_view_half_angle: self.field_of_view_half_angle,
            preset_time: self.preset_time,
            recovery_time: self.recovery_time,
            clearance: switch(self.clearance)?,
            between_nodes: switch(self.between_nodes)?,
        })
    }

    fn tolerances(&self) -> Tolerances {
        let [dynamics, control, joint, joint_rate, pointing, preset, terminal_rate, ..] =
            self.tolerances;
        let [.., keep_out, end_effector_position, end_effector_angle, clearance] = self.tolerances;
        Tolerances {
            dynamics,
            control,
            joint,
            joint_rate,
            pointing,
            preset,
            terminal_rate,
            keep_out,
            end_effector_position,
            end_effector_angle,
            clearance,
        }
    }

    fn typical(&self) -> Typical {
        let [length, velocity, force, angle, rate, joint_rate, bus_torque, joint_torque] =
            self.typical;
        Typical { length, velocity, force, angle, rate, joint_rate, bus_torque, joint_torque }
    }
}

fn tolerances(e: &Tolerances) -> [f64; 11] {
    [
        e.dynamics,
        e.control,
        e.joint,
        e.joint_rate,
        e.pointing,
        e.preset,
        e.terminal_rate,
        e.keep_out,
        e.end_effector_position,
        e.end_effector_angle,
        e.clearance,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mission_goes_to_c_and_back_number_by_number() {
        let mut mission = Mission::default();
        mission.servicer.links[1].inertia[(0, 1)] = 1e-3;
        mission.servicer.links[1].inertia[(1, 0)] = 1e-3;
        mission.servicer.max_joint_rate[2] = 4e-3;
        mission.target.gravity_gradient = Switch::On;
        mission.approach.clearance = Switch::Off;
        let (end_effector, port) = (Vector3::x(), Vector3::y());
        for roll in [None, Some(Roll { end_effector, port })] {
            mission.roll = roll;
            mission.typical_magnitudes = roll.map(|_| mission.typical());
            let there = RemoraMission::of(&mission);
            assert_eq!(*there.validated().unwrap(), mission);
        }
    }

    /// Were two members of one type swapped in both directions, the test above would not see it.
    #[test]
    fn members_mean_what_they_are_called() {
        let there = RemoraMission::of(&Mission::default());
        assert_eq!((there.keep_out_far, there.keep_out_near), (1.85, 1.46));
        assert_eq!(
            (there.preset_time, there.recovery_time, there.keep_out_near_time),
            (80.0, 80.0, 360.0)
        );
        assert_eq!(
            (there.target_inertia, there.target_half_extents),
            ([2.5, 3.0, 2.0], [0.4, 0.4, 0.2])
        );
        assert_eq!((there.links[2].tip, there.links[2].mass), ([0.0, 0.0, 0.3], 10.0));
        assert_eq!(there.weights, [1.0, 0.03, 0.5, 1.0]);
        assert_eq!((there.nodes, there.duration), (60, 1200.0));
    }

    #[test]
    fn numbers_out_of_range_and_unknown_codes_are_refused() {
        for change in [
            (|m| m.bus_mass = -1.0) as fn(&mut RemoraMission),
            |m| m.target_mass = f64::NAN,
            |m| m.nodes = 1,
            |m| m.clearance = 3,
            |m| m.gravity_gradient = 7,
            |m| m.has_roll = 2,
            |m| m.bus_inertia[0][1] = 1.0,
        ] {
            let mut mission = RemoraMission::of(&Mission::default());
            change(&mut mission);
            assert_eq!(mission.validated().unwrap_err(), RemoraStatus::InvalidMission);
        }
    }
}
