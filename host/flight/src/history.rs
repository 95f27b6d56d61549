//! One flight over time: a row a second.

use crate::flight::Moment;
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_host::error::Error;
use remora_host::formats::{Cell, Column, parquet_table, write_atomically};
use std::path::Path;

/// One instant of a flight.
#[derive(Clone, Debug, PartialEq)]
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
}

impl Sample {
    /// Of a moment of an arm of which the first `joints` are the mission's.
    pub fn of<const NL: usize>(moment: &Moment<'_, NL>, joints: usize) -> Self {
        let Moment { view, command, .. } = moment;
        let axes = quaternion::rotation_matrix(&Vector4::from(view.target.attitude));
        let seen: Vector3<f64> = axes.tr_mul(&(view.tip - view.port));
        let torque = &command.control.joint_torque;
        let first = |values: &[f64]| values.iter().take(joints).copied().collect();
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
        }
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        let mut push = |name: String, unit: &'static str, value: f64| {
            columns.push(Column { name, unit, cell: Cell::Number(value) });
        };
        push("time_s".into(), "s", self.time_s);
        for (axis, value) in ["x", "y", "z"].iter().zip(self.tip_target_m) {
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
        for (axis, value) in ["r", "t", "n"].iter().zip(self.force_n) {
            push(format!("force_{axis}_n"), "N", value);
        }
        for (axis, value) in ["x", "y", "z"].iter().zip(self.bus_torque_n_m) {
            push(format!("bus_torque_{axis}_n_m"), "N m", value);
        }
        push("tracking_position_m".into(), "m", self.tracking[0]);
        push("tracking_attitude_rad".into(), "rad", self.tracking[1]);
        push("tracking_joint_rad".into(), "rad", self.tracking[2]);
        push("target_rad".into(), "rad", self.target_rad);
        columns.push(Column {
            name: "mode".into(),
            unit: "",
            cell: Cell::Integer(self.mode.into()),
        });
        columns
    }
}

/// Writes a history as a Parquet file, whole or not at all.
///
/// # Errors
/// The file with the reason why it cannot be written.
pub fn write(file: &Path, history: &[Sample], run: u64) -> Result<(), Error> {
    let table: Vec<Vec<Column>> = history.iter().map(Sample::columns).collect();
    let entries =
        vec![("remora.format", "remora-history/1".to_string()), ("remora.run", run.to_string())];
    let bytes = parquet_table(&table, entries)
        .map_err(|error| Error::Output { file: file.into(), reason: error.to_string() })?;
    write_atomically(file, &bytes)
}
