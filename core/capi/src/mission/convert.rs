//! From the core's mission to C's and back.
#![allow(unsafe_code, reason = "makes a structure of zeros")]

use super::{RemoraLink, RemoraMission};
use crate::RemoraStatus;
use crate::abi::{REMORA_JOINTS, REMORA_NODES};
use remora_core::advanced::model::{
    Approach, Body, Corridor, Link, Margins, Orbit, Roll, Servicer, Switch, Target, Tolerances,
    Typical, Weights,
};
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::nalgebra::Matrix3;
use remora_core::prelude::Mission;

fn switch(code: u32) -> Result<Switch, RemoraStatus> {
    match code {
        0 => Ok(Switch::Auto),
        1 => Ok(Switch::On),
        2 => Ok(Switch::Off),
        _ => Err(RemoraStatus::InvalidMission),
    }
}

/// Flag of the caller, 0 or 1.
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
        Self {
            tip_from_joint_link_m: tip.into(),
            com_from_joint_link_m: center_of_mass.into(),
            mass_kg: mass,
            inertia_about_com_link_kg_m2: rows(&inertia),
            axis_link: axis.into(),
            armature_kg_m2: armature,
            radius_m: radius,
        }
    }

    fn link(&self) -> Link {
        Link {
            tip: self.tip_from_joint_link_m.into(),
            center_of_mass: self.com_from_joint_link_m.into(),
            mass: self.mass_kg,
            inertia: matrix(&self.inertia_about_com_link_kg_m2),
            axis: self.axis_link.into(),
            armature: self.armature_kg_m2,
            radius: self.radius_m,
        }
    }
}

impl RemoraMission {
    /// C's structure of a mission: all zeros first, then its members part by part.
    pub(crate) fn of(mission: &Mission) -> Self {
        // SAFETY: numbers only, so all zeros is a value.
        let mut told: Self = unsafe { core::mem::zeroed() };
        told.size = size_of::<Self>() as u32;
        told.tell_world(mission);
        told.tell_servicer(&mission.servicer);
        told.tell_approach(&mission.approach);
        told.tell_quality(mission);
        told.tell_typical(mission.typical_magnitudes.as_ref());
        if let Some(Roll { end_effector, port }) = mission.roll {
            told.has_roll = 1;
            told.roll_ee_link = end_effector.into();
            told.roll_port_target = port.into();
        }
        told
    }

    fn tell_world(&mut self, mission: &Mission) {
        let Mission { orbit: o, target: t, .. } = mission;
        self.gravity_gradient = t.gravity_gradient as u32;
        self.gravitational_parameter_m3_s2 = o.gravitational_parameter;
        self.semi_major_axis_m = o.semi_major_axis;
        self.eccentricity = o.eccentricity;
        self.inclination_rad = o.inclination;
        self.target_half_extents_body_m = t.half_extents.into();
        self.target_inertia_body_kg_m2 = t.inertia.into();
        self.target_mass_kg = t.mass;
        self.port_position_target_m = t.port_position.into();
        self.port_normal_target = t.port_normal.into();
    }

    fn tell_servicer(&mut self, s: &Servicer<REMORA_JOINTS>) {
        self.bus_mass_kg = s.bus_mass;
        self.bus_inertia_body_kg_m2 = rows(&s.bus_inertia);
        self.bus_half_extents_body_m = s.bus_half_extents.into();
        self.boresight_bus = s.boresight.into();
        self.arm_base_bus_m = s.arm_base.into();
        self.links = s.links.each_ref().map(RemoraLink::of);
        self.min_joint_angle_rad = s.min_joint_angle.into();
        self.max_joint_angle_rad = s.max_joint_angle.into();
        self.max_joint_rate_rad_s = s.max_joint_rate.into();
        self.initial_joint_angle_rad = s.initial_joint_angle.into();
        self.capture_joint_angle_rad = s.capture_joint_angle.into();
        self.max_bus_force_rtn_n = s.max_force.into();
        self.max_bus_torque_body_n_m = s.max_bus_torque.into();
        self.max_joint_torque_n_m = s.max_joint_torque.into();
    }

    fn tell_approach(&mut self, a: &Approach) {
        self.duration_s = a.duration;
        self.nodes = a.nodes as u32;
        self.clearance = a.clearance as u32;
        self.between_nodes = a.between_nodes as u32;
        self.keep_out_far_m = a.keep_out_far;
        self.keep_out_near_m = a.keep_out_near;
        self.keep_out_near_time_s = a.keep_out_near_time;
        self.field_of_view_half_angle_rad = a.field_of_view_half_angle;
        self.preset_time_s = a.preset_time;
        self.recovery_time_s = a.recovery_time;
    }

