//! A flight as the page shows it: columns over time, as few rows and digits as a picture needs.

use serde::{Serialize, Serializer};

/// Most rows of a flight on a page, but for its end: two seconds apart in a plan of twenty minutes.
const MOST_ROWS: usize = 600;

/// Significant digits of a number behind its first.
const DIGITS: usize = 6;

/// One instant of a flight. Positions are from the target's centre of mass, in RTN; attitudes lead from
/// body to RTN.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// When [s].
    pub time_s: f64,
    /// Centre of the bus [m].
    pub bus_m: [f64; 3],
    /// Attitude of the bus.
    pub bus_attitude: [f64; 4],
    /// Attitude of the target.
    pub target_attitude: [f64; 4],
    /// Joint angles [rad], rates [rad/s], commanded torques [N m].
    pub joints: [Vec<f64>; 3],
    /// Commanded force, RTN [N].
    pub force_n: [f64; 3],
    /// Commanded bus torque, bus axes [N m].
    pub bus_torque_n_m: [f64; 3],
}

/// A flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlightTrack {
    name: String,
    rows: Rows,
}

/// Its columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct Rows {
    time_s: Vec<Short>,
    bus_m: Vec<[Short; 3]>,
    bus_attitude: Vec<[Short; 4]>,
    target_attitude: Vec<[Short; 4]>,
    joint_angle: Vec<Vec<Short>>,
    joint_rate: Vec<Vec<Short>>,
    joint_torque: Vec<Vec<Short>>,
    force_n: Vec<[Short; 3]>,
    bus_torque_n_m: Vec<[Short; 3]>,
}

/// A number in a few digits.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Short(f64);

impl Serialize for Short {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = format!("{:.*e}", DIGITS, self.0);
        serializer.serialize_f64(text.parse().unwrap_or(self.0))
    }
}

impl FlightTrack {
    /// A flight by its name, of its instants in their order: evenly thinned, the last one kept.
    pub fn new(name: String, instants: &[Instant]) -> Self {
        let every = instants.len().div_ceil(MOST_ROWS).max(1);
        let last = instants.len().saturating_sub(1);
        let kept = instants.iter().enumerate();
        let kept = kept.filter(|(i, _)| i % every == 0 || *i == last).map(|(_, instant)| instant);
        let mut rows = Rows::default();
        for instant in kept {
            let [angle, rate, torque] =
                instant.joints.each_ref().map(|joints| joints.iter().map(|x| Short(*x)).collect());
            rows.time_s.push(Short(instant.time_s));
            rows.bus_m.push(instant.bus_m.map(Short));
            rows.bus_attitude.push(instant.bus_attitude.map(Short));
            rows.target_attitude.push(instant.target_attitude.map(Short));
            rows.joint_angle.push(angle);
            rows.joint_rate.push(rate);
            rows.joint_torque.push(torque);
            rows.force_n.push(instant.force_n.map(Short));
            rows.bus_torque_n_m.push(instant.bus_torque_n_m.map(Short));
        }
        Self { name, rows }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instant(time_s: f64) -> Instant {
        Instant {
            time_s,
            bus_m: [1.0 / 3.0, -1e-9, 0.0],
            bus_attitude: [0.0, 0.0, 0.0, 1.0],
            target_attitude: [0.0, 0.0, 0.0, 1.0],
            joints: [vec![0.1], vec![0.2], vec![0.3]],
            force_n: [0.0; 3],
            bus_torque_n_m: [0.0; 3],
        }
    }

    #[test]
    fn a_flight_is_thinned_to_its_end_and_numbers_are_short() {
        let instants: Vec<Instant> = (0..12_001).map(|i| instant(0.1 * f64::from(i))).collect();
        let flown = FlightTrack::new("run 3".into(), &instants);
        let times: Vec<f64> = flown.rows.time_s.iter().map(|time| time.0).collect();
        assert!(times.len() <= MOST_ROWS + 1, "{}", times.len());
        assert_eq!((times[0], *times.last().unwrap()), (0.0, 1200.0));
        let text = serde_json::to_string(&flown.rows.bus_m[0]).unwrap();
        assert_eq!(text, "[0.3333333,-1e-9,0.0]");
        assert_eq!(FlightTrack::new("none".into(), &[]).rows, Rows::default());
    }
}
