//! The parts of a plan that are not the subproblem's solver, each on its own.

use crate::Memory;
use crate::board::Board;
use crate::output::Line;
use remora_core::advanced::dynamics::{Integrator, Multibody, Stepping};
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::Workspace;
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::qp::{Qp, Solution};
use remora_core::advanced::scp::Problem;
use remora_core::advanced::stages::{
    Formulation, LINKS, Mode, NODES, Reorientation, ReorientationTrajectory, Residuals,
    Translation, TranslationTrajectory, heuristic, size, verify,
};
use remora_core::advanced::time::Deadline;

type StageTwo<'a> = Reorientation<'a, Sequential, NODES, LINKS, { size::NX }, { size::NU }>;

/// Stage 1's projection, in the size of the planner's subproblems.
fn project(
    problem: &impl Problem<
        NODES,
        { size::NX },
        { size::NU },
        { size::NG },
        Trajectory = TranslationTrajectory<NODES>,
    >,
    trajectory: &mut TranslationTrajectory<NODES>,
) {
    problem.project(trajectory);
}

/// Runs every kernel once on a scenario; prints the checksum of what it computed, the same on
/// every board, and the instructions it took.
// Apart from the plans, so that its memory is not on their stack.
#[inline(never)]
pub fn run<B: Board>(
    board: &B,
    id: &str,
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    integrator: Integrator,
    memory: &mut Memory,
) {
    let w = &mut memory.workspace;
    let dt = mission.grid(scenario).interval();
    let kernels = Kernels { measure: Measure { board, id }, mission, scenario, integrator, dt };
    kernels.initial_guess(w);
    kernels.step(w);
    kernels.step_jacobian(w);
    kernels.linearise(w);
    kernels.verify(w);
}

/// The kernels of one scenario.
struct Kernels<'a, B> {
    measure: Measure<'a, B>,
    mission: &'a Mission<LINKS>,
    scenario: &'a Scenario,
    integrator: Integrator,
    dt: f64,
}

impl<B: Board> Kernels<'_, B> {
    /// The target's motion, a translation without force, the heuristic guess.
    fn initial_guess(&self, w: &mut Workspace) {
        let Self { measure, mission, scenario, integrator, dt } = self;
        measure.run("tumble", 1, || {
            let (q, rate) = (&scenario.target_attitude, &scenario.target_rate);
            let n = mission.mean_motion();
            mission.target.tumble(*integrator, n, q, rate, *dt, &mut w.target);
        });
        let Workspace { target, translation, reorientation, .. } = w;
        let mut sum = Checksum::new();
        for node in target.iter() {
            sum.numbers(&node.attitude);
            sum.numbers(&node.rate);
        }
        measure.check("tumble", sum);

        let formulation = Formulation::new(mission, scenario, *integrator);
        measure.run("path", 1, || {
            translation.trajectory = TranslationTrajectory::ZERO;
            let problem = Translation::new(&formulation, target);
            project(&problem, &mut translation.trajectory);
        });
        measure.check("path", path(&translation.trajectory));
        measure.run("heuristic", 1, || {
            let out = &mut reorientation.trajectory;
            heuristic::warm_start(mission, scenario, &translation.trajectory, target, out);
        });
        measure.check("heuristic", motion(&reorientation.trajectory));
    }

    /// Steps of the dynamics from every node.
    fn step(&self, w: &Workspace) {
        let body = Multibody::new(self.mission);
        let z = &w.reorientation.trajectory;
        let nodes = z.states.iter().zip(&z.controls).take(NODES - 1);
        let mut sum = Checksum::new();
        self.measure.run("step_with_checksum", NODES - 1, || {
            for ((state, control), force) in nodes.zip(&w.translation.trajectory.force) {
                let next = body.step(self.integrator, self.dt, state, control, force);
                sum.numbers(&next.attitude);
                sum.numbers(&next.rate);
                sum.numbers(&next.joint_angle);
                sum.numbers(&next.joint_rate);
            }
        });
        self.measure.check("step", sum);
    }

    /// Steps with their derivatives.
    fn step_jacobian(&self, w: &Workspace) {
        let body = Multibody::new(self.mission);
        let z = &w.reorientation.trajectory;
        let nodes = z.states.iter().zip(&z.controls).take(NODES - 1);
        let mut sum = Checksum::new();
        self.measure.run("step_jacobian_with_checksum", NODES - 1, || {
            for ((state, control), force) in nodes.zip(&w.translation.trajectory.force) {
                let (_, by) = body.step_jacobian::<{ size::NX }, { size::NU }>(
                    &Stepping::new(self.integrator, self.dt),
                    state,
                    control,
                    force,
                );
                sum.numbers(&by.state);
                sum.numbers(&by.control);
            }
        });
        self.measure.check("step_jacobian", sum);
    }

    /// Subproblems of Stage 2, without and with the Lagrangian's Hessian.
    fn linearise(&self, w: &mut Workspace) {
        let Workspace { target, scratch, translation, reorientation } = w;
        let formulation = Formulation::new(self.mission, self.scenario, self.integrator);
        let translation = &translation.trajectory;
        let mut problem =
            StageTwo::new(&formulation, translation, target, Mode::Optimal, &Sequential);
        self.measure.run("linearise", 1, || {
            problem.linearise(&reorientation.trajectory, None, &mut scratch.qp);
        });
        self.measure.check("linearise", program(&scratch.qp));
        set_multipliers(&mut scratch.step);
        self.measure.run("linearise_and_convexify", 1, || {
            problem.linearise(&reorientation.trajectory, Some(&scratch.step), &mut scratch.qp);
        });
        self.measure.check("linearise_and_convexify", program(&scratch.qp));
    }

    /// The verifier.
    fn verify(&self, w: &Workspace) {
        let Self { measure, mission, scenario, integrator, .. } = self;
        let mut residuals = Residuals::default();
        measure.run("verify", 1, || {
            let (translation, reorientation) = (w.translation(), w.reorientation());
            let never = Deadline::never();
            let found = verify(mission, scenario, *integrator, translation, reorientation, &never);
            residuals = found.residuals;
        });
        let mut sum = Checksum::new();
        sum.numbers(&residuals.against(&mission.tolerances).map(|(_, value, _)| value));
        measure.check("verify", sum);
    }
}