    fn tell_quality(&mut self, mission: &Mission) {
        let Mission { weights: w, tolerances: e, margins: m, corridor: c, .. } = mission;
        self.weight_force = w.force;
        self.weight_force_change = w.force_change;
        self.weight_bus_torque = w.bus_torque;
        self.weight_joint_torque = w.joint_torque;
        self.tolerance_dynamics = e.dynamics;
        self.tolerance_control = e.control;
        self.tolerance_joint_rad = e.joint;
        self.tolerance_joint_rate = e.joint_rate;
        self.tolerance_pointing = e.pointing;
        self.tolerance_preset = e.preset;
        self.tolerance_terminal_rate = e.terminal_rate;
        self.tolerance_keep_out_m = e.keep_out;
        self.tolerance_ee_position_m = e.end_effector_position;
        self.tolerance_ee_angle_rad = e.end_effector_angle;
        self.tolerance_clearance_m = e.clearance;
        self.margin_joint_angle_rad = m.joint_angle;
        self.margin_joint_rate = m.joint_rate;
        self.margin_keep_out_m = m.keep_out;
        self.margin_field_of_view_rad = m.field_of_view;
        self.margin_clearance_m = m.clearance;
        self.corridor_half_angle_rad = c.half_angle;
        self.corridor_mouth_radius_m = c.mouth_radius;
        self.ee_length_m = c.end_effector_length;
    }

    fn tell_typical(&mut self, typical: Option<&Typical>) {
        let Some(t) = typical else { return };
        self.has_typical = 1;
        self.typical_length_m = t.length;
        self.typical_velocity_m_s = t.velocity;
        self.typical_force_n = t.force;
        self.typical_angle_rad = t.angle;
        self.typical_rate_rad_s = t.rate;
        self.typical_joint_rate_rad_s = t.joint_rate;
        self.typical_bus_torque_n_m = t.bus_torque;
        self.typical_joint_torque_n_m = t.joint_torque;
    }

    /// Converts C's mission, if every number is in its range.
    #[inline(never)]
    pub(crate) fn validated(&self) -> Result<Valid<Mission>, RemoraStatus> {
        let invalid = RemoraStatus::InvalidMission;
        let roll =
            Roll { end_effector: self.roll_ee_link.into(), port: self.roll_port_target.into() };
        let mission = Mission {
            orbit: self.orbit(),
            target: self.target()?,
            servicer: self.servicer(),
            approach: self.approach()?,
            weights: self.weights(),
            tolerances: self.tolerances(),
            margins: self.margins(),
            corridor: Corridor {
                half_angle: self.corridor_half_angle_rad,
                mouth_radius: self.corridor_mouth_radius_m,
                end_effector_length: self.ee_length_m,
            },
            typical_magnitudes: flag(self.has_typical, invalid)?.then(|| self.typical()),
            roll: flag(self.has_roll, invalid)?.then_some(roll),
            ..Mission::default()
        };
        if self.nodes as usize > REMORA_NODES {
            return Err(invalid);
        }
        mission.validated().map_err(|_| invalid)
    }

    fn orbit(&self) -> Orbit {
        Orbit {
            gravitational_parameter: self.gravitational_parameter_m3_s2,
            semi_major_axis: self.semi_major_axis_m,
            eccentricity: self.eccentricity,
            inclination: self.inclination_rad,
            body: Body::with(self.gravitational_parameter_m3_s2),
        }
    }

    fn target(&self) -> Result<Target, RemoraStatus> {
        Ok(Target {
            half_extents: self.target_half_extents_body_m.into(),
            inertia: self.target_inertia_body_kg_m2.into(),
            mass: self.target_mass_kg,
            port_position: self.port_position_target_m.into(),
            port_normal: self.port_normal_target.into(),
            gravity_gradient: switch(self.gravity_gradient)?,
        })
    }

    fn servicer(&self) -> Servicer<REMORA_JOINTS> {
        Servicer {
            bus_mass: self.bus_mass_kg,
            bus_inertia: matrix(&self.bus_inertia_body_kg_m2),
            bus_half_extents: self.bus_half_extents_body_m.into(),
            boresight: self.boresight_bus.into(),
            arm_base: self.arm_base_bus_m.into(),
            links: self.links.each_ref().map(RemoraLink::link),
            min_joint_angle: self.min_joint_angle_rad.into(),
            max_joint_angle: self.max_joint_angle_rad.into(),
            max_joint_rate: self.max_joint_rate_rad_s.into(),
            initial_joint_angle: self.initial_joint_angle_rad.into(),
            capture_joint_angle: self.capture_joint_angle_rad.into(),
            max_force: self.max_bus_force_rtn_n.into(),
            max_bus_torque: self.max_bus_torque_body_n_m.into(),
            max_joint_torque: self.max_joint_torque_n_m.into(),
        }
    }

