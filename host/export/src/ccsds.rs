//! Ephemerides as text: CCSDS 502.0-B (OEM, version 2.0) and 504.0-B (AEM, version 1.0), each as lines of
//! key and value. These versions are what today's readers know.
//!
//! A file holds one spacecraft: many readers take no more.

use crate::chief::{Chief, Designation};
use crate::epoch::Epoch;
use crate::inertial::{Row, Spacecraft};
use nalgebra::Vector3;
use std::fmt::Write as _;

/// Heading of an ephemeris: spacecraft, axes, times and comments.
#[derive(Clone, Debug)]
pub struct Heading<'a> {
    /// The spacecraft.
    pub of: Spacecraft,
    /// Its names, and the axes that it is in.
    pub chief: &'a Chief,
    /// Name of the body that the orbit is about.
    pub center: &'a str,
    /// When the first row is.
    pub epoch: Epoch,
    /// When the file was made.
    pub created: Epoch,
    /// Where the numbers come from, a line each.
    pub comments: &'a [String],
}

impl Heading<'_> {
    fn named(&self) -> &Designation {
        match self.of {
            Spacecraft::Target => &self.chief.target,
            Spacecraft::Servicer => &self.chief.servicer,
        }
    }

    /// Lines up to what is particular to a kind of file.
    fn begin(&self, text: &mut String, version: &str) {
        line(text, version, "");
        for comment in self.comments {
            let _ = writeln!(text, "COMMENT {comment}");
        }
        line(text, "CREATION_DATE", &self.created.to_string());
        line(text, "ORIGINATOR", "REMORA");
        let _ = writeln!(text, "\nMETA_START");
        let of = |word: &Option<String>, otherwise: &str| word.clone().unwrap_or(otherwise.into());
        line(text, "OBJECT_NAME", &of(&self.named().name, &self.of.name().to_uppercase()));
        line(text, "OBJECT_ID", &of(&self.named().designator, "UNKNOWN"));
        line(text, "CENTER_NAME", self.center);
    }

    /// The times that rows span.
    fn span(&self, text: &mut String, rows: &[Row]) {
        let at = |row: Option<&Row>| self.epoch.after(row.map_or(0, |row| row.micros)).to_string();
        line(text, "TIME_SYSTEM", "UTC");
        line(text, "START_TIME", &at(rows.first()));
        line(text, "STOP_TIME", &at(rows.last()));
    }
}

/// A key with its value; a key that has its value in it stands alone.
fn line(text: &mut String, key: &str, value: &str) {
    let _ = match value {
        "" => writeln!(text, "{key}"),
        _ => writeln!(text, "{key} = {value}"),
    };
}

/// An orbit's ephemeris: kilometres, and kilometres a second.
pub fn oem(heading: &Heading<'_>, rows: &[Row]) -> String {
    let mut text = String::new();
    heading.begin(&mut text, "CCSDS_OEM_VERS = 2.0");
    line(&mut text, "REF_FRAME", &heading.chief.frame);
    heading.span(&mut text, rows);
    line(&mut text, "INTERPOLATION", "HERMITE");
    // Two rows, each with its velocity: no interpolation goes over a node, where the force changes.
    line(&mut text, "INTERPOLATION_DEGREE", "3");
    text.push_str("META_STOP\n\n");
    for row in rows {
        let _ = write!(text, "{}", heading.epoch.after(row.micros));
        numbers(&mut text, &row.position, 16, 9);
        numbers(&mut text, &row.velocity, 17, 12);
        text.push('\n');
    }
    text
}

/// Metres as kilometres, in columns.
fn numbers(text: &mut String, metres: &Vector3<f64>, width: usize, digits: usize) {
    for number in metres.iter() {
        let _ = write!(text, " {:width$.digits$}", number / 1000.0);
    }
}

/// An attitude's ephemeris: quaternions from the inertial axes to the body's, scalar last.
///
/// The quaternion of that rotation, as CCSDS means it, has the components of the one that turns body
/// components into inertial ones, as ours does: the inertial axes are turned by it into the body's.
pub fn aem(heading: &Heading<'_>, rows: &[Row]) -> String {
    let mut text = String::new();
    heading.begin(&mut text, "CCSDS_AEM_VERS = 1.0");
    line(&mut text, "REF_FRAME_A", &heading.chief.frame);
    line(&mut text, "REF_FRAME_B", "SC_BODY_1");
    line(&mut text, "ATTITUDE_DIR", "A2B");
    heading.span(&mut text, rows);
    line(&mut text, "ATTITUDE_TYPE", "QUATERNION");
    line(&mut text, "QUATERNION_TYPE", "LAST");
    line(&mut text, "INTERPOLATION_METHOD", "LINEAR");
    line(&mut text, "INTERPOLATION_DEGREE", "1");
    text.push_str("META_STOP\n\nDATA_START\n");
    for row in rows {
        let _ = write!(text, "{}", heading.epoch.after(row.micros));
        for component in row.attitude.iter() {
            let _ = write!(text, " {component:16.13}");
        }
        text.push('\n');
    }
    text.push_str("DATA_STOP\n");
    text
}
