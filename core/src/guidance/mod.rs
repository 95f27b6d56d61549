//! Guidance: flies a plan in a world that is not the plan's.
//!
//! [`Guidance::step`] is called at any rate from 0.2 to 20 Hz with what navigation knows, and answers
//! forces, torques and joint references. It knows the plan's dynamics between nodes, turns the plan with
//! the target as that is estimated to be (`docs/concepts/guidance.md`), and shortens the feedback as
//! a whole where it meets limits. Planning again is the caller's, who is told when, and hands the
//! new plan over. No allocation, no panic; the same input gives the same bits on every target.

mod closing;
mod estimate;
mod expected;
mod flight_plan;
mod guarded;
mod leaving;
mod numbers;
mod replanning;
mod safety;
mod settings;
mod tracking;
mod turn;

pub use closing::Closing;
pub use estimate::{Command, Estimate, FlightMode, Limits, Reason, TrackingError};
pub(crate) use flight_plan::MAX_REFERENCE_STEPS;
pub use flight_plan::{FlightPlan, NotFlyable, Reference};
pub use numbers::GuidancePart;
pub use replanning::Replan;
pub use safety::{Drift, Escape, Safety};
pub(crate) use safety::{MAX_DRIFT_STEPS, MAX_ESCAPE_STEPS};
pub use settings::{AbortErrors, GuidanceSettings, Triggers};

use crate::dynamics::{Control, Multibody, State};
use crate::math::quaternion;
use crate::model::{Mission, hcw_acceleration};
use crate::stages::LINKS;
use closing::Pace;
use flight_plan::Cursor;
use guarded::{Guarded, Parity, bits};
use leaving::Leaving;
use nalgebra::Vector3;
use remora_qp::Valid;
use remora_qp::dense::{clamp, divisor};
use tracking::{Effort, Errors, Tracking};
use turn::Turn;

/// Longest time between steps that feedback counts with [s].
const LONGEST_STEP: f64 = 5.0;

/// The state of flying plans, one after the other: plain data, [`Guidance::BYTES`] of it.
///
/// ```
/// use remora_core::prelude::*;
///
/// let mission = Mission::default().validated()?;
/// let scenario = Scenario::default().validated()?;
/// let mut planner = Box::new(Planner::new());
/// let options = Options::builder().mode(remora_core::prelude::Mode::Feasible).build()?;
/// let plan = planner.plan(&mission, &scenario, &options)?.flight_plan(0.0)?;
/// let mut guidance = Guidance::new(GuidanceSettings::DEFAULT.validated()?);
/// // The servicer is where guidance expects it, and so is the target.
/// let estimate = guidance.expected(&mission, &plan, 0.0);
/// let limits = Limits::of(&mission.servicer);
/// let command = guidance.step(&mission, &plan, &estimate, &limits);
/// assert_eq!(command.mode, FlightMode::Track);
/// assert!((command.force - plan.translation.force[0]).amax() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Guidance<const NL: usize = LINKS> {
    settings: Guarded<GuidanceSettings>,
    /// When the plan of the last step begins [s]; by it another plan is known.
    begins: Option<f64>,
    cursor: Cursor<NL>,
    /// Parity of the place on the plan as the last step left it.
    parity: u64,
    memory: Guarded<Memory<NL>>,
    /// Time of the last step [s]; none before the first.
    last: Option<f64>,
    /// From the one before to it [s].
    since: f64,
    /// Last command, for a change of plans without a jump.
    commanded: (Vector3<f64>, Control<NL>),
}

/// State that guidance learns in flight, and only there.
#[derive(Clone, Copy, Debug)]
struct Memory<const NL: usize> {
    integrals: Errors<NL>,
    /// Position error that the wrist camera has found.
    offset: Offset,
    /// When the turn to the estimated target began to be faded in; the first step's time.
    first: Option<f64>,
    /// Jump of the command to the new plan, and its time; it is faded out.
    jump: Option<Jump<NL>>,
    /// Whether another plan, or an abort, was asked for.
    asked: Option<Request<NL>>,
}

