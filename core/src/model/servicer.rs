//! The servicer: bus, arm and actuators as data.

use super::fields::{Field, FieldVisitor, Judge, Range, Value, judge_inertia, section};
#[cfg(feature = "serde")]
use super::forms;
use super::segment_to_box;
use crate::math::quaternion;
use nalgebra::{Matrix3, SVector, Vector3};
use remora_qp::dense::{clamp, divisor, is_positive, is_within};

section! {
    /// One link of the arm. Its frame sits at its own joint, which turns it relative to the body
    /// before it; at zero angle all frames are parallel to the bus body frame. By default it has neither
    /// length nor mass, and turns about +z.
    Link in "servicer.links" {
        /// Vector from this joint to the next one (for the last link, to the end effector), in link
        /// axes [m].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        tip_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0), Finite;
        /// Centre of mass in link axes, from the joint [m].
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        center_of_mass_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0), Finite;
        /// Mass [kg].
        mass_kg: f64 = 0.0, NotNegative;
        /// Inertia tensor about the centre of mass, link axes [kg m^2]; symmetric.
        #[cfg_attr(feature = "serde", serde(with = "forms::inertia"))]
        inertia_kg_m2: Matrix3<f64> = Matrix3::zeros(), Finite;
        /// Unit joint axis, in link axes.
        #[cfg_attr(feature = "serde", serde(with = "forms::vector"))]
        axis: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0), Unit;
        /// Inertia of the joint's rotor about the joint axis, times the gear ratio squared [kg m^2]: what it
        /// adds to the joint's own inertia.
        #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
        armature_kg_m2: f64 = 0.0, NotNegative;
        /// Radius of the capsule that holds the link [m]; it runs from joint to tip but for the next two.
        #[cfg_attr(feature = "serde", serde(default = "radius_of_thin_links"))]
        radius_m: f64 = 0.0, NotNegative;
        /// The capsule's near end from the joint, link axes [m].
        #[cfg_attr(feature = "serde", serde(default, with = "forms::vector"))]
        #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero_vector"))]
        capsule_start_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0), Finite;
        /// The capsule's far end from the tip, link axes [m].
        #[cfg_attr(feature = "serde", serde(default, with = "forms::vector"))]
        #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero_vector"))]
        capsule_end_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0), Finite;
    }
}

/// Whether a file may leave a number out.
#[cfg(feature = "serde")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Whether a file may leave a vector out.
#[cfg(feature = "serde")]
fn is_zero_vector(value: &Vector3<f64>) -> bool {
    value.amax() == 0.0
}

/// Radius of a link where a file gives none [m].
#[cfg(feature = "serde")]
fn radius_of_thin_links() -> f64 {
    0.05
}

impl Link {
    /// Whether it reaches from its joint to another point: one that does not has no body. Joints whose
    /// axes meet have such links between them.
    pub fn has_length(&self) -> bool {
        self.tip_m.amax() > 0.0
    }

    /// Ends of its capsule, where the link's joint and tip are `joint` and `tip`, and `turned` gives a vector in
    /// their axes.
    // Nothing is added to ends that are joint and tip: their bits stay.
    pub fn capsule(
        &self,
        joint: &Vector3<f64>,
        tip: &Vector3<f64>,
        turned: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    ) -> [Vector3<f64>; 2] {
        let shifted = |end: &Vector3<f64>, by: &Vector3<f64>| match by.amax() > 0.0 {
            true => end + turned(by),
            false => *end,
        };
        [shifted(joint, &self.capsule_start_m), shifted(tip, &self.capsule_end_m)]
    }

    /// A uniform cylinder along +z, turning about +y.
    pub fn cylinder(length: f64, mass: f64, radius: f64) -> Self {
        let across = mass * (3.0 * radius * radius + length * length) / 12.0;
        Self {
            tip_m: Vector3::new(0.0, 0.0, length),
            center_of_mass_m: Vector3::new(0.0, 0.0, 0.5 * length),
            mass_kg: mass,
            inertia_kg_m2: principal_inertia(across, across, 0.5 * mass * radius * radius),
            axis: Vector3::y(),
            radius_m: radius,
            ..Self::default()
        }
    }
}

/// Inertia tensor of a body whose principal axes are those it is resolved in, from its principal
/// moments [kg m^2].
pub fn principal_inertia(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(x, y, z))
}

