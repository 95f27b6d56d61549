//! Readers of text.

use crate::{one_line, taken};
use remora_core::advanced::model::{Orbit, Tolerances};
use remora_export::chief::Chief;
use remora_flight::errors_file;
use remora_flight::flights_file::FlightsFile;
use remora_host::fingerprint::Fnv;
use remora_host::formats::{MissionFile, Row, ScenarioSet, json};
use remora_host::importing::{self, Request};
use remora_host::journal::{Heading, Journal};
use remora_host::qp_file::QpFile;
use remora_host::rows_file::RowsFile;
use remora_learn::dataset::Manifest;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::path::Path;

/// The text that bytes are: what is none is refused before any parser sees it.
fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap_or_default()
}

/// Checks that a taken value comes back as it is once it is written.
fn comes_back<T: Serialize + PartialEq + Debug>(value: &T, parse: impl FnOnce(&str) -> Option<T>) {
    let written = json::to_text(value).expect("what was read can be written");
    let again = parse(&written).expect("what was written can be read");
    assert_eq!(&again, value);
}

pub(crate) fn scenarios(bytes: &[u8]) {
    let parse = |text: &str| taken(ScenarioSet::parse(text));
    let Some(set) = parse(text(bytes)) else { return };
    for scenario in &set.scenarios {
        assert!(scenario.scenario().position.amax() <= 1e6);
    }
    comes_back(&set, parse);
}

pub(crate) fn mission(bytes: &[u8]) {
    let Some(file) = taken(MissionFile::parse(text(bytes))) else { return };
    let Some(mission) = taken(file.mission()) else { return };
    mission.validate().expect("a mission that was taken is sound");
    let written = toml::to_string(&file).expect("what was read can be written");
    assert_eq!(taken(MissionFile::parse(&written)).as_ref(), Some(&file));
}

pub(crate) fn qp(bytes: &[u8]) {
    let parse = |text: &str| taken(QpFile::parse(text));
    let Some(file) = parse(text(bytes)) else { return };
    // The sizes of the two stages; any other is refused.
    let _ = taken(file.program::<60, 6, 3, 4>().map(drop));
    comes_back(&file, parse);
}

pub(crate) fn manifest(bytes: &[u8]) {
    let parse = |text: &str| taken(Manifest::parse(text));
    let Some(manifest) = parse(text(bytes)) else { return };
    comes_back(&manifest, parse);
    // Neither first nor last shard of it is this.
    for number in [0, 7] {
        manifest.shard(number, bytes).map(drop).expect_err("a text is no shard");
    }
}

pub(crate) fn errors(bytes: &[u8]) {
    let Some(errors) = taken(errors_file::parse(text(bytes), 3)) else { return };
    let written = errors_file::text(&errors).expect("what was read can be written");
    assert_eq!(taken(errors_file::parse(&written, 3)), Some(errors));
}

pub(crate) fn flights(bytes: &[u8]) {
    let parse = |text: &str| taken(FlightsFile::parse(text));
    let _ = parse(text(bytes)).map(|asked| asked.dispersion(1));
}

pub(crate) fn chief(bytes: &[u8]) {
    let Some(chief) = taken(Chief::parse(text(bytes), &Orbit::default())) else { return };
    let now = chief.at(600.0);
    assert!(now.position.iter().chain(&now.velocity).all(|x| x.is_finite()));
}

pub(crate) fn urdf(bytes: &[u8]) {
    for end_effector in [None, Some("tip".to_string())] {
        let options = remora_urdf::Options { end_effector, ..Default::default() };
        let _ = remora_urdf::explain("fuzzed", bytes, &options);
        match remora_urdf::import("fuzzed", bytes, &options) {
            Ok(arm) => assert!(arm.joints.iter().all(|joint| joint.body.mass > 0.0)),
            Err(refusal) => assert!(!refusal.faults.is_empty()),
        }
    }
}

/// Imports a URDF and checks the mission of every arm that is taken.
pub(crate) fn import(bytes: &[u8]) {
    let request = Request::new("fuzzed.urdf".into(), bytes.to_vec());
    match importing::import(&request) {
        Ok(imported) => {
            let file = imported.mission;
            let written = toml::to_string(&file).expect("what was made can be written");
            assert_eq!(taken(MissionFile::parse(&written)), Some(file));
        }
        Err(refusal) => refusal.faults().iter().for_each(|fault| one_line(fault)),
    }
}

/// A header that is always right: what is forged are the rows.
#[derive(Serialize, Deserialize)]
struct Header;

impl Heading for Header {
    const FORMAT: &'static str = "fuzzed";
    const WORK: &'static str = "work";

    fn format(&self) -> &str {
        Self::FORMAT
    }

    fn difference(&self, _: &Self) -> Option<(&'static str, String)> {
        None
    }
}

pub(crate) fn journal(bytes: &[u8]) {
    let tolerances = Tolerances::default();
    rows::<Row>(bytes, &|row| row.check(&tolerances));
    rows::<remora_flight::row::Row>(bytes, &|row| row.check(1000));
}

/// The rows below a header, all of which pass the check.
fn rows<R: Serialize + DeserializeOwned>(bytes: &[u8], check: remora_host::journal::Check<'_, R>) {
    let mut journal = serde_json::to_vec(&Header).expect("a unit");
    journal.push(b'\n');
    journal.extend(bytes);
    match Journal::parse(Path::new("journal"), &*journal, &Header, check) {
        Ok((rows, whole)) => {
            assert!(whole <= journal.len() as u64);
            rows.iter().for_each(|row| check(row).expect("a row that was taken passes"));
        }
        Err(error) => one_line(&error.to_string()),
    }
    done::<R>(bytes, check);
}

/// Checks the rows in a finished file, whose last line holds their true count and checksum.
fn done<R: DeserializeOwned>(bytes: &[u8], check: remora_host::journal::Check<'_, R>) {
    let mut file = serde_json::to_vec(&Header).expect("a unit");
    file.extend(b"\n{}\n");
    file.extend(bytes);
    let (mut hash, rows) = (Fnv::default(), bytes.split(|byte| *byte == b'\n').count() - 1);
    hash.add(&file);
    file.extend(format!("{{\"rows\":{rows},\"checksum\":\"{hash}\",\"tables\":{{}}}}\n").bytes());
    let read = RowsFile::<Header, _>::of(Path::new("rows"), &*file)
        .and_then(|opened| opened.each(|row: R| check(&row)));
    match read {
        Ok(count) => assert_eq!(count, rows as u64),
        Err(error) => one_line(&error.to_string()),
    }
}