struct Measure<'a, B> {
    board: &'a B,
    id: &'a str,
}

impl<B: Board> Measure<'_, B> {
    /// Prints the instructions a kernel takes.
    fn run(&self, name: &str, calls: usize, kernel: impl FnOnce()) {
        let before = self.board.instructions();
        kernel();
        let instructions = self.board.instructions().wrapping_sub(before);
        let line = Line::about(self.board, "count", self.id).text("name", name);
        line.number("calls", calls as u64).number("instructions", instructions).end();
    }

    /// Prints the checksum of what it computed.
    fn check(&self, name: &str, sum: Checksum) {
        let line = Line::about(self.board, "kernel", self.id).text("name", name);
        line.bits("checksum", sum.value()).end();
    }
}

/// Some multipliers, the same everywhere, so that there is curvature to compute.
fn set_multipliers<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    solution: &mut Solution<N, NX, NU, NG>,
) {
    solution.clear_multipliers();
    let mut value = 0.0;
    for multipliers in &mut solution.defect_multiplier {
        for multiplier in multipliers.iter_mut() {
            // A ramp from -1 to 1, over and over.
            value = if value >= 1.0 { -1.0 } else { value + 0.078_125 };
            *multiplier = value * 1e-2;
        }
    }
}

/// Checksum of a path.
pub fn path<const N: usize>(trajectory: &TranslationTrajectory<N>) -> Checksum {
    let mut sum = Checksum::new();
    for vectors in [&trajectory.position, &trajectory.velocity, &trajectory.force] {
        vectors.iter().for_each(|v| sum.numbers(v));
    }
    sum
}

/// Checksum of attitude and arm.
pub fn motion<const N: usize, const NL: usize>(
    trajectory: &ReorientationTrajectory<N, NL>,
) -> Checksum {
    let mut sum = Checksum::new();
    for (state, control) in trajectory.states.iter().zip(&trajectory.controls) {
        sum.numbers(&state.attitude);
        sum.numbers(&state.joint_angle);
        sum.numbers(&state.rate);
        sum.numbers(&state.joint_rate);
        sum.numbers(&control.bus_torque);
        sum.numbers(&control.joint_torque);
    }
    sum
}

fn program<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
) -> Checksum {
    let mut sum = Checksum::new();
    for stage in &qp.stages {
        sum.numbers(&stage.hessian_xx);
        sum.numbers(&stage.hessian_ux);
        sum.numbers(&stage.hessian_uu);
        sum.numbers(&stage.gradient_x);
        sum.numbers(&stage.gradient_u);
        sum.numbers(&stage.a);
        sum.numbers(&stage.b);
        sum.numbers(&stage.c);
        sum.numbers(&stage.path_jacobian);
        sum.numbers(&stage.path_offset);
    }
    sum
}
