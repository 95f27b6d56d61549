//! The target's orbit, the chief's: `*.chief.toml`.
//!
//! A plan knows of its orbit the mean motion and nothing else. What turns its RTN axes into inertial ones is
//! given here: the state at the plan's first node, by elements or as vectors. From there on the chief flies
//! about a sphere.

use crate::motion::Motion;
use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::model;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Kind, Limit, as_text, toml_text};
use remora_truth::rotation::about;
use remora_truth::{Orbit, Rtn, eccentricity};
use serde::Deserialize;
use std::path::Path;

/// The format of these files.
pub const FORMAT: &str = "remora-chief/1";

/// Largest share by which the chief's semi-major axis may be another than the mission's: an osculating one
/// swings by less about the mean.
const SAME_ORBIT: f64 = 0.01;

/// A file as it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a chief")]
pub struct ChiefFile {
    /// [`FORMAT`], or left out.
    pub format: Option<String>,
    /// Name of the inertial axes that the numbers are in.
    pub frame: Option<String>,
    /// Keplerian elements at the first node.
    pub elements: Option<Elements>,
    /// Position and velocity at the first node, in their place.
    pub state: Option<State>,
    /// The target's name and designator.
    #[serde(default)]
    pub target: Designation,
    /// The servicer's.
    #[serde(default)]
    pub servicer: Designation,
}

/// Keplerian elements; shape and inclination are the mission's where they are left out.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elements {
    /// Semi-major axis [m].
    pub semi_major_axis_m: Option<f64>,
    /// Eccentricity.
    pub eccentricity: Option<f64>,
    /// Inclination [deg].
    pub inclination_deg: Option<f64>,
    /// Right ascension of the ascending node [deg].
    pub ascending_node_deg: f64,
    /// Argument of perigee [deg].
    pub argument_of_perigee_deg: f64,
    /// True anomaly at the first node [deg].
    pub true_anomaly_deg: f64,
}

/// Position and velocity.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Position from the body's centre [m].
    pub position_m: [f64; 3],
    /// In inertial axes [m/s].
    pub velocity_m_s: [f64; 3],
}

/// Names of a spacecraft.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Designation {
    /// Its name.
    pub name: Option<String>,
    /// Its international designator, such as `2026-001A`.
    pub designator: Option<String>,
}

/// The chief on its orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct Chief {
    /// Name of the inertial axes.
    pub frame: String,
    /// Names of the target.
    pub target: Designation,
    /// Names of the servicer.
    pub servicer: Designation,
    /// Key that gives the orbit's shape.
    shape: &'static str,
    /// Gravitational parameter [m^3/s^2].
    mu: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
}

/// The chief at one time, inertial axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position from the body's centre [m].
    pub position: Vector3<f64>,
    /// Its rate of change [m/s].
    pub velocity: Vector3<f64>,
    /// The RTN axes there.
    pub rtn: Rtn,
}

impl Chief {
    /// Reads a file, for a mission whose orbit this is.
    ///
    /// # Errors
    /// The file with the key that is wrong and why.
    pub fn read(file: &Path, orbit: &model::Orbit) -> Result<Self, Error> {
        Kind::Chief.read(file, Limit::TEXT, |bytes| Self::parse(as_text(bytes)?, orbit))
    }

    /// Parses a file's text, likewise.
    ///
    /// # Errors
    /// The key that is wrong and why.
    pub fn parse(text: &str, orbit: &model::Orbit) -> Result<Self, FieldError> {
        Self::new(toml_text::parse(text, Some(FORMAT))?, orbit)
    }

