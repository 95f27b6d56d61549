//! Error of the planner's model of relative motion on an orbit that is not a circle.

use super::norm;
use crate::model::{Grid, Mission, Orbit, Refusal, Scenario};
use remora_qp::dense::count;

/// Places on the orbit that are tried, evenly spaced in eccentric anomaly: the worst is met within 3 %.
const PLACES: usize = 36;
/// Places of a first look, which ends the check where the error is below half its limit.
const FEW_PLACES: usize = 9;
/// Steps of an integration for each radian of eccentric anomaly.
const STEPS_PER_RADIAN: f64 = 12.0;
/// Least steps of an integration over the horizon.
const LEAST_STEPS: usize = 8;
/// Most steps of an integration over the horizon.
pub const MAX_ECCENTRICITY_STEPS: usize = 64;

/// Radial and along-track offset with their rates, of unit length; time in units of `1 / n`.
type Plane = [f64; 4];

impl<const NL: usize> Mission<NL> {
    /// Refuses an orbit on which the planner's model is too wrong.
    pub(super) fn check_eccentricity(
        &self,
        grid: &Grid,
        scenario: &Scenario<NL>,
    ) -> Result<(), Refusal> {
        let (range, duration) = (norm(&scenario.position), grid.duration);
        let limit = self.hcw_error_limit(range);
        if 2.0 * range * self.orbit.hcw_error_at(FEW_PLACES, duration) <= limit {
            return Ok(());
        }
        let error = range * self.orbit.hcw_error(duration);
        // NaN is refused.
        if error <= limit {
            return Ok(());
        }
        let eccentricity = self.orbit.eccentricity;
        Err(Refusal::Eccentricity { eccentricity, error, limit, duration })
    }

    /// Largest accepted error of HCW over a horizon that begins `range` [m] from the target [m]: the way from
    /// there to the far keep-out distance, and at least the near one.
    ///
    /// Guidance corrects the error on the way. Beyond this limit HCW does not predict the path at all.
    pub fn hcw_error_limit(&self, range: f64) -> f64 {
        (range - self.approach.keep_out_far_m).max(self.approach.keep_out_near_m)
    }
}

impl Orbit {
    /// Error of HCW over `duration` [s] as a share of the distance at the start: of the free motion from rest
    /// in RTN, radially from the target, at the worst true anomaly. Along other axes it is smaller.
    ///
    /// Cost: 37 integrations of the linear motion about an ellipse, one of them with eccentricity zero.
    pub fn hcw_error(&self, duration: f64) -> f64 {
        self.hcw_error_at(PLACES, duration)
    }

    fn hcw_error_at(&self, places: usize, duration: f64) -> f64 {
        let (e, time) = (self.eccentricity, self.mean_motion() * duration);
        let circle = on_ellipse(0.0, 0.0, time);
        let mut most = 0.0;
        for place in 0..places {
            let begin = 2.0 * core::f64::consts::PI * place as f64 / places as f64;
            let [x, y, ..] = on_ellipse(e, begin, time);
            let (x, y) = (x - circle[0], y - circle[1]);
            let error = libm::sqrt(x * x + y * y);
            // NaN stays.
            most = if error <= most { most } else { error };
        }
        most
    }
}

/// Free motion from `(1, 0)` at rest in RTN, from eccentric anomaly `begin` on, after `time`: RK4 in the
/// eccentric anomaly, whose steps are short in time where the orbit turns fast.
#[inline(never)]
fn on_ellipse(e: f64, begin: f64, time: f64) -> Plane {
    let end = eccentric_anomaly(e, begin - e * libm::sin(begin) + time);
    let steps = count(libm::ceil(STEPS_PER_RADIAN * (end - begin)));
    let steps = steps.clamp(LEAST_STEPS, MAX_ECCENTRICITY_STEPS);
    let h = (end - begin) / steps as f64;
    let mut x = [1.0, 0.0, 0.0, 0.0];
    // Bound: steps about an ellipse.
    for step in 0..steps {
        let at = begin + h * step as f64;
        let a = slope(e, at, &x);
        let b = slope(e, at + 0.5 * h, &moved(&x, &a, 0.5 * h));
        let c = slope(e, at + 0.5 * h, &moved(&x, &b, 0.5 * h));
        let d = slope(e, at + h, &moved(&x, &c, h));
        for (rate, share) in [(a, 1.0), (b, 2.0), (c, 2.0), (d, 1.0)] {
            x = moved(&x, &rate, share * h / 6.0);
        }
    }
    x
}

fn moved(x: &Plane, rate: &Plane, by: f64) -> Plane {
    core::array::from_fn(|i| x[i] + rate[i] * by)
}

/// Rate of change by eccentric anomaly: the linear equations of relative motion about an ellipse with unit
/// semi-major axis and mean motion (Alfriend et al., *Spacecraft Formation Flying*, section 4.4).
#[inline(never)]
fn slope(e: f64, anomaly: f64, &[x, y, u, v]: &Plane) -> Plane {
    let (sin, cos) = libm::sincos(anomaly);
    let r = 1.0 - e * cos;
    let w = libm::sqrt(1.0 - e * e) / (r * r);
    let (pull, turning) = (1.0 / (r * r * r), -2.0 * w * e * sin / (r * r));
    let radial = (w * w + 2.0 * pull) * x + turning * y + 2.0 * w * v;
    let along = (w * w - pull) * y - turning * x - 2.0 * w * u;
    [u * r, v * r, radial * r, along * r]
}

/// Solves Kepler's equation by halving: it has one root, within `e` of the mean anomaly.
fn eccentric_anomaly(e: f64, mean: f64) -> f64 {
    let (mut low, mut high) = (mean - e, mean + e);
    for _ in 0..52 {
        let middle = 0.5 * (low + high);
        if middle - e * libm::sin(middle) < mean { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_that_of_a_fine_integration_in_time() {
        // By another program, in time and true anomaly, at the worst of many places.
        let low = |eccentricity| Orbit { eccentricity, ..Orbit::default() };
        let high = Orbit { semi_major_axis_m: 2.4e7, eccentricity: 0.6, ..Orbit::default() };
        for (orbit, duration, share) in [
            (low(1e-3), 1200.0, 0.01134),
            (low(0.01), 1200.0, 0.1153),
            (low(1e-3), 6000.0, 0.1303),
            (high, 1200.0, 1.118),
        ] {
            let found = orbit.hcw_error(duration);
            assert!((found / share - 1.0).abs() < 0.02, "{orbit:?} {duration}: {found} {share}");
        }
        assert!(low(0.0).hcw_error(1200.0) < 1e-12);
    }
}
