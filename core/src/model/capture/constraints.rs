//! Constraints at capture, as distances beyond limits with exact gradients.

use super::pose::Pose;
use super::{CaptureSearch, CaptureViolation};
use crate::model::{Link, Servicer, segment_to_box};
use nalgebra::{SMatrix, SVector, Vector3};
use remora_qp::dense::divisor;

/// How far within its limits the search goes, so that rounding leaves it there [rad or m].
const WITHIN: f64 = 1e-9;

/// Names of the inequalities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Limit {
    View,
    Bus,
    Port,
}

/// Receiver of the inequalities, one after the other.
pub(super) trait Take<const NL: usize> {
    /// An angle or distance beyond its limit [rad or m]; its gradient by the joint angles where
    /// wanted.
    fn take(&mut self, limit: Limit, beyond: f64, gradient: impl Fn(usize) -> f64);
}

/// Everything that joint angles at capture have to satisfy.
pub(super) struct Constraints<'a, const NL: usize> {
    pub servicer: &'a Servicer<NL>,
    pub search: &'a CaptureSearch,
    /// First and last link of any length; past the arm where there is none.
    first: usize,
    last: usize,
}

/// Angle between unit vectors, exact where it is small [rad].
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let across = a.cross(b);
    libm::atan2(libm::sqrt(across.dot(&across)), a.dot(b))
}

impl<'a, const NL: usize> Constraints<'a, NL> {
    pub fn new(servicer: &'a Servicer<NL>, search: &'a CaptureSearch) -> Self {
        let has_length = |i: &usize| servicer.links.get(*i).is_some_and(Link::has_length);
        let first = (0..NL).find(has_length).unwrap_or(NL);
        let last = (0..NL).rev().find(has_length).unwrap_or(NL);
        Self { servicer, search, first, last }
    }

    /// Least and largest angle of joint `i`, off its stops by the margin [rad].
    pub fn stops(&self, i: usize) -> (f64, f64) {
        let margin = self.search.stop_margin;
        (
            self.servicer.min_joint_angle_rad[i] + margin,
            self.servicer.max_joint_angle_rad[i] - margin,
        )
    }

    pub fn pose(&self, angles: &SVector<f64, NL>) -> Pose<NL> {
        Pose::new(self.servicer, &self.search.axis, angles)
    }

    /// Violation of each constraint by `angles` [rad].
    pub fn violation(&self, angles: &SVector<f64, NL>) -> CaptureViolation {
        let pose = self.pose(angles);
        let none = f64::NEG_INFINITY;
        let axis = angle(&pose.tool.value, &pose.direction.value);
        let mut out = CaptureViolation { axis, view: none, stop: none, bus: none, port: none };
        for i in 0..NL {
            let (least, largest) = self.stops(i);
            keep_larger(&mut out.stop, least - angles[i]);
            keep_larger(&mut out.stop, angles[i] - largest);
        }
        self.inequalities(&pose, &mut out);
        out
    }

    /// The least-squares problem at `angles` [rad]: axis and direction, and what is violated.
    pub fn squares(&self, angles: &SVector<f64, NL>) -> Squares<NL> {
        let pose = self.pose(angles);
        let mut out = Squares::EMPTY;
        let apart = pose.tool.value - pose.direction.value;
        for axis in 0..3 {
            let row = |j: usize| pose.tool.by_joint[j][axis] - pose.direction.by_joint[j][axis];
            out.add(apart[axis], row);
        }
        self.inequalities(&pose, &mut out);
        out
    }

    /// All but the stops, which a search keeps of itself.
    pub fn inequalities(&self, pose: &Pose<NL>, to: &mut impl Take<NL>) {
        self.view(pose, to);
        self.own_bus(pose, to);
        self.behind_the_port(pose, to);
    }

    /// The direction within a cone about the boresight.
    fn view(&self, pose: &Pose<NL>, to: &mut impl Take<NL>) {
        let (boresight, direction) = (&self.servicer.boresight, &pose.direction);
        let across = boresight.cross(&direction.value);
        let sine = libm::sqrt(across.dot(&across));
        let beyond = angle(boresight, &direction.value) - self.search.max_off_boresight;
        to.take(Limit::View, beyond, |j| {
            // On the boresight, or opposite to it, the angle has no gradient.
            if sine > 0.0 { -boresight.dot(&direction.by_joint[j]) / divisor(sine) } else { 0.0 }
        });
    }