    /// The chief that a file tells of.
    ///
    /// # Errors
    /// The first key that is wrong.
    pub fn new(file: ChiefFile, orbit: &model::Orbit) -> Result<Self, FieldError> {
        let mu = orbit.gravitational_parameter_m3_s2;
        let (key, (position, velocity)) = match (&file.elements, &file.state) {
            (Some(elements), None) => ("elements.semi_major_axis_m", elements.state(orbit)?),
            (None, Some(state)) => {
                ("state", (state.position_m.into(), Vector3::from(state.velocity_m_s)))
            }
            (None, None) => {
                return Err(FieldError::new("elements", "is missing, and so is [state]: give one"));
            }
            (Some(_), Some(_)) => {
                return Err(FieldError::new("state", "stands beside [elements]: give one"));
            }
        };
        check_same_orbit(key, mu, (&position, &velocity), orbit.semi_major_axis_m)?;
        let shape = if file.state.is_some() { "state" } else { "elements.eccentricity" };
        check_perigee(shape, mu, (&position, &velocity), orbit.body.radius_m)?;
        let frame = file.frame.unwrap_or_else(|| "EME2000".into());
        check_word("frame", &frame)?;
        for (key, named) in [("target", &file.target), ("servicer", &file.servicer)] {
            for (part, word) in [("name", &named.name), ("designator", &named.designator)] {
                word.iter().try_for_each(|word| check_word(&format!("{key}.{part}"), word))?;
            }
        }
        let (target, servicer) = (file.target, file.servicer);
        Ok(Self { frame, target, servicer, shape, mu, position, velocity })
    }

    /// Refuses an orbit on which RTN axes do not turn at the mean motion, as plan files assume.
    ///
    /// # Errors
    /// The key of the orbit's shape, with the error that it makes.
    pub fn check(&self, motion: &Motion) -> Result<(), FieldError> {
        let Self { mu, position, velocity, .. } = self;
        let e = eccentricity(position, velocity, *mu);
        let flown = model::Orbit {
            semi_major_axis_m: semi_major_axis(*mu, position, velocity),
            eccentricity: libm::sqrt(e.dot(&e)),
            ..motion.orbit
        };
        let (duration, limit) = (motion.duration(), motion.hcw_error_limit_m);
        let error = motion.start_distance_m * flown.hcw_error(duration);
        if error <= limit {
            return Ok(());
        }
        let reason = format!(
            "with an eccentricity of {:.4} the plan, made for RTN axes that turn at a constant rate, is wrong \
             by up to {error:.2} m after {duration:.0} s; at most {limit:.2} m are accepted",
            flown.eccentricity
        );
        Err(FieldError::new(self.shape, reason))
    }

    /// Where it is so long after the first node [s].
    ///
    /// By the difference of eccentric anomalies, which knows no node and no perigee and so needs none
    /// (Battin, *An Introduction to the Mathematics and Methods of Astrodynamics*, section 4.3).
    pub fn at(&self, time: f64) -> Place {
        let (r, v, mu) = (&self.position, &self.velocity, self.mu);
        let distance = libm::sqrt(r.dot(r));
        let a = semi_major_axis(mu, r, v);
        let root = libm::sqrt(mu * a);
        let (outward, share) = (r.dot(v) / root, 1.0 - distance / a);
        let mean = time * libm::sqrt(mu / a) / a;
        // Newton's method on Kepler's equation; for orbits that a plan is made for it ends in a few steps.
        let mut turn = mean;
        for _ in 0..20 {
            let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
            let off = turn - share * sine + outward * (1.0 - cosine) - mean;
            turn -= off / (1.0 - share * cosine + outward * sine);
        }
        let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
        let now = a * (1.0 - share * cosine + outward * sine);
        let f = 1.0 - a / distance * (1.0 - cosine);
        let g = time - (turn - sine) * a * libm::sqrt(a / mu);
        let position = r * f + v * g;
        let velocity = r * (-root * sine / (now * distance)) + v * (1.0 - a / now * (1.0 - cosine));
        Place { position, velocity, rtn: Rtn::of(&position, &velocity) }
    }
}

impl Place {
    /// Position [m] and velocity [m/s] in inertial axes of what is there in RTN, its velocity relative to RTN.
    pub fn of(&self, position: &Vector3<f64>, velocity: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let Rtn { axes, rate } = &self.rtn;
        let carried = Vector3::new(0.0, 0.0, *rate).cross(position);
        [self.position + axes * position, self.velocity + axes * (velocity + carried)]
    }