impl<const NL: usize> Parity for Memory<NL> {
    // Once in an image.
    #[inline(never)]
    fn parity(&self) -> u64 {
        let Errors { position, attitude, joint } = &self.integrals;
        let Offset { seen, value, rate, is_astray } = &self.offset;
        bits(&position.data.0[0])
            ^ bits(&attitude.data.0[0])
            ^ bits(&joint.data.0[0])
            ^ bits(&seen.data.0[0])
            ^ bits(&value.data.0[0])
            ^ bits(&rate.data.0[0])
            ^ u64::from(*is_astray)
            ^ bits(&[self.first.unwrap_or(0.0)])
            ^ self.jump.as_ref().map_or(0, Jump::parity)
            ^ self.asked.as_ref().map_or(0, Request::parity)
    }
}

/// Request of the caller.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Request<const NL: usize> {
    Replan,
    Abort(Leaving<NL>),
}

impl<const NL: usize> Parity for Request<NL> {
    fn parity(&self) -> u64 {
        match self {
            Self::Replan => 1,
            Self::Abort(leaving) => 2 ^ leaving.parity(),
        }
    }
}

/// Correction of navigation's position by the wrist camera, followed as a smooth path: a step of the
/// error would wind up the integral.
#[derive(Clone, Copy, Debug, Default)]
struct Offset {
    /// As last seen [m].
    seen: Vector3<f64>,
    /// As followed [m], and its rate [m/s].
    value: Vector3<f64>,
    rate: Vector3<f64>,
    /// Whether the end effector is seen beside the port where the plan's own motion has ended.
    is_astray: bool,
}

impl Offset {
    /// Goes on for `since` [s] with critical damping, and shifts what is wanted by what it has come to.
    fn follow<const NL: usize>(&mut self, wanted: &mut Reference<NL>, bandwidth: f64, since: f64) {
        // Implicit in the rate, so that no step is too long.
        let w = bandwidth * since;
        let pull = (self.seen - self.value) * (bandwidth * w);
        let rate = (self.rate + pull) / (1.0 + 2.0 * w + w * w);
        let acceleration =
            if since > 0.0 { (rate - self.rate) / divisor(since) } else { Vector3::zeros() };
        self.rate = rate;
        self.value += rate * since;
        wanted.position -= self.value;
        wanted.velocity -= self.rate;
        wanted.acceleration -= acceleration;
    }
}

/// A jump of the command where one plan took over from another.
#[derive(Clone, Copy, Debug)]
struct Jump<const NL: usize> {
    force: Vector3<f64>,
    control: Control<NL>,
    /// When; none before the first step of the new plan.
    at: Option<f64>,
}

impl<const NL: usize> Parity for Jump<NL> {
    fn parity(&self) -> u64 {
        let Self { force, control: Control { bus_torque, joint_torque }, at } = self;
        bits(&force.data.0[0])
            ^ bits(&bus_torque.data.0[0])
            ^ bits(&joint_torque.data.0[0])
            ^ bits(&[at.unwrap_or(0.0)])
    }
}

impl<const NL: usize> Guidance<NL> {
    /// Size in bytes of its state.
    pub const BYTES: usize = size_of::<Self>();

    /// Nothing flown yet.
    pub fn new(settings: Valid<GuidanceSettings>) -> Self {
        // Number by number: as a constant it would lie in an image twice.
        let memory = Memory {
            integrals: Errors::ZERO,
            offset: Offset::default(),
            first: None,
            jump: None,
            asked: None,
        };
        Self {
            settings: Guarded::new(settings.into_inner()),
            begins: None,
            cursor: Cursor::START,
            parity: Cursor::<NL>::START.parity(),
            memory: Guarded::new(memory),
            last: None,
            since: 0.0,
            commanded: (Vector3::zeros(), Control::ZERO),
        }
    }

    /// Asks for another plan: the next steps say that it is wanted.
    pub fn ask_for_plan(&mut self) {
        self.memory.restore();
        self.memory.asked = self.memory.asked.or(Some(Request::Replan));
        self.memory.keep();
    }

    /// Leaves the target, from the next step on; the only way back is another `Guidance`.
    pub fn abort(&mut self) {
        self.memory.restore();
        self.memory.asked = Some(Request::Abort(Leaving::without(Vector3::zeros())));
        self.memory.keep();
    }

