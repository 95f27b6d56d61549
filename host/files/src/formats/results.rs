//! Campaign results: one row a scenario, as Parquet and as CSV, with units and origin beside them.

use super::table::{Cell, Column, parquet};
use super::{Program, Residuals, Row, results_about};
use crate::method::Method;
use parquet::errors::ParquetError;
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Origin of a table's rows, kept in its metadata.
#[derive(Clone, Debug, PartialEq)]
pub struct TableOrigin {
    /// How the plans were made.
    pub method: Method,
    /// Seed of the scenarios' draw, where they were drawn.
    pub seed: Option<u64>,
    /// Checksum of the mission.
    pub mission_checksum: String,
    /// Program that made the plans.
    pub program: Program,
}

/// Number of columns.
pub const COLUMNS: usize = 38 + Residuals::COUNT;

/// A row with names and units of its columns, in order. New columns go to the end.
pub fn columns(row: &Row, method: &Method) -> Vec<Column> {
    let text = |text: &str| Cell::Text(text.to_string());
    let count = |n: u64| Cell::Integer(i64::try_from(n).unwrap_or(i64::MAX));
    let mut columns = Vec::with_capacity(COLUMNS);
    let mut push = |name: &str, unit: &'static str, cell: Cell| {
        columns.push(Column { name: name.to_string(), unit, cell });
    };
    push("scenario", "", text(&row.scenario));
    push("status", "", text(row.status.name()));
    push("stage1_iterations", "", count(row.stage1.iterations));
    push("stage1_cost", "", Cell::Number(row.stage1.cost));
    push("stage1_time_s", "s", Cell::Number(row.stage1.time_s));
    push("stage2_iterations", "", count(row.stage2.iterations));
    push("stage2_cost", "", Cell::Number(row.stage2.cost));
    push("stage2_time_s", "s", Cell::Number(row.stage2.time_s));
    push("inference_s", "s", Cell::Number(row.inference_s));
    let names = Residuals::default().against(&Default::default());
    for (((name, _, _), unit), value) in names.iter().zip(Residuals::UNITS).zip(row.residuals) {
        push(&format!("residual_{name}"), unit, Cell::Number(value));
    }
    push("verdict", "", text(row.verdict.name()));
    push("reason", "", text(&row.reason));
    for (name, closest) in row.clearances.named() {
        push(&format!("clearance_{name}_m"), "m", Cell::Number(closest.distance));
        push(&format!("clearance_{name}_time_s"), "s", Cell::Number(closest.time_s));
    }
    push("mode", "", text(method.mode.name()));
    push("warm_start", "", text(&row.warm_start));
    push("qp", "", text(method.qp.name()));
    push("integrator", "", text(&method.integrator.to_string()));
    push("verified", "", Cell::Flag(row.is_verified()));
    let flight = &row.flight;
    push("target_rate_rad_s", "rad/s", Cell::Number(flight.target_rate_rad_s));
    push("start_distance_m", "m", Cell::Number(flight.start_distance_m));
    push("peak_force_n", "N", Cell::Number(flight.peak_force_n));
    push("peak_bus_torque_n_m", "N m", Cell::Number(flight.peak_bus_torque_n_m));
    push("peak_joint_torque_n_m", "N m", Cell::Number(flight.peak_joint_torque_n_m));
    push("delta_v_m_s", "m/s", Cell::Number(flight.delta_v_m_s));
    push("clearance_smallest_m", "m", Cell::Number(row.nearest.at.distance));
    push("time_s", "s", Cell::Number(row.time_s));
    push("cpu_time_s", "s", Cell::Number(row.cpu_time_s));
    push("stage1_corrections", "", count(row.stage1.corrections));
    push("stage2_corrections", "", count(row.stage2.corrections));
    push("plan_checksum", "", text(&row.plan_checksum));
    push("clearance_smallest_pair", "", text(&row.nearest.pair));
    push("clearance_smallest_time_s", "s", Cell::Number(row.nearest.at.time_s));
    push("clearance_end_effector_m", "m", Cell::Number(row.end_effector.distance));
    push("clearance_end_effector_time_s", "s", Cell::Number(row.end_effector.time_s));
    columns
}

impl TableOrigin {
    /// The metadata of a Parquet file of rows, but for units.
    pub fn table_entries(&self) -> Vec<(&'static str, String)> {
        self.entries().into_iter().chain(results_about::entries()).collect()
    }

    /// Keys and values, as metadata spells them.
    fn entries(&self) -> Vec<(&'static str, String)> {
        let mut entries = vec![
            ("remora.format", "remora-results/1".to_string()),
            ("remora.version", self.program.version.clone()),
            ("remora.commit", self.program.commit.clone()),
            ("remora.mission_checksum", self.mission_checksum.clone()),
        ];
        entries.extend(self.seed.map(|seed| ("remora.seed", seed.to_string())));
        entries
    }
}

