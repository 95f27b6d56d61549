//! Everything that is the same for every approach of a mission.

#[cfg(doc)]
use super::Grid;
use super::fields::{
    ABOVE_ZERO, BELOW_ONE, FieldVisitor, InvalidField, Judge, UNIT, optional, section,
};
#[cfg(feature = "serde")]
use super::forms;
use super::{MIN_NODES, Orbit, Servicer, Switch, Target, Typical};
use crate::math::nearly_unit;
use core::f64::consts::{FRAC_PI_2, PI};
use nalgebra::Vector3;
use remora_qp::dense::is_within;
use remora_qp::{Valid, Validate};

section! {
    /// The approach itself: how long, how far off, how well seen.
    Approach in "approach" {
        /// Nodes of a plan, from [`MIN_NODES`] to what a build has room for.
        nodes: usize = 60, Count;
        /// Whether bus and arm must stay clear of the target, and the arm of its own bus.
        clearance: Switch = Switch::Auto, Code(3);
        /// Whether limits hold between the nodes too, and planning keeps [`Margins`] from them.
        between_nodes: Switch = Switch::Auto, Code(3);
        /// Time from the first node to the last [s].
        duration_s: f64 = 1200.0, Positive;
        /// Keep-out distance of the system centre of mass from the target's box while far [m].
        keep_out_far_m: f64 = 1.85, NotNegative;
        /// Keep-out distance during the last part of the approach [m].
        keep_out_near_m: f64 = 1.46, NotNegative;
        /// Time before the end from which the near distance holds [s].
        keep_out_near_s: f64 = 360.0, NotNegative;
        /// Half angle of the cone about the boresight that must contain the docking port [rad].
        field_of_view_half_angle_rad: f64 = 20.0 * PI / 180.0, Within(ABOVE_ZERO, PI, "must lie in (0, pi]");
        /// Time before the end from which the arm is in its capture configuration, at the node before at
        /// the latest [s].
        preset_s: f64 = 80.0, Positive;
        /// Time within which a given [start](super::Start) is led back into limits that it violates [s].
        recovery_s: f64 = 80.0, NotNegative;
    }
}

section! {
    /// How far planning stays from what the verifier holds a plan to, where
    /// [`Approach::between_nodes`] is in force (`clearance_m`: where [`Approach::clearance`] is).
    #[cfg_attr(feature = "serde", serde(default))]
    Margins in "margins" {
        /// From the joint stops [rad].
        joint_angle_rad: f64 = 0.02, NotNegative;
        /// Share of the joint rate limit that is left unused.
        joint_rate: f64 = 0.1, Within(-0.0, BELOW_ONE, "must lie in [0, 1)");
        /// From the keep-out distances [m]; it fades as [`Grid::margin_share`] says.
        keep_out_m: f64 = 0.03, NotNegative;
        /// From the edge of the field of view [rad].
        #[cfg_attr(feature = "serde", serde(rename = "field_of_view_deg", with = "forms::degrees"))]
        field_of_view_rad: f64 = PI / 180.0, NotNegative;
        /// Between bodies [m]; it fades like that of keep-out.
        clearance_m: f64 = 0.03, NotNegative;
    }
}

section! {
    /// The end effector's way to the port: within a cone about the port's normal the end effector may
    /// come nearer to the target than anything else.
    #[cfg_attr(feature = "serde", serde(default))]
    Corridor in "corridor" {
        /// Half angle of the cone [rad].
        #[cfg_attr(feature = "serde", serde(rename = "half_angle_deg", with = "forms::degrees"))]
        half_angle_rad: f64 = 60.0 * PI / 180.0,
            Within(ABOVE_ZERO, FRAC_PI_2.next_down(), "must lie in (0, pi/2)");
        /// Radius of the cone at the port [m].
        mouth_radius_m: f64 = 0.1, Positive;
        /// Length of the last link's end that only the corridor concerns: the gripper [m].
        end_effector_length_m: f64 = 0.15, NotNegative;
    }
}

section! {
    /// Where scenarios are drawn from (section 8); planning has no use for it.
    #[cfg_attr(feature = "serde", serde(default))]
    ScenarioRanges in "scenarios" {
        /// Distance in front of the port about which starts are drawn [m].
        standoff_m: f64 = 5.0, Positive;
        /// Half widths of the offset from there, along the RTN axes [m].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        offset_m: Vector3<f64> = Vector3::new(1.0, 1.0, 2.0), NotNegative;
        /// Half width of each component of the target's rate [rad/s].
        rate_rad_s: f64 = 1e-3, NotNegative;
        /// Norm of the target's rate where that is given: its direction is then uniform [rad/s].
        #[cfg_attr(feature = "serde", serde(rename = "rate_norm_deg_s", with = "forms::degrees_if_given"))]
        #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
        rate_norm_rad_s: Option<f64> = None, NotNegative;
        /// Half width of each component of the servicer's velocity [m/s].
        velocity_m_s: f64 = 5e-3, NotNegative;
    }
}