    /// One step along `plan`: what the actuators are to do from the estimate's time to the next step's.
    ///
    /// A plan that begins at another time than that of the step before takes over from it: integrals go on,
    /// and what the command would jump by is faded out. The caller sees to it that plans are verified.
    ///
    /// Cost: five evaluations of the dynamics, one of the inverse dynamics; see `docs/evidence/results.md` for
    /// instructions. An estimate that is no number leaves what is planned as it stands
    /// ([`FlightMode::Degraded`]).
    // A function of its own, whose stack is bounded as such.
    #[inline(never)]
    pub fn step(
        &mut self,
        mission: &Valid<Mission<NL>>,
        plan: &FlightPlan<NL>,
        estimate: &Estimate<NL>,
        limits: &Limits<NL>,
    ) -> Command<NL> {
        self.restore();
        self.notice(plan);
        let is_known = self.tick(estimate);
        if is_known && self.is_leaving() {
            return self.leave(mission, estimate, limits);
        }
        let pace = plan.pace(&self.closing(plan), self.last.unwrap_or(plan.begins));
        self.cursor.advance(plan, mission, pace.time);
        // The cursor advances before tracking, not within it: their stacks do not add up.
        if is_known {
            self.track(mission, plan, estimate, limits, &pace)
        } else {
            self.blind(mission, plan, limits)
        }
    }

    /// Makes good what memory has lost since the last step: settings and what was learnt from their spares, the
    /// place on the plan from the node before it.
    #[inline(never)]
    fn restore(&mut self) {
        self.settings.restore();
        self.memory.restore();
        if self.cursor.parity() != self.parity {
            self.cursor = Cursor::START;
        }
    }

    /// Notes the time of the step and whether what navigation says is known.
    // Separate function: its frame is on no other stack.
    #[inline(never)]
    fn tick(&mut self, estimate: &Estimate<NL>) -> bool {
        let is_known = estimate.is_finite();
        if is_known {
            let last = self.last.replace(estimate.time).unwrap_or(estimate.time);
            self.since = clamp(estimate.time - last, 0.0, LONGEST_STEP);
        }
        is_known
    }

    /// The last way, as far as it fits between the first step and capture.
    fn closing(&self, plan: &FlightPlan<NL>) -> Closing {
        let first = self.memory.first.or(self.last).unwrap_or(plan.begins);
        self.settings.closing.within(plan.left(first))
    }

    /// Makes of what the plan asks for at the cursor what is asked for now, and tells the angle by which
    /// the target is off.
    #[inline(never)]
    fn aim(
        &mut self,
        mission: &Mission<NL>,
        plan: &FlightPlan<NL>,
        estimate: &Estimate<NL>,
        pace: &Pace,
        wanted: &mut Reference<NL>,
    ) -> f64 {
        let now = estimate.time;
        pace.apply(wanted);
        let turn = Turn::to(plan, mission, wanted, &estimate.target, self.faded_in(now));
        // Where the plan is flown ahead, so is its target.
        let ahead = pace.time - (now - plan.begins);
        let off = turn.whole + wanted.target.rate * ahead.max(0.0);
        turn.apply(wanted);
        if let Some(seen) = seen_by_camera(mission, estimate) {
            self.memory.offset.seen = seen;
        }
        self.memory.offset.follow(wanted, self.settings.camera, self.since);
        let (left, closing) = (plan.left(now), self.closing(plan));
        let away = closing::add(wanted, &closing, mission, &estimate.target, [left, self.since]);
        let has_come = pace.rate == 0.0;
        self.memory.offset.is_astray = has_come
            && estimate.wrist.is_some_and(|tip| {
                let off = tip - away;
                libm::sqrt(off.dot(&off)) > self.settings.abort.port
            });
        libm::sqrt(off.dot(&off))
    }

