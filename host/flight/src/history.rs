//! One flight over time: a row a second.

use crate::flight::Moment;
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Cell, Column, Kind, parquet_table, write_atomically};
use remora_host::journal::Heading;
use remora_host::rows_file::{self, Entries, RowsFile};
use remora_web::{FlightTrack, Instant};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The `format` of histories.
const FORMAT: &str = "remora-history/2";

/// Components of quaternions, in the names of columns.
const QUATERNION: [&str; 4] = ["x", "y", "z", "w"];
/// Axes, in the names of columns.
const RTN: [&str; 3] = ["r", "t", "n"];
const XYZ: [&str; 3] = ["x", "y", "z"];

/// One instant of a flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// When [s].
    pub time_s: f64,
    /// End effector from the port, target's axes [m].
    pub tip_target_m: [f64; 3],
    /// Its speed relative to the port [m/s].
    pub speed_m_s: f64,
    /// Angle between the approach axis and the port's [rad].
    pub angle_rad: f64,
    /// Angles of the joints [rad], rates [rad/s], commanded torques [N m].
    pub joints: [Vec<f64>; 3],
    /// Commanded force, RTN [N].
    pub force_n: [f64; 3],
    /// Commanded bus torque, bus axes [N m].
    pub bus_torque_n_m: [f64; 3],
    /// Tracking errors: position [m], attitude [rad], the joint farthest off [rad].
    pub tracking: [f64; 3],
    /// Target's attitude from what the plan expects [rad].
    pub target_rad: f64,
    /// Code of the mode.
    pub mode: u32,
    /// Centre of the bus from the target's, RTN [m].
    pub bus_m: [f64; 3],
    /// Attitude of the bus, body to RTN.
    pub bus_attitude: [f64; 4],
    /// Attitude of the target, body to RTN.
    pub target_attitude: [f64; 4],
}

impl Sample {
    /// Of a moment of an arm of which the first `joints` are the mission's.
    pub fn of<const NL: usize>(moment: &Moment<'_, NL>, joints: usize) -> Self {
        let Moment { view, frame, command, .. } = moment;
        let axes = quaternion::rotation_matrix(&Vector4::from(view.target.attitude));
        let seen: Vector3<f64> = axes.tr_mul(&(view.tip - view.port));
        let torque = &command.control.joint_torque;
        let first = |values: &[f64]| values.iter().take(joints).copied().collect();
        let to_rtn = quaternion::from_rotation_matrix(&frame.axes.transpose());
        let in_rtn = |attitude| quaternion::product(&to_rtn, &Vector4::from(attitude)).data.0[0];
        Self {
            time_s: view.time,
            tip_target_m: seen.data.0[0],
            speed_m_s: view.relative_speed(),
            angle_rad: view.angle(),
            joints: [first(&view.joint_angle), first(&view.joint_rate), first(torque.as_slice())],
            force_n: command.force.data.0[0],
            bus_torque_n_m: command.control.bus_torque.data.0[0],
            tracking: [command.error.position, command.error.attitude, command.error.joint],
            target_rad: command.error.target,
            mode: command.mode as u32,
            bus_m: frame.axes.tr_mul(&view.bus_position).data.0[0],
            bus_attitude: in_rtn(view.attitude),
            target_attitude: in_rtn(view.target.attitude),
        }
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        let mut push = |name: String, unit: &'static str, value: f64| {
            columns.push(Column { name, unit, cell: Cell::Number(value) });
        };
        push("time_s".into(), "s", self.time_s);
        for (axis, value) in XYZ.iter().zip(self.tip_target_m) {
            push(format!("tip_target_{axis}_m"), "m", value);
        }
        push("speed_m_s".into(), "m/s", self.speed_m_s);
        push("angle_rad".into(), "rad", self.angle_rad);
        let names = [("joint_angle", "rad"), ("joint_rate", "rad/s"), ("joint_torque", "N m")];
        for ((name, unit), values) in names.into_iter().zip(&self.joints) {
            for (i, value) in values.iter().enumerate() {
                push(format!("{name}[{i}]"), unit, *value);
            }
        }
        for (axis, value) in RTN.iter().zip(self.force_n) {
            push(format!("force_{axis}_n"), "N", value);
        }
        for (axis, value) in XYZ.iter().zip(self.bus_torque_n_m) {
            push(format!("bus_torque_{axis}_n_m"), "N m", value);
        }
        push("tracking_position_m".into(), "m", self.tracking[0]);
        push("tracking_attitude_rad".into(), "rad", self.tracking[1]);
        push("tracking_joint_rad".into(), "rad", self.tracking[2]);
        push("target_rad".into(), "rad", self.target_rad);
        for (axis, value) in RTN.iter().zip(self.bus_m) {
            push(format!("bus_{axis}_m"), "m", value);
        }
        let attitudes = [("bus", self.bus_attitude), ("target", self.target_attitude)];
        for (body, attitude) in attitudes {
            for (part, value) in QUATERNION.iter().zip(attitude) {
                push(format!("{body}_attitude_{part}"), "", value);
            }
        }
        columns.push(Column {
            name: "mode".into(),
            unit: "",
            cell: Cell::Integer(self.mode.into()),
        });
        columns
    }
}

