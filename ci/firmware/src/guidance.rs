//! Guidance along the last plan that was made, step by step.

use crate::board::Board;
use crate::output::{Line, print_stack};
use core::hint::black_box;
use remora_core::advanced::dynamics::{Integrator, Multibody};
use remora_core::advanced::guidance::{
    Command, Estimate, FlightPlan, Guidance, GuidanceSettings, Limits,
};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::Workspace;
use remora_core::advanced::qp::{Checksum, Valid};
use remora_core::advanced::stages::LINKS;
use remora_core::nalgebra::{SVector, Vector3};

/// Substeps of an interval of the plan as it is flown, whatever it was made with: what is compared is
/// bits.
const SUBSTEPS: usize = 4;

/// Time between steps [s].
const PERIOD: f64 = 0.1;

/// Time before capture from which the wrist camera sees the port [s].
const SEEN: f64 = 150.0;

/// Flies a few seconds of the plan in the workspace here and there, with estimates that are off; prints
/// the checksum of what is commanded, the most instructions of a step, and the stack of one.
// Apart from the plans, so that its memory is not on their stack.
#[inline(never)]
pub fn run<B: Board>(
    board: &B,
    id: &str,
    mission: &Valid<Mission<LINKS>>,
    scenario: &Scenario,
    workspace: &Workspace,
    plan: &mut FlightPlan,
) {
    let (path, motion) = (workspace.translation(), workspace.reorientation());
    let integrator = black_box(Integrator::Rk4 { substeps: SUBSTEPS });
    if plan.write(mission, scenario, integrator, path, motion).is_err() {
        return;
    }
    let settings = black_box(Valid::of_constant(GuidanceSettings::DEFAULT));
    let guidance = Guidance::new(settings);
    let limits = black_box(Limits::of(&mission.servicer));
    let mut flight = Flight { board, id, mission, plan, limits, guidance, most: Most::default() };
    let interval = plan.duration() / plan.grid().nodes.saturating_sub(1) as f64;
    // The steps at each place follow each other; its last number is their count.
    for (place, begins, steps) in [
        ("start", 0.0, 8),
        ("node", interval - 0.43, 8),
        ("middle", 0.5 * plan.duration() + 0.37 * interval, 12),
        ("closing", plan.duration() - 212.3, 8),
        ("camera", plan.duration() - 61.7, 12),
        ("end", plan.duration() - 0.43, 8),
    ] {
        flight.follow(place, begins, steps);
    }
    flight.guidance.abort();
    flight.follow("abort", 0.6 * plan.duration(), 4);
    flight.print_costs();
}

/// A flight.
struct Flight<'a, B> {
    board: &'a B,
    id: &'a str,
    mission: &'a Valid<Mission<LINKS>>,
    plan: &'a FlightPlan,
    limits: Limits,
    guidance: Guidance,
    most: Most,
}

/// The most instructions of a step, and how many steps there were.
#[derive(Clone, Copy, Default)]
struct Most {
    /// Cost of steps that begin at another place of the plan, where its motion is not yet known from the node on.
    first: Cost,
    /// Cost of steps that follow another.
    next: Cost,
}

#[derive(Clone, Copy, Default)]
struct Cost {
    steps: u64,
    instructions: u64,
}

impl<B: Board> Flight<'_, B> {
    /// Makes steps from a time on; prints the checksum of their commands.
    fn follow(&mut self, place: &str, begins: f64, steps: u32) {
        let mut sum = Checksum::new();
        for i in 0..steps {
            let estimate = self.estimate(begins + f64::from(i) * PERIOD, i);
            let before = self.board.instructions();
            let command = self.step(&estimate);
            let instructions = self.board.instructions().wrapping_sub(before);
            let Most { first, next } = &mut self.most;
            let cost = if i == 0 { first } else { next };
            cost.steps += 1;
            cost.instructions = cost.instructions.max(instructions);
            add(&mut sum, &command);
        }
        let line = Line::about(self.board, "guidance", self.id).text("place", place);
        line.number("steps", steps.into()).bits("checksum", sum.value()).end();
    }

    /// One step. Inlined, so that the stack of a step has no frame of the image's own.
    #[inline(always)]
    fn step(&mut self, estimate: &Estimate) -> Command {
        self.guidance.step(self.mission, self.plan, estimate, &self.limits)
    }

    /// Navigation estimate at a time: the plan's state with an error that is equal on all boards.
    fn estimate(&self, time: f64, step: u32) -> Estimate {
        let planned = self.plan.at(self.mission, time);
        let mut off = Pattern(step);
        let mut estimate = Estimate::as_planned(self.mission, time, &planned);
        estimate.position += off.vector(5e-3);
        estimate.velocity += off.vector(1e-4);
        let turn = quaternion::exp(&off.vector(4e-3));
        let state = &mut estimate.state;
        state.attitude = quaternion::product(&turn, &state.attitude);
        state.rate += off.vector(1e-4);
        state.joint_angle += SVector::from_fn(|_, _| off.number(2e-3));
        state.joint_rate += SVector::from_fn(|_, _| off.number(1e-4));
        let target = &mut estimate.target;
        target.attitude =
            quaternion::product(&quaternion::exp(&off.vector(1e-2)), &target.attitude);
        target.rate += off.vector(1e-5);
        if self.plan.duration() - time < SEEN {
            let body = Multibody::new(self.mission);
            let (center, _) = body.center_of_mass(&estimate.state);
            let tip = estimate.position + center + body.end_effector(&estimate.state).position;
            let target = quaternion::rotation_matrix(&estimate.target.attitude);
            let port = target * self.mission.target.port_position_m;
            estimate.wrist = Some(tip - port + off.vector(4e-3));
        }
        estimate
    }

    /// The most instructions of a step, and the stack of one.
    fn print_costs(&mut self) {
        let Most { first, next } = self.most;
        for (name, Cost { steps, instructions }) in [("first_step", first), ("step", next)] {
            let line = Line::about(self.board, "most", self.id);
            line.text("name", name)
                .number("calls", steps)
                .number("instructions", instructions)
                .end();
        }
        // At another place once more, with the camera: the longest way through the code.
        let time = self.plan.duration() - 31.3;
        self.guidance = Guidance::new(Valid::of_constant(GuidanceSettings::DEFAULT));
        let estimate = self.estimate(time, 3);
        self.board.paint_stack();
        let above = self.board.stack().map_or(0, |stack| stack.used);
        black_box(self.step(&estimate));
        print_stack(self.board, "guidance");
        Line::new(self.board, "above").text("entry", "guidance").number("used", above as u64).end();
    }
}

/// Checksum of a command.
fn add(sum: &mut Checksum, command: &Command) {
    let Command { mode, wanted, force, control, joint_angle, joint_rate, error, share } = command;
    let wanted = wanted.map_or(0, |reason| reason as u32);
    sum.numbers(&[f64::from(*mode as u32), f64::from(wanted)]);
    sum.numbers(force);
    sum.numbers(&control.bus_torque);
    sum.numbers(&control.joint_torque);
    sum.numbers(joint_angle);
    sum.numbers(joint_rate);
    sum.numbers(&[error.position, error.attitude, error.joint, error.target]);
    sum.numbers(share);
}

/// Numbers of either sign that jump about, the same everywhere.
struct Pattern(u32);

impl Pattern {
    /// The next, of at most this size.
    fn number(&mut self, most: f64) -> f64 {
        self.0 = self.0.wrapping_mul(11).wrapping_add(7) % 17;
        most * (f64::from(self.0) - 8.0) * 0.125
    }

    fn vector(&mut self, most: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number(most))
    }
}
