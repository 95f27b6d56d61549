//! The initial guess of Stage 2.

use super::{ArmWorkspace, Nominal, PlanSettings};
use crate::dynamics::{Control, State};
use crate::executor::ForkJoin;
use crate::scp::Problem;
use crate::stages::{Formulation, LINKS, NODES, Reorientation, ReorientationTrajectory, heuristic};
use crate::warmstart::{self, Policy, Scene};
use core::mem;
use remora_qp::Checksum;

/// The initial guess of Stage 2.
#[derive(Clone, Copy)]
pub enum InitialGuess<'a, const NL: usize = LINKS> {
    /// The heuristic of section 9.
    Heuristic,
    /// The rollout of a policy, or the heuristic where that is no better.
    Learned {
        /// The policy.
        policy: &'a dyn Policy,
        /// Seed of a policy that samples.
        seed: u64,
    },
    /// The heuristic, because the learned model was refused.
    Refused,
    /// A trajectory of the user's, such as an earlier plan, or the heuristic where that is better. It
    /// need not satisfy any constraint: it is projected onto limits and fixed values, as every guess.
    User(&'a ReorientationTrajectory<NODES, NL>),
    /// The rest of the plan in force `elapsed` seconds after its start, or the heuristic where that is
    /// better.
    Nominal {
        /// The plan in force.
        plan: &'a Nominal<NL>,
        /// Time since its first node [s].
        elapsed: f64,
    },
    /// A trajectory of the user's, used without comparison to the heuristic. For fault injection.
    Unchecked(&'a ReorientationTrajectory<NODES, NL>),
}

/// The initial guess that Stage 2 used, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum GuessRecord {
    /// The heuristic, as asked.
    #[default]
    Heuristic = 0,
    /// The learned rollout.
    #[cfg_attr(feature = "serde", serde(rename = "model"))]
    Learned = 1,
    /// The heuristic: the model was refused when it was opened.
    Refused = 2,
    /// The heuristic: the rollout was not completed, or the offered guess was not finite.
    NotFinite = 3,
    /// The heuristic: its merit (cost plus penalty) is lower than the offered guess's.
    Worse = 4,
    /// The heuristic: the SCP solver did not converge from the offered guess.
    Unsolved = 5,
    /// The heuristic: the deadline had passed.
    Deadline = 6,
    /// The user's trajectory.
    #[cfg_attr(feature = "serde", serde(rename = "given"))]
    User = 7,
    /// The rest of the plan in force.
    Nominal = 8,
    /// The heuristic: the model is for another number of nodes or joints, for a roll that is free, or has
    /// learnt from approaches that begin otherwise ([`MAX_DEVIATION`](crate::warmstart::MAX_DEVIATION)).
    Unfit = 9,
}

impl GuessRecord {
    /// Code for records; it never changes its meaning.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Heuristic => "heuristic",
            Self::Learned => "model",
            Self::User => "given",
            Self::Nominal => "nominal",
            Self::Refused => "refused",
            Self::NotFinite => "not_finite",
            Self::Worse => "worse",
            Self::Unsolved => "unsolved",
            Self::Deadline => "deadline",
            Self::Unfit => "unfit",
        }
    }

    /// Name in plan files and tables: what was used, and whether it was what was asked for.
    pub fn in_tables(self) -> &'static str {
        if self.is_fallback() { "fallback" } else { self.name() }
    }

    /// Why the heuristic was used though something else was asked for.
    pub fn why(self) -> Option<&'static str> {
        match self {
            Self::Heuristic | Self::Learned | Self::User | Self::Nominal => None,
            Self::Refused => Some("the model was refused"),
            Self::NotFinite => Some("the rollout is not finite"),
            Self::Worse => Some("the rollout is worse than the heuristic"),
            Self::Unsolved => Some("from the rollout Stage 2 was not solved"),
            Self::Deadline => Some("no time was left for a rollout"),
            Self::Unfit => Some(
                "the model has learnt from other approaches: nodes, joints, roll or features differ",
            ),
        }
    }

    /// Whether another guess was asked for and the heuristic used.
    pub fn is_fallback(self) -> bool {
        !(matches!(self, Self::Heuristic) || self.is_offered())
    }

    /// Whether the offered guess was used, not the heuristic: it has SCP settings of its own and the
    /// heuristic as fallback.
    pub(super) fn is_offered(self) -> bool {
        matches!(self, Self::Learned | Self::User | Self::Nominal)
    }
}

