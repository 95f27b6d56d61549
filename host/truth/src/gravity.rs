//! Gravity: two bodies, the body's oblateness, differences over metres, gravity gradient.

use crate::rotation::length;
use nalgebra::{Matrix3, Vector3};

/// The Earth's gravitational parameter [m^3/s^2] (EGM2008).
pub const EARTH_MU: f64 = 3.986_004_418e14;

/// Environment that acts on both spacecraft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Gravitational parameter of the body that the orbit is about [m^3/s^2].
    pub mu: f64,
    /// Whether the body attracts. Otherwise both spacecraft begin on the orbit and fly straight.
    pub has_gravity: bool,
    /// Oblateness; none: a sphere.
    pub oblateness: Option<Oblateness>,
    /// Whether the gravity gradient turns the target. It always turns the servicer's bodies.
    pub target_gravity_gradient: bool,
    /// Whether the reaction wheels' momentum turns with the bus, `-w x h`. Off, the bus torque is an
    /// external one, as in the planner.
    pub wheel_momentum: bool,
}

/// The second zonal harmonic; z of the inertial axes is the pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oblateness {
    /// J2.
    pub j2: f64,
    /// Equatorial radius [m].
    pub radius: f64,
}

impl Oblateness {
    /// The Earth's (EGM2008, WGS84).
    pub const EARTH: Self = Self { j2: 1.082_626_68e-3, radius: 6_378_137.0 };
}

impl Environment {
    /// The Earth as a sphere, with gravity gradient on the target.
    pub const EARTH: Self = Self {
        mu: EARTH_MU,
        has_gravity: true,
        oblateness: None,
        target_gravity_gradient: true,
        wheel_momentum: false,
    };

    /// No gravity.
    pub const FREE: Self =
        Self { has_gravity: false, target_gravity_gradient: false, ..Self::EARTH };

    /// The gravity about a body with this gravitational parameter [m^3/s^2].
    #[must_use]
    pub fn about(self, mu: f64) -> Self {
        Self { mu, ..self }
    }

    /// Acceleration [m/s^2] at a place [m] from the body's centre, inertial axes.
    pub fn acceleration(&self, r: &Vector3<f64>) -> Vector3<f64> {
        if !self.has_gravity {
            return Vector3::zeros();
        }
        let distance = length(r);
        let central = r * (-self.mu / (distance * distance * distance));
        central + self.oblate(r)
    }

    /// Potential energy of a unit mass [J/kg].
    pub fn potential(&self, r: &Vector3<f64>) -> f64 {
        if !self.has_gravity {
            return 0.0;
        }
        let distance = length(r);
        let oblate = self.oblateness.map_or(0.0, |o| {
            let (ratio, sine) = (o.radius / distance, r.z / distance);
            0.5 * o.j2 * ratio * ratio * (3.0 * sine * sine - 1.0)
        });
        -self.mu / distance * (1.0 - oblate)
    }

    /// Acceleration by J2 (Vallado, *Fundamentals of Astrodynamics*, section 8.7).
    fn oblate(&self, r: &Vector3<f64>) -> Vector3<f64> {
        let Some(o) = self.oblateness else { return Vector3::zeros() };
        let r2 = r.dot(r);
        let r5 = r2 * r2 * libm::sqrt(r2);
        let factor = -1.5 * o.j2 * self.mu * o.radius * o.radius / r5;
        let z2 = 5.0 * r.z * r.z / r2;
        Vector3::new(r.x * (1.0 - z2), r.y * (1.0 - z2), r.z * (3.0 - z2)) * factor
    }

    /// The field about a place [m] from the body's centre.
    #[inline]
    pub fn around(&self, center: &Vector3<f64>) -> Field {
        if !self.has_gravity {
            return Field { environment: *self, center: *center, per_r2: 0.0, mu_per_r3: 0.0 };
        }
        let r2 = center.dot(center);
        Field {
            environment: *self,
            center: *center,
            per_r2: 1.0 / r2,
            mu_per_r3: self.mu / (r2 * libm::sqrt(r2)),
        }
    }
}

/// Gravity in the neighbourhood of one place: how it differs from the gravity there.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    environment: Environment,
    center: Vector3<f64>,
    per_r2: f64,
    mu_per_r3: f64,
}

impl Field {
    /// Gravity at `offset` [m] from the center, less that at the center [m/s^2].
    ///
    /// No digits are lost by the difference of nearly equal vectors: with
    /// `q = offset . (offset + 2 center) / r^2` and `c = (1 + q)^(3/2)`, the factor `1 - 1/c` is
    /// `q (3 + 3 q + q^2) / (c (1 + c))` (Encke's, as in Battin, *An Introduction to the Mathematics
    /// and Methods of Astrodynamics*, section 8.5). J2's part, a thousandth, is subtracted as it is.
    #[inline]
    pub fn difference(&self, offset: &Vector3<f64>) -> Vector3<f64> {
        if self.mu_per_r3 == 0.0 {
            return Vector3::zeros();
        }
        let q = offset.dot(&(offset + self.center * 2.0)) * self.per_r2;
        let c = (1.0 + q) * libm::sqrt(1.0 + q);
        let lost = q * (3.0 + q * (3.0 + q)) / (c * (1.0 + c));
        let central = (offset * (1.0 - lost) - self.center * lost) * -self.mu_per_r3;
        if self.environment.oblateness.is_none() {
            return central;
        }
        let there = self.environment.oblate(&(self.center + offset));
        central + (there - self.environment.oblate(&self.center))
    }

    /// Moment [N m] of the gravity gradient on a body with this inertia [kg m^2] about its centre of
    /// mass, in the same axes as the center: `3 mu / r^5 r x I r`.
    #[inline]
    pub fn gradient_moment(&self, inertia: &Matrix3<f64>) -> Vector3<f64> {
        let r = &self.center;
        r.cross(&(inertia * r)) * (3.0 * self.mu_per_r3 * self.per_r2)
    }
}
