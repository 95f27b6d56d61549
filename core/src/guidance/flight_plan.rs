//! The plan that is flown, and what it asks for at any instant.

use super::guarded::{Parity, bits};
use crate::dynamics::{Acceleration, Control, Integrator, Multibody, State};
use crate::model::{Grid, HcwTransition, Mission, Scenario, TargetState, hcw_acceleration};
use crate::planner::Nominal;
use crate::stages::{LINKS, NODES, ReorientationTrajectory, TranslationTrajectory};
use core::fmt;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::count;
use remora_qp::kept::nth;

/// Fewest steps of the target's motion an interval, as in planning.
const TARGET_STEPS: f64 = 10.0;

/// Most steps of the target's motion between two instants.
pub(crate) const MAX_REFERENCE_STEPS: usize = 10;

/// A plan as it is flown: path, motion of bus and arm, and the target's motion that it was made for.
///
/// [`ArmPlan::flight_plan`](crate::prelude::ArmPlan::flight_plan) makes it from a plan in a
/// planner's memory. It is data, [`FlightPlan::BYTES`] of it, which a spacecraft may keep or uplink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightPlan<const NL: usize = LINKS> {
    /// Time of its first node on the clock of the estimates [s].
    pub begins: f64,
    /// Path of the system's centre of mass.
    pub translation: TranslationTrajectory<NODES>,
    /// Bus and arm, with the number of nodes and their time.
    pub nominal: Nominal<NL>,
    /// The target at the nodes.
    pub target: [TargetState; NODES],
    grid: Grid,
    /// Substeps of an interval.
    substeps: usize,
    /// Whether the gravity gradient turns the target.
    has_gradient: bool,
}

/// Why a plan cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotFlyable {
    /// It was made with Euler's step: between its nodes it says nothing.
    Euler,
    /// The verifier did not find every constraint satisfied.
    Unverified,
}

impl fmt::Display for NotFlyable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Euler => "was made with Euler's step, which says nothing between nodes; use rk4",
            Self::Unverified => "was not found flyable by the verifier",
        })
    }
}

impl core::error::Error for NotFlyable {}

/// Reference of a plan at one instant, in the world that it was made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<const NL: usize> {
    /// System's centre of mass, RTN [m].
    pub position: Vector3<f64>,
    /// Its velocity relative to RTN, in RTN [m/s].
    pub velocity: Vector3<f64>,
    /// Its acceleration relative to RTN, in RTN [m/s^2].
    pub acceleration: Vector3<f64>,
    /// Bus and arm.
    pub state: State<NL>,
    /// Their accelerations.
    pub state_acceleration: Acceleration<NL>,
    /// Torques of the interval.
    pub control: Control<NL>,
    /// The target, as the plan expects it.
    pub target: TargetState,
    /// Its angular acceleration relative to RTN, in RTN [rad/s^2].
    pub target_acceleration: Vector3<f64>,
}

impl<const NL: usize> FlightPlan<NL> {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Placeholder for static memory that [`FlightPlan::write`] fills, and no plan to fly: all its bits are
    /// zero, so that it costs no room in an image.
    pub const BLANK: Self = Self {
        begins: 0.0,
        translation: TranslationTrajectory::ZERO,
        nominal: Nominal { reorientation: ReorientationTrajectory::BLANK, nodes: 0, duration: 0.0 },
        target: [TargetState::BLANK; NODES],
        grid: Grid::BLANK,
        substeps: 0,
        has_gradient: false,
    };

    /// A plan's trajectories as they are flown, from time zero on. Cost: one propagation of the target over the horizon.
    ///
    /// # Errors
    /// A plan made with Euler's step. Whether it is verified is the caller's to know.
    pub fn new(
        mission: &Mission<NL>,
        scenario: &Scenario<NL>,
        integrator: Integrator,
        translation: &TranslationTrajectory<NODES>,
        reorientation: &ReorientationTrajectory<NODES, NL>,
    ) -> Result<Self, NotFlyable> {
        let mut plan = Self::BLANK;
        plan.write(mission, scenario, integrator, translation, reorientation)?;
        Ok(plan)
    }

    /// Builds the plan in place: nothing large goes over the stack.
    ///
    /// # Errors
    /// As [`FlightPlan::new`]; the plan is then as it was.
    pub fn write(
        &mut self,
        mission: &Mission<NL>,
        scenario: &Scenario<NL>,
        integrator: Integrator,
        translation: &TranslationTrajectory<NODES>,
        reorientation: &ReorientationTrajectory<NODES, NL>,
    ) -> Result<(), NotFlyable> {
        let grid = mission.grid(scenario);
        let has_gradient = mission.target.gravity_gradient.is_on(integrator);
        self.set(integrator, has_gradient, &grid, (translation, reorientation))?;
        self.target.fill(TargetState::ZERO);
        mission.target.tumble(
            integrator,
            mission.mean_motion(),
            &scenario.target_attitude,
            &scenario.target_rate,
            grid.interval(),
            &mut self.target[..grid.nodes.min(NODES)],
        );
        Ok(())
    }

