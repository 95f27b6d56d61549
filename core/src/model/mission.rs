//! Everything that is the same for every approach of a mission.

#[cfg(doc)]
use super::Grid;
use super::{MIN_NODES, Orbit, Servicer, Switch, Target, Typical};
use crate::math::nearly_unit;
use core::fmt;
use nalgebra::{Matrix3, Vector3};
use remora_qp::dense::{cholesky_in_place, is_not_negative, is_positive, is_usable, is_within};
use remora_qp::{Valid, Validate};

/// Largest distance from one of the norm of a direction that is not normalised.
const UNIT: f64 = 1e-9;

/// The approach itself: how long, how far off, how well seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Time from the first node to the last [s].
    pub duration: f64,
    /// Nodes of a plan, from [`MIN_NODES`] to what a build has room for.
    pub nodes: usize,
    /// Keep-out distance of the system centre of mass from the target's box while far [m].
    pub keep_out_far: f64,
    /// The same during the last part of the approach [m].
    pub keep_out_near: f64,
    /// Time before the end from which the near distance holds [s].
    pub keep_out_near_time: f64,
    /// Half angle of the cone about the boresight that must contain the docking port [rad].
    pub field_of_view_half_angle: f64,
    /// Time before the end from which the arm is in its capture configuration, at the node before at
    /// the latest [s].
    pub preset_time: f64,
    /// Time within which a given [start](super::Start) is led back into limits that it violates [s].
    pub recovery_time: f64,
    /// Whether bus and arm must stay clear of the target, and the arm of its own bus.
    pub clearance: Switch,
    /// Whether limits hold between the nodes too, and planning keeps [`Margins`] from them.
    pub between_nodes: Switch,
}

impl Default for Approach {
    fn default() -> Self {
        Self {
            duration: 1200.0,
            nodes: 60,
            keep_out_far: 1.85,
            keep_out_near: 1.46,
            keep_out_near_time: 360.0,
            field_of_view_half_angle: 20.0 * core::f64::consts::PI / 180.0,
            preset_time: 80.0,
            recovery_time: 80.0,
            clearance: Switch::Auto,
            between_nodes: Switch::Auto,
        }
    }
}

/// How far planning stays from what the verifier holds a plan to, where
/// [`Approach::between_nodes`] is in force (`clearance`: where [`Approach::clearance`] is).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// From the joint stops [rad].
    pub joint_angle: f64,
    /// Share of the joint rate limit that is left unused.
    pub joint_rate: f64,
    /// From the keep-out distances [m]; it fades as [`Grid::margin_share`] says.
    pub keep_out: f64,
    /// From the edge of the field of view [rad].
    pub field_of_view: f64,
    /// Between bodies [m]; it fades like that of keep-out.
    pub clearance: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self {
            joint_angle: 0.02,
            joint_rate: 0.1,
            keep_out: 0.03,
            field_of_view: core::f64::consts::PI / 180.0,
            clearance: 0.03,
        }
    }
}

/// The end effector's way to the port: within a cone about the port's normal the end effector may
/// come nearer to the target than anything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corridor {
    /// Half angle of the cone [rad].
    pub half_angle: f64,
    /// Radius of the cone at the port [m].
    pub mouth_radius: f64,
    /// Length of the last link's end that only the corridor concerns: the gripper [m].
    pub end_effector_length: f64,
}

impl Default for Corridor {
    fn default() -> Self {
        Self {
            half_angle: 60.0 * core::f64::consts::PI / 180.0,
            mouth_radius: 0.1,
            end_effector_length: 0.15,
        }
    }
}

/// Where scenarios are drawn from (section 8); planning has no use for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenarioRanges {
    /// Distance in front of the port about which starts are drawn [m].
    pub standoff: f64,
    /// Half widths of the offset from there, along the RTN axes [m].
    pub offset: Vector3<f64>,
    /// Half width of each component of the target's rate [rad/s].
    pub rate: f64,
    /// Norm of the target's rate where that is given: its direction is then uniform [rad/s].
    pub rate_norm: Option<f64>,
    /// Half width of each component of the servicer's velocity [m/s].
    pub velocity: f64,
}

impl Default for ScenarioRanges {
    fn default() -> Self {
        Self {
            standoff: 5.0,
            offset: Vector3::new(1.0, 1.0, 2.0),
            rate: 1e-3,
            rate_norm: None,
            velocity: 5e-3,
        }
    }
}

