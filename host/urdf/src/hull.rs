//! Collision shapes: convex hulls of points, all of them with a ball about.

use crate::body::Body;
use crate::pose::Pose;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use urdf_rs::Geometry;

/// Corners of the polygon that stands for a cylinder's rim; it lies outside of it, by 0.12 %.
const RIM: usize = 64;

/// The convex hull of points, and all that is within a distance of it.
#[derive(Clone, Debug)]
pub struct Hull {
    points: Vec<Vector3<f64>>,
    margin: f64,
}

impl Hull {
    /// A shape at `pose`; meshes are not read.
    pub fn new(geometry: &Geometry, pose: &Pose) -> Option<Self> {
        let (points, margin) = match geometry {
            Geometry::Box { size } => (corners(size), 0.0),
            Geometry::Cylinder { radius, length } => (rims(*radius, *length), 0.0),
            Geometry::Capsule { radius, length } => {
                (vec![Vector3::z() * (0.5 * length), Vector3::z() * (-0.5 * length)], *radius)
            }
            Geometry::Sphere { radius } => (vec![Vector3::zeros()], *radius),
            Geometry::Mesh { .. } => return None,
        };
        Some(Self { points, margin }.seen_from(pose))
    }

    /// Expresses the shape in the frame in which its own has the pose `pose`.
    pub fn seen_from(&self, pose: &Pose) -> Self {
        let points = self.points.iter().map(|point| pose.point(point)).collect();
        Self { points, margin: self.margin }
    }

    /// A point.
    pub fn point(point: Vector3<f64>) -> Self {
        Self { points: vec![point], margin: 0.0 }
    }

    /// Radius of the least capsule about the line `from`, `to` that holds the shape [m]. The distance
    /// from a line is convex: a corner is farthest.
    pub fn capsule_radius(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
        let line = to - from;
        let square = line.dot(&line);
        let distance = |point: &Vector3<f64>| {
            let along = if square > 0.0 { (point - from).dot(&line) / square } else { 0.0 };
            (point - from - line * along.clamp(0.0, 1.0)).norm()
        };
        self.points.iter().map(distance).fold(0.0, f64::max) + self.margin
    }

    /// A point in the middle of the shapes, and the direction in which their points spread most.
    pub fn middle_line(hulls: &[Self]) -> (Vector3<f64>, Vector3<f64>) {
        let points = || hulls.iter().flat_map(|hull| &hull.points);
        let middle = points().sum::<Vector3<f64>>() / points().count().max(1) as f64;
        let square = |point: &Vector3<f64>| (point - middle) * (point - middle).transpose();
        let inertia = points().map(square).sum();
        let spread = Body { mass: 1.0, center_of_mass: middle, inertia };
        let (squares, axes) = spread.principal_axes();
        (middle, axes.column(squares.imax()).into_owned())
    }

    /// The capsule about the middle line that holds the shapes: of the least radius there, and then of the least
    /// length.
    pub fn fitted_capsule(hulls: &[Self]) -> Capsule {
        let (middle, along) = Self::middle_line(hulls);
        // Place along the line, distance from it, and margin of each point.
        let places = || {
            hulls.iter().flat_map(|hull| hull.points.iter().map(|point| (point, hull.margin))).map(
                |(point, margin)| {
                    let place = (point - middle).dot(&along);
                    (place, (point - middle - along * place).norm(), margin)
                },
            )
        };
        let radius = places().map(|(_, off, margin)| off + margin).fold(0.0, f64::max);
        // The segment may end this far before a point, whose ball the end's ball still holds.
        let before =
            |off: f64, margin: f64| ((radius - margin).powi(2) - off * off).max(0.0).sqrt();
        let ends = places().fold((f64::INFINITY, f64::NEG_INFINITY), |(start, end), place| {
            let (place, off, margin) = place;
            let before = before(off, margin);
            (start.min(place + before), end.max(place - before))
        });
        let (start, end) = match ends {
            (start, end) if start <= end => (start, end),
            // A ball.
            (start, end) if start.is_finite() => (0.5 * (start + end), 0.5 * (start + end)),
            _ => (0.0, 0.0),
        };
        Capsule { start: middle + along * start, end: middle + along * end, radius }
    }