    /// A plan whose target's motion is known.
    pub(crate) fn of_parts(
        integrator: Integrator,
        has_gradient: bool,
        grid: &Grid,
        trajectories: (&TranslationTrajectory<NODES>, &ReorientationTrajectory<NODES, NL>),
        target: &[TargetState; NODES],
    ) -> Result<Self, NotFlyable> {
        let mut plan = Self { target: *target, ..Self::BLANK };
        plan.set(integrator, has_gradient, grid, trajectories)?;
        Ok(plan)
    }

    /// All of it but for the target's motion.
    fn set(
        &mut self,
        integrator: Integrator,
        has_gradient: bool,
        grid: &Grid,
        (translation, reorientation): (
            &TranslationTrajectory<NODES>,
            &ReorientationTrajectory<NODES, NL>,
        ),
    ) -> Result<(), NotFlyable> {
        let Integrator::Rk4 { substeps } = integrator else { return Err(NotFlyable::Euler) };
        self.begins = 0.0;
        self.translation = *translation;
        self.nominal.reorientation = *reorientation;
        self.nominal.nodes = grid.nodes;
        self.nominal.duration = grid.duration;
        self.grid = *grid;
        self.substeps = substeps;
        self.has_gradient = has_gradient;
        Ok(())
    }

    /// Moves the plan's beginning to this time [s].
    pub fn beginning_at(self, begins: f64) -> Self {
        Self { begins, ..self }
    }

    /// Reference at a time on the clock of the estimates [s]; outside the plan, that of its first or last
    /// node. Cost: the motion from the node before.
    pub fn at(&self, mission: &Mission<NL>, time: f64) -> Reference<NL> {
        let mut cursor = Cursor::START;
        cursor.at(self, mission, time - self.begins)
    }

    /// Its nodes and what holds at them.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether the gravity gradient turns its target.
    pub(super) fn has_gradient(&self) -> bool {
        self.has_gradient
    }

    /// Time from its first node to its last [s].
    pub fn duration(&self) -> f64 {
        self.nominal.duration
    }
}

/// A place on a plan that moves on with time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cursor<const NL: usize> {
    /// The node before.
    node: usize,
    /// Time since the plan's first node [s].
    time: f64,
    state: State<NL>,
    /// That of the state.
    acceleration: Acceleration<NL>,
    target: TargetState,
}

/// Without the acceleration, which is computed anew whenever it moves on.
impl<const NL: usize> Parity for Cursor<NL> {
    // Once in an image.
    #[inline(never)]
    fn parity(&self) -> u64 {
        let State { attitude, joint_angle, rate, joint_rate } = &self.state;
        self.node as u64
            ^ bits(&[self.time])
            ^ bits(&attitude.data.0[0])
            ^ bits(&joint_angle.data.0[0])
            ^ bits(&rate.data.0[0])
            ^ bits(&joint_rate.data.0[0])
            ^ bits(&self.target.attitude.data.0[0])
            ^ bits(&self.target.rate.data.0[0])
    }
}

impl<const NL: usize> Cursor<NL> {
    /// Not on the plan yet.
    pub const START: Self = Self {
        node: NODES,
        time: 0.0,
        state: State::ZERO,
        acceleration: Acceleration::ZERO,
        target: TargetState::ZERO,
    };

    /// Reference of `plan` at `time` [s] after its first node, along its own dynamics from the node
    /// before or from the time of the last call. Before the first node and after the last, that of
    /// the node.
    ///
    /// Cost: four evaluations of the dynamics and those of the target where time goes on by no more than
    /// a substep of planning; at most those of an interval.
    pub fn at(&mut self, plan: &FlightPlan<NL>, mission: &Mission<NL>, time: f64) -> Reference<NL> {
        self.follow(plan, mission, time, plan.substeps);
        self.reference(plan, mission)
    }

    /// Number `element` of the place, for fault injection: time, state, its acceleration, target.
    pub fn number(&mut self, element: usize) -> Option<&mut f64> {
        let (state, target) = (&mut self.state, &mut self.target);
        let numbers = [
            core::slice::from_mut(&mut self.time),
            state.attitude.as_mut_slice(),
            state.joint_angle.as_mut_slice(),
            state.rate.as_mut_slice(),
            state.joint_rate.as_mut_slice(),
            self.acceleration.bus.as_mut_slice(),
            self.acceleration.joint.as_mut_slice(),
            target.attitude.as_mut_slice(),
            target.rate.as_mut_slice(),
        ];
        nth(numbers, element)
    }

