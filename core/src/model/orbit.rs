//! The target's orbit and relative motion about it (Hill-Clohessy-Wiltshire).

use super::fields::{BELOW_ONE, Field, FieldVisitor, Range, Value};
use nalgebra::{SMatrix, Vector3};

/// The body that an orbit is about, beside its gravity. No plan depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Name in ASCII, filled up with zeros; zeros alone where it is not known.
    pub name: [u8; 16],
    /// Radius of its surface [m]; zero where it is not known.
    pub radius_m: f64,
}

impl Body {
    /// The Earth, with its equatorial radius (WGS84).
    pub const EARTH: Self = Self { name: *b"EARTH\0\0\0\0\0\0\0\0\0\0\0", radius_m: 6_378_137.0 };
    /// An unknown body.
    pub const UNKNOWN: Self = Self { name: [0; 16], radius_m: 0.0 };

    /// The Earth, if this is its gravitational parameter [m^3/s^2]; else an unknown body.
    pub fn with(gravitational_parameter: f64) -> Self {
        match (gravitational_parameter / EARTH_MU - 1.0).abs() < EARTH_MU_SPREAD {
            true => Self::EARTH,
            false => Self::UNKNOWN,
        }
    }
}

/// The Earth's gravitational parameter [m^3/s^2] (EGM2008).
const EARTH_MU: f64 = 3.986_004_418e14;
/// Share by which values of it in use differ at most, 3.986e14 included.
const EARTH_MU_SPREAD: f64 = 1e-5;

/// The target's orbit. The planner sees only its mean motion; the rest matters to a truth model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// The body's gravitational parameter [m^3/s^2].
    pub gravitational_parameter_m3_s2: f64,
    /// Semi-major axis [m].
    pub semi_major_axis_m: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination [rad].
    pub inclination_rad: f64,
    /// The body that it is about.
    pub body: Body,
}

impl Orbit {
    /// The radius of the body's surface, which no plan depends on.
    pub(super) const BODY_RADIUS: Field =
        Field { key: "orbit.body_radius_m", range: Range::NotNegative, link: None };

    /// Visits the fields that plans depend on, in their order.
    pub(super) fn visit(&mut self, visitor: &mut impl FieldVisitor) {
        let Self { gravitational_parameter_m3_s2, semi_major_axis_m, .. } = self;
        let mut number = |key, range, value: &mut f64| {
            value.visit(Field { key, range, link: None }, visitor);
        };
        let eccentricity = Range::Within(-0.0, BELOW_ONE, "must lie in [0, 1)");
        number(
            "orbit.gravitational_parameter_m3_s2",
            Range::Positive,
            gravitational_parameter_m3_s2,
        );
        number("orbit.semi_major_axis_m", Range::Positive, semi_major_axis_m);
        number("orbit.eccentricity", eccentricity, &mut self.eccentricity);
        number("orbit.inclination_rad", Range::Finite, &mut self.inclination_rad);
    }

    /// Mean motion `n = sqrt(mu / a^3)` [rad/s].
    pub fn mean_motion(&self) -> f64 {
        let a = self.semi_major_axis_m;
        libm::sqrt(self.gravitational_parameter_m3_s2 / (a * a * a))
    }
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            gravitational_parameter_m3_s2: EARTH_MU,
            semi_major_axis_m: 6.8e6,
            eccentricity: 1e-3,
            inclination_rad: 97.0 * core::f64::consts::PI / 180.0,
            body: Body::EARTH,
        }
    }
}

/// HCW acceleration [m/s^2] at `position` [m] with `velocity` [m/s], all in RTN relative to the
/// target: `(3 n^2 p_R + 2 n v_T, -2 n v_R, -n^2 p_N)`.
pub fn hcw_acceleration(n: f64, position: &Vector3<f64>, velocity: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        3.0 * n * n * position.x + 2.0 * n * velocity.y,
        -2.0 * n * velocity.x,
        -n * n * position.z,
    )
}

/// The exact solution of HCW over one interval with the specific force held constant in RTN:
/// `[r; v]+ = state [r; v] + input a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HcwTransition {
    /// State transition of `[r; v]` (SI).
    pub state: SMatrix<f64, 6, 6>,
    /// Response of `[r; v]` to a constant specific force [m/s^2] in RTN.
    pub input: SMatrix<f64, 6, 3>,
}

impl HcwTransition {
    /// The transition over `dt` [s] at mean motion `n` [rad/s].
    ///
    /// `1 - cos` and `nt - sin` are evaluated without cancellation, so that the input response
    /// keeps full relative precision at small `n dt`.
    pub fn new(n: f64, dt: f64) -> Self {
        let t = n * dt;
        let (s, c) = libm::sincos(t);
        let half = libm::sin(0.5 * t);
        let versine = 2.0 * half * half;
        let excess = t_minus_sin(t, s);
        let (n2, t2) = (n * n, t * t);

        #[rustfmt::skip]
        let state = SMatrix::<f64, 6, 6>::from_row_slice(&[
            4.0 - 3.0 * c,   0.0, 0.0, s / n,              2.0 * versine / n,           0.0,
            -6.0 * excess,   1.0, 0.0, -2.0 * versine / n, (4.0 * s - 3.0 * t) / n,     0.0,
            0.0,             0.0, c,   0.0,                0.0,                         s / n,
            3.0 * n * s,     0.0, 0.0, c,                  2.0 * s,                     0.0,
            -6.0 * n * versine, 0.0, 0.0, -2.0 * s,        4.0 * c - 3.0,               0.0,
            0.0,             0.0, -n * s, 0.0,             0.0,                         c,
        ]);
        // The input response is the integral of the state transition's last three columns.
        #[rustfmt::skip]
        let input = SMatrix::<f64, 6, 3>::from_row_slice(&[
            versine / n2,       2.0 * excess / n2,            0.0,
            -2.0 * excess / n2, (4.0 * versine - 1.5 * t2) / n2, 0.0,
            0.0,                0.0,                          versine / n2,
            s / n,              2.0 * versine / n,            0.0,
            -2.0 * versine / n, (4.0 * s - 3.0 * t) / n,      0.0,
            0.0,                0.0,                          s / n,
        ]);
        Self { state, input }
    }