    fn approach(&self) -> Result<Approach, RemoraStatus> {
        Ok(Approach {
            duration: self.duration_s,
            nodes: self.nodes as usize,
            keep_out_far: self.keep_out_far_m,
            keep_out_near: self.keep_out_near_m,
            keep_out_near_time: self.keep_out_near_time_s,
            field_of_view_half_angle: self.field_of_view_half_angle_rad,
            preset_time: self.preset_time_s,
            recovery_time: self.recovery_time_s,
            clearance: switch(self.clearance)?,
            between_nodes: switch(self.between_nodes)?,
        })
    }

    fn weights(&self) -> Weights {
        Weights {
            force: self.weight_force,
            force_change: self.weight_force_change,
            bus_torque: self.weight_bus_torque,
            joint_torque: self.weight_joint_torque,
        }
    }

    fn tolerances(&self) -> Tolerances {
        Tolerances {
            dynamics: self.tolerance_dynamics,
            control: self.tolerance_control,
            joint: self.tolerance_joint_rad,
            joint_rate: self.tolerance_joint_rate,
            pointing: self.tolerance_pointing,
            preset: self.tolerance_preset,
            terminal_rate: self.tolerance_terminal_rate,
            keep_out: self.tolerance_keep_out_m,
            end_effector_position: self.tolerance_ee_position_m,
            end_effector_angle: self.tolerance_ee_angle_rad,
            clearance: self.tolerance_clearance_m,
        }
    }

    fn margins(&self) -> Margins {
        Margins {
            joint_angle: self.margin_joint_angle_rad,
            joint_rate: self.margin_joint_rate,
            keep_out: self.margin_keep_out_m,
            field_of_view: self.margin_field_of_view_rad,
            clearance: self.margin_clearance_m,
        }
    }

    fn typical(&self) -> Typical {
        Typical {
            length: self.typical_length_m,
            velocity: self.typical_velocity_m_s,
            force: self.typical_force_n,
            angle: self.typical_angle_rad,
            rate: self.typical_rate_rad_s,
            joint_rate: self.typical_joint_rate_rad_s,
            bus_torque: self.typical_bus_torque_n_m,
            joint_torque: self.typical_joint_torque_n_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::nalgebra::Vector3;

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

    /// Finds two members of one type swapped in both directions, which the test above cannot.
    #[test]
    fn members_mean_what_they_are_called() {
        let there = RemoraMission::of(&Mission::default());
        assert_eq!((there.keep_out_far_m, there.keep_out_near_m), (1.85, 1.46));
        assert_eq!(
            (there.preset_time_s, there.recovery_time_s, there.keep_out_near_time_s),
            (80.0, 80.0, 360.0)
        );
        assert_eq!(
            (there.target_inertia_body_kg_m2, there.target_half_extents_body_m),
            ([2.5, 3.0, 2.0], [0.4, 0.4, 0.2])
        );
        assert_eq!(
            (there.links[2].tip_from_joint_link_m, there.links[2].mass_kg),
            ([0.0, 0.0, 0.3], 10.0)
        );
        assert_eq!((there.weight_force, there.weight_force_change), (1.0, 0.03));
        assert_eq!((there.weight_bus_torque, there.weight_joint_torque), (0.5, 1.0));
        assert_eq!((there.nodes, there.duration_s), (60, 1200.0));
    }

    #[test]
    fn numbers_out_of_range_and_unknown_codes_are_refused() {
        for change in [
            (|m| m.bus_mass_kg = -1.0) as fn(&mut RemoraMission),
            |m| m.target_mass_kg = f64::NAN,
            |m| m.nodes = 1,
            |m| m.nodes = 61,
            |m| m.clearance = 3,
            |m| m.gravity_gradient = 7,
            |m| m.has_roll = 2,
            |m| m.bus_inertia_body_kg_m2[0][1] = 1.0,
        ] {
            let mut mission = RemoraMission::of(&Mission::default());
            change(&mut mission);
            assert_eq!(mission.validated().unwrap_err(), RemoraStatus::InvalidMission);
        }
    }
}