/// The table as CSV, with a header line. Numbers read back bit for bit.
pub fn csv(rows: &[Row], method: &Method) -> String {
    let mut out = String::new();
    for (i, row) in rows.iter().enumerate() {
        let columns = columns(row, method);
        if i == 0 {
            let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
            out.push_str(&names.join(","));
            out.push('\n');
        }
        for (j, column) in columns.iter().enumerate() {
            let comma = if j == 0 { "" } else { "," };
            // No cell needs quotes: ids and names are letters, digits, '-', '_', '.' and ':'.
            let _ = match &column.cell {
                Cell::Text(text) => write!(out, "{comma}{text}"),
                Cell::Integer(n) => write!(out, "{comma}{n}"),
                Cell::Number(x) => write!(out, "{comma}{x:?}"),
                Cell::Flag(is) => write!(out, "{comma}{is}"),
            };
        }
        out.push('\n');
    }
    out
}

/// Metadata of the CSV file: its origin, types and units of its columns. The form is that for
/// tables on the web (W3C, CSVW). None where there is no row.
pub fn csv_metadata(rows: &[Row], origin: &TableOrigin, url: &str) -> Option<Value> {
    let described = |column: &Column| {
        let mut described = json!({ "name": column.name, "datatype": column.cell.datatype() });
        if !column.unit.is_empty() {
            described["schema:unitText"] = column.unit.into();
        }
        described
    };
    let columns: Vec<Value> =
        columns(rows.first()?, &origin.method).iter().map(described).collect();
    let mut metadata = Map::new();
    metadata.insert("@context".into(), "http://www.w3.org/ns/csvw".into());
    metadata.insert("url".into(), url.into());
    for (key, value) in origin.entries() {
        metadata.insert(key.replace('.', ":"), value.into());
    }
    metadata.insert("tableSchema".into(), json!({ "columns": columns, "primaryKey": "scenario" }));
    Some(Value::Object(metadata))
}