/// Weights of the cost, on controls divided by their limits (sections 5 and 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// `W1`: force.
    pub force: f64,
    /// `W2`: change of force from node to node.
    pub force_change: f64,
    /// `W3`, first block: bus torque.
    pub bus_torque: f64,
    /// `W3`, second block: joint torque.
    pub joint_torque: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { force: 1.0, force_change: 0.03, bus_torque: 0.5, joint_torque: 1.0 }
    }
}

/// What counts as solved (section 7). Residuals below these, by the independent verifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Dynamics defects over their scales.
    pub dynamics: f64,
    /// Control bounds, relative.
    pub control: f64,
    /// Joint limits [rad].
    pub joint: f64,
    /// Joint rate limit, relative.
    pub joint_rate: f64,
    /// Pointing, in cosine.
    pub pointing: f64,
    /// Arm preset, scaled.
    pub preset: f64,
    /// Terminal bus rate, scaled.
    pub terminal_rate: f64,
    /// Keep-out distance [m].
    pub keep_out: f64,
    /// End effector at the port [m].
    pub end_effector_position: f64,
    /// Approach direction [rad].
    pub end_effector_angle: f64,
    /// Overlap of bodies [m].
    pub clearance: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self {
            dynamics: 1e-4,
            control: 1e-6,
            joint: 1e-6,
            joint_rate: 1e-6,
            pointing: 1e-4,
            preset: 1e-4,
            terminal_rate: 1e-4,
            keep_out: 1e-4,
            end_effector_position: 1e-3,
            end_effector_angle: 1e-3,
            clearance: 1e-4,
        }
    }
}

/// Largest cosine between the approach and a direction across it, of which the roll is told.
const ALONG: f64 = 0.995;

/// A mission: everything but the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mission<const NL: usize> {
    /// The target's orbit.
    pub orbit: Orbit,
    /// The target.
    pub target: Target,
    /// The servicer.
    pub servicer: Servicer<NL>,
    /// The approach.
    pub approach: Approach,
    /// Cost weights.
    pub weights: Weights,
    /// What counts as solved.
    pub tolerances: Tolerances,
    /// How far planning stays from its limits.
    pub margins: Margins,
    /// The end effector's way to the port.
    pub corridor: Corridor,
    /// Where scenarios are drawn from.
    pub scenarios: ScenarioRanges,
    /// What steps are divided by; `None`: what follows from the rest, see [`Mission::typical`].
    pub typical_magnitudes: Option<Typical>,
    /// The roll of the end effector about the approach at capture; `None`: free.
    pub roll: Option<Roll>,
}

/// Two directions that are one at capture, seen along the approach: they fix the end effector's roll
/// about it. What of them lies along the approach does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roll {
    /// Unit vector in the last link's axes.
    pub end_effector: Vector3<f64>,
    /// Unit vector in the target's axes, across the port's normal.
    pub port: Vector3<f64>,
}

impl Default for Mission<3> {
    fn default() -> Self {
        Self {
            orbit: Orbit::default(),
            target: Target::default(),
            servicer: Servicer::default(),
            approach: Approach::default(),
            weights: Weights::default(),
            tolerances: Tolerances::default(),
            margins: Margins::default(),
            corridor: Corridor::default(),
            scenarios: ScenarioRanges::default(),
            typical_magnitudes: None,
            roll: None,
        }
    }
}

impl<const NL: usize> Mission<NL> {
    /// The same mission with another servicer, whose arm may have another number of joints. Keep-out
    /// distances follow from it: [`Servicer::extension`] while far, its reach at capture afterwards.
    ///
    /// Cost: that of the extension; not for flight.
    pub fn with_servicer<const M: usize>(&self, servicer: Servicer<M>) -> Mission<M> {
        let mut mission = self.with(servicer);
        mission.approach.keep_out_far = mission.servicer.extension();
        mission.approach.keep_out_near = mission.servicer.capture_geometry().reach;
        mission
    }