    /// Moves on to `time` [s] after the first node, in one step of the dynamics however far that is: what
    /// a step of guidance costs has a bound. Over a whole interval that is as near the plan as its own
    /// discretisation is near the continuous motion.
    pub fn advance(&mut self, plan: &FlightPlan<NL>, mission: &Mission<NL>, time: f64) {
        self.follow(plan, mission, time, 1);
    }

    /// Moves on to `time` [s] after the first node, in steps as the plan's or larger ones, at most so many.
    // Without what a step of guidance keeps meanwhile: their stacks do not add up.
    #[inline(never)]
    fn follow(&mut self, plan: &FlightPlan<NL>, mission: &Mission<NL>, time: f64, most: usize) {
        let (k, share) = plan.nominal.place(time);
        let begin = plan.nominal.time(k);
        let time = begin + share * plan.nominal.interval();
        let at_node = |all: &[State<NL>]| all.get(k).copied().unwrap_or(State::ZERO);
        if k != self.node || !(time >= self.time) {
            let state = at_node(&plan.nominal.reorientation.states);
            let target = plan.target.get(k).copied().unwrap_or(TargetState::ZERO);
            *self = Self { node: k, time: begin, state, target, ..Self::START };
        }
        self.go_on(plan, mission, time, most);
        // A time that is NaN stays NaN.
        self.time = time;
        let (control, force) = plan.held(k);
        self.acceleration = Multibody::new(mission).acceleration(&self.state, &control, &force);
    }

    /// Reference of the plan where the cursor is.
    #[inline(never)]
    pub fn reference(&self, plan: &FlightPlan<NL>, mission: &Mission<NL>) -> Reference<NL> {
        let body = Multibody::new(mission);
        let k = self.node;
        let (control, force) = plan.held(k);
        let along = HcwTransition::new(mission.mean_motion(), self.time - plan.nominal.time(k));
        let specific_force = force / body.total_mass();
        let (position, velocity) = plan.node(k);
        let (position, velocity) = along.carry(&position, &velocity, &specific_force);
        Reference {
            position,
            velocity,
            acceleration: hcw_acceleration(mission.mean_motion(), &position, &velocity)
                + specific_force,
            state: self.state,
            state_acceleration: self.acceleration,
            control,
            target: self.target,
            target_acceleration: plan.turning(mission, &self.target),
        }
    }

    /// Moves on within the interval to `time`, in so many steps at most.
    fn go_on(&mut self, plan: &FlightPlan<NL>, mission: &Mission<NL>, time: f64, most: usize) {
        let (gap, interval) = (time - self.time, plan.nominal.interval());
        if !(gap > 0.0) {
            return;
        }
        // Conversions to integers saturate, and make nothing of NaN.
        let substeps = count(libm::ceil(gap / interval * plan.substeps as f64));
        let substeps = substeps.clamp(1, most.max(1));
        let body = Multibody::new(mission);
        let (control, force) = plan.held(self.node);
        body.rk4(substeps, gap, &mut self.state, &control, &force);
        let steps = count(libm::ceil(gap / interval * TARGET_STEPS));
        let steps = steps.clamp(1, MAX_REFERENCE_STEPS);
        let n = mission.mean_motion();
        self.target = mission.target.after(plan.has_gradient, n, &self.target, gap, steps);
    }
}

impl<const NL: usize> FlightPlan<NL> {
    /// Angular acceleration of a target as the plan knows it, RTN [rad/s^2].
    pub(super) fn turning(&self, mission: &Mission<NL>, target: &TargetState) -> Vector3<f64> {
        mission.target.acceleration(self.has_gradient, mission.mean_motion(), target)
    }

    /// Torques and force from node `k` on.
    fn held(&self, k: usize) -> (Control<NL>, Vector3<f64>) {
        let control = self.nominal.reorientation.controls.get(k).copied();
        let force = self.translation.force.get(k).copied();
        (control.unwrap_or(Control::ZERO), force.unwrap_or_default())
    }

    /// Position and velocity at node `k`.
    pub(super) fn node(&self, k: usize) -> (Vector3<f64>, Vector3<f64>) {
        let at = |all: &[Vector3<f64>]| all.get(k).copied().unwrap_or_default();
        (at(&self.translation.position), at(&self.translation.velocity))
    }
}

impl<const NL: usize> Reference<NL> {
    /// Whether every number is finite.
    pub(super) fn is_finite(&self) -> bool {
        let bus =
            [&self.position, &self.velocity, &self.acceleration, &self.state_acceleration.bus];
        let arm: &SVector<f64, NL> = &self.state_acceleration.joint;
        let mut numbers = bus.into_iter().flatten().chain(arm);
        self.state.is_finite() && numbers.all(|x| x.is_finite())
    }
}