/// Bounds of a body's principal moments of inertia, from the tensor in any axes (Gershgorin's): the
/// least and the largest moment themselves where the axes are principal ones [kg m^2].
// Not inlined: before planning time does not count, and an image's room does.
#[inline(never)]
pub(super) fn moment_bounds(inertia: &Matrix3<f64>) -> [f64; 2] {
    let (x, y, z) = (inertia[(0, 0)], inertia[(1, 1)], inertia[(2, 2)]);
    let (xy, xz, yz) = (inertia[(0, 1)].abs(), inertia[(0, 2)].abs(), inertia[(1, 2)].abs());
    let least = (x - (xy + xz)).min(y - (xy + yz)).min(z - (xz + yz));
    let largest = (x + (xy + xz)).max(y + (xy + yz)).max(z + (xz + yz));
    [least.max(0.0), largest]
}

/// The largest of an actuator's limits by axis, and each as a share of it.
// Not inlined, as `moment_bounds`.
#[inline(never)]
pub(super) fn largest_and_shares(limits: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let largest = limits.max();
    (largest, limits / largest)
}

/// A spacecraft bus with a serial arm of `NL` revolute joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servicer<const NL: usize> {
    /// Bus mass [kg].
    pub bus_mass_kg: f64,
    /// Bus inertia tensor about its centre of mass, body axes [kg m^2]; symmetric.
    pub bus_inertia_kg_m2: Matrix3<f64>,
    /// Half edge lengths of the box about the bus's centre of mass that holds it [m].
    pub bus_half_extents_m: Vector3<f64>,
    /// Unit boresight of the camera, bus axes.
    pub boresight: Vector3<f64>,
    /// First joint, from the bus centre of mass, bus axes [m].
    pub arm_base_m: Vector3<f64>,
    /// The arm, from the bus outwards.
    pub links: [Link; NL],
    /// Lower stops: least joint angles [rad].
    pub min_joint_angle_rad: SVector<f64, NL>,
    /// Upper stops: largest joint angles [rad].
    pub max_joint_angle_rad: SVector<f64, NL>,
    /// Joint rates are kept within plus and minus these [rad/s].
    pub joint_rate_limit_rad_s: SVector<f64, NL>,
    /// Joint angles at the start of the approach, at rest [rad].
    pub initial_joint_angle_rad: SVector<f64, NL>,
    /// Joint angles at capture [rad].
    pub capture_joint_angle_rad: SVector<f64, NL>,
    /// Largest force along each axis, RTN axes [N].
    pub force_limit_n: Vector3<f64>,
    /// Largest bus torque about each axis, body axes [N m].
    pub bus_torque_limit_n_m: Vector3<f64>,
    /// Largest joint torques [N m].
    pub joint_torque_limit_n_m: SVector<f64, NL>,
}

impl Default for Servicer<3> {
    /// The servicer of section 3.
    fn default() -> Self {
        use core::f64::consts::PI;
        Self {
            bus_mass_kg: 500.0,
            bus_inertia_kg_m2: principal_inertia(83.3, 83.3, 83.3),
            bus_half_extents_m: Vector3::new(0.5, 0.5, 0.5),
            boresight: Vector3::z(),
            arm_base_m: Vector3::new(0.0, 0.0, 0.116),
            links: [0.75, 0.75, 0.30].map(|length| Link::cylinder(length, 10.0, 0.05)),
            min_joint_angle_rad: SVector::from([-PI, -PI / 2.0, -1.75]),
            max_joint_angle_rad: SVector::from([PI, PI / 2.0, 1.75]),
            joint_rate_limit_rad_s: SVector::repeat(5e-3),
            initial_joint_angle_rad: SVector::from([-PI / 9.0, PI / 5.0, 0.0]),
            capture_joint_angle_rad: SVector::from([-0.752_793_7, 1.505_587_4, -0.752_793_7]),
            force_limit_n: Vector3::repeat(2.5),
            bus_torque_limit_n_m: Vector3::repeat(5e-3),
            joint_torque_limit_n_m: SVector::repeat(5e-3),
        }
    }
}

impl<const NL: usize> Servicer<NL> {
    /// Visits the fields in their order.
    pub(super) fn visit(&mut self, visitor: &mut impl FieldVisitor) {
        macro_rules! fields {
            ($($field:ident: $range:ident),*) => {$(
                let key = concat!("servicer.", stringify!($field));
                let field = Field { key, range: Range::$range, link: None };
                self.$field.visit(field, visitor);
            )*};
        }
        fields!(bus_mass_kg: Positive, bus_inertia_kg_m2: Inertia, bus_half_extents_m: Positive);
        fields!(boresight: Unit, arm_base_m: Finite);
        for (i, link) in self.links.iter_mut().enumerate() {
            link.visit(Some(i), visitor);
        }
        fields!(min_joint_angle_rad: Finite, max_joint_angle_rad: Finite);
        fields!(joint_rate_limit_rad_s: Positive, initial_joint_angle_rad: Finite);
        fields!(capture_joint_angle_rad: Finite, force_limit_n: Positive);
        fields!(bus_torque_limit_n_m: Positive, joint_torque_limit_n_m: Positive);
    }