    /// The step once the reference has moved on.
    #[inline(never)]
    fn track(
        &mut self,
        mission: &Mission<NL>,
        plan: &FlightPlan<NL>,
        estimate: &Estimate<NL>,
        limits: &Limits<NL>,
        pace: &Pace,
    ) -> Command<NL> {
        let mut wanted = self.cursor.reference(plan, mission);
        if !wanted.is_finite() {
            return self.blind(mission, plan, limits);
        }
        let angle = self.aim(mission, plan, estimate, pace, &mut wanted);
        let (body, mean_motion) = (Multibody::new(mission), mission.mean_motion());
        let (settings, since) = (&self.settings, self.since);
        let tracking = Tracking { body, mean_motion, settings, limits, since };
        let mut effort = tracking.effort(&wanted, estimate, &mut self.memory.integrals);
        effort.error.target = angle;
        if plan.left(estimate.time) <= settings.abort.near_times[1] {
            let target = quaternion::rotation_matrix(&estimate.target.attitude);
            let normal = target * mission.target.port_normal;
            effort.beside = tracking.beside(&normal, &wanted.state, &estimate.state, &effort.soon);
        }
        self.follow(plan, limits, &wanted, &mut effort, estimate.time)
    }

    fn is_leaving(&self) -> bool {
        matches!(self.memory.asked, Some(Request::Abort(_)))
    }

    /// Gives the approach up, from the next step on, where it is lost.
    fn give_up(&mut self, plan: &FlightPlan<NL>, now: f64, effort: &Effort<NL>) {
        let abort = &self.settings.abort;
        let (since_first, left) = (now - self.memory.first.unwrap_or(now), plan.left(now));
        if let Some(without) = abort.beyond(effort, since_first, left) {
            self.memory.asked = Some(Request::Abort(Leaving::without(without)));
        } else if self.memory.offset.is_astray {
            self.memory.asked = Some(Request::Abort(Leaving::without(Vector3::zeros())));
        }
    }

    /// A step away from the target; joints with servos of their own stay where they are.
    // Separate function: its memory is not on the feedback's stack.
    #[inline(never)]
    fn leave(
        &mut self,
        mission: &Mission<NL>,
        estimate: &Estimate<NL>,
        limits: &Limits<NL>,
    ) -> Command<NL> {
        let mut leaving = match self.memory.asked {
            Some(Request::Abort(leaving)) => leaving,
            _ => Leaving::without(Vector3::zeros()),
        };
        let (body, mean_motion) = (Multibody::new(mission), mission.mean_motion());
        let (settings, since) = (&self.settings, self.since);
        let tracking = Tracking { body, mean_motion, settings, limits, since };
        let effort = leaving.effort(&tracking, mission, estimate);
        self.memory.asked = Some(Request::Abort(leaving));
        let mut state = estimate.state;
        state.joint_angle = leaving.joint_angle;
        state.joint_rate.fill(0.0);
        self.command(FlightMode::Abort, None, &state, &effort)
    }

    /// The feedback's effort as a command, and whether another plan is wanted.
    // Separate function, too: its memory is not on the feedback's stack.
    #[inline(never)]
    fn follow(
        &mut self,
        plan: &FlightPlan<NL>,
        limits: &Limits<NL>,
        wanted: &Reference<NL>,
        effort: &mut Effort<NL>,
        now: f64,
    ) -> Command<NL> {
        self.give_up(plan, now, effort);
        self.fade_out_jump(effort, limits, now);
        let age = now - plan.begins;
        let reason = self.reason(&effort.error, age, plan.duration() - age);
        let mode = if age >= plan.duration() {
            FlightMode::Done
        } else if reason.is_some() {
            FlightMode::ReplanWanted
        } else {
            FlightMode::Track
        };
        self.command(mode, reason, &wanted.state, effort)
    }

    /// Notices another plan.
    fn notice(&mut self, plan: &FlightPlan<NL>) {
        if self.begins == Some(plan.begins) {
            return;
        }
        self.cursor = Cursor::START;
        self.memory.asked = self.memory.asked.filter(|asked| matches!(asked, Request::Abort(_)));
        if self.begins.is_some() {
            let (force, control) = self.commanded;
            self.memory.jump = Some(Jump { force, control, at: None });
        }
        self.begins = Some(plan.begins);
    }