    /// The box along the axes that holds the shape.
    pub fn bounds(&self) -> Bounds {
        let margin = Vector3::repeat(self.margin);
        let first = self.points.first().copied().unwrap_or_default();
        let bounds =
            self.points.iter().fold(Bounds { lower: first, upper: first }, |bounds, point| {
                Bounds { lower: bounds.lower.inf(point), upper: bounds.upper.sup(point) }
            });
        Bounds { lower: bounds.lower - margin, upper: bounds.upper + margin }
    }
}

/// All that is within a distance of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of the segment [m].
    pub start: Vector3<f64>,
    /// The other end [m].
    pub end: Vector3<f64>,
    /// The distance [m].
    pub radius: f64,
}

/// A box along the axes of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Corner with the least components [m].
    pub lower: Vector3<f64>,
    /// Corner with the largest components [m].
    pub upper: Vector3<f64>,
}

impl Bounds {
    /// The box that holds all the hulls, if there is one.
    pub(crate) fn of(hulls: &[Hull]) -> Option<Self> {
        let both =
            |a: Self, b: Self| Self { lower: a.lower.inf(&b.lower), upper: a.upper.sup(&b.upper) };
        hulls.iter().map(Hull::bounds).reduce(both)
    }
}

fn corners(size: &[f64; 3]) -> Vec<Vector3<f64>> {
    let half = Vector3::from(*size) * 0.5;
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
    let corner = |i: usize| Vector3::new(sign(i, 0), sign(i, 1), sign(i, 2)).component_mul(&half);
    (0..8).map(corner).collect()
}

/// Both rims of a cylinder along z.
fn rims(radius: f64, length: f64) -> Vec<Vector3<f64>> {
    let outer = radius / (PI / RIM as f64).cos();
    let corner = |i: usize, z: f64| {
        let angle = TAU * i as f64 / RIM as f64;
        Vector3::new(outer * angle.cos(), outer * angle.sin(), z)
    };
    let rim = |z: f64| (0..RIM).map(move |i| corner(i, z));
    rim(0.5 * length).chain(rim(-0.5 * length)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use urdf_rs::Vec3;

    #[test]
    fn capsules_hold_the_shapes() {
        let (from, to) = (Vector3::zeros(), Vector3::z());
        let at = |x: f64, z: f64| Pose::shift(Vector3::new(x, 0.0, z));
        let radius = |geometry: Geometry, pose: Pose| {
            Hull::new(&geometry, &pose).unwrap().capsule_radius(&from, &to)
        };
        let sphere = || Geometry::Sphere { radius: 0.1 };
        assert!((radius(sphere(), at(0.0, 0.5)) - 0.1).abs() < 1e-15);
        assert!((radius(sphere(), at(0.0, 1.5)) - 0.6).abs() < 1e-15);
        let size = Vec3([0.6, 0.8, 1.0]);
        assert!((radius(Geometry::Box { size }, at(0.0, 0.5)) - 0.5).abs() < 1e-15);
        let cylinder = radius(Geometry::Cylinder { radius: 0.1, length: 1.0 }, at(0.2, 0.5));
        assert!((0.3..0.3004).contains(&cylinder), "{cylinder}");
        let capsule = radius(Geometry::Capsule { radius: 0.1, length: 1.0 }, at(0.2, 0.5));
        assert!((capsule - 0.3).abs() < 1e-15);
    }

    #[test]
    fn a_tube_fits_a_capsule_of_its_own_radius_wherever_it_is() {
        let pose = Pose::from_xyz_rpy([0.3, -0.2, 0.7], [0.4, 1.0, -0.6]);
        let tube = Geometry::Cylinder { radius: 0.055, length: 0.6 };
        let hull = Hull::new(&tube, &pose).unwrap();
        let fitted = Hull::fitted_capsule(std::slice::from_ref(&hull));
        assert!((0.055..0.0552).contains(&fitted.radius), "{}", fitted.radius);
        let length = (fitted.end - fitted.start).norm();
        assert!((length - 0.6).abs() < 1e-6, "flat ends need the whole length: {length}");
        assert!(hull.capsule_radius(&fitted.start, &fitted.end) < fitted.radius + 1e-12);
        assert_eq!(Hull::fitted_capsule(&[]).radius, 0.0);
        let rod = Geometry::Capsule { radius: 0.05, length: 0.4 };
        let fitted = Hull::fitted_capsule(&[Hull::new(&rod, &pose).unwrap()]);
        let length = (fitted.end - fitted.start).norm();
        assert!((fitted.radius - 0.05).abs() < 1e-9 && (length - 0.4).abs() < 1e-6, "{fitted:?}");
    }
}