    /// The same mission with another servicer, and nothing else changed.
    pub(super) fn with<const M: usize>(&self, servicer: Servicer<M>) -> Mission<M> {
        let Self { orbit, target, servicer: _, approach, weights, tolerances, margins, .. } = *self;
        let Self { corridor, scenarios, typical_magnitudes, roll, .. } = *self;
        Mission {
            orbit,
            target,
            servicer,
            approach,
            weights,
            tolerances,
            margins,
            corridor,
            scenarios,
            typical_magnitudes,
            roll,
        }
    }
}

/// A field whose value makes no sense, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidField {
    /// Path of the field, such as `servicer.bus_mass`.
    pub field: &'static str,
    /// What is wrong with it.
    pub reason: &'static str,
}

impl fmt::Display for InvalidField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.reason)
    }
}

impl core::error::Error for InvalidField {}

/// Share of an inertia's trace by which rounding may make a flat body's second mass moment negative.
const FLAT: f64 = 1e-12;

/// Ends of intervals that are open there.
const ABOVE_ZERO: f64 = 0.0_f64.next_up();
const BELOW_ONE: f64 = 1.0_f64.next_down();

/// Collects checks so that each is one line.
struct Check;

impl Check {
    fn that(ok: bool, field: &'static str, reason: &'static str) -> Result<(), InvalidField> {
        if ok { Ok(()) } else { Err(InvalidField { field, reason }) }
    }

    fn positive(value: f64, field: &'static str) -> Result<(), InvalidField> {
        Self::that(is_positive(value), field, "must be positive and finite, from 1e-30 to 1e30")
    }

    fn non_negative(value: f64, field: &'static str) -> Result<(), InvalidField> {
        Self::that(is_not_negative(value), field, "must be finite and not negative, up to 1e30")
    }

    fn finite(values: &[f64], field: &'static str) -> Result<(), InvalidField> {
        Self::that(values.iter().all(|v| is_usable(*v)), field, "must be finite, up to 1e30")
    }

    fn unit(v: &Vector3<f64>, field: &'static str) -> Result<(), InvalidField> {
        Self::finite(v.as_slice(), field)?;
        let off = (libm::sqrt(v.dot(v)) - 1.0).abs();
        Self::that(off <= UNIT, field, "must be a unit vector")
    }

    fn inertia(v: &Vector3<f64>, field: &'static str) -> Result<(), InvalidField> {
        Self::inertia_tensor(&Matrix3::from_diagonal(v), field)
    }

    /// The tensor must be symmetric and positive definite, and so must, but for rounding, be the body's
    /// second mass moments: no principal moment is then above the sum of the other two.
    fn inertia_tensor(m: &Matrix3<f64>, field: &'static str) -> Result<(), InvalidField> {
        for i in 0..3 {
            Self::positive(m[(i, i)], field)?;
        }
        Self::finite(m.as_slice(), field)?;
        Self::that(*m == m.transpose(), field, "must be symmetric")?;
        let is_positive = |m: &Matrix3<f64>| cholesky_in_place(&mut m.clone_owned()).is_ok();
        Self::that(is_positive(m), field, "must be positive definite")?;
        let second = Matrix3::from_diagonal_element((0.5 + FLAT) * m.trace()) - m;
        Self::that(
            is_positive(&second),
            field,
            "no body has such moments: each must be at most the sum of the other two",
        )
    }
}

impl<const NL: usize> Validate for Mission<NL> {
    type Error = InvalidField;

    /// Directions whose norm differs from one by at most 1e-3 are normalised.
    fn validated(mut self) -> Result<Valid<Self>, InvalidField> {
        let Self { target, servicer, roll, .. } = &mut self;
        let axes = servicer.links.iter_mut().map(|link| &mut link.axis);
        let rolls = roll.iter_mut().flat_map(|roll| [&mut roll.end_effector, &mut roll.port]);
        for v in axes.chain(rolls).chain([&mut target.port_normal, &mut servicer.boresight]) {
            *v = nearly_unit(v, UNIT);
        }
        self.validate().map(|()| Valid::of_constant(self))
    }

    fn validate(&self) -> Result<(), InvalidField> {
        Mission::validate(self)
    }
}

impl<const NL: usize> Mission<NL> {
    /// Mean motion of the orbit [rad/s].
    pub fn mean_motion(&self) -> f64 {
        self.orbit.mean_motion()
    }