/// The table as a Parquet file ([`parquet`]).
///
/// # Errors
/// Where there is no row, or too much of them for memory.
pub fn parquet_bytes(rows: &[Row], origin: &TableOrigin) -> Result<Vec<u8>, ParquetError> {
    let table: Vec<Vec<Column>> = rows.iter().map(|row| columns(row, &origin.method)).collect();
    parquet(&table, origin.table_entries())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::{
        Clearances, Closest, Flight, NamedScenario, Nearest, ScenarioSet, StageRow, Status, Verdict,
    };
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    use remora_core::advanced::model::Refusal;

    fn origin() -> TableOrigin {
        TableOrigin {
            method: Method::default(),
            seed: Some(7),
            mission_checksum: "0123456789abcdef".into(),
            program: Program::this(),
        }
    }

    pub(in crate::formats) fn rows() -> Vec<Row> {
        let stage = StageRow { iterations: 4, corrections: 1, cost: 1.0 / 3.0, time_s: 2e-7 };
        let row = Row {
            scenario: "a".into(),
            status: Status::Solved,
            verdict: Verdict::Optimal,
            reason: String::new(),
            warm_start: "fallback".into(),
            stage1: stage,
            stage2: StageRow { iterations: 9, corrections: 3, cost: 0.1, time_s: 0.25 },
            inference_s: 0.0,
            residuals: std::array::from_fn(|i| 1e-9 * i as f64),
            clearances: Clearances {
                arm: Closest { distance: 0.25, time_s: 1180.5, body: 2 },
                ..Clearances::NONE
            },
            nearest: Nearest {
                at: Closest { distance: 0.75, time_s: 1150.0, body: 2 },
                pair: "link_2:target".into(),
            },
            end_effector: Closest { distance: 0.25, time_s: 1180.5, body: 3 },
            flight: Flight { delta_v_m_s: 0.125, start_distance_m: 5.0, ..Flight::default() },
            time_s: 0.5,
            cpu_time_s: 0.25,
            plan_checksum: "00ff".into(),
        };
        let mut other = row.clone();
        other.scenario = "b-2".into();
        other.status = Status::IterationLimit;
        other.residuals[3] = f64::NAN;
        let limit = 1.46;
        let public = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let scenario = NamedScenario { id: "c".into(), ..public };
        vec![row, other, Row::refused(&scenario, &Refusal::KeepOut { distance: 1.0, limit })]
    }

    #[test]
    fn columns_are_those_of_the_contract() {
        let text = csv(&rows(), &Method::default());
        let header = "scenario,status,stage1_iterations,stage1_cost,stage1_time_s,\
            stage2_iterations,stage2_cost,stage2_time_s,inference_s,residual_dynamics1,\
            residual_keep_out,residual_dynamics2,residual_control,residual_joint,\
            residual_joint_rate,residual_pointing,residual_preset,residual_terminal_rate,\
            residual_ee_position,residual_ee_angle,residual_clearance,verdict,reason,\
            clearance_arm_m,clearance_arm_time_s,clearance_bus_m,clearance_bus_time_s,\
            clearance_own_m,clearance_own_time_s,mode,warm_start,qp,integrator,\
            verified,target_rate_rad_s,start_distance_m,peak_force_n,peak_bus_torque_n_m,\
            peak_joint_torque_n_m,delta_v_m_s,clearance_smallest_m,time_s,cpu_time_s,\
            stage1_corrections,stage2_corrections,plan_checksum,clearance_smallest_pair,\
            clearance_smallest_time_s,clearance_end_effector_m,clearance_end_effector_time_s";
        assert_eq!(text.lines().next().unwrap(), header);
        assert_eq!(header.split(',').count(), COLUMNS);
        let first = text.lines().nth(1).unwrap();
        assert!(first.starts_with("a,solved,4,0.3333333333333333,2e-7,9,0.1,0.25,0.0,0.0,1e-9,"));
        let end = ",optimal,fallback,embedded,rk4,true,0.0,5.0,0.0,0.0,0.0,0.125,0.75,0.5,0.25,1,3,00ff,\
             link_2:target,1150.0,0.25,1180.5";
        assert!(first.ends_with(end), "{first}");
        assert!(first.contains(",optimal,,0.25,1180.5,inf,0.0,inf,0.0,optimal,"), "{first}");
        let refused = text.lines().nth(3).unwrap();
        assert!(refused.starts_with("c,infeasible,0,NaN,0.0,0,NaN,"), "{refused}");
        assert!(refused.contains(",NaN,not_flyable,keep_out,inf,"), "{refused}");
        assert!(
            refused.contains(",rk4,false,")
                && refused.ends_with(",NaN,NaN,NaN,NaN,inf,0.0,0.0,0,0,,,0.0,inf,0.0")
        );
    }

    #[test]
    fn parquet_reads_back() {
        let (rows, method) = (rows(), Method::default());
        let bytes = parquet_bytes(&rows, &origin()).unwrap();
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap();
        let value = |key: &str| {
            let entry = metadata.iter().find(|entry| entry.key == format!("remora.{key}"));
            entry.and_then(|entry| entry.value.clone()).unwrap()
        };
        assert_eq!((value("seed"), value("version")), ("7".into(), Program::this().version));
        let units: Value = serde_json::from_str(&value("units")).unwrap();
        assert_eq!(units["delta_v_m_s"], "m/s");
        let about: Value = serde_json::from_str(&value("about")).unwrap();
        assert_eq!(about["delta_v_m_s"], "force over mass, summed over the plan");
        assert!(value("times").contains("\"cpu_time_s\""));
        assert_eq!(
            (&units["residual_ee_angle"], &units["scenario"]),
            (&"rad".into(), &Value::Null)
        );
        let mut read = 0;
        for (row, expected) in reader.get_row_iter(None).unwrap().zip(&rows) {
            let row = row.unwrap();
            let fields: Vec<_> = row.get_column_iter().collect();
            let expected = columns(expected, &method);
            assert_eq!(fields.len(), expected.len());
            for ((name, field), column) in fields.iter().zip(&expected) {
                assert_eq!(*name, &column.name);
                match (field, &column.cell) {
                    (Field::Str(a), Cell::Text(b)) => assert_eq!(a, b),
                    (Field::Bool(a), Cell::Flag(b)) => assert_eq!(a, b),
                    (Field::Long(a), Cell::Integer(b)) => assert_eq!(a, b),
                    (Field::Double(a), Cell::Number(b)) => assert_eq!(a.to_bits(), b.to_bits()),
                    other => panic!("{name}: {other:?}"),
                }
            }
            read += 1;
        }
        assert_eq!(read, rows.len());
        assert!(parquet_bytes(&[], &origin()).is_err());
    }

    #[test]
    fn metadata_of_csv_names_every_column() {
        let metadata = csv_metadata(&rows(), &origin(), "results.csv").unwrap();
        let columns = metadata["tableSchema"]["columns"].as_array().unwrap();
        let names: Vec<&str> =
            columns.iter().filter_map(|column| column["name"].as_str()).collect();
        let text = csv(&rows(), &Method::default());
        assert_eq!(names.join(","), text.lines().next().unwrap());
        assert_eq!(columns[4]["schema:unitText"], "s");
        assert_eq!(
            (&metadata["remora:seed"], &metadata["url"]),
            (&"7".into(), &"results.csv".into())
        );
        assert!(csv_metadata(&[], &origin(), "results.csv").is_none());
    }

    #[test]
    fn rows_survive_json_even_where_a_number_is_not_one() {
        let rows = rows();
        let back: Row = serde_json::from_str(&serde_json::to_string(&rows[1]).unwrap()).unwrap();
        assert!(back.residuals[3].is_nan());
        let again: Row = serde_json::from_str(&serde_json::to_string(&rows[0]).unwrap()).unwrap();
        assert_eq!(again, rows[0]);
    }
}