    /// Judges what ranges of single fields cannot say: links with and without mass, stops, the reach.
    #[inline(never)]
    pub(super) fn judge(&self, judge: &mut Judge) {
        for (i, link) in self.links.iter().enumerate() {
            let (index, inertia) = (Some(i), "servicer.links.inertia_kg_m2");
            if link.mass_kg > 0.0 {
                let found = judge_inertia(&link.inertia_kg_m2);
                judge.that(found.is_ok(), inertia, index, found.err().unwrap_or_default());
                continue;
            }
            let reason = "must be zero for a link without mass";
            judge.that(link.inertia_kg_m2.amax() == 0.0, inertia, index, reason);
            let reason = "must be positive for a link without mass";
            let is_driven = link.armature_kg_m2 > 0.0;
            judge.that(is_driven, "servicer.links.armature_kg_m2", index, reason);
        }
        for i in 0..NL {
            let (index, lower, upper) =
                (Some(i), self.min_joint_angle_rad[i], self.max_joint_angle_rad[i]);
            let reason = "the lower stop must be below the upper one";
            judge.that(lower < upper, "servicer.max_joint_angle_rad", index, reason);
            let within = |angle: f64| is_within(angle, lower, upper);
            let reason = "must lie within the joint's stops";
            let is_within = within(self.initial_joint_angle_rad[i]);
            judge.that(is_within, "servicer.initial_joint_angle_rad", index, reason);
            let is_within = within(self.capture_joint_angle_rad[i]);
            judge.that(is_within, "servicer.capture_joint_angle_rad", index, reason);
        }
        let reason = "must leave the end effector away from the system's centre of mass";
        let reaches = is_positive(self.capture_geometry().reach);
        judge.that(reaches, "servicer.capture_joint_angle_rad", None, reason);
    }
}

/// Where the end effector is at capture, seen from the system's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureGeometry {
    /// Distance `d` from the system's centre of mass to the end effector [m].
    pub reach: f64,
    /// Unit vector `rhat_ee` from the centre of mass to the end effector, bus axes.
    pub direction: Vector3<f64>,
}

impl<const NL: usize> Servicer<NL> {
    /// Mass of bus and arm together [kg].
    pub fn total_mass(&self) -> f64 {
        self.bus_mass_kg + self.links.iter().map(|link| link.mass_kg).sum::<f64>()
    }

    /// System centre of mass and end effector for joint angles `angles`, both from the bus centre
    /// of mass in bus axes [m].
    pub fn center_of_mass_and_end_effector(
        &self,
        angles: &SVector<f64, NL>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let mut moment = Vector3::zeros();
        let mut joint = self.arm_base_m;
        let mut attitude = quaternion::IDENTITY;
        for (link, angle) in self.links.iter().zip(angles.iter()) {
            attitude = quaternion::product(&attitude, &quaternion::exp(&(link.axis * *angle)));
            let rotation = quaternion::rotation_matrix(&attitude);
            moment += (joint + rotation * link.center_of_mass_m) * link.mass_kg;
            joint += rotation * link.tip_m;
        }
        (moment / self.total_mass(), joint)
    }

    /// A vector in the last link's axes, in bus axes at capture.
    // Not inlined, as `moment_bounds`.
    #[inline(never)]
    pub fn in_bus_axes_at_capture(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let joints = self.links.iter().zip(self.capture_joint_angle_rad.iter());
        let attitude = joints.fold(quaternion::IDENTITY, |attitude, (link, angle)| {
            quaternion::product(&attitude, &quaternion::exp(&(link.axis * *angle)))
        });
        quaternion::rotation_matrix(&attitude) * vector
    }

