//! One plan behind several doors.

use crate::doors::door::Door;
use crate::doors::input::Input;
use crate::doors::programs::{Opened, Workshop};
use remora_host::choice::Choice;
use remora_host::error::Error;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// A plan to be made again: the input of `cargo xtask replay`.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The plan.
    pub input: Input,
    /// The doors.
    pub doors: Vec<Door>,
    /// The checkout of the sources; none where there is none.
    pub root: Option<PathBuf>,
}

/// Outcome of a replay, as `cargo xtask replay --json` prints it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Replays {
    /// `remora-replay/1`.
    pub format: &'static str,
    /// Id of the plan's scenario.
    pub scenario: String,
    /// Checksum of the numbers in the file: 16 hexadecimal digits.
    pub checksum: String,
    /// One a door.
    pub doors: Vec<Row>,
}

/// A door.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// Its name.
    pub door: &'static str,
    /// Its outcome.
    pub outcome: Outcome,
    /// Checksum of its plan, where it made one.
    pub checksum: Option<String>,
    /// Why it made none.
    pub reason: Option<String>,
    /// From the first step to the checksum, builds included [ms].
    pub time_ms: u64,
}

/// Outcome behind a door.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Its plan is the file's, bit for bit.
    Same,
    /// It is another.
    Differs,
    /// It is not there, or not for such a plan.
    Missing,
    /// It is there and makes no plan.
    Failed,
}

impl Replay {
    /// Plans behind each door; `watch` is told of each that is done.
    ///
    /// # Errors
    /// Faults of the plan or of this machine.
    pub fn run(&self, watch: &mut dyn FnMut(&str)) -> Result<Replays, Error> {
        let scratch = tempfile::tempdir()
            .map_err(|cause| Error::Thread { reason: format!("no scratch folder: {cause}") })?;
        let (input, root) = (&self.input, self.root.clone());
        let expected = input.checksum()?;
        let workshop = Workshop { input, root, scratch: scratch.path().into() };
        let mut doors = Vec::new();
        for door in &self.doors {
            let began = Instant::now();
            let opened = workshop.open(*door)?;
            let time_ms = began.elapsed().as_millis() as u64;
            watch(&format!("{}: {:.1} s", door.name(), time_ms as f64 / 1000.0));
            doors.push(Row::new(*door, opened, expected, time_ms));
        }
        Ok(Replays {
            format: "remora-replay/1",
            scenario: input.plan.scenario.clone(),
            checksum: digits(expected),
            doors,
        })
    }
}

impl Row {
    fn new(door: Door, opened: Opened, expected: u64, time_ms: u64) -> Self {
        let (outcome, checksum, reason) = match opened {
            Opened::Planned(sum) if sum == expected => (Outcome::Same, Some(digits(sum)), None),
            Opened::Planned(sum) => (Outcome::Differs, Some(digits(sum)), None),
            Opened::Missing(reason) => (Outcome::Missing, None, Some(reason)),
            Opened::Failed(reason) => (Outcome::Failed, None, Some(reason)),
        };
        Self { door: door.name(), outcome, checksum, reason, time_ms }
    }
}

impl Replays {
    /// Whether no door made another plan, or none where it is there.
    pub fn all_same(&self) -> bool {
        self.doors.iter().all(|row| matches!(row.outcome, Outcome::Same | Outcome::Missing))
    }
}

fn digits(sum: u64) -> String {
    format!("{sum:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_checksum_and_a_broken_door_are_told_and_a_missing_one_is_no_fault() {
        let row = |opened| Row::new(Door::C, opened, 7, 1);
        let replays = |rows: Vec<Row>| Replays {
            format: "remora-replay/1",
            scenario: "a".into(),
            checksum: digits(7),
            doors: rows,
        };
        let same = row(Opened::Planned(7));
        let missing = row(Opened::Missing("there is no cc".into()));
        assert_eq!((same.outcome, missing.outcome), (Outcome::Same, Outcome::Missing));
        assert!(replays(vec![same.clone(), missing]).all_same());
        for opened in [Opened::Planned(8), Opened::Failed("no".into())] {
            assert!(!replays(vec![same.clone(), row(opened)]).all_same());
        }
        assert_eq!(row(Opened::Planned(8)).checksum.unwrap(), "0000000000000008");
    }
}
