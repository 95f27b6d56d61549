//! A plan that somebody else has made, made again: its input as numbers in the order of `remora.h`, which
//! whoever starts the image leaves in its memory.

use crate::StartKind;
use crate::board::Board;
use crate::output::Line;
use crate::run::{Memory, Models};
use crate::start::with_start;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::model::{Body, Field, FieldVisitor, Mission, Scenario, Start};
use remora_core::advanced::planner::{self, Options, PlanSettings, Platform};
use remora_core::advanced::stages::{LINKS, Mode};
use remora_core::nalgebra::Vector3;

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

impl FieldVisitor for Input<'_> {
    fn numbers(&mut self, _: Field, values: &mut [f64]) {
        values.fill_with(|| self.next());
    }

    fn word(&mut self, _: Field, value: &mut u32) {
        *value = self.next() as u32;
    }
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

    fn all<const N: usize>(&mut self) -> [f64; N] {
        core::array::from_fn(|_| self.next())
    }

    fn vector(&mut self) -> Vector3<f64> {
        self.all::<3>().into()
    }

    fn mission(&mut self) -> Mission<LINKS> {
        let mut mission = Mission::default();
        mission.visit(self);
        mission.orbit.body = Body::with(mission.orbit.gravitational_parameter_m3_s2);
        // A member of the structure that is not read.
        self.next();
        mission
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