    /// Inertia of bus and arm together about the system's centre of mass, bus axes [kg m^2].
    pub fn system_inertia(&self, angles: &SVector<f64, NL>) -> Matrix3<f64> {
        let (com, _) = self.center_of_mass_and_end_effector(angles);
        // A body's own inertia, and that of its mass at `at` from the system's centre of mass.
        let about = |own: Matrix3<f64>, mass: f64, at: Vector3<f64>| {
            own + (Matrix3::identity() * at.dot(&at) - at * at.transpose()) * mass
        };
        let mut sum = about(self.bus_inertia_kg_m2, self.bus_mass_kg, -com);
        let mut joint = self.arm_base_m;
        let mut attitude = quaternion::IDENTITY;
        for (link, angle) in self.links.iter().zip(angles.iter()) {
            attitude = quaternion::product(&attitude, &quaternion::exp(&(link.axis * *angle)));
            let rotation = quaternion::rotation_matrix(&attitude);
            let own = rotation * link.inertia_kg_m2 * rotation.transpose();
            sum += about(own, link.mass_kg, joint + rotation * link.center_of_mass_m - com);
            joint += rotation * link.tip_m;
        }
        sum
    }

    /// Moment of inertia of all that joint `i` carries, about it, the arm straight, and of its own rotor:
    /// a bound of the largest of any axis of each body [kg m^2].
    // Not inlined, as `moment_bounds`.
    #[inline(never)]
    pub fn inertia_beyond(&self, i: usize) -> f64 {
        let (mut joint, mut sum) = (Vector3::zeros(), 0.0);
        if let Some(link) = self.links.get(i) {
            sum += link.armature_kg_m2;
        }
        for link in self.links.iter().skip(i) {
            let center = joint + link.center_of_mass_m;
            let [_, largest] = moment_bounds(&link.inertia_kg_m2);
            sum += largest + link.mass_kg * center.dot(&center);
            joint += link.tip_m;
        }
        sum
    }

    /// The first and the last link that has a length; the first and the last of all where none has.
    pub(crate) fn ends_with_length(&self) -> [usize; 2] {
        let first = self.links.iter().position(Link::has_length).unwrap_or(0);
        let last = self.links.iter().rposition(Link::has_length);
        [first, last.unwrap_or(NL.saturating_sub(1))]
    }

    /// The least distance of the arm beyond its first link from its own bus at joint angles `angles`, its
    /// radius taken off, and the number of that link, from 1; infinite for an arm of one link [m].
    // Not inlined, as `moment_bounds`.
    #[inline(never)]
    pub(super) fn distance_from_own_bus(&self, angles: &SVector<f64, NL>) -> (usize, f64) {
        let [mounted, _] = self.ends_with_length();
        let (mut joint, mut attitude) = (self.arm_base_m, quaternion::IDENTITY);
        let (mut nearest, mut least) = (0, f64::INFINITY);
        for (i, (link, angle)) in self.links.iter().zip(angles.iter()).enumerate() {
            attitude = quaternion::product(&attitude, &quaternion::exp(&(link.axis * *angle)));
            let rotation = quaternion::rotation_matrix(&attitude);
            let tip = joint + rotation * link.tip_m;
            let [near, far] = link.capsule(&joint, &tip, |v| rotation * v);
            let distance =
                segment_to_box(&self.bus_half_extents_m, &near, &far).value - link.radius_m;
            if i > mounted && link.has_length() && distance < least {
                (nearest, least) = (i + 1, distance);
            }
            joint = tip;
        }
        (nearest, least)
    }

    /// How far joint `i` is beyond the nearer of its stops at `angle`; negative within them [rad].
    pub(super) fn beyond_stop(&self, i: usize, angle: f64) -> f64 {
        (angle - self.max_joint_angle_rad[i]).max(self.min_joint_angle_rad[i] - angle)
    }

    /// Farthest that the end effector gets from the system's centre of mass [m]: joint by joint
    /// over a grid of angles within the stops, from the straightest arm on, which is the least.
    ///
    /// Cost: a few hundred evaluations of the arm's geometry; not for flight.
    pub fn extension(&self) -> f64 {
        const STEPS: usize = 72;
        const ROUNDS: usize = 8;
        let distance = |angles: &SVector<f64, NL>| {
            let (com, tip) = self.center_of_mass_and_end_effector(angles);
            libm::sqrt((tip - com).dot(&(tip - com)))
        };
        let mut farthest = 0.0;
        let (lower, upper) = (&self.min_joint_angle_rad, &self.max_joint_angle_rad);
        let straight = SVector::from_fn(|i, _| clamp(0.0, lower[i], upper[i]));
        let (middle, half) = ((upper + lower) * 0.5, (upper - lower) * 0.5);
        for start in [straight, self.initial_joint_angle_rad, self.capture_joint_angle_rad] {
            let mut best = start;
            let mut reached = distance(&best);
            for _ in 0..ROUNDS {
                let before = reached;
                for i in 0..NL {
                    for step in 0..=STEPS {
                        let mut angles = best;
                        let share = 2.0 * step as f64 / STEPS as f64 - 1.0;
                        angles[i] = middle[i] + share * half[i];
                        let found = distance(&angles);
                        if found > reached {
                            (best, reached) = (angles, found);
                        }
                    }
                }
                if reached <= before {
                    break;
                }
            }
            if reached > farthest {
                farthest = reached;
            }
        }
        farthest
    }