section! {
    /// Weights of the cost, on what [`Mission::cost_units`] divides (sections 5 and 6).
    #[cfg_attr(feature = "serde", serde(default))]
    Weights in "weights" {
        /// `W1`: force.
        force: f64 = 1.0, Positive;
        /// `W2`: change of force from node to node.
        force_change: f64 = 0.03, NotNegative;
        /// `W3`, first block: bus torque.
        bus_torque: f64 = 0.5, Positive;
        /// `W3`, second block: joint torque.
        joint_torque: f64 = 1.0, Positive;
        /// Of joint rates over typical ones, a node: what moves less costs less. The paper has no such term.
        joint_motion: f64 = 0.0, NotNegative;
    }
}

section! {
    /// Tolerances of a solved plan (section 7), for the independent verifier's residuals.
    #[cfg_attr(feature = "serde", serde(default))]
    Tolerances in "tolerances" {
        /// Dynamics defects over their scales.
        dynamics: f64 = 1e-4, Positive;
        /// Control bounds, relative.
        control: f64 = 1e-6, Positive;
        /// Joint limits [rad].
        joint_rad: f64 = 1e-6, Positive;
        /// Joint rate limit, relative.
        joint_rate: f64 = 1e-6, Positive;
        /// Pointing, in cosine.
        pointing: f64 = 1e-4, Positive;
        /// Arm preset, scaled.
        preset: f64 = 1e-4, Positive;
        /// Terminal bus rate, scaled.
        terminal_rate: f64 = 1e-4, Positive;
        /// Keep-out distance [m].
        keep_out_m: f64 = 1e-4, Positive;
        /// End effector at the port [m].
        ee_position_m: f64 = 1e-3, Positive;
        /// Approach direction [rad].
        ee_angle_rad: f64 = 1e-3, Positive;
        /// Overlap of bodies [m].
        clearance_m: f64 = 1e-4, Positive;
    }
}

