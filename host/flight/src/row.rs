//! One flight as a row.

use crate::flight::{Ending, FlightOutcome};
use crate::judge::{Arrival, Room};
use remora_host::error::FieldError;
use remora_host::formats::{Cell, Column};
use serde::{Deserialize, Serialize};

/// Result of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Number of the run: its errors are drawn from the seed and this.
    pub run: u64,
    /// Id of the scenario.
    pub scenario: String,
    /// Result of the flight; none where there was no plan to fly.
    pub flown: Option<FlightRow>,
}

/// Result of a flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightRow {
    /// How it ended.
    pub ending: Ending,
    /// When [s].
    pub time_s: f64,
    /// The state at the end.
    pub arrival: Arrival,
    /// How near it came to limits.
    pub room: Room,
    /// Limits that were passed.
    pub violations: Vec<String>,
    /// Plans made in flight, and how many of them were verified.
    pub replans: [u32; 2],
    /// Largest tracking errors after the first minute: position [m], attitude [rad].
    pub tracking: [f64; 2],
    /// Impulse of the commanded force [N s].
    pub impulse_n_s: f64,
    /// Quantities that were drawn, in the order of the table's columns.
    pub drawn: Vec<f64>,
}

impl From<&FlightOutcome> for FlightRow {
    fn from(flown: &FlightOutcome) -> Self {
        Self {
            ending: flown.ending,
            time_s: flown.time_s,
            arrival: flown.arrival,
            room: flown.room,
            violations: flown.violations().into_iter().map(String::from).collect(),
            replans: flown.replans,
            tracking: flown.tracking,
            impulse_n_s: flown.impulse_n_s,
            drawn: flown.drawn.iter().map(|quantity| quantity.value).collect(),
        }
    }
}

impl FlightRow {
    /// Refuses what no flight comes to. Its numbers are all finite: a journal keeps no others.
    fn check(&self) -> Result<(), FieldError> {
        let wrong = |field: String, reason: String| Err(FieldError::new(field, reason));
        if self.replans[1] > self.replans[0] {
            return wrong("flown.replans".into(), "more are verified than were made".into());
        }
        for (name, value) in self.sizes() {
            if !(0.0..f64::INFINITY).contains(&value) {
                return wrong(format!("flown.{name}"), format!("is {value}, and no flight's is"));
            }
        }
        for (name, value) in self.signed() {
            if !value.is_finite() {
                return wrong(format!("flown.{name}"), format!("is {value}, and no flight's is"));
            }
        }
        match self.ending == Ending::Captured && self.room.collided() {
            true => wrong("flown.ending".into(), "is captured, and bodies overlapped".into()),
            false => Ok(()),
        }
    }

