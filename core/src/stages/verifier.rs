//! The independent verifier: what counts as solved (section 7).
//!
//! It recomputes every residual from the plan's numbers and the mission alone. Nothing here is
//! shared with the stages' own residuals: accelerations come from articulated bodies instead of
//! composite ones, positions from a power series of HCW instead of its closed form, the end
//! effector from link rotations.

use super::{ReorientationTrajectory, TranslationTrajectory};
use crate::dynamics::{Control, Integrator, State, articulated};
use crate::math::{clamp, quaternion};
use crate::model::{Mission, Scenario, TargetState, Tolerances, hcw_acceleration};
use nalgebra::{Matrix3, SVector, Vector3, Vector4};

/// Residuals of a plan, each zero or positive, in the units of section 7.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Residuals {
    /// Stage 1 dynamics, initial and terminal state: r over 1 m, v over 1e-2 m/s.
    pub dynamics1: f64,
    /// Keep-out [m].
    pub keep_out: f64,
    /// Stage 2 dynamics and initial state: q, alpha over 1, w, alpha' over 1e-2 rad/s.
    pub dynamics2: f64,
    /// Excess of any control over its limit, relative.
    pub control: f64,
    /// Joint limits [rad].
    pub joint: f64,
    /// Excess of a joint rate over its limit, relative.
    pub joint_rate: f64,
    /// Pointing, in cosine.
    pub pointing: f64,
    /// Arm preset, angles over 1 rad, rates over 1e-2 rad/s.
    pub preset: f64,
    /// Terminal bus rate over 1e-2 rad/s.
    pub terminal_rate: f64,
    /// Distance of the end effector from the port [m].
    pub ee_position: f64,
    /// Angle between end-effector direction and approach direction [rad].
    pub ee_angle: f64,
    /// Overlap of bodies [m]; zero where [`Approach::clearance`](crate::model::Approach) is not in
    /// force.
    pub clearance: f64,
}

/// The smallest distance between two bodies over a plan, nodes and what lies between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Distance of their surfaces [m]; negative where they overlap.
    pub distance: f64,
    /// When [s].
    pub time_s: f64,
    /// Which body of the servicer: 0 the bus, then the links, from 1.
    pub body: u32,
}

impl Closest {
    /// Nothing looked at yet.
    pub const NONE: Self = Self { distance: f64::INFINITY, time_s: 0.0, body: 0 };
}

/// How near bodies come to each other, by the verifier; judged or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearances {
    /// The arm and the target; within the corridor, the end effector and its edge.
    pub arm: Closest,
    /// The bus and the target.
    pub bus: Closest,
    /// The arm and its own bus.
    pub own: Closest,
}

/// What the verifier found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verification {
    /// The residuals.
    pub residuals: Residuals,
    /// How near bodies come to each other.
    pub clearances: Clearances,
}

impl Residuals {
    /// Number of residuals.
    pub const COUNT: usize = 12;

    /// Names, values and tolerances, in the order of the plan file.
    pub fn against(&self, t: &Tolerances) -> [(&'static str, f64, f64); Self::COUNT] {
        [
            ("dynamics1", self.dynamics1, t.dynamics),
            ("keep_out", self.keep_out, t.keep_out),
            ("dynamics2", self.dynamics2, t.dynamics),
            ("control", self.control, t.control),
            ("joint", self.joint, t.joint),
            ("joint_rate", self.joint_rate, t.joint_rate),
            ("pointing", self.pointing, t.pointing),
            ("preset", self.preset, t.preset),
            ("terminal_rate", self.terminal_rate, t.terminal_rate),
            ("ee_position", self.ee_position, t.end_effector_position),
            ("ee_angle", self.ee_angle, t.end_effector_angle),
            ("clearance", self.clearance, t.clearance),
        ]
    }

    /// Whether every residual is within its tolerance. NaN never is.
    pub fn are_within(&self, tolerances: &Tolerances) -> bool {
        self.against(tolerances).iter().all(|(_, value, tolerance)| value <= tolerance)
    }
}

/// Scales of section 7: rates over 1e-2 rad/s, velocities over 1e-2 m/s.
const RATE_SCALE: f64 = 1e-2;

/// The larger of two residuals; unlike `f64::max` it keeps a NaN.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// Largest magnitude; NaN where a component is not a number.
fn worst(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| worse(m, v.abs()))
}