impl From<&Sample> for Instant {
    fn from(sample: &Sample) -> Self {
        Self {
            time_s: sample.time_s,
            bus_m: sample.bus_m,
            bus_attitude: sample.bus_attitude,
            target_attitude: sample.target_attitude,
            joints: sample.joints.clone(),
            force_n: sample.force_n,
            bus_torque_n_m: sample.bus_torque_n_m,
        }
    }
}

/// A run as pages show it.
pub fn shown(run: u64, history: &[Sample]) -> FlightTrack {
    let instants: Vec<Instant> = history.iter().map(Instant::from).collect();
    FlightTrack::new(format!("run {run}"), &instants)
}

/// A history's first line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HistoryHeader {
    format: String,
    run: u64,
    scenario: String,
}

impl Heading for HistoryHeader {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "flight";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let is_other = (self.run, &self.scenario) != (begun.run, &begun.scenario);
        is_other.then(|| ("run", "is of another flight".into()))
    }
}

/// Writes a history as a Parquet file, and beside it as rows (`*.jsonl`) for [`read`]; each whole or not at all.
///
/// # Errors
/// The file with the reason why it cannot be written.
pub fn write(table: &Path, history: &[Sample], (run, scenario): (u64, &str)) -> Result<(), Error> {
    let columns: Vec<Vec<Column>> = history.iter().map(Sample::columns).collect();
    let entries = vec![
        ("remora.format", FORMAT.to_string()),
        ("remora.run", run.to_string()),
        ("remora.scenario", scenario.to_string()),
    ];
    let bytes = parquet_table(&columns, entries)
        .map_err(|error| Error::Output { file: table.into(), reason: error.to_string() })?;
    write_atomically(table, &bytes)?;
    let header = HistoryHeader { format: FORMAT.into(), run, scenario: scenario.into() };
    let rows = history.iter().map(Ok);
    rows_file::write(&table.with_extension("jsonl"), &header, &Entries::new(), &[], rows)
}

/// A history as pages show it, with its scenario's id.
///
/// # Errors
/// The file with what is wrong with it: another kind of file, another format, damage.
pub fn read(file: &Path) -> Result<(String, FlightTrack), Error> {
    read_rows(file).map_err(|error| Kind::History.unless_other(file, error))
}

fn read_rows(file: &Path) -> Result<(String, FlightTrack), Error> {
    let rows = RowsFile::<HistoryHeader>::open(file)?;
    let HistoryHeader { run, scenario, .. } = &rows.header;
    let (name, scenario) = (format!("run {run}"), scenario.clone());
    let mut instants: Vec<Instant> = Vec::new();
    rows.each(|sample: Sample| {
        let count = instants.first().map_or(sample.joints[0].len(), |first| first.joints[0].len());
        if sample.joints.iter().any(|joints| joints.len() != count) {
            return Err(FieldError::new("joints", format!("has not {count} numbers of each")));
        }
        instants.push(Instant::from(&sample));
        Ok(())
    })?;
    Ok((scenario, FlightTrack::new(name, &instants)))
}