    /// Numbers that are never negative.
    fn sizes(&self) -> [(&'static str, f64); 9] {
        let Self { arrival, room, .. } = self;
        [
            ("time_s", self.time_s),
            ("arrival.miss_m", arrival.miss_m),
            ("arrival.angle_rad", arrival.angle_rad),
            ("arrival.speed_m_s", arrival.speed_m_s),
            ("room.joint_rate", room.joint_rate),
            ("room.command", room.command),
            ("tracking[0]", self.tracking[0]),
            ("tracking[1]", self.tracking[1]),
            ("impulse_n_s", self.impulse_n_s),
        ]
    }

    /// The others.
    fn signed(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let Self { arrival, room, .. } = self;
        let rooms = [
            ("room.arm_m", room.arm_m),
            ("room.bus_m", room.bus_m),
            ("room.own_m", room.own_m),
            ("room.keep_out_m", room.keep_out_m),
            ("room.view", room.view),
            ("room.joint_rad", room.joint_rad),
        ];
        let miss = arrival.miss_target_m.map(|x| ("arrival.miss_target_m", x));
        let drawn = self.drawn.iter().map(|x| ("drawn", *x));
        rooms.into_iter().chain(miss).chain(drawn)
    }
}

/// Meanings of the columns of a table of flights, for the table's own metadata.
pub(crate) const ABOUT: [(&str, &str); 22] = [
    ("run", "its number, from which with the seed its errors are drawn"),
    ("scenario", "id"),
    ("ending", "captured, missed, collided, aborted or no_plan"),
    ("time_s", "when it ended"),
    ("miss_m", "end effector from the port at the end"),
    ("miss_target_*", "the same along the target's axes"),
    ("angle_rad", "between the approach axis and the port's at the end"),
    ("speed_m_s", "of the end effector relative to the port at the end"),
    ("room_arm_m", "smallest distance of arm and target, negative where they overlapped"),
    ("room_bus_m", "smallest distance of bus and target, likewise"),
    ("room_own_m", "smallest distance of arm and own bus, likewise"),
    ("room_keep_out_m", "smallest distance beyond the keep-out distance, negative within it"),
    ("room_view", "least room of the port within the field of view, as a cosine; negative outside"),
    ("room_joint_rad", "smallest angle left to a joint's stop, negative beyond it"),
    ("joint_rate_over_limit", "largest joint rate, of its limit"),
    ("command_over_limit", "largest command, of its limit"),
    ("violations", "names of the limits that were passed, with +"),
    ("replans", "plans made in flight"),
    ("replans_verified", "those of them that were verified"),
    ("tracking_*", "largest error from what guidance asks for, after the first minute"),
    ("impulse_n_s", "of the commanded force"),
    ("drawn.*", "error of the world that was drawn, read back from the truth"),
];

/// Name and unit of something that is drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorColumn {
    /// Section and key of the errors file, with what it belongs to.
    pub name: String,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
}

impl Row {
    /// Refuses a row of no flight of a campaign of so many.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check(&self, count: u64) -> Result<(), FieldError> {
        if self.run >= count {
            return Err(FieldError::new("run", format!("is {}, of {count} runs", self.run)));
        }
        self.flown.as_ref().map_or(Ok(()), FlightRow::check)
    }

    /// The row with names and units of its columns; NaN where there was no plan to fly.
    pub fn columns(&self, drawn: &[ErrorColumn]) -> Vec<Column> {
        let mut columns = Vec::new();
        let mut push = |name: &str, unit: &'static str, cell: Cell| {
            columns.push(Column { name: name.to_string(), unit, cell });
        };
        let flown = self.flown.as_ref();
        let number = |of: &dyn Fn(&FlightRow) -> f64| Cell::Number(flown.map_or(f64::NAN, of));
        let ending = flown.map_or("no_plan", |flown| flown.ending.name());
        push("run", "", Cell::Integer(i64::try_from(self.run).unwrap_or(i64::MAX)));
        push("scenario", "", Cell::Text(self.scenario.clone()));
        push("ending", "", Cell::Text(ending.into()));
        push("time_s", "s", number(&|f| f.time_s));
        push("miss_m", "m", number(&|f| f.arrival.miss_m));
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            push(&format!("miss_target_{axis}_m"), "m", number(&|f| f.arrival.miss_target_m[i]));
        }
        push("angle_rad", "rad", number(&|f| f.arrival.angle_rad));
        push("speed_m_s", "m/s", number(&|f| f.arrival.speed_m_s));
        push("room_arm_m", "m", number(&|f| f.room.arm_m));
        push("room_bus_m", "m", number(&|f| f.room.bus_m));
        push("room_own_m", "m", number(&|f| f.room.own_m));
        push("room_keep_out_m", "m", number(&|f| f.room.keep_out_m));
        push("room_view", "", number(&|f| f.room.view));
        push("room_joint_rad", "rad", number(&|f| f.room.joint_rad));
        push("joint_rate_over_limit", "", number(&|f| f.room.joint_rate));
        push("command_over_limit", "", number(&|f| f.room.command));
        let violations = flown.map_or(String::new(), |flown| flown.violations.join("+"));
        push("violations", "", Cell::Text(violations));
        push("replans", "", number(&|f| f.replans[0].into()));
        push("replans_verified", "", number(&|f| f.replans[1].into()));
        push("tracking_position_m", "m", number(&|f| f.tracking[0]));
        push("tracking_attitude_rad", "rad", number(&|f| f.tracking[1]));
        push("impulse_n_s", "N s", number(&|f| f.impulse_n_s));
        for (i, drawn) in drawn.iter().enumerate() {
            let value = number(&|f| f.drawn.get(i).copied().unwrap_or(f64::NAN));
            push(&format!("drawn.{}", drawn.name), drawn.unit, value);
        }
        columns
    }
}