/// Residuals of a whole plan. `target` is recomputed from the scenario, never taken from a plan.
///
/// Cost: `N - 1` steps of the articulated-body dynamics, four substeps of HCW an interval.
// Its memory is on the stack only while it runs.
#[inline(never)]
pub fn verify<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario,
    integrator: Integrator,
    translation: &TranslationTrajectory<N>,
    reorientation: &ReorientationTrajectory<N, NL>,
) -> Verification {
    let mut residuals = verify_translation(mission, scenario, translation);
    let target = tumble::<N, NL>(mission, scenario);
    let plan = Checked { mission, translation, reorientation, target: &target };
    residuals.dynamics2 = plan.dynamics(integrator);
    plan.bounds(&mut residuals);
    plan.terminal(&mut residuals);
    let clearances = Clearances { arm: Closest::NONE, bus: Closest::NONE, own: Closest::NONE };
    Verification { residuals, clearances }
}

/// Residuals of Stage 1 alone; those of Stage 2 are left zero (`control` is that of the force).
pub fn verify_translation<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario,
    t: &TranslationTrajectory<N>,
) -> Residuals {
    let target = tumble::<N, NL>(mission, scenario);
    let error = |position: Vector3<f64>, velocity: Vector3<f64>| {
        worse(worst(position.as_slice()), worst((velocity / RATE_SCALE).as_slice()))
    };
    let mut dynamics = error(t.position[0] - scenario.position, t.velocity[0] - scenario.velocity);
    let (mut keep_out, mut control) = (0.0, 0.0);
    let dt = mission.approach.duration / (N - 1) as f64;
    for k in 0..N - 1 {
        let (r, v) = propagate(mission, dt, t.position[k], t.velocity[k], t.force[k]);
        dynamics = worse(dynamics, error(r - t.position[k + 1], v - t.velocity[k + 1]));
        let clearance = clearance(mission, &target[k], &t.position[k]);
        keep_out = worse(keep_out, worse(0.0, mission.approach.keep_out(k, N) - clearance));
        control = worse(control, excess(t.force[k].as_slice(), mission.servicer.max_force));
    }
    let last = &target[N - 1];
    let capture = mission.servicer.capture_geometry();
    let goal = quaternion::rotation_matrix(&last.attitude)
        * (mission.target.port_position + mission.target.port_normal * capture.reach);
    let at_goal = error(t.position[N - 1] - goal, t.velocity[N - 1] - last.rate.cross(&goal));
    Residuals { dynamics1: worse(dynamics, at_goal), keep_out, control, ..Default::default() }
}

fn tumble<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario,
) -> [TargetState; N] {
    let mut nodes = [TargetState::ZERO; N];
    mission.target.tumble(
        mission.mean_motion(),
        &scenario.target_attitude,
        &scenario.target_rate,
        mission.approach.duration / (N - 1) as f64,
        &mut nodes,
    );
    nodes
}

/// HCW over an interval by its Taylor series: exact to rounding for `n dt` well below one.
fn propagate<const NL: usize>(
    mission: &Mission<NL>,
    dt: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    force: Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    // A few substeps keep the series short for long horizons too.
    const SUBSTEPS: usize = 4;
    let (n, h) = (mission.mean_motion(), dt / SUBSTEPS as f64);
    let (mut r, mut v) = (position, velocity);
    for _ in 0..SUBSTEPS {
        // Derivatives of [r; v] of order 1, 2, ...: HCW applied again and again.
        let mut term_r = v;
        let mut term_v = hcw_acceleration(n, &r, &v) + force / mission.servicer.total_mass();
        let mut factor = h;
        for order in 2..14 {
            r += term_r * factor;
            v += term_v * factor;
            let next = hcw_acceleration(n, &term_r, &term_v);
            term_r = term_v;
            term_v = next;
            factor *= h / order as f64;
        }
    }
    (r, v)
}

