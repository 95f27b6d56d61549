//! The initial guess of Stage 2.

use super::{PlanSettings, Workspace};
use crate::dynamics::{Control, State};
use crate::model::Mission;
use crate::pair::Pair;
use crate::scp::Problem;
use crate::stages::{
    Formulation, LINKS, MissionReorientation, NODES, ReorientationTrajectory, heuristic,
};
use crate::warmstart::{self, Policy, Scene};
use core::mem;
use remora_qp::Checksum;

/// What Stage 2 is to start from.
#[derive(Clone, Copy)]
pub enum InitialGuess<'a> {
    /// The heuristic of section 9.
    Heuristic,
    /// The roll-out of a policy, and the heuristic where that is of no use.
    Learned {
        /// Whom to ask.
        policy: &'a dyn Policy,
        /// Seed of a policy that draws.
        seed: u64,
    },
    /// The heuristic, because the model that should have been used was refused.
    Refused,
    /// A trajectory handed in, such as an earlier plan or one sent from the ground; the heuristic
    /// where that is of no use. It need not satisfy any constraint: it is moved into the limits
    /// and onto what is pinned, as every start is.
    User(&'a ReorientationTrajectory<NODES, LINKS>),
    /// The same, taken as it is: nobody looks whether it is of use. For fault injection.
    Unchecked(&'a ReorientationTrajectory<NODES, LINKS>),
}

/// What Stage 2 started from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
#[repr(u32)]
pub enum GuessRecord {
    /// The heuristic, as asked.
    #[default]
    Heuristic = 0,
    /// The learned roll-out.
    Learned = 1,
    /// The heuristic: the model was refused when it was opened.
    Refused = 2,
    /// The heuristic: the roll-out could not be finished, or it or the trajectory handed in was
    /// not finite.
    NotFinite = 3,
    /// The heuristic: its merit, cost and weighted defects, is lower than that of the roll-out or
    /// of the trajectory handed in.
    Worse = 4,
    /// The heuristic: from the roll-out or the trajectory handed in the loop did not end solved.
    Unsolved = 5,
    /// The heuristic: there was no time left to look at anything else.
    Deadline = 6,
    /// The trajectory handed in.
    User = 7,
}

impl GuessRecord {
    /// Stable code for records.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Whether another start was asked for and the heuristic used.
    pub fn is_fallback(self) -> bool {
        !(matches!(self, Self::Heuristic) || self.is_offered())
    }

    /// Whether it is what was offered in the heuristic's place: from there the loop has settings of
    /// its own, and the heuristic to fall back on.
    pub(super) fn is_offered(self) -> bool {
        matches!(self, Self::Learned | Self::User)
    }
}

impl InitialGuess<'_> {
    /// Adds what tells this start from others.
    pub(super) fn identify(&self, sum: &mut Checksum) {
        match self {
            Self::Heuristic => sum.integer(0),
            Self::Learned { policy, seed } => {
                sum.integer(1);
                sum.integer(*seed);
                policy.identify(sum);
            }
            Self::Refused => sum.integer(2),
            Self::User(motion) => {
                sum.integer(3);
                identify(motion, sum);
            }
            Self::Unchecked(motion) => {
                sum.integer(4);
                identify(motion, sum);
            }
        }
    }

    /// Writes the start of Stage 2 into the workspace, along the path in it.
    ///
    /// A roll-out follows the dynamics, so that its defects are what it misses at the pins; the
    /// heuristic does not. Their merits at the loop's first weight tell at the price of two
    /// evaluations of the residuals whether a roll-out has gone astray. What was handed in has
    /// to pass the same test.
    #[inline(never)]
    pub(super) fn write<P: Pair>(
        &self,
        formulation: &Formulation<'_, LINKS>,
        options: &PlanSettings,
        pair: &P,
        workspace: &mut Workspace,
    ) -> GuessRecord {
        let Formulation { mission, integrator, deadline, .. } = *formulation;
        write_heuristic(mission, workspace);
        let Workspace { target, scratch: w, translation, reorientation: z } = workspace;
        let path = &translation.trajectory;
        let offered = match self {
            Self::Heuristic => return GuessRecord::Heuristic,
            Self::Refused => return GuessRecord::Refused,
            Self::Unchecked(motion) => {
                z.trajectory = **motion;
                return GuessRecord::User;
            }
            _ if deadline.has_passed() => return GuessRecord::Deadline,
            Self::Learned { policy, seed } => {
                let mut scene = Scene::new(mission, path, target, integrator);
                scene.deadline = deadline;
                warmstart::rollout(&scene, *policy, *seed, &mut z.trial)
                    .then_some(GuessRecord::Learned)
            }
            Self::User(motion) => {
                z.trial = **motion;
                is_finite(motion).then_some(GuessRecord::User)
            }
        };
        let Some(offered) = offered else {
            return match deadline.has_passed() {
                true => GuessRecord::Deadline,
                false => GuessRecord::NotFinite,
            };
        };
        let problem = MissionReorientation::<P>::new(formulation, path, target, options.mode, pair);
        let mut merit = |trajectory: &mut _| {
            problem.project(trajectory);
            problem.residuals(trajectory, &mut w.residuals);
            w.residuals.cost + options.reorientation.penalty_parameter * w.residuals.l1_violation()
        };
        let (other, heuristic) = (merit(&mut z.trial), merit(&mut z.trajectory));
        if deadline.has_passed() {
            heuristic::warm_start(mission, path, target, &mut z.trajectory);
            return GuessRecord::Deadline;
        }
        if !(other <= heuristic) {
            // Clipped twice it would not be the same to the last bit.
            heuristic::warm_start(mission, path, target, &mut z.trajectory);
            return match other.is_finite() {
                true => GuessRecord::Worse,
                false => GuessRecord::NotFinite,
            };
        }
        mem::swap(&mut z.trajectory, &mut z.trial);
        offered
    }
}

fn is_finite(motion: &ReorientationTrajectory<NODES, LINKS>) -> bool {
    motion.states.iter().all(State::is_finite) && motion.controls.iter().all(Control::is_finite)
}

/// Adds a trajectory that was handed in: every bit of it.
fn identify(motion: &ReorientationTrajectory<NODES, LINKS>, sum: &mut Checksum) {
    for state in &motion.states {
        sum.numbers(&state.attitude);
        sum.numbers(&state.joint_angle);
        sum.numbers(&state.rate);
        sum.numbers(&state.joint_rate);
    }
    for control in &motion.controls {
        sum.numbers(&control.bus_torque);
        sum.numbers(&control.joint_torque);
    }
}

/// Writes the heuristic start into the workspace, along the path in it.
pub(super) fn write_heuristic(mission: &Mission<LINKS>, workspace: &mut Workspace) {
    let Workspace { target, translation, reorientation, .. } = workspace;
    let motion = &mut reorientation.trajectory;
    heuristic::warm_start(mission, &translation.trajectory, target, motion);
}
