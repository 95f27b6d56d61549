//! The independent verifier: what counts as solved (section 7).
//!
//! It recomputes every residual from the plan's numbers, the scenario and the mission. Nothing of
//! the planner's is used where a mistake could hide in both:
//!
//! | | here | in the planner |
//! | --- | --- | --- |
//! | target | momentum in inertial axes, Dormand-Prince with error control | body rates, RK4 |
//! | Stage 1 | power series of HCW | its closed form |
//! | Stage 2 | ABA, substeps by their error | CRBA, the plan's substeps |
//! | arm, reach, initial attitude | rotation matrices, Euler angles | quaternions |
//! | distances | search, certified by tangents | piecewise, exact |
//!
//! Shared are what defines the problem (mission, scenario and trajectories as data; the keep-out
//! radius and the preset's node, the mean motion, the total mass and
//! [`hcw_acceleration`](crate::model::hcw_acceleration), which the verifier's tests derive a second
//! time) and what is mathematics alone and tested as such: nalgebra, products and matrices of
//! quaternions, Cholesky's factorisation.

mod clearance;
mod distance;
mod posture;
mod reorientation;
mod residuals;
mod start;
mod target;
#[cfg(test)]
mod tests;
mod translation;

pub(crate) use distance::MAX_HALVINGS;
pub(crate) use reorientation::{MAX_DOUBLINGS, MAX_PART_SUBSTEPS};
pub use residuals::{ArmClearances, Clearances, Closest, Residuals, Verification};
pub(crate) use target::MAX_TARGET_STEPS;

use super::worse;
use super::{ReorientationTrajectory, TranslationTrajectory};
use crate::dynamics::{Control, Integrator, State};
use crate::math::quaternion;
use crate::model::{Mission, Scenario, TargetState};
use clearance::Bodies;
use nalgebra::Vector3;
use posture::Posture;
use remora_qp::time::Deadline;
use reorientation::{Interval, difference};
use residuals::{RATE_SCALE, beyond_stops, excess, worst};
use start::{Beyond, initial_state};
use target::Tumbling;
use translation::{Leg, Path};

/// Parts of an interval; limits are checked at their ends.
const PARTS: usize = 10;

/// Number of parts between checks of clearances.
const CLEARANCE_PARTS: usize = 2;

/// Residuals of a whole plan. The target is recomputed from the scenario, never taken from a plan.
///
/// `deadline` is checked once an interval. Once it has passed the residuals are
/// [`Residuals::UNFINISHED`], and the clearances those found so far.
///
/// Cost: for RK4 15 substeps of the articulated-body dynamics an interval (60 evaluations) where
/// the motion is slow, twice as many for each doubling that it takes beyond that; one evaluation
/// for Euler. The rest is less than 20 evaluations' worth.
// Not inlined: its frame is released afterwards.
#[inline(never)]
pub fn verify<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    integrator: Integrator,
    translation: &TranslationTrajectory<N>,
    reorientation: &ReorientationTrajectory<N, NL>,
    deadline: &Deadline<'_>,
) -> Verification {
    let plan = Trajectories { translation, reorientation };
    verify_some(mission, scenario, integrator, plan, usize::MAX, deadline)
}

/// [`verify`] for the first interval alone, to measure its time.
pub(crate) fn verify_first<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    integrator: Integrator,
    translation: &TranslationTrajectory<N>,
    reorientation: &ReorientationTrajectory<N, NL>,
) -> Verification {
    let (plan, never) = (Trajectories { translation, reorientation }, Deadline::never());
    verify_some(mission, scenario, integrator, plan, 1, &never)
}

/// The trajectories of both stages.
struct Trajectories<'a, const N: usize, const NL: usize> {
    translation: &'a TranslationTrajectory<N>,
    reorientation: &'a ReorientationTrajectory<N, NL>,
}

