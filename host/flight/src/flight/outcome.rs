//! Outcome of a flight, and a view of it meanwhile.

use crate::judge::{Arrival, KEEP_OUT_TOLERANCE_M, Room, VIEW_TOLERANCE};
use remora_core::advanced::guidance::{Command, Estimate};
use remora_truth::{Quantity, Rtn, View};
use serde::{Deserialize, Serialize};

/// End of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// At the port, as capture demands, and nothing touched on the way.
    Captured,
    /// Elsewhere or otherwise than capture demands.
    Missed,
    /// Bodies overlapped on the way.
    Collided,
    /// The approach was given up, and the target left clear.
    Aborted,
}

/// Outcome of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightOutcome {
    /// How it ended.
    pub ending: Ending,
    /// When [s].
    pub time_s: f64,
    /// The state at the end.
    pub arrival: Arrival,
    /// How near it came to limits.
    pub room: Room,
    /// Plans made in flight, and how many of them were verified.
    pub replans: [u32; 2],
    /// Largest tracking errors after the first minute: position [m], attitude [rad].
    pub tracking: [f64; 2],
    /// Impulse of the commanded force [N s].
    pub impulse_n_s: f64,
    /// Least distance of the centre of mass from the target's box [m].
    pub nearest_m: f64,
    /// Quantities that were drawn, read back from the truth.
    pub drawn: Vec<Quantity>,
}

impl FlightOutcome {
    /// The limits that were passed, by name.
    pub fn violations(&self) -> Vec<&'static str> {
        let room = &self.room;
        let passed = [
            ("arm", !(room.arm_m >= 0.0)),
            ("bus", !(room.bus_m >= 0.0)),
            ("own", !(room.own_m >= 0.0)),
            ("keep_out", !(room.keep_out_m >= -KEEP_OUT_TOLERANCE_M)),
            ("view", !(room.view >= -VIEW_TOLERANCE)),
            ("joint", !(room.joint_rad >= 0.0)),
            ("command", !(room.command <= 1.0 + 1e-9)),
        ];
        passed.iter().filter(|(_, is)| *is).map(|(name, _)| *name).collect()
    }
}

/// One instant of a flight, for whoever watches.
pub struct Moment<'a, const NL: usize> {
    /// The truth.
    pub view: &'a View<NL>,
    /// The target's RTN axes.
    pub frame: &'a Rtn,
    /// Estimate given to guidance.
    pub estimate: &'a Estimate<NL>,
    /// Command that guidance answered.
    pub command: &'a Command<NL>,
}