impl<const NL: usize> InitialGuess<'_, NL> {
    /// Adds all that distinguishes this guess from others to a checksum.
    pub(super) fn identify(&self, sum: &mut Checksum) {
        match self {
            Self::Heuristic => sum.integer(0),
            Self::Learned { policy, seed } => {
                sum.integer(1);
                sum.integer(*seed);
                policy.identify(sum);
            }
            Self::Refused => sum.integer(2),
            Self::User(reorientation) => {
                sum.integer(3);
                identify(reorientation, sum);
            }
            Self::Unchecked(reorientation) => {
                sum.integer(4);
                identify(reorientation, sum);
            }
            Self::Nominal { plan, elapsed } => {
                sum.integer(5);
                sum.numbers([&plan.duration, elapsed]);
                if plan.nodes != NODES {
                    sum.integer(plan.nodes as u64);
                }
                identify(&plan.reorientation, sum);
            }
        }
    }

    /// Writes the initial guess of Stage 2 to the workspace, along the translation in it.
    ///
    /// The offered guess must have no higher merit, at the initial penalty parameter, than the heuristic, which
    /// rejects a diverged rollout. Cost: its residuals, with which the solver begins, and the heuristic's at as
    /// many nodes as it takes to exceed them.
    #[inline(never)]
    pub(super) fn write<P: ForkJoin, const NX: usize, const NU: usize>(
        &self,
        formulation: &Formulation<'_, NL>,
        options: &PlanSettings,
        executor: &P,
        workspace: &mut ArmWorkspace<NL, NX, NU>,
    ) -> GuessRecord {
        let Formulation { mission, scenario, integrator, deadline, .. } = *formulation;
        let nodes = formulation.grid().nodes;
        write_heuristic(formulation, workspace);
        let ArmWorkspace { target, scratch: w, translation, reorientation: z } = workspace;
        z.is_evaluated = false;
        let translation = &translation.trajectory;
        let offered = match self {
            Self::Heuristic => return GuessRecord::Heuristic,
            Self::Refused => return GuessRecord::Refused,
            Self::Unchecked(reorientation) => {
                z.trajectory = **reorientation;
                return GuessRecord::User;
            }
            Self::Learned { policy, .. }
                if policy.nodes() != nodes || policy.joints() != NL || mission.roll.is_some() =>
            {
                return GuessRecord::Unfit;
            }
            _ if deadline.has_passed() => return GuessRecord::Deadline,
            Self::Learned { policy, seed } => {
                let mut scene = Scene::new(mission, scenario, translation, target, integrator);
                scene.deadline = deadline;
                if !warmstart::is_known(&scene, *policy) {
                    return GuessRecord::Unfit;
                }
                let trial = &mut z.trial;
                warmstart::rollout(&scene, *policy, *seed, trial).then_some(GuessRecord::Learned)
            }
            Self::User(reorientation) => {
                z.trial = **reorientation;
                is_finite(reorientation, nodes).then_some(GuessRecord::User)
            }
            Self::Nominal { plan, elapsed } => {
                plan.resample(*elapsed, &formulation.grid(), &mut z.trial);
                is_finite(&z.trial, nodes).then_some(GuessRecord::Nominal)
            }
        };
        let Some(offered) = offered else {
            let is_late = deadline.has_passed();
            return if is_late { GuessRecord::Deadline } else { GuessRecord::NotFinite };
        };
        let mode = options.mode;
        let problem = Reorientation::<P, NODES, NL, NX, NU>::new(
            formulation,
            translation,
            target,
            mode,
            executor,
        );
        let penalty_parameter = options.reorientation.penalty_parameter;
        problem.project(&mut z.trial);
        problem.residuals(&z.trial, &mut w.residuals);
        let merit = w.residuals.cost + penalty_parameter * w.residuals.l1_violation();
        problem.project(&mut z.trajectory);
        let (heuristic, scratch) = (&z.trajectory, &mut w.trial_residuals);
        let is_better = problem.has_at_least_merit(merit, penalty_parameter, heuristic, scratch);
        let is_late = deadline.has_passed();
        if is_late || !is_better {
            // Written again: a projection repeated would change its last bits.
            heuristic::warm_start(mission, scenario, translation, target, &mut z.trajectory);
            return if is_late {
                GuessRecord::Deadline
            } else if merit.is_finite() {
                GuessRecord::Worse
            } else {
                GuessRecord::NotFinite
            };
        }
        mem::swap(&mut z.trajectory, &mut z.trial);
        z.is_evaluated = true;
        offered
    }
}

fn is_finite<const NL: usize>(
    reorientation: &ReorientationTrajectory<NODES, NL>,
    nodes: usize,
) -> bool {
    reorientation.states.iter().take(nodes).all(State::is_finite)
        && reorientation.controls.iter().take(nodes).all(Control::is_finite)
}

/// Adds every bit of a user's trajectory to a checksum.
fn identify<const NL: usize>(
    reorientation: &ReorientationTrajectory<NODES, NL>,
    sum: &mut Checksum,
) {
    for state in &reorientation.states {
        sum.numbers(&state.attitude);
        sum.numbers(&state.joint_angle);
        sum.numbers(&state.rate);
        sum.numbers(&state.joint_rate);
    }
    for control in &reorientation.controls {
        sum.numbers(&control.bus_torque);
        sum.numbers(&control.joint_torque);
    }
}

/// Writes the heuristic guess to the workspace, along the translation in it.
pub(super) fn write_heuristic<const NL: usize, const NX: usize, const NU: usize>(
    formulation: &Formulation<'_, NL>,
    workspace: &mut ArmWorkspace<NL, NX, NU>,
) {
    let Formulation { mission, scenario, .. } = *formulation;
    let ArmWorkspace { target, translation, reorientation, .. } = workspace;
    let reorientation = &mut reorientation.trajectory;
    heuristic::warm_start(mission, scenario, &translation.trajectory, target, reorientation);
}
