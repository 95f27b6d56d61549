//! A plan that somebody else has made, made again: its input as numbers in the order of `remora.h`, which
//! whoever starts the image leaves in its memory.

use crate::StartKind;
use crate::board::Board;
use crate::output::Line;
use crate::run::{Memory, Models};
use crate::start::with_start;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::model::{
    Approach, Body, Corridor, Link, Margins, Mission, Orbit, Roll, Scenario, Servicer, Start,
    Switch, Target, Tolerances, Typical, Weights,
};
use remora_core::advanced::planner::{self, Options, PlanSettings, Platform};
use remora_core::advanced::stages::{LINKS, Mode};
use remora_core::nalgebra::{Matrix3, Vector3};

/// Doubles that an input has room for.
pub const NUMBERS: usize = 256;

/// Numbers in their order; where there are no more, not a number.
struct Input<'a>(core::slice::Iter<'a, u64>);

/// Plans what the numbers say, and prints the checksum.
pub fn replay<B: Board>(board: &B, numbers: &[u64], models: &Models<'_>, memory: &mut Memory) {
    let mut input = Input(numbers.iter());
    let start = if input.flag() { StartKind::Model } else { StartKind::Heuristic };
    let (mission, scenario, settings) = (input.mission(), input.scenario(), input.settings());
    let file = match settings.integrator {
        Integrator::Rk4 { .. } => models.rk4,
        _ => models.euler,
    };
    let Memory { workspace, solver, network, .. } = memory;
    let report = with_start(board, start, file, network, |start| {
        let options = Options::from_parts(settings, *start, Platform::BARE);
        planner::plan(&mission, &scenario, &options, solver, workspace)
    });
    Line::new(board, "replay").bits("output", report.record.output).end();
    Line::new(board, "end").end();
}

impl Input<'_> {
    fn next(&mut self) -> f64 {
        self.0.next().map_or(f64::NAN, |bits| f64::from_bits(*bits))
    }

    fn count(&mut self) -> usize {
        self.next() as usize
    }

    fn flag(&mut self) -> bool {
        self.count() == 1
    }

    fn switch(&mut self) -> Switch {
        match self.count() {
            0 => Switch::Auto,
            1 => Switch::On,
            _ => Switch::Off,
        }
    }

    fn all<const N: usize>(&mut self) -> [f64; N] {
        core::array::from_fn(|_| self.next())
    }

    fn vector(&mut self) -> Vector3<f64> {
        self.all::<3>().into()
    }

    fn matrix(&mut self) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.all::<9>())
    }

    fn mission(&mut self) -> Mission<LINKS> {
        let gravity_gradient = self.switch();
        let [gravitational_parameter, semi_major_axis, eccentricity, inclination] = self.all();
        let body = Body::with(gravitational_parameter);
        let orbit =
            Orbit { gravitational_parameter, semi_major_axis, eccentricity, inclination, body };
        let target = Target {
            half_extents: self.vector(),
            inertia: self.vector(),
            mass: self.next(),
            port_position: self.vector(),
            port_normal: self.vector(),
            gravity_gradient,
        };
        let (servicer, approach, has_typical) = (self.servicer(), self.approach(), self.flag());
        let [keep_out_far, keep_out_near, keep_out_near_time] = self.all();
        let [field_of_view_half_angle, preset_time, recovery_time] = self.all();
        let [force, force_change, bus_torque, joint_torque] = self.all();
        let tolerances = self.tolerances();
        let [joint_angle, joint_rate, keep_out, field_of_view, clearance] = self.all();
        let [half_angle, mouth_radius, end_effector_length] = self.all();
        let (typical, has_roll, _) = (self.typical(), self.flag(), self.next());
        let roll = Roll { end_effector: self.vector(), port: self.vector() };
        Mission {
            orbit,
            target,
            servicer,
            approach: Approach {
                keep_out_far,
                keep_out_near,
                keep_out_near_time,
                field_of_view_half_angle,
                preset_time,
                recovery_time,
                ..approach
            },
            weights: Weights { force, force_change, bus_torque, joint_torque },
            tolerances,
            margins: Margins { joint_angle, joint_rate, keep_out, field_of_view, clearance },
            corridor: Corridor { half_angle, mouth_radius, end_effector_length },
            typical_magnitudes: has_typical.then_some(typical),
            roll: has_roll.then_some(roll),
            ..Mission::default()
        }
    }

    fn servicer(&mut self) -> Servicer<LINKS> {
        Servicer {
            bus_mass: self.next(),
            bus_inertia: self.matrix(),
            bus_half_extents: self.vector(),
            boresight: self.vector(),
            arm_base: self.vector(),
            links: core::array::from_fn(|_| self.link()),
            min_joint_angle: self.vector(),
            max_joint_angle: self.vector(),
            max_joint_rate: self.vector(),
            initial_joint_angle: self.vector(),
            capture_joint_angle: self.vector(),
            max_force: self.vector(),
            max_bus_torque: self.vector(),
            max_joint_torque: self.vector(),
        }
    }

    fn link(&mut self) -> Link {
        Link {
            tip: self.vector(),
            center_of_mass: self.vector(),
            mass: self.next(),
            inertia: self.matrix(),
            axis: self.vector(),
            armature: self.next(),
            radius: self.next(),
        }
    }

    /// As far as its members come before whether there are typical magnitudes.
    fn approach(&mut self) -> Approach {
        Approach {
            duration: self.next(),
            nodes: self.count(),
            clearance: self.switch(),
            between_nodes: self.switch(),
            ..Approach::default()
        }
    }

    fn tolerances(&mut self) -> Tolerances {
        Tolerances {
            dynamics: self.next(),
            control: self.next(),
            joint: self.next(),
            joint_rate: self.next(),
            pointing: self.next(),
            preset: self.next(),
            terminal_rate: self.next(),
            keep_out: self.next(),
            end_effector_position: self.next(),
            end_effector_angle: self.next(),
            clearance: self.next(),
        }
    }

    fn typical(&mut self) -> Typical {
        Typical {
            length: self.next(),
            velocity: self.next(),
            force: self.next(),
            angle: self.next(),
            rate: self.next(),
            joint_rate: self.next(),
            bus_torque: self.next(),
            joint_torque: self.next(),
        }
    }

    fn scenario(&mut self) -> Scenario<LINKS> {
        let nodes = self.count();
        let (target_attitude, target_rate) = (self.all::<4>().into(), self.vector());
        let (position, velocity, duration) = (self.vector(), self.vector(), self.next());
        let (has_attitude, has_angle) = (self.flag(), self.flag());
        let (attitude, bus_rate) = (self.all::<4>().into(), self.vector());
        let (angle, joint_rate) = (self.vector(), self.vector());
        let start = Start {
            bus_attitude: has_attitude.then_some(attitude),
            bus_rate,
            joint_angle: has_angle.then_some(angle),
            joint_rate,
        };
        Scenario {
            target_attitude,
            target_rate,
            position,
            velocity,
            start,
            duration: (duration != 0.0).then_some(duration),
            nodes: (nodes != 0).then_some(nodes),
        }
    }

    fn settings(&mut self) -> PlanSettings {
        let mode = if self.count() == 0 { Mode::Optimal } else { Mode::Feasible };
        let integrator = match (self.count(), self.count()) {
            (0, substeps) => Integrator::Rk4 { substeps },
            _ => Integrator::Euler,
        };
        PlanSettings::new(mode, integrator)
    }
}