section! {
    /// Two directions that are one at capture, seen along the approach: they fix the end effector's roll
    /// about it. What of them lies along the approach does not count.
    Roll in "roll" {
        /// Unit vector in the last link's axes.
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        end_effector: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0), Unit;
        /// Unit vector in the target's axes, across the port's normal.
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        port: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0), Unit;
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
    /// Tolerances of a solved plan.
    pub tolerances: Tolerances,
    /// How far planning stays from its limits.
    pub margins: Margins,
    /// The end effector's way to the port.
    pub corridor: Corridor,
    /// Where scenarios are drawn from.
    pub scenarios: ScenarioRanges,
    /// Magnitudes that steps are divided by; `None` derives them from the rest, see [`Mission::typical`].
    pub typical_magnitudes: Option<Typical>,
    /// The roll of the end effector about the approach at capture; `None`: free.
    pub roll: Option<Roll>,
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
    /// This mission with another servicer, whose arm may have another number of joints. Keep-out
    /// distances follow from it: [`Servicer::extension`] while far, its reach at capture afterwards.
    ///
    /// Cost: that of the extension; not for flight.
    pub fn with_servicer<const M: usize>(&self, servicer: Servicer<M>) -> Mission<M> {
        let mut mission = self.with(servicer);
        mission.approach.keep_out_far_m = mission.servicer.extension();
        mission.approach.keep_out_near_m = mission.servicer.capture_geometry().reach;
        mission
    }

    /// This mission with another servicer, and nothing else changed.
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

    /// Visits the fields in their order: everything that a plan depends on.
    pub fn visit(&mut self, visitor: &mut impl FieldVisitor) {
        self.target.visit(None, visitor);
        self.orbit.visit(visitor);
        self.servicer.visit(visitor);
        let typical = &mut self.typical_magnitudes;
        optional(typical, "typical", Typical::default(), visitor, |part, v| part.visit(None, v));
        self.approach.visit(None, visitor);
        self.weights.visit(None, visitor);
        self.tolerances.visit(None, visitor);
        self.margins.visit(None, visitor);
        self.corridor.visit(None, visitor);
        optional(&mut self.roll, "roll", Roll::default(), visitor, |part, v| part.visit(None, v));
    }

    /// Refuses values that no mission can have: NaN, negative masses, axes that are not unit
    /// vectors, limits that exclude the arm's own start.
    ///
    /// # Errors
    /// The first field found wrong, with the reason.
    // Not inlined: before planning time does not count, and an image's room does.
    #[inline(never)]
    pub fn validate(&self) -> Result<(), InvalidField> {
        let (mut judge, mut mission) = (Judge::default(), *self);
        mission.visit(&mut judge);
        mission.scenarios.visit(None, &mut judge);
        judge.numbers(Orbit::BODY_RADIUS, &mut [self.orbit.body.radius_m]);
        judge.verdict()?;
        let mut judge = Judge::default();
        let enough = self.approach.nodes >= MIN_NODES;
        judge.that(enough, "approach.nodes", None, "must be at least 4");
        let most = self.approach.field_of_view_half_angle_rad.next_down();
        let seen = is_within(self.margins.field_of_view_rad, -0.0, most);
        let reason = "must lie in [0, field of view)";
        judge.that(seen, "margins.field_of_view_rad", None, reason);
        self.servicer.judge(&mut judge);
        self.judge_roll(&mut judge);
        judge.verdict()
    }

    /// Refuses a roll about the approach that two directions along it would give.
    #[inline(never)]
    fn judge_roll(&self, judge: &mut Judge) {
        let Some(roll) = &self.roll else { return };
        let reason = "must be across the approach: it is within 6 degrees of it";
        let along = self.servicer.capture_geometry().direction;
        let end_effector = self.servicer.in_bus_axes_at_capture(&roll.end_effector);
        let is_across = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(b).abs() < ALONG;
        judge.that(is_across(&end_effector, &along), "roll.end_effector", None, reason);
        judge.that(is_across(&roll.port, &self.target.port_normal), "roll.port", None, reason);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion;
    use nalgebra::Matrix3;

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
        assert_eq!(field(|m| m.servicer.bus_mass_kg = -1.0), "servicer.bus_mass_kg");
        assert_eq!(field(|m| m.servicer.links[1].mass_kg = f64::NAN), "servicer.links.mass_kg");
        assert_eq!(field(|m| m.servicer.links[2].axis.y = 0.9), "servicer.links.axis");
        assert_eq!(field(|m| m.target.inertia_kg_m2.x = 50.0), "target.inertia_kg_m2");
        assert_eq!(
            field(|m| m.servicer.max_joint_angle_rad[1] = 0.1),
            "servicer.initial_joint_angle_rad"
        );
        assert_eq!(
            field(|m| m.servicer.min_joint_angle_rad[0] = 4.0),
            "servicer.max_joint_angle_rad"
        );
        assert_eq!(
            field(|m| m.servicer.max_joint_angle_rad[2] = f64::NAN),
            "servicer.max_joint_angle_rad"
        );
        assert_eq!(
            field(|m| m.servicer.min_joint_angle_rad[2] = 0.1),
            "servicer.initial_joint_angle_rad"
        );
        assert_eq!(
            field(|m| m.servicer.min_joint_angle_rad[0] = -0.5),
            "servicer.capture_joint_angle_rad"
        );
        assert_eq!(
            field(|m| m.servicer.joint_rate_limit_rad_s[2] = 0.0),
            "servicer.joint_rate_limit_rad_s"
        );
        assert_eq!(field(|m| m.servicer.force_limit_n.z = -1.0), "servicer.force_limit_n");
        assert_eq!(
            field(|m| m.servicer.bus_torque_limit_n_m.y = f64::NAN),
            "servicer.bus_torque_limit_n_m"
        );
        assert_eq!(
            field(|m| m.servicer.links[1].armature_kg_m2 = -1.0),
            "servicer.links.armature_kg_m2"
        );
        assert_eq!(field(|m| m.approach.duration_s = 0.0), "approach.duration_s");
        assert_eq!(field(|m| m.approach.preset_s = 0.0), "approach.preset_s");
        assert_eq!(field(|m| m.orbit.eccentricity = 1.0), "orbit.eccentricity");
        assert_eq!(field(|m| m.weights.force = 0.0), "weights.force");
        assert_eq!(field(|m| m.tolerances.dynamics = 0.0), "tolerances.dynamics");
    }

    #[test]
    fn inertias_are_those_of_bodies_in_any_axes() {
        let judged = |inertia: Matrix3<f64>| {
            let mut mission = Mission::default();
            mission.servicer.bus_inertia_kg_m2 = inertia;
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
        assert_eq!(judged(skew).unwrap_err().0, "servicer.bus_inertia_kg_m2");
    }
}
