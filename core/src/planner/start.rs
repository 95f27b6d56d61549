//! Where Stage 2 starts from.

use super::{Options, Workspace};
use crate::dynamics::{Control, State};
use crate::math::Checksum;
use crate::model::Mission;
use crate::pair::Pair;
use crate::scp::Problem;
use crate::stages::{
    Formulation, LINKS, NODES, Reorientation, ReorientationTrajectory, heuristic, size,
};
use crate::warmstart::{self, Policy, Scene};
use core::mem;

/// What Stage 2 is to start from.
pub enum Start<'a> {
    /// The heuristic of section 9.
    Heuristic,
    /// The roll-out of a policy, and the heuristic where that is of no use.
    Learned {
        /// Whom to ask.
        policy: &'a mut dyn Policy,
        /// Seed of a policy that draws.
        seed: u64,
    },
    /// The heuristic, because the model that should have been used was refused.
    Refused,
    /// A trajectory handed in, such as an earlier plan or one sent from the ground; the heuristic
    /// where that is of no use. It need not satisfy any constraint: it is moved into the limits
    /// and onto what is pinned, as every start is.
    Given(&'a ReorientationTrajectory<NODES, LINKS>),
}

/// What Stage 2 started from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
#[repr(u32)]
pub enum StartRecord {
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
    Given = 7,
}

impl StartRecord {
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
        matches!(self, Self::Learned | Self::Given)
    }
}

impl Start<'_> {
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
            Self::Given(motion) => {
                sum.integer(3);
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
        &mut self,
        formulation: &Formulation<'_, LINKS>,
        options: &Options,
        pair: &P,
        workspace: &mut Workspace,
    ) -> StartRecord {
        let Formulation { mission, integrator, deadline, .. } = *formulation;
        write_heuristic(mission, workspace);
        let Workspace { target, scratch: w, translation, reorientation: z } = workspace;
        let path = &translation.trajectory;
        let offered = match self {
            Self::Heuristic => return StartRecord::Heuristic,
            Self::Refused => return StartRecord::Refused,
            _ if deadline.has_passed() => return StartRecord::Deadline,
            Self::Learned { policy, seed } => {
                let mut scene = Scene::new(mission, path, target, integrator);
                scene.deadline = deadline;
                warmstart::roll_out(&scene, &mut **policy, *seed, &mut z.trial)
                    .then_some(StartRecord::Learned)
            }
            Self::Given(motion) => {
                z.trial = **motion;
                is_finite(motion).then_some(StartRecord::Given)
            }
        };
        let Some(offered) = offered else {
            return match deadline.has_passed() {
                true => StartRecord::Deadline,
                false => StartRecord::NotFinite,
            };
        };
        let problem = Reorientation::<P, _, LINKS, { size::NX }, { size::NU }>::new(
            formulation,
            path,
            target,
            options.mode,
            pair,
        );
        let mut merit = |trajectory: &mut _| {
            problem.clip(trajectory);
            problem.residuals(trajectory, &mut w.residuals);
            w.residuals.cost + options.reorientation.weight * w.residuals.penalty()
        };
        let (other, heuristic) = (merit(&mut z.trial), merit(&mut z.trajectory));
        if deadline.has_passed() {
            heuristic::warm_start(mission, path, target, &mut z.trajectory);
            return StartRecord::Deadline;
        }
        if !(other <= heuristic) {
            // Clipped twice it would not be the same to the last bit.
            heuristic::warm_start(mission, path, target, &mut z.trajectory);
            return match other.is_finite() {
                true => StartRecord::Worse,
                false => StartRecord::NotFinite,
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