impl Ending {
    /// Spells it as files do.
    pub fn name(self) -> &'static str {
        match self {
            Self::Captured => "captured",
            Self::Missed => "missed",
            Self::Collided => "collided",
            Self::Aborted => "aborted",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flown() -> FlightRow {
        let room = Room { view: 0.5, joint_rate: 0.5, command: 0.5, ..Room::ALL };
        FlightRow {
            ending: Ending::Captured,
            time_s: 1200.0,
            arrival: Arrival {
                miss_m: 0.01,
                miss_target_m: [0.0, -0.01, 0.0],
                angle_rad: 0.0,
                speed_m_s: 0.0,
            },
            room: Room {
                arm_m: 0.1,
                bus_m: 0.1,
                own_m: 0.1,
                keep_out_m: -1.0,
                joint_rad: -0.1,
                ..room
            },
            violations: Vec::new(),
            replans: [3, 2],
            tracking: [0.1, 0.2],
            impulse_n_s: 7.0,
            drawn: vec![8.0, -0.5],
        }
    }

    #[test]
    fn what_no_flight_comes_to_is_refused() {
        let refused = |change: &dyn Fn(&mut FlightRow)| {
            let mut flown = flown();
            change(&mut flown);
            let row = Row { run: 0, scenario: "a".into(), flown: Some(flown) };
            row.check(1).map_err(|error| error.field).err().unwrap_or_default()
        };
        assert_eq!(refused(&|_| ()), "");
        type Change<'a> = &'a dyn Fn(&mut FlightRow);
        let changes: [(Change<'_>, &str); 11] = [
            (&|f| f.replans = [1, 2], "flown.replans"),
            (&|f| f.time_s = f64::INFINITY, "flown.time_s"),
            (&|f| f.time_s = -1.0, "flown.time_s"),
            (&|f| f.arrival.miss_m = f64::NAN, "flown.arrival.miss_m"),
            (&|f| f.arrival.miss_m = -1.0, "flown.arrival.miss_m"),
            (&|f| f.arrival.miss_target_m[1] = f64::NAN, "flown.arrival.miss_target_m"),
            (&|f| f.arrival.speed_m_s = -0.1, "flown.arrival.speed_m_s"),
            (&|f| f.impulse_n_s = f64::NAN, "flown.impulse_n_s"),
            (&|f| f.room.view = f64::INFINITY, "flown.room.view"),
            (&|f| f.drawn[1] = f64::NAN, "flown.drawn"),
            (&|f| f.room.arm_m = -0.1, "flown.ending"),
        ];
        for (change, field) in changes {
            assert_eq!(refused(change), field);
        }
        let missed = |f: &mut FlightRow| (f.ending, f.room.arm_m) = (Ending::Collided, -0.1);
        assert_eq!(refused(&missed), "");
    }

    #[test]
    fn every_column_is_explained_once_and_nothing_else() {
        let row = Row { run: 0, scenario: "a".into(), flown: None };
        let columns = row.columns(&[ErrorColumn { name: "mass.mass".into(), unit: "" }]);
        let is_of = |name: &str, entry: &str| match entry.strip_suffix('*') {
            Some(start) => name.starts_with(start),
            None => name == entry,
        };
        for Column { name, .. } in &columns {
            assert_eq!(ABOUT.iter().filter(|(entry, _)| is_of(name, entry)).count(), 1, "{name}");
        }
        for (entry, _) in ABOUT {
            assert!(columns.iter().any(|column| is_of(&column.name, entry)), "{entry}");
        }
    }
}