    /// The RTN axes as columns in inertial axes.
    pub fn axes(&self) -> &Matrix3<f64> {
        &self.rtn.axes
    }
}

impl Elements {
    /// Position and velocity.
    fn state(&self, orbit: &model::Orbit) -> Result<(Vector3<f64>, Vector3<f64>), FieldError> {
        let inclination = self.inclination_deg.map_or(orbit.inclination_rad, f64::to_radians);
        let e = self.eccentricity.unwrap_or(orbit.eccentricity);
        let angles = [self.ascending_node_deg, self.argument_of_perigee_deg, self.true_anomaly_deg];
        if !(0.0..1.0).contains(&e) {
            return Err(FieldError::new("elements.eccentricity", "expected a number in [0, 1)"));
        }
        if !angles.iter().chain([&inclination]).all(|angle| angle.is_finite()) {
            return Err(FieldError::new("elements", "expected finite angles"));
        }
        let [node, perigee, anomaly] = angles.map(f64::to_radians);
        let flat = Orbit {
            semi_major_axis: self.semi_major_axis_m.unwrap_or(orbit.semi_major_axis_m),
            eccentricity: e,
            inclination,
            argument_of_latitude: perigee + anomaly,
            argument_of_perigee: perigee,
        };
        let turn = about(&Vector3::z(), node);
        let (position, velocity) = flat.state(orbit.gravitational_parameter_m3_s2);
        Ok((turn * position, turn * velocity))
    }
}

fn semi_major_axis(mu: f64, r: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
    1.0 / (2.0 / libm::sqrt(r.dot(r)) - v.dot(v) / mu)
}

/// Refuses an orbit whose mean motion is another than the plan's.
fn check_same_orbit(
    key: &str,
    mu: f64,
    (position, velocity): (&Vector3<f64>, &Vector3<f64>),
    planned: f64,
) -> Result<(), FieldError> {
    let a = semi_major_axis(mu, position, velocity);
    let momentum = position.cross(velocity);
    if (a / planned - 1.0).abs() <= SAME_ORBIT && momentum.dot(&momentum) > 0.0 {
        return Ok(());
    }
    let reason = format!(
        "its semi-major axis is {a:.0} m; the plan was made for an orbit of {planned:.0} m"
    );
    Err(FieldError::new(key, reason))
}

/// Refuses an orbit that leads below the body's surface.
fn check_perigee(
    key: &str,
    mu: f64,
    (position, velocity): (&Vector3<f64>, &Vector3<f64>),
    radius: f64,
) -> Result<(), FieldError> {
    let e = eccentricity(position, velocity, mu);
    let perigee = semi_major_axis(mu, position, velocity) * (1.0 - libm::sqrt(e.dot(&e)));
    if perigee >= radius {
        return Ok(());
    }
    let reason = format!(
        "the perigee is {perigee:.0} m from the body's centre, whose radius is {radius:.0} m"
    );
    Err(FieldError::new(key, reason))
}