    /// Position [m] and velocity [m/s] in RTN after the interval, at a constant specific force [m/s^2]: as by
    /// the matrices, without what is zero in them.
    pub fn carry(
        &self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        specific_force: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (s, b) = (&self.state, &self.input);
        let (r, v, a) = (position, velocity, specific_force);
        let pushed = |i: usize| b[(i, 0)] * a.x + b[(i, 1)] * a.y;
        let x = s[(0, 0)] * r.x + s[(0, 3)] * v.x + s[(0, 4)] * v.y + pushed(0);
        let y = s[(1, 0)] * r.x + s[(1, 1)] * r.y + s[(1, 3)] * v.x + s[(1, 4)] * v.y + pushed(1);
        let z = s[(2, 2)] * r.z + s[(2, 5)] * v.z + b[(2, 2)] * a.z;
        let vx = s[(3, 0)] * r.x + s[(3, 3)] * v.x + s[(3, 4)] * v.y + pushed(3);
        let vy = s[(4, 0)] * r.x + s[(4, 3)] * v.x + s[(4, 4)] * v.y + pushed(4);
        let vz = s[(5, 2)] * r.z + s[(5, 5)] * v.z + b[(5, 2)] * a.z;
        (Vector3::new(x, y, z), Vector3::new(vx, vy, vz))
    }
}

/// `t - sin t` to full relative precision; `sin` is the sine of `t`.
fn t_minus_sin(t: f64, sin: f64) -> f64 {
    if t.abs() > 0.5 {
        return t - sin;
    }
    // t^3/3! - t^5/5! + ...: the term after the last is below 1e-17 of the first for |t| <= 0.5.
    let t2 = t * t;
    let mut sum = 0.0;
    for denominator in [210.0, 156.0, 110.0, 72.0, 42.0, 20.0] {
        sum = (1.0 - sum) * t2 / denominator;
    }
    (1.0 - sum) * t2 * t / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use nalgebra::SVector;

    /// The transition against a fine RK4 integration of the same equations.
    #[test]
    fn transition_solves_hcw() {
        let n = Orbit::default().mean_motion();
        for dt in [1e-3, 1200.0 / 59.0, 700.0] {
            let transition = HcwTransition::new(n, dt);
            let accel = Vector3::new(3e-5, -2e-5, 1e-5);
            let start = SVector::<f64, 6>::from([4.0, -2.0, 1.5, 3e-3, -4e-3, 2e-3]);
            let rate = |x: &SVector<f64, 6>| {
                let (r, v) = (x.fixed_rows::<3>(0).into_owned(), x.fixed_rows::<3>(3).into_owned());
                let a = hcw_acceleration(n, &r, &v) + accel;
                SVector::<f64, 6>::from([v.x, v.y, v.z, a.x, a.y, a.z])
            };
            let mut x = start;
            let h = dt / 200.0;
            for _ in 0..200 {
                let k1 = rate(&x);
                let k2 = rate(&(x + k1 * (h / 2.0)));
                let k3 = rate(&(x + k2 * (h / 2.0)));
                let k4 = rate(&(x + k3 * h));
                x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
            }
            let exact = transition.state * start + transition.input * accel;
            assert!((exact - x).norm() < 1e-11 * x.norm(), "dt {dt}: {}", (exact - x).norm());
            let [r, v] = [0, 3].map(|i| start.fixed_rows::<3>(i).into_owned());
            let (r, v) = transition.carry(&r, &v, &accel);
            assert_eq!([r.as_slice(), v.as_slice()].concat(), exact.as_slice());
        }
    }

    #[test]
    fn transitions_compose() {
        let n = Orbit::default().mean_motion();
        let (once, twice) = (HcwTransition::new(n, 20.0), HcwTransition::new(n, 40.0));
        assert!((once.state * once.state - twice.state).norm() < 1e-12);
        let input = once.state * once.input + once.input;
        assert!((input - twice.input).norm() < 1e-12 * twice.input.norm());
    }

    #[test]
    fn t_minus_sin_meets_itself_at_the_seam() {
        for t in [0.49999999_f64, 0.3, 0.023] {
            let series = t_minus_sin(t, libm::sin(t));
            let direct = t - libm::sin(t);
            assert!((series - direct).abs() < 2e-16, "{t}");
        }
        assert_eq!(t_minus_sin(0.0, 0.0), 0.0);
    }
}