    /// Refuses values that no mission can have: NaN, negative masses, axes that are not unit
    /// vectors, limits that exclude the arm's own start.
    ///
    /// # Errors
    /// The first field found wrong, with the reason.
    pub fn validate(&self) -> Result<(), InvalidField> {
        let o = &self.orbit;
        Check::positive(o.gravitational_parameter, "orbit.gravitational_parameter")?;
        Check::positive(o.semi_major_axis, "orbit.semi_major_axis")?;
        let open = is_within(o.eccentricity, -0.0, BELOW_ONE);
        Check::that(open, "orbit.eccentricity", "must lie in [0, 1)")?;
        Check::finite(&[o.inclination], "orbit.inclination")?;
        Check::non_negative(o.body.radius, "orbit.body_radius")?;
        self.validate_target()?;
        self.validate_servicer()?;
        self.validate_approach()?;
        self.validate_margins()?;
        self.validate_weights_and_tolerances()
    }

    fn validate_target(&self) -> Result<(), InvalidField> {
        let t = &self.target;
        for i in 0..3 {
            Check::positive(t.half_extents[i], "target.half_extents")?;
        }
        Check::inertia(&t.inertia, "target.inertia")?;
        Check::positive(t.mass, "target.mass")?;
        Check::finite(t.port_position.as_slice(), "target.port_position")?;
        Check::unit(&t.port_normal, "target.port_normal")
    }

    fn validate_servicer(&self) -> Result<(), InvalidField> {
        let s = &self.servicer;
        Check::positive(s.bus_mass, "servicer.bus_mass")?;
        Check::inertia_tensor(&s.bus_inertia, "servicer.bus_inertia")?;
        for i in 0..3 {
            Check::positive(s.bus_half_extents[i], "servicer.bus_half_extents")?;
        }
        Check::unit(&s.boresight, "servicer.boresight")?;
        Check::finite(s.arm_base.as_slice(), "servicer.arm_base")?;
        for link in &s.links {
            Check::finite(link.tip.as_slice(), "servicer.links.tip")?;
            Check::finite(link.center_of_mass.as_slice(), "servicer.links.center_of_mass")?;
            Check::non_negative(link.mass, "servicer.links.mass")?;
            Check::non_negative(link.armature, "servicer.links.armature")?;
            if link.mass > 0.0 {
                Check::inertia_tensor(&link.inertia, "servicer.links.inertia")?;
            } else {
                let reason = "must be zero for a link without mass";
                Check::that(link.inertia.amax() == 0.0, "servicer.links.inertia", reason)?;
                let reason = "must be positive for a link without mass";
                Check::that(link.armature > 0.0, "servicer.links.armature", reason)?;
            }
            Check::unit(&link.axis, "servicer.links.axis")?;
            Check::non_negative(link.radius, "servicer.links.radius")?;
        }
        for i in 0..NL {
            let (lower, upper) = (s.min_joint_angle[i], s.max_joint_angle[i]);
            Check::finite(&[lower, upper], "servicer.max_joint_angle")?;
            let reason = "the lower stop must be below the upper one";
            Check::that(lower < upper, "servicer.max_joint_angle", reason)?;
            let within = |angle: f64| is_within(angle, lower, upper);
            let reason = "must lie within the joint's stops";
            Check::that(within(s.initial_joint_angle[i]), "servicer.initial_joint_angle", reason)?;
            Check::that(within(s.capture_joint_angle[i]), "servicer.capture_joint_angle", reason)?;
            Check::positive(s.max_joint_rate[i], "servicer.max_joint_rate")?;
            Check::positive(s.max_joint_torque[i], "servicer.max_joint_torque")?;
        }
        for i in 0..3 {
            Check::positive(s.max_force[i], "servicer.max_force")?;
            Check::positive(s.max_bus_torque[i], "servicer.max_bus_torque")?;
        }
        let reach = s.capture_geometry().reach;
        Check::positive(reach, "servicer.capture_joint_angle")
    }

    fn validate_approach(&self) -> Result<(), InvalidField> {
        let a = &self.approach;
        Check::positive(a.duration, "approach.duration")?;
        Check::that(a.nodes >= MIN_NODES, "approach.nodes", "must be at least 4")?;
        Check::non_negative(a.keep_out_far, "approach.keep_out_far")?;
        Check::non_negative(a.keep_out_near, "approach.keep_out_near")?;
        Check::non_negative(a.keep_out_near_time, "approach.keep_out_near_time")?;
        Check::that(
            is_within(a.field_of_view_half_angle, ABOVE_ZERO, core::f64::consts::PI),
            "approach.field_of_view_half_angle",
            "must lie in (0, pi]",
        )?;
        Check::positive(a.preset_time, "approach.preset_time")?;
        Check::non_negative(a.recovery_time, "approach.recovery_time")
    }