/// Verifies at most `intervals` intervals, from the first.
fn verify_some<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    integrator: Integrator,
    plan: Trajectories<'_, N, NL>,
    intervals: usize,
    deadline: &Deadline<'_>,
) -> Verification {
    let Trajectories { translation, reorientation } = plan;
    let between = mission.approach.between_nodes.is_on(integrator);
    let grid = mission.grid(scenario);
    let mut beyond = Beyond::of(mission, scenario, &grid);
    let is_euler = scenario.start.is_given() && !integrator.is_flown();
    if let (true, Some(position)) = (is_euler, translation.position.get(1)) {
        let dt = grid.interval();
        let first = Tumbling::new(mission, scenario, integrator).along(0, dt);
        beyond = beyond.and_euler_pose(mission, scenario, dt, position, &first[PARTS]);
    }
    let beyond = &beyond;
    let path = Path { mission, grid, trajectory: translation, between, beyond };
    let plan =
        Checked { mission, integrator, path: &path, trajectory: reorientation, between, beyond };
    let mut target = Tumbling::new(mission, scenario, integrator);
    let mut bodies = Bodies::new(mission);
    let mut out = Residuals::default();
    path.begin(scenario, &mut out);
    plan.begin(scenario, &mut out);
    for (leg, held) in path.legs().zip(plan.legs()).take(intervals) {
        if deadline.has_passed() {
            return bodies.with(Residuals::UNFINISHED);
        }
        let turning = target.along(leg.k, path.dt());
        let positions = path.interval(&leg, &turning, &mut out);
        plan.interval(&leg, &held, &turning, &positions, &mut bodies, &mut out);
    }
    if deadline.has_passed() {
        return bodies.with(Residuals::UNFINISHED);
    }
    let last = target.state();
    path.end(&last, &mut out);
    plan.end(&last, &mut bodies, &mut out);
    if mission.approach.clearance.is_on(integrator) {
        out.clearance = bodies.found.overlap();
    }
    bodies.with(out)
}

/// Residuals of Stage 1 alone; those of Stage 2 are left zero (`control` is that of the force).
pub fn verify_translation<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    integrator: Integrator,
    trajectory: &TranslationTrajectory<N>,
) -> Residuals {
    let between = mission.approach.between_nodes.is_on(integrator);
    let grid = mission.grid(scenario);
    let beyond = &Beyond::of(mission, scenario, &grid);
    let path = Path { mission, grid, trajectory, between, beyond };
    let mut target = Tumbling::new(mission, scenario, integrator);
    let mut out = Residuals::default();
    path.begin(scenario, &mut out);
    for leg in path.legs() {
        let turning = target.along(leg.k, path.dt());
        path.interval(&leg, &turning, &mut out);
    }
    path.end(&target.state(), &mut out);
    out
}

/// Angle about `axis` between the planes through it that two directions lie in [rad].
fn roll_error(a: &Vector3<f64>, b: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
    let (a, b) = (axis.cross(a), axis.cross(b));
    let across = a.cross(&b);
    libm::atan2(libm::sqrt(across.dot(&across)), a.dot(&b))
}

/// Target and servicer at one instant.
struct Instant<'a, const NL: usize> {
    time_s: f64,
    target: &'a TargetState,
    position: &'a Vector3<f64>,
    state: &'a State<NL>,
}

/// How near bodies come to each other at one instant, by the verifier's distances: the servicer's centre
/// of mass at `position` (RTN, m) in `state`, and the target.
pub fn clearances_at<const NL: usize>(
    mission: &Mission<NL>,
    time_s: f64,
    target: &TargetState,
    position: &Vector3<f64>,
    state: &State<NL>,
) -> Clearances {
    let mut bodies = Bodies::new(mission);
    bodies.look(&Instant { time_s, target, position, state });
    bodies.found
}

/// Stage 2 of a plan under verification.
struct Checked<'a, const N: usize, const NL: usize> {
    mission: &'a Mission<NL>,
    integrator: Integrator,
    path: &'a Path<'a, N, NL>,
    trajectory: &'a ReorientationTrajectory<N, NL>,
    between: bool,
    beyond: &'a Beyond<NL>,
}

/// Stage 2 over one interval: the states at its ends and the control.
struct Held<'a, const NL: usize> {
    from: &'a State<NL>,
    to: &'a State<NL>,
    control: &'a Control<NL>,
}

