//! Kinematics cache: the arm's geometry and mass moments at one set of joint angles.

use super::{Multibody, State};
use crate::math::{Mat3, Scalar, Vec3};
use nalgebra::Matrix3;

/// One link and its subtree, bus axes.
#[derive(Clone, Copy)]
pub(super) struct LinkKinematics {
    /// Joint axis.
    pub axis: Vec3<f64>,
    /// From the joint before (the bus centre of mass for the first link) to this joint [m].
    pub lever: Vec3<f64>,
    /// From the joint to the link's centre of mass [m].
    pub offset: Vec3<f64>,
    /// Mass of the link [kg].
    pub mass: f64,
    /// Second mass moment of the link, the integral of `s s^T`, about its centre [kg m^2].
    pub second_moment: Mat3<f64>,
    /// Mass moments of this link and all after it, about the joint.
    pub subtree: MassMoments,
    /// Linear momentum of the subtree for unit joint rate [kg m].
    pub momentum: Vec3<f64>,
}

/// Mass moments about some point, bus axes.
#[derive(Clone, Copy)]
pub(super) struct MassMoments {
    /// Mass [kg].
    pub mass: f64,
    /// First moment [kg m].
    pub first: Vec3<f64>,
    /// Second moment, the integral of `s s^T` [kg m^2].
    pub second: Mat3<f64>,
}

/// The arm's kinematics at one set of joint angles.
#[derive(Clone, Copy)]
pub(super) struct Kinematics<const NL: usize> {
    pub links: [LinkKinematics; NL],
    /// The whole arm about the bus centre of mass.
    pub whole: MassMoments,
}

impl MassMoments {
    const ZERO: Self = Self { mass: 0.0, first: Vec3::ZERO, second: Mat3([Vec3::ZERO; 3]) };

    /// Adds a body whose centre is at `center`, by its moments about that.
    #[inline]
    fn add(&mut self, mass: f64, second: &Mat3<f64>, center: Vec3<f64>) {
        let first = center.scaled(mass);
        self.mass += mass;
        self.first += first;
        self.second += *second + Mat3::outer(center, first);
    }

    /// The moments about a point at `-lever`.
    #[inline]
    fn moved(&self, lever: Vec3<f64>) -> Self {
        let first = self.first + lever.scaled(self.mass);
        let second = self.second + Mat3::outer(lever, first) + Mat3::outer(self.first, lever);
        Self { mass: self.mass, first, second }
    }

    /// Moment of inertia applied to a vector: `(tr S) v - S v`.
    #[inline]
    pub(super) fn inertia(&self, v: Vec3<f64>) -> Vec3<f64> {
        let Mat3([x, y, z]) = self.second;
        v.scaled(x.0[0] + y.0[1] + z.0[2]) - self.second.apply(v)
    }
}

/// Second mass moment of a body, the integral of `s s^T`, from its inertia tensor.
#[inline]
pub(super) fn second_moment(inertia: &Matrix3<f64>) -> Mat3<f64> {
    let half_trace = 0.5 * (inertia[(0, 0)] + inertia[(1, 1)] + inertia[(2, 2)]);
    let (xy, xz, yz) = (0.0 - inertia[(1, 0)], 0.0 - inertia[(2, 0)], 0.0 - inertia[(2, 1)]);
    Mat3([
        Vec3([half_trace - inertia[(0, 0)], xy, xz]),
        Vec3([xy, half_trace - inertia[(1, 1)], yz]),
        Vec3([xz, yz, half_trace - inertia[(2, 2)]]),
    ])
}

/// `R S R^T`.
#[inline]
fn turned(rotation: &Mat3<f64>, second: &Mat3<f64>) -> Mat3<f64> {
    let (Mat3([x, y, z]), Mat3([mx, my, mz])) = (*rotation, rotation.product(second));
    Mat3::outer(mx, x) + Mat3::outer(my, y) + Mat3::outer(mz, z)
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Computes the arm's kinematics in `state`. Cost: about 250 flops a link and a sine and cosine.
    // Once in an image, with memory of its own that is free again when it returns.
    #[inline(never)]
    pub(super) fn kinematics(&self, state: &State<NL>) -> Kinematics<NL> {
        // Sines first: what they need on the stack, for angles of many turns, does not come on top.
        self.kinematics_of(&Self::angles(&state.joint_angle).map(Scalar::sin_cos))
    }

    /// Computes the kinematics from sines and cosines of the joint angles.
    #[inline(never)]
    fn kinematics_of(&self, turns: &[(f64, f64); NL]) -> Kinematics<NL> {
        let poses = self.link_poses_of(turns);
        let mut kinematics = Kinematics::ZERO;
        let mut subtree = MassMoments::ZERO;
        for i in (0..NL).rev() {
            let (link, pose) = (&self.servicer.links[i], &poses[i]);
            let before = if i == 0 { Vec3::ZERO } else { poses[i - 1].joint };
            let lever = pose.joint - before;
            let offset = pose.center - pose.joint;
            let second_moment = turned(&pose.rotation, &second_moment(&link.inertia_kg_m2));
            subtree.add(link.mass_kg, &second_moment, offset);
            kinematics.links[i] = LinkKinematics {
                axis: pose.axis,
                lever,
                offset,
                mass: link.mass_kg,
                second_moment,
                subtree,
                momentum: pose.axis.cross(subtree.first),
            };
            subtree = subtree.moved(lever);
        }
        kinematics.whole = subtree;
        kinematics
    }
}

impl<const NL: usize> Kinematics<NL> {
    const ZERO: Self = Self { links: [LinkKinematics::ZERO; NL], whole: MassMoments::ZERO };
}

impl LinkKinematics {
    const ZERO: Self = Self {
        axis: Vec3::ZERO,
        lever: Vec3::ZERO,
        offset: Vec3::ZERO,
        mass: 0.0,
        second_moment: Mat3([Vec3::ZERO; 3]),
        subtree: MassMoments::ZERO,
        momentum: Vec3::ZERO,
    };
}