    /// The arm, but for its first link, which is mounted there, off its own bus.
    fn own_bus(&self, pose: &Pose<NL>, to: &mut impl Take<NL>) {
        let half = &self.servicer.bus_half_extents_m;
        for (i, link) in self.servicer.links.iter().enumerate() {
            if i <= self.first || !link.has_length() {
                continue;
            }
            let [start, end] = &pose.capsule[i];
            let near = segment_to_box(half, start, end);
            let beyond = link.radius_m + self.search.clearance - near.value;
            let gradient = |j| -near.gradient.dot(&pose.point_by_joint(i, &near.point, j));
            to.take(Limit::Bus, beyond, gradient);
        }
    }

    /// Bus and links, all but the last, behind the plane through the end effector and across the
    /// direction. Links after the last of any length are part of the end effector.
    fn behind_the_port(&self, pose: &Pose<NL>, to: &mut impl Take<NL>) {
        let (half, clearance) = (&self.servicer.bus_half_extents_m, self.search.clearance);
        let (direction, tip) = (&pose.direction, &pose.tip);
        // The corner of the box that is farthest along the direction.
        let corner =
            half.zip_map(&direction.value, |half, along| if along < 0.0 { -half } else { half });
        let beyond = (corner - tip.value).dot(&direction.value) + clearance;
        to.take(Limit::Port, beyond, |j| {
            (corner - tip.value).dot(&direction.by_joint[j]) - direction.value.dot(&tip.by_joint[j])
        });
        for (i, link) in self.servicer.links.iter().enumerate().take(self.last) {
            for end in pose.capsule[i] {
                let from_tip = end - tip.value;
                let beyond = from_tip.dot(&direction.value) + link.radius_m + clearance;
                to.take(Limit::Port, beyond, |j| {
                    let moved = pose.point_by_joint(i, &end, j) - tip.by_joint[j];
                    direction.value.dot(&moved) + from_tip.dot(&direction.by_joint[j])
                });
            }
        }
    }
}

/// A number that is not one must not be lost.
fn keep_larger(kept: &mut f64, other: f64) {
    if !(other <= *kept) {
        *kept = other;
    }
}

impl<const NL: usize> Take<NL> for CaptureViolation {
    fn take(&mut self, limit: Limit, beyond: f64, _: impl Fn(usize) -> f64) {
        let kept = match limit {
            Limit::View => &mut self.view,
            Limit::Bus => &mut self.bus,
            Limit::Port => &mut self.port,
        };
        keep_larger(kept, beyond);
    }
}

/// Half a sum of squares near one set of joint angles.
#[derive(Clone, Copy)]
pub(super) struct Squares<const NL: usize> {
    /// The sum of squares, twice the cost.
    pub sum: f64,
    /// The cost's gradient.
    pub gradient: SVector<f64, NL>,
    /// Gauss and Newton's part of its curvature.
    pub curvature: SMatrix<f64, NL, NL>,
}

impl<const NL: usize> Squares<NL> {
    const EMPTY: Self = Self {
        sum: 0.0,
        gradient: remora_qp::dense::zeros(),
        curvature: remora_qp::dense::zeros(),
    };

    fn add(&mut self, residual: f64, gradient: impl Fn(usize) -> f64) {
        let row = SVector::<f64, NL>::from_fn(|j, _| gradient(j));
        self.sum += residual * residual;
        self.gradient += row * residual;
        self.curvature += row * row.transpose();
    }
}

impl<const NL: usize> Take<NL> for Squares<NL> {
    fn take(&mut self, _: Limit, beyond: f64, gradient: impl Fn(usize) -> f64) {
        // NaN goes in and fails the start.
        if !(beyond + WITHIN <= 0.0) {
            self.add(beyond + WITHIN, gradient);
        }
    }
}