    /// Reach and direction of the end effector at capture.
    pub fn capture_geometry(&self) -> CaptureGeometry {
        let (com, tip) = self.center_of_mass_and_end_effector(&self.capture_joint_angle_rad);
        let arm = tip - com;
        let reach = libm::sqrt(arm.dot(&arm));
        CaptureGeometry { reach, direction: arm / divisor(reach) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two keep-out radii the paper publishes follow from the arm's mounting and alpha_f.
    #[test]
    fn geometry_gives_the_published_radii() {
        let servicer = Servicer::default();
        assert!((servicer.capture_geometry().reach - 1.46).abs() < 5e-5);
        let (com, tip) = servicer.center_of_mass_and_end_effector(&SVector::zeros());
        assert!(((tip - com).norm() - 1.85).abs() < 5e-3);
        assert_eq!(servicer.total_mass(), 530.0);
        assert!((servicer.extension() - (tip - com).norm()).abs() < 1e-9);
    }

    #[test]
    fn an_arm_that_is_bent_at_zero_extends_farther_than_that() {
        let mut servicer = Servicer::default();
        servicer.links[1].tip_m = Vector3::new(0.75, 0.0, 0.0);
        let (com, tip) = servicer.center_of_mass_and_end_effector(&SVector::zeros());
        let straight = Servicer::default().extension();
        assert!(servicer.extension() > (tip - com).norm() + 0.1);
        assert!(servicer.extension() < straight + 0.1);
    }

    #[test]
    fn an_arm_whose_stops_hold_no_zero_extends_within_them() {
        let mut servicer = Servicer::default();
        servicer.min_joint_angle_rad[1] = 0.5;
        let bent = SVector::from([0.0, 0.5, 0.0]);
        let (com, tip) = servicer.center_of_mass_and_end_effector(&bent);
        let (extension, straight) = (servicer.extension(), Servicer::default().extension());
        assert!(extension >= (tip - com).norm() && extension < straight - 0.01, "{extension}");
    }

    #[test]
    fn bounds_of_moments_hold_in_any_axes() {
        let axes = quaternion::rotation_matrix(&quaternion::exp(&Vector3::new(0.9, 0.3, -0.5)));
        let principal = principal_inertia(2.0, 3.0, 4.0);
        assert_eq!(moment_bounds(&principal), [2.0, 4.0]);
        let [least, largest] = moment_bounds(&(axes * principal * axes.transpose()));
        assert!((0.0..2.0).contains(&least) && largest > 4.0, "{least} {largest}");
    }

    #[test]
    fn a_joint_carries_what_comes_after_it() {
        let servicer = Servicer::default();
        let own = |i: usize| servicer.links[i].inertia_kg_m2[(0, 0)];
        let last = own(2) + 10.0 * 0.15 * 0.15;
        assert!((servicer.inertia_beyond(2) - last).abs() < 1e-12);
        let two = own(1) + own(2) + 10.0 * (0.375_f64.powi(2) + 0.9 * 0.9);
        assert!((servicer.inertia_beyond(1) - two).abs() < 1e-12);
        let mut geared = servicer;
        geared.links[1].armature_kg_m2 = 0.7;
        assert!((geared.inertia_beyond(1) - two - 0.7).abs() < 1e-12);
        assert_eq!(geared.inertia_beyond(0), servicer.inertia_beyond(0));
    }

    #[test]
    fn the_systems_inertia_is_that_of_its_bodies() {
        let servicer = Servicer::default();
        let (com, _) = servicer.center_of_mass_and_end_effector(&SVector::zeros());
        let inertia = servicer.system_inertia(&SVector::zeros());
        // The straight arm along z: centres of mass at 0.491, 1.241 and 1.766 m.
        let across = 500.0 * com.z * com.z
            + [0.491, 1.241, 1.766].map(|z: f64| 10.0 * (z - com.z).powi(2)).iter().sum::<f64>();
        let own = 83.3 + servicer.links.iter().map(|link| link.inertia_kg_m2[(0, 0)]).sum::<f64>();
        assert!((inertia[(0, 0)] - across - own).abs() < 1e-9, "{inertia}");
        assert!((inertia[(2, 2)] - 83.3 - 0.0375).abs() < 1e-9, "{inertia}");
    }
}