impl<'a, const N: usize, const NL: usize> Checked<'a, N, NL> {
    /// The intervals, from the first on.
    fn legs(&self) -> impl Iterator<Item = Held<'a, NL>> {
        let ReorientationTrajectory { states, controls } = self.trajectory;
        states.iter().zip(states.iter().skip(1)).zip(controls).map(|((from, to), control)| Held {
            from,
            to,
            control,
        })
    }

    fn begin(&self, scenario: &Scenario<NL>, out: &mut Residuals) {
        let initial = initial_state(self.mission, scenario);
        out.dynamics2 = worse(out.dynamics2, difference(&initial, &self.trajectory.states[0]));
    }

    /// Checks a node and the interval after it.
    fn interval(
        &self,
        leg: &Leg<'_>,
        held: &Held<'_, NL>,
        target: &[TargetState; PARTS + 1],
        positions: &[Vector3<f64>; PARTS + 1],
        bodies: &mut Bodies<'_, NL>,
        out: &mut Residuals,
    ) {
        let (servicer, dt) = (&self.mission.servicer, self.path.dt());
        let control = held.control;
        let bus = excess(control.bus_torque.as_slice(), servicer.bus_torque_limit_n_m.as_slice());
        let joint =
            excess(control.joint_torque.as_slice(), servicer.joint_torque_limit_n_m.as_slice());
        out.control = worse(out.control, worse(bus, joint));

        let (mission, integrator) = (self.mission, self.integrator);
        let flown = Interval { mission, integrator, dt, control, force: leg.force }.fly(held.from);
        let defect = difference(&flown.states[PARTS], held.to);
        out.dynamics2 = worse(out.dynamics2, worse(defect, flown.unresolved));

        for part in 0..PARTS {
            let time_s = (leg.k as f64 + part as f64 / PARTS as f64) * dt;
            let (target, position) = (&target[part], &positions[part]);
            let at = Instant { time_s, target, position, state: &flown.states[part] };
            if part == 0 || self.between {
                self.limits(&at, out);
            }
            if part % CLEARANCE_PARTS == 0 {
                bodies.look(&at);
            }
        }
    }

    /// Joint stops, joint rates and pointing.
    fn limits(&self, at: &Instant<'_, NL>, out: &mut Residuals) {
        let servicer = &self.mission.servicer;
        let is_recovering = self.path.grid.is_recovering(at.time_s);
        for i in 0..NL {
            if !(is_recovering && self.beyond.joint[i]) {
                let (lower, upper) =
                    (servicer.min_joint_angle_rad[i], servicer.max_joint_angle_rad[i]);
                let beyond = beyond_stops(at.state.joint_angle[i], lower, upper);
                out.joint = worse(out.joint, worse(0.0, beyond));
            }
            if !(is_recovering && self.beyond.joint_rate[i]) {
                let rate = excess(&[at.state.joint_rate[i]], &[servicer.joint_rate_limit_rad_s[i]]);
                out.joint_rate = worse(out.joint_rate, rate);
            }
        }
        if is_recovering && self.beyond.pointing {
            return;
        }
        let sight = self.port(at.target) - at.position;
        let boresight = quaternion::rotation_matrix(&at.state.attitude) * servicer.boresight;
        let seen = sight.dot(&boresight) / libm::sqrt(sight.dot(&sight));
        let cosine = libm::cos(self.mission.approach.field_of_view_half_angle_rad);
        out.pointing = worse(out.pointing, worse(0.0, cosine - seen));
    }

    /// Checks the last node and the terminal constraints.
    fn end(&self, target: &TargetState, bodies: &mut Bodies<'_, NL>, out: &mut Residuals) {
        let last = self.path.last();
        let (last, position) =
            (&self.trajectory.states[last], &self.path.trajectory.position[last]);
        let time_s = self.path.grid.duration;
        let at = Instant { time_s, target, position, state: last };
        self.limits(&at, out);
        bodies.look(&at);
        out.preset = self.held();
        out.terminal_rate = worst(((last.rate - target.rate) / RATE_SCALE).as_slice());

        let servicer = &self.mission.servicer;
        let bus = quaternion::rotation_matrix(&last.attitude);
        let tip = bus * Posture::new(servicer, &last.joint_angle).arm();
        let miss = position + tip - self.port(target);
        out.ee_position = libm::sqrt(miss.dot(&miss));
        let approach =
            -(quaternion::rotation_matrix(&target.attitude) * self.mission.target.port_normal);
        let arm = bus * Posture::at_capture(servicer).arm();
        let across = arm.cross(&approach);
        out.ee_angle = libm::atan2(libm::sqrt(across.dot(&across)), arm.dot(&approach));
        if let Some(roll) = &self.mission.roll {
            let reference = bus * Posture::at_capture(servicer).last_axes * roll.end_effector;
            let wanted = quaternion::rotation_matrix(&target.attitude) * roll.port;
            out.ee_angle = worse(out.ee_angle, roll_error(&reference, &wanted, &approach));
        }
    }

    /// Deviation of the arm from its capture configuration, scaled: flown plans hold its angles from the
    /// preset on and its rates at the end; the paper's problem its angles at the preset and its rates
    /// from there on.
    fn held(&self) -> f64 {
        let capture = &self.mission.servicer.capture_joint_angle_rad;
        let (preset, last) = (self.path.grid.preset_node(), self.path.last());
        let (angles_until, rates_from) =
            if self.integrator.is_flown() { (last, last) } else { (preset, preset) };
        let mut worst_held = 0.0;
        for (k, state) in self.trajectory.states.iter().enumerate().take(last + 1).skip(preset) {
            if k <= angles_until {
                let off = state.joint_angle - capture;
                worst_held = worse(worst_held, worst(off.as_slice()));
            }
            if k >= rates_from {
                let rate = state.joint_rate / RATE_SCALE;
                worst_held = worse(worst_held, worst(rate.as_slice()));
            }
        }
        worst_held
    }

    /// Docking port, RTN [m].
    fn port(&self, target: &TargetState) -> Vector3<f64> {
        quaternion::rotation_matrix(&target.attitude) * self.mission.target.port_position_m
    }
}