    fn command(
        &mut self,
        mode: FlightMode,
        wanted: Option<Reason>,
        reference: &State<NL>,
        effort: &Effort<NL>,
    ) -> Command<NL> {
        self.commanded = (effort.force, effort.control);
        self.parity = self.cursor.parity();
        self.memory.keep();
        Command {
            mode,
            wanted,
            force: effort.force,
            control: effort.control,
            joint_angle: reference.joint_angle,
            joint_rate: reference.joint_rate,
            error: effort.error,
            share: effort.share,
        }
    }

    /// Commands the plan's reference at the cursor, without feedback, where the estimate is unusable.
    #[inline(never)]
    fn blind(
        &mut self,
        mission: &Mission<NL>,
        plan: &FlightPlan<NL>,
        limits: &Limits<NL>,
    ) -> Command<NL> {
        let planned = self.cursor.reference(plan, mission);
        let mut effort = Effort::NONE;
        if self.is_leaving() {
            // No force or torque: the plan leads to the target.
            return self.command(FlightMode::Abort, None, &planned.state, &effort);
        }
        let free = hcw_acceleration(mission.mean_motion(), &planned.position, &planned.velocity);
        let force = (planned.acceleration - free) * mission.servicer.total_mass();
        effort.force = limits.force(&force, &Vector3::zeros()).0;
        effort.control = limits.torques(&planned.control, &Control::ZERO).0;
        self.command(FlightMode::Degraded, None, &planned.state, &effort)
    }

    /// Share of the turn to the estimated target that is in force, and its rate [1/s].
    fn faded_in(&mut self, now: f64) -> [f64; 2] {
        self.memory.first.get_or_insert(now);
        self.share_of_turn(now)
    }

    /// Share of the turn and its rate [1/s], a smooth step; a flight that has not begun begins now.
    fn share_of_turn(&self, now: f64) -> [f64; 2] {
        let since = now - self.memory.first.unwrap_or(now);
        let [share, rate, _] = closing::smooth(since, self.settings.fade[1]);
        [share, rate]
    }

    /// Adds what is left of the jump from the plan before.
    fn fade_out_jump(&mut self, effort: &mut Effort<NL>, limits: &Limits<NL>, now: f64) {
        let Some(mut jump) = self.memory.jump else { return };
        let at = match jump.at {
            Some(at) => at,
            None => {
                jump.force -= effort.force;
                jump.control.bus_torque -= effort.control.bus_torque;
                jump.control.joint_torque -= effort.control.joint_torque;
                jump.at = Some(now);
                now
            }
        };
        let left = 1.0 - (now - at) / self.settings.fade[0];
        self.memory.jump = (left > 0.0).then_some(jump);
        let left = left.max(0.0);
        let Jump { force, control, .. } = jump;
        let control = Control {
            bus_torque: control.bus_torque * left,
            joint_torque: control.joint_torque * left,
        };
        effort.force = limits.force(&effort.force, &(force * left)).0;
        effort.control = limits.torques(&effort.control, &control).0;
    }

    /// Why another plan is wanted, at this age of the plan in force and with so much time left [s].
    fn reason(&self, error: &TrackingError, age: f64, left: f64) -> Option<Reason> {
        let triggers = &self.settings.triggers;
        if left < triggers.last {
            None
        } else if self.memory.asked == Some(Request::Replan) {
            Some(Reason::Caller)
        } else if error.target > triggers.target {
            Some(Reason::Tumble)
        } else if error.position > triggers.position || error.attitude > triggers.attitude {
            Some(Reason::Error)
        } else if age > triggers.age {
            Some(Reason::Time)
        } else {
            None
        }
    }
}

/// Error of navigation's end-effector position by the wrist camera, where it sees the port [m].
fn seen_by_camera<const NL: usize>(
    mission: &Mission<NL>,
    estimate: &Estimate<NL>,
) -> Option<Vector3<f64>> {
    let seen = estimate.wrist?;
    let body = Multibody::new(mission);
    let (center, _) = body.center_of_mass(&estimate.state);
    let tip = estimate.position + center + body.end_effector(&estimate.state).position;
    let target = quaternion::rotation_matrix(&estimate.target.attitude);
    Some(seen - (tip - target * mission.target.port_position_m))
}