/// Distance from `position` (RTN) to the target's box [m], negative inside.
fn clearance<const NL: usize>(
    mission: &Mission<NL>,
    target: &TargetState,
    position: &Vector3<f64>,
) -> f64 {
    let local = quaternion::rotation_matrix(&target.attitude).transpose() * position;
    let half = mission.target.half_extents;
    let nearest = Vector3::from_fn(|i, _| clamp(local[i], -half[i], half[i]));
    let outside = local - nearest;
    let distance = libm::sqrt(outside.dot(&outside));
    let depth = (0..3).map(|i| half[i] - local[i].abs()).fold(f64::INFINITY, f64::min);
    // `min` drops a NaN, but then `distance` is one.
    if distance > 0.0 || distance.is_nan() { distance } else { -depth }
}

/// By how much any value leaves `[-limit, limit]`, relative to the limit.
fn excess(values: &[f64], limit: f64) -> f64 {
    worse(0.0, worst(values) / limit - 1.0)
}

/// A plan under verification.
struct Checked<'a, const N: usize, const NL: usize> {
    mission: &'a Mission<NL>,
    translation: &'a TranslationTrajectory<N>,
    reorientation: &'a ReorientationTrajectory<N, NL>,
    target: &'a [TargetState; N],
}

impl<const N: usize, const NL: usize> Checked<'_, N, NL> {
    fn dynamics(&self, integrator: Integrator) -> f64 {
        let servicer = &self.mission.servicer;
        let states = &self.reorientation.states;
        let initial = State {
            attitude: crate::model::initial_bus_attitude(&self.translation.position[0]),
            joint_angle: servicer.initial_joint_angle,
            rate: Vector3::zeros(),
            joint_rate: SVector::zeros(),
        };
        let mut error = difference(&initial, &states[0]);
        let dt = self.mission.approach.duration / (N - 1) as f64;
        for k in 0..N - 1 {
            let (control, force) = (&self.reorientation.controls[k], &self.translation.force[k]);
            let next = self.step(integrator, dt, &states[k], control, force);
            error = worse(error, difference(&next, &states[k + 1]));
        }
        error
    }

    /// One interval by Euler or RK4, on articulated-body accelerations.
    fn step(
        &self,
        integrator: Integrator,
        dt: f64,
        x: &State<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> State<NL> {
        let n = self.mission.mean_motion();
        let rates = |x: &State<NL>| {
            let spin = Vector4::new(x.rate.x, x.rate.y, x.rate.z, 0.0);
            let a = articulated::acceleration(&self.mission.servicer, n, x, control, force);
            State {
                attitude: quaternion::product(&spin, &x.attitude) * 0.5,
                joint_angle: x.joint_rate,
                rate: a.bus,
                joint_rate: a.joint,
            }
        };
        let moved = |x: &State<NL>, d: &State<NL>, h: f64| State {
            attitude: x.attitude + d.attitude * h,
            joint_angle: x.joint_angle + d.joint_angle * h,
            rate: x.rate + d.rate * h,
            joint_rate: x.joint_rate + d.joint_rate * h,
        };
        let (substeps, classical) = match integrator {
            Integrator::Euler => (1, false),
            Integrator::Rk4 { substeps } => (substeps, true),
        };
        let h = dt / substeps as f64;
        let mut x = *x;
        // Bound: verified_substeps.
        for _ in 0..substeps {
            let k1 = rates(&x);
            x = if classical {
                let k2 = rates(&moved(&x, &k1, 0.5 * h));
                let k3 = rates(&moved(&x, &k2, 0.5 * h));
                let k4 = rates(&moved(&x, &k3, h));
                let mut sum = x;
                for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                    sum = moved(&sum, &k, weight * h / 6.0);
                }
                sum
            } else {
                moved(&x, &k1, h)
            };
            x.attitude = quaternion::normalized(&x.attitude);
        }
        x
    }

    fn bounds(&self, out: &mut Residuals) {
        let servicer = &self.mission.servicer;
        let cosine = libm::cos(self.mission.approach.field_of_view_half_angle);
        for k in 0..N {
            let state = &self.reorientation.states[k];
            if k + 1 < N {
                let control = &self.reorientation.controls[k];
                let bus = excess(control.bus_torque.as_slice(), servicer.max_bus_torque);
                let joint = excess(control.joint_torque.as_slice(), servicer.max_joint_torque);
                out.control = worse(out.control, worse(bus, joint));
            }
            for i in 0..NL {
                let beyond = state.joint_angle[i].abs() - servicer.max_joint_angle[i];
                out.joint = worse(out.joint, worse(0.0, beyond));
            }
            let rate = excess(state.joint_rate.as_slice(), servicer.max_joint_rate);
            out.joint_rate = worse(out.joint_rate, rate);
            let port = self.port(k);
            let sight = port - self.translation.position[k];
            let boresight = quaternion::rotation_matrix(&state.attitude) * servicer.boresight;
            let seen = sight.dot(&boresight) / libm::sqrt(sight.dot(&sight));
            out.pointing = worse(out.pointing, worse(0.0, cosine - seen));
        }
    }

    fn terminal(&self, out: &mut Residuals) {
        let servicer = &self.mission.servicer;
        let preset = (N - 1).saturating_sub(self.mission.approach.preset_lead);
        let angles = self.reorientation.states[preset].joint_angle - servicer.capture_joint_angle;
        out.preset = worst(angles.as_slice());
        for state in &self.reorientation.states[preset..] {
            out.preset = worse(out.preset, worst((state.joint_rate / RATE_SCALE).as_slice()));
        }
        let (last, target) = (&self.reorientation.states[N - 1], &self.target[N - 1]);
        out.terminal_rate = worst(((last.rate - target.rate) / RATE_SCALE).as_slice());

        let bus = quaternion::rotation_matrix(&last.attitude);
        let tip = bus * self.tip_from_center(&last.joint_angle);
        let miss = self.translation.position[N - 1] + tip - self.port(N - 1);
        out.ee_position = libm::sqrt(miss.dot(&miss));
        let approach =
            -(quaternion::rotation_matrix(&target.attitude) * self.mission.target.port_normal);
        let arm = bus * self.tip_from_center(&servicer.capture_joint_angle);
        let across = arm.cross(&approach);
        out.ee_angle = libm::atan2(libm::sqrt(across.dot(&across)), arm.dot(&approach));
    }

    /// Docking port at node `k`, RTN [m].
    fn port(&self, k: usize) -> Vector3<f64> {
        quaternion::rotation_matrix(&self.target[k].attitude) * self.mission.target.port_position
    }

    /// End effector from the system's centre of mass, bus axes [m].
    fn tip_from_center(&self, angles: &SVector<f64, NL>) -> Vector3<f64> {
        let servicer = &self.mission.servicer;
        let (mut rotation, mut joint) = (Matrix3::identity(), servicer.arm_base);
        let (mut mass, mut moment) = (servicer.bus_mass, Vector3::zeros());
        for (link, angle) in servicer.links.iter().zip(angles.iter()) {
            let (sin, cos) = libm::sincos(*angle);
            let cross = link.axis.cross_matrix();
            rotation *= Matrix3::identity() + cross * sin + cross * cross * (1.0 - cos);
            moment += (joint + rotation * link.center_of_mass) * link.mass;
            mass += link.mass;
            joint += rotation * link.tip;
        }
        joint - moment / mass
    }
}

/// Largest scaled difference of two states; the quaternion's sign does not count.
fn difference<const NL: usize>(a: &State<NL>, b: &State<NL>) -> f64 {
    let same = worst((a.attitude - b.attitude).as_slice());
    let opposite = worst((a.attitude + b.attitude).as_slice());
    let attitude = if opposite < same { opposite } else { same };
    let angle = worst((a.joint_angle - b.joint_angle).as_slice());
    let rate = worst(((a.rate - b.rate) / RATE_SCALE).as_slice());
    let joint_rate = worst(((a.joint_rate - b.joint_rate) / RATE_SCALE).as_slice());
    worse(worse(attitude, angle), worse(rate, joint_rate))
}
