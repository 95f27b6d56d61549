//! One flight over time: a row a second.

use crate::flight::Moment;
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_host::error::Error;
use remora_host::formats::{Cell, Column, Numbers, parquet_table, write_atomically};
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

/// Writes a history as a Parquet file, whole or not at all.
///
/// # Errors
/// The file with the reason why it cannot be written.
pub fn write(file: &Path, history: &[Sample], (run, scenario): (u64, &str)) -> Result<(), Error> {
    let table: Vec<Vec<Column>> = history.iter().map(Sample::columns).collect();
    let entries = vec![
        ("remora.format", FORMAT.to_string()),
        ("remora.run", run.to_string()),
        ("remora.scenario", scenario.to_string()),
    ];
    let bytes = parquet_table(&table, entries)
        .map_err(|error| Error::Output { file: file.into(), reason: error.to_string() })?;
    write_atomically(file, &bytes)
}

/// A history as pages show it, with its scenario's id.
///
/// # Errors
/// The file with what is wrong with it: no table, another format, a column that is missing.
pub fn read(file: &Path) -> Result<(String, FlightTrack), Error> {
    let table = Numbers::read(file)?;
    let entry = |key: &str| table.entries.get(key).cloned().unwrap_or_default();
    let format = entry("remora.format");
    if format != FORMAT {
        let reason = format!("is {format:?}: this reader understands {FORMAT:?}; fly it again");
        return Err(Error::input(file, "remora.format", reason));
    }
    let instants = instants(file, &table)?;
    Ok((
        entry("remora.scenario"),
        FlightTrack::new(format!("run {}", entry("remora.run")), &instants),
    ))
}

fn instants(file: &Path, table: &Numbers) -> Result<Vec<Instant>, Error> {
    let column = |name: String| table.column(file, &name);
    let triple = |names: [String; 3]| -> Result<[&[f64]; 3], Error> {
        let [a, b, c] = names.map(column);
        Ok([a?, b?, c?])
    };
    let attitude = |body: &str| -> Result<[&[f64]; 4], Error> {
        let [x, y, z, w] = QUATERNION.map(|part| column(format!("{body}_attitude_{part}")));
        Ok([x?, y?, z?, w?])
    };
    let joints = (0..).take_while(|i| table.columns.contains_key(&format!("joint_angle[{i}]")));
    let count = joints.count();
    let of_joints = |name: &str| -> Result<Vec<&[f64]>, Error> {
        (0..count).map(|i| column(format!("{name}[{i}]"))).collect()
    };
    let times = column("time_s".into())?;
    let bus = triple(RTN.map(|axis| format!("bus_{axis}_m")))?;
    let force = triple(RTN.map(|axis| format!("force_{axis}_n")))?;
    let torque = triple(XYZ.map(|axis| format!("bus_torque_{axis}_n_m")))?;
    let (bus_attitude, target_attitude) = (attitude("bus")?, attitude("target")?);
    let [angle, rate, joint_torque] =
        [of_joints("joint_angle")?, of_joints("joint_rate")?, of_joints("joint_torque")?];
    let row = |k: usize| Instant {
        time_s: times[k],
        bus_m: bus.map(|axis| axis[k]),
        bus_attitude: bus_attitude.map(|part| part[k]),
        target_attitude: target_attitude.map(|part| part[k]),
        joints: [&angle, &rate, &joint_torque]
            .map(|columns| columns.iter().map(|column| column[k]).collect()),
        force_n: force.map(|axis| axis[k]),
        bus_torque_n_m: torque.map(|axis| axis[k]),
    };
    Ok((0..times.len()).map(row).collect())
}