/// Refuses what would not be one word of a line: these files have a line an entry.
fn check_word(key: &str, word: &str) -> Result<(), FieldError> {
    let is_plain = |c: char| c.is_ascii_graphic() || c == ' ';
    match !word.trim().is_empty() && word.len() <= 64 && word.chars().all(is_plain) {
        true => Ok(()),
        false => Err(FieldError::new(key, "expected 1 to 64 printable characters")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chief(text: &str) -> Result<Chief, FieldError> {
        with_orbit(text, &model::Orbit::default())
    }

    fn with_orbit(text: &str, orbit: &model::Orbit) -> Result<Chief, FieldError> {
        Chief::parse(text, orbit)
    }

    const ELEMENTS: &str = "[elements]\nascending_node_deg = 40.0\nargument_of_perigee_deg = 70.0\n\
                            true_anomaly_deg = 200.0\n";

    /// Energy, momentum and the eccentricity vector are those of the start, on orbits of any shape.
    #[test]
    fn the_orbit_keeps_what_an_orbit_keeps() {
        for e in [0.0, 1e-3, 0.3] {
            // The body has no surface: some of these orbits would be below the Earth's.
            let orbit = model::Orbit { body: model::Body::UNKNOWN, ..model::Orbit::default() };
            let chief = with_orbit(&format!("{ELEMENTS}eccentricity = {e}\n"), &orbit).unwrap();
            let kept = |time: f64| {
                let Place { position, velocity, .. } = chief.at(time);
                let energy = velocity.dot(&velocity) / 2.0 - chief.mu / position.norm();
                let perigee = eccentricity(&position, &velocity, chief.mu);
                (energy, position.cross(&velocity), perigee)
            };
            let (energy, momentum, perigee) = kept(0.0);
            assert!((perigee.norm() - e).abs() < 1e-15);
            for time in [1.0, 600.0, 1200.0, 5000.0] {
                let now = kept(time);
                assert!((now.0 / energy - 1.0).abs() < 1e-13);
                assert!((now.1 - momentum).norm() < 1e-13 * momentum.norm());
                assert!((now.2 - perigee).norm() < 1e-13);
            }
        }
    }

    /// After one period it is where it was; in between velocity is the rate of change of position, and the
    /// axes turn with the rate that is told.
    #[test]
    fn velocity_and_rate_are_rates_of_change() {
        let chief = chief(&format!("{ELEMENTS}eccentricity = 0.01\n")).unwrap();
        let a = model::Orbit::default().semi_major_axis_m;
        let period = core::f64::consts::TAU * a * (a / chief.mu).sqrt();
        assert!((chief.at(period).position - chief.position).norm() < 1e-6);
        let (before, now, after) = (chief.at(599.5), chief.at(600.0), chief.at(600.5));
        // The third derivative's share of a central difference is a few 1e-4 m/s.
        assert!((after.position - before.position - now.velocity).norm() < 1e-3);
        let turned = before.axes().transpose() * (after.axes() - before.axes());
        assert!((turned[(1, 0)] - now.rtn.rate).abs() < 1e-9, "{turned}");
    }

    #[test]
    fn a_state_says_the_same_as_its_elements() {
        let one = chief(ELEMENTS).unwrap();
        let (p, v) = (one.position, one.velocity);
        let text = format!(
            "[state]\nposition_m = [{:?}, {:?}, {:?}]\nvelocity_m_s = [{:?}, {:?}, {:?}]\n",
            p.x, p.y, p.z, v.x, v.y, v.z
        );
        let two = chief(&text).unwrap();
        assert_eq!(two.shape, "state");
        assert_eq!(Chief { shape: one.shape, ..two }, one);
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |text: &str| chief(text).unwrap_err().field;
        assert_eq!(field(""), "elements");
        assert_eq!(field("format = \"remora-chief/9\""), "format");
        assert_eq!(
            field(&format!("{ELEMENTS}semi_major_axis_m = 7.0e6")),
            "elements.semi_major_axis_m"
        );
        assert_eq!(field(&format!("{ELEMENTS}eccentricity = 1.0")), "elements.eccentricity");
        assert_eq!(field(&format!("{ELEMENTS}inclination_deg = nan")), "elements");
        let state = "[state]\nposition_m = [6.8e6, 0.0, 0.0]\nvelocity_m_s = [7656.0, 0.0, 0.0]\n";
        assert_eq!(field(state), "state");
        assert_eq!(field(&format!("{ELEMENTS}{state}")), "state");
        assert_eq!(field(&format!("frame = \"two\\nlines\"\n{ELEMENTS}")), "frame");
        assert_eq!(field(&format!("{ELEMENTS}[servicer]\nname = \"\"\n")), "servicer.name");
    }
}