    fn validate_margins(&self) -> Result<(), InvalidField> {
        use core::f64::consts::FRAC_PI_2;
        let (m, c, r) = (&self.margins, &self.corridor, &self.scenarios);
        Check::non_negative(m.joint_angle, "margins.joint_angle")?;
        let share = is_within(m.joint_rate, -0.0, BELOW_ONE);
        Check::that(share, "margins.joint_rate", "must lie in [0, 1)")?;
        Check::non_negative(m.keep_out, "margins.keep_out")?;
        let most = self.approach.field_of_view_half_angle.next_down();
        let seen = is_within(m.field_of_view, -0.0, most);
        Check::that(seen, "margins.field_of_view", "must lie in [0, field of view)")?;
        Check::non_negative(m.clearance, "margins.clearance")?;
        let open = is_within(c.half_angle, ABOVE_ZERO, FRAC_PI_2.next_down());
        Check::that(open, "corridor.half_angle", "must lie in (0, pi/2)")?;
        Check::positive(c.mouth_radius, "corridor.mouth_radius")?;
        Check::non_negative(c.end_effector_length, "corridor.end_effector_length")?;
        Check::positive(r.standoff, "scenarios.standoff")?;
        for i in 0..3 {
            Check::non_negative(r.offset[i], "scenarios.offset")?;
        }
        Check::non_negative(r.rate, "scenarios.rate")?;
        Check::non_negative(r.rate_norm.unwrap_or(0.0), "scenarios.rate_norm")?;
        Check::non_negative(r.velocity, "scenarios.velocity")?;
        self.validate_roll()?;
        let Some(t) = &self.typical_magnitudes else { return Ok(()) };
        Check::positive(t.length, "typical.length")?;
        Check::positive(t.velocity, "typical.velocity")?;
        Check::positive(t.force, "typical.force")?;
        Check::positive(t.angle, "typical.angle")?;
        Check::positive(t.rate, "typical.rate")?;
        Check::positive(t.joint_rate, "typical.joint_rate")?;
        Check::positive(t.bus_torque, "typical.bus_torque")?;
        Check::positive(t.joint_torque, "typical.joint_torque")
    }

    /// Refuses a roll about the approach that two directions along it would give.
    // Not inlined: before planning time does not count, and an image's room does.
    #[inline(never)]
    fn validate_roll(&self) -> Result<(), InvalidField> {
        let Some(roll) = &self.roll else { return Ok(()) };
        Check::unit(&roll.end_effector, "roll.end_effector")?;
        Check::unit(&roll.port, "roll.port")?;
        let reason = "must be across the approach: it is within 6 degrees of it";
        let along = self.servicer.capture_geometry().direction;
        let end_effector = self.servicer.in_bus_axes_at_capture(&roll.end_effector);
        let is_across = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(b).abs() < ALONG;
        Check::that(is_across(&end_effector, &along), "roll.end_effector", reason)?;
        Check::that(is_across(&roll.port, &self.target.port_normal), "roll.port", reason)
    }

    fn validate_weights_and_tolerances(&self) -> Result<(), InvalidField> {
        let w = &self.weights;
        Check::positive(w.force, "weights.force")?;
        Check::non_negative(w.force_change, "weights.force_change")?;
        Check::positive(w.bus_torque, "weights.bus_torque")?;
        Check::positive(w.joint_torque, "weights.joint_torque")?;
        let t = &self.tolerances;
        Check::positive(t.dynamics, "tolerances.dynamics")?;
        Check::positive(t.control, "tolerances.control")?;
        Check::positive(t.joint, "tolerances.joint")?;
        Check::positive(t.joint_rate, "tolerances.joint_rate")?;
        Check::positive(t.pointing, "tolerances.pointing")?;
        Check::positive(t.preset, "tolerances.preset")?;
        Check::positive(t.terminal_rate, "tolerances.terminal_rate")?;
        Check::positive(t.keep_out, "tolerances.keep_out")?;
        Check::positive(t.end_effector_position, "tolerances.end_effector_position")?;
        Check::positive(t.end_effector_angle, "tolerances.end_effector_angle")?;
        Check::positive(t.clearance, "tolerances.clearance")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion;

    #[test]
    fn the_default_is_valid() {
        Mission::default().validate().unwrap();
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |change: fn(&mut Mission<3>)| {
            let mut mission = Mission::default();
            change(&mut mission);
            mission.validate().unwrap_err().field
        };
        assert_eq!(field(|m| m.servicer.bus_mass = -1.0), "servicer.bus_mass");
        assert_eq!(field(|m| m.servicer.links[1].mass = f64::NAN), "servicer.links.mass");
        assert_eq!(field(|m| m.servicer.links[2].axis.y = 0.9), "servicer.links.axis");
        assert_eq!(field(|m| m.target.inertia.x = 50.0), "target.inertia");
        assert_eq!(field(|m| m.servicer.max_joint_angle[1] = 0.1), "servicer.initial_joint_angle");
        assert_eq!(field(|m| m.servicer.min_joint_angle[0] = 4.0), "servicer.max_joint_angle");
        assert_eq!(field(|m| m.servicer.max_joint_angle[2] = f64::NAN), "servicer.max_joint_angle");
        assert_eq!(field(|m| m.servicer.min_joint_angle[2] = 0.1), "servicer.initial_joint_angle");
        assert_eq!(field(|m| m.servicer.min_joint_angle[0] = -0.5), "servicer.capture_joint_angle");
        assert_eq!(field(|m| m.servicer.max_joint_rate[2] = 0.0), "servicer.max_joint_rate");
        assert_eq!(field(|m| m.servicer.max_force.z = -1.0), "servicer.max_force");
        assert_eq!(field(|m| m.servicer.max_bus_torque.y = f64::NAN), "servicer.max_bus_torque");
        assert_eq!(field(|m| m.servicer.links[1].armature = -1.0), "servicer.links.armature");
        assert_eq!(field(|m| m.approach.duration = 0.0), "approach.duration");
        assert_eq!(field(|m| m.approach.preset_time = 0.0), "approach.preset_time");
        assert_eq!(field(|m| m.orbit.eccentricity = 1.0), "orbit.eccentricity");
        assert_eq!(field(|m| m.weights.force = 0.0), "weights.force");
        assert_eq!(field(|m| m.tolerances.dynamics = 0.0), "tolerances.dynamics");
    }

    #[test]
    fn inertias_are_those_of_bodies_in_any_axes() {
        let judged = |inertia: Matrix3<f64>| {
            let mut mission = Mission::default();
            mission.servicer.bus_inertia = inertia;
            mission.validate().map_err(|error| (error.field, error.reason))
        };
        let refused = |inertia| judged(inertia).unwrap_err().1;
        let axes = quaternion::rotation_matrix(&quaternion::exp(&Vector3::new(0.4, -1.1, 0.7)));
        let turned = |moments: [f64; 3]| {
            let tensor = axes * Matrix3::from_diagonal(&moments.into()) * axes.transpose();
            (tensor + tensor.transpose()) * 0.5
        };
        // A plate's moments are one the sum of the others, in any axes.
        judged(turned([30.0, 40.0, 70.0])).unwrap();
        judged(Matrix3::from_diagonal(&Vector3::new(30.0, 40.0, 70.0))).unwrap();
        let no_body = "no body has such moments: each must be at most the sum of the other two";
        assert_eq!(refused(turned([30.0, 40.0, 70.1])), no_body);
        assert_eq!(refused(Matrix3::from_diagonal(&Vector3::new(30.0, 40.0, 70.1))), no_body);
        assert_eq!(refused(turned([40.0, 40.0, -1.0])), "must be positive definite");
        let mut skew = turned([30.0, 40.0, 50.0]);
        skew[(0, 1)] += 1e-3;
        assert_eq!(refused(skew), "must be symmetric");
        skew[(0, 1)] = f64::NAN;
        assert_eq!(refused(skew), "must be finite, up to 1e30");
        skew[(0, 0)] = f64::NAN;
        assert_eq!(refused(skew), "must be positive and finite, from 1e-30 to 1e30");
        assert_eq!(judged(skew).unwrap_err().0, "servicer.bus_inertia");
    }
}
