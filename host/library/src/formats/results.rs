//! Campaign results: one row a scenario, as Parquet and as CSV.

use super::{PlanClearances, PlanFile, PlanStatus, PlanVerdict};
use crate::method::Method;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use remora_core::advanced::model::Refusal;
use remora_core::advanced::stages::Residuals;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt::Write;
use std::sync::Arc;

/// What a campaign keeps of one plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Id of the scenario.
    pub scenario: String,
    /// The worse of the stages'; infeasible where it was refused before planning.
    pub status: PlanStatus,
    /// What the plan is good for.
    pub verdict: PlanVerdict,
    /// Name of what makes a plan not flyable: the constraint for which it was refused, or the
    /// residual farthest beyond its tolerance. Empty where it can be flown.
    pub reason: String,
    /// What Stage 2 started from: heuristic, model, or fallback where a model was asked for.
    pub warm_start: String,
    /// Stage 1.
    pub stage1: StageRow,
    /// Stage 2.
    pub stage2: StageRow,
    /// Time in a learned warm start [s].
    #[serde(deserialize_with = "number")]
    pub inference_s: f64,
    /// The residuals in the order of the plan file.
    #[serde(deserialize_with = "numbers")]
    pub residuals: [f64; Residuals::COUNT],
    /// How near bodies come to each other.
    pub clearances: PlanClearances,
}

/// What a campaign keeps of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageRow {
    /// Iterations.
    pub iterations: u64,
    /// Second-order corrections beside them; in the summary, not in the table.
    pub corrections: u64,
    /// Cost.
    #[serde(deserialize_with = "number")]
    pub cost: f64,
    /// Time of the whole stage [s].
    #[serde(deserialize_with = "number")]
    pub time_s: f64,
}

/// JSON has no NaN: it is written as null.
fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

fn numbers<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error>
where
    [Option<f64>; N]: Deserialize<'de>,
{
    let values = <[Option<f64>; N]>::deserialize(from)?;
    Ok(values.map(|value| value.unwrap_or(f64::NAN)))
}

/// The start of what was refused before planning.
const UNPLANNED: &str = "none";

impl Row {
    /// The row of a plan; the corrections are not in its file, nor what it fails by.
    pub fn new(plan: &PlanFile, corrections: (u64, u64), reason: Option<&str>) -> Self {
        let (one, two) = (&plan.stage1, &plan.stage2);
        let residuals = Residuals::from(plan.residuals).against(&Default::default());
        Self {
            scenario: plan.scenario.clone(),
            status: plan.status,
            verdict: plan.verdict.unwrap_or(PlanVerdict::NotFlyable),
            reason: reason.unwrap_or_default().into(),
            warm_start: plan.warm_start.clone(),
            stage1: StageRow {
                iterations: one.iterations,
                corrections: corrections.0,
                cost: one.cost,
                time_s: one.time_s,
            },
            stage2: StageRow {
                iterations: two.iterations,
                corrections: corrections.1,
                cost: two.cost,
                time_s: two.time_s,
            },
            inference_s: two.inference_s,
            residuals: residuals.map(|(_, value, _)| value),
            clearances: plan.clearances.unwrap_or_else(PlanClearances::none),
        }
    }

    /// The row of a scenario that was refused before planning: no iteration, no time, no number.
    pub fn refused(scenario: &str, refusal: &Refusal) -> Self {
        let stage = StageRow { iterations: 0, corrections: 0, cost: f64::NAN, time_s: 0.0 };
        Self {
            scenario: scenario.into(),
            status: PlanStatus::Infeasible,
            verdict: PlanVerdict::NotFlyable,
            reason: refusal.name().into(),
            warm_start: UNPLANNED.into(),
            stage1: stage,
            stage2: stage,
            inference_s: 0.0,
            residuals: [f64::NAN; Residuals::COUNT],
            clearances: PlanClearances::none(),
        }
    }

    /// Whether it was refused before planning: then Stage 2 started from nothing.
    pub fn is_refused(&self) -> bool {
        self.warm_start == UNPLANNED
    }
}

/// A cell of the table.
#[derive(Clone, Debug, PartialEq)]
enum Cell {
    Text(String),
    Integer(i64),
    Number(f64),
}

impl Cell {
    fn physical(&self) -> Physical {
        match self {
            Self::Text(_) => Physical::BYTE_ARRAY,
            Self::Integer(_) => Physical::INT64,
            Self::Number(_) => Physical::DOUBLE,
        }
    }
}

/// Number of columns.
pub const COLUMNS: usize = 21 + Residuals::COUNT;

/// A row with the names of its columns, in order.
fn cells(row: &Row, method: &Method) -> Vec<(String, Cell)> {
    let text = |text: &str| Cell::Text(text.to_string());
    let count = |n: u64| Cell::Integer(i64::try_from(n).unwrap_or(i64::MAX));
    let mut cells = Vec::with_capacity(COLUMNS);
    let mut push = |name: &str, cell: Cell| cells.push((name.to_string(), cell));
    push("scenario", text(&row.scenario));
    push("status", text(row.status.name()));
    push("stage1_iterations", count(row.stage1.iterations));
    push("stage1_cost", Cell::Number(row.stage1.cost));
    push("stage1_time_s", Cell::Number(row.stage1.time_s));
    push("stage2_iterations", count(row.stage2.iterations));
    push("stage2_cost", Cell::Number(row.stage2.cost));
    push("stage2_time_s", Cell::Number(row.stage2.time_s));
    push("inference_s", Cell::Number(row.inference_s));
    let names = Residuals::default().against(&Default::default());
    for ((name, _, _), value) in names.iter().zip(row.residuals) {
        push(&format!("residual_{name}"), Cell::Number(value));
    }
    push("verdict", text(row.verdict.name()));
    push("reason", text(&row.reason));
    for (name, closest) in row.clearances.named() {
        let distance = closest.distance_m.unwrap_or(f64::INFINITY);
        push(&format!("clearance_{name}_m"), Cell::Number(distance));
        push(&format!("clearance_{name}_time_s"), Cell::Number(closest.time_s));
    }
    push("mode", text(method.mode.name()));
    push("warm_start", text(&row.warm_start));
    push("qp", text(method.qp.name()));
    push("integrator", text(&method.integrator.to_string()));
    cells
}

/// The table as CSV, with a header line. Numbers read back bit for bit.
pub fn csv(rows: &[Row], method: &Method) -> String {
    let mut out = String::new();
    for (i, row) in rows.iter().enumerate() {
        let cells = cells(row, method);
        if i == 0 {
            let names: Vec<&str> = cells.iter().map(|(name, _)| name.as_str()).collect();
            out.push_str(&names.join(","));
            out.push('\n');
        }
        for (j, (_, cell)) in cells.iter().enumerate() {
            let comma = if j == 0 { "" } else { "," };
            // No cell needs quotes: ids and names are letters, digits, '-', '_', '.' and ':'.
            let _ = match cell {
                Cell::Text(text) => write!(out, "{comma}{text}"),
                Cell::Integer(n) => write!(out, "{comma}{n}"),
                Cell::Number(x) => write!(out, "{comma}{x:?}"),
            };
        }
        out.push('\n');
    }
    out
}

/// The table as a Parquet file: uncompressed, one row group, strings, 64-bit integers and doubles.
///
/// # Errors
/// Where there is no row, or too much of them for memory.
pub fn parquet_bytes(rows: &[Row], method: &Method) -> Result<Vec<u8>, ParquetError> {
    let table: Vec<Vec<(String, Cell)>> = rows.iter().map(|row| cells(row, method)).collect();
    let first = table.first().ok_or_else(|| ParquetError::General("no rows".into()))?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema(first)?, properties)?;
    let mut group = writer.next_row_group()?;
    for j in 0..first.len() {
        write_column(&mut group, table.iter().map(|row| &row[j].1))?;
    }
    group.close()?;
    writer.into_inner()
}

fn schema(columns: &[(String, Cell)]) -> Result<TypePtr, ParquetError> {
    let column = |(name, cell): &(String, Cell)| {
        let string = matches!(cell, Cell::Text(_)).then_some(LogicalType::String);
        let column = Type::primitive_type_builder(name, cell.physical())
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(string)
            .build()?;
        Ok(Arc::new(column))
    };
    let fields = columns.iter().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
    Ok(Arc::new(Type::group_type_builder("results").with_fields(fields).build()?))
}

/// Writes the next column of a row group.
fn write_column<'a>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    cells: impl Iterator<Item = &'a Cell>,
) -> Result<(), ParquetError> {
    let (mut texts, mut integers, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
    for cell in cells {
        match cell {
            Cell::Text(text) => texts.push(ByteArray::from(text.as_str())),
            Cell::Integer(n) => integers.push(*n),
            Cell::Number(x) => numbers.push(*x),
        }
    }
    let missing = || ParquetError::General("fewer columns than the schema has".into());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    if !texts.is_empty() {
        column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
    } else if !integers.is_empty() {
        column.typed::<Int64Type>().write_batch(&integers, None, None)?;
    } else {
        column.typed::<DoubleType>().write_batch(&numbers, None, None)?;
    }
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::PlanClosest;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    fn rows() -> Vec<Row> {
        let stage = StageRow { iterations: 4, corrections: 1, cost: 1.0 / 3.0, time_s: 2e-7 };
        let row = Row {
            scenario: "a".into(),
            status: PlanStatus::Solved,
            verdict: PlanVerdict::Optimal,
            reason: String::new(),
            warm_start: "fallback".into(),
            stage1: stage,
            stage2: StageRow { iterations: 9, corrections: 3, cost: 0.1, time_s: 0.25 },
            inference_s: 0.0,
            residuals: std::array::from_fn(|i| 1e-9 * i as f64),
            clearances: PlanClearances {
                arm: PlanClosest { distance_m: Some(0.25), time_s: 1180.5, body: 2 },
                ..PlanClearances::none()
            },
        };
        let mut other = row.clone();
        other.scenario = "b-2".into();
        other.status = PlanStatus::IterationLimit;
        other.residuals[3] = f64::NAN;
        let limit = 1.46;
        vec![row, other, Row::refused("c", &Refusal::KeepOut { distance: 1.0, limit })]
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
            clearance_own_m,clearance_own_time_s,mode,warm_start,qp,integrator";
        assert_eq!(text.lines().next().unwrap(), header);
        assert_eq!(header.split(',').count(), COLUMNS);
        let first = text.lines().nth(1).unwrap();
        assert!(first.starts_with("a,solved,4,0.3333333333333333,2e-7,9,0.1,0.25,0.0,0.0,1e-9,"));
        assert!(first.ends_with(",optimal,fallback,embedded,rk4"));
        assert!(first.contains(",optimal,,0.25,1180.5,inf,0.0,inf,0.0,optimal,"), "{first}");
        let refused = text.lines().nth(3).unwrap();
        assert!(refused.starts_with("c,infeasible,0,NaN,0.0,0,NaN,"), "{refused}");
        assert!(refused.contains(",NaN,not_flyable,keep_out,inf,"), "{refused}");
    }

    #[test]
    fn parquet_reads_back() {
        let (rows, method) = (rows(), Method::default());
        let bytes = parquet_bytes(&rows, &method).unwrap();
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let mut read = 0;
        for (row, expected) in reader.get_row_iter(None).unwrap().zip(&rows) {
            let row = row.unwrap();
            let columns: Vec<_> = row.get_column_iter().collect();
            let expected = cells(expected, &method);
            assert_eq!(columns.len(), expected.len());
            for ((name, field), (expected_name, cell)) in columns.iter().zip(&expected) {
                assert_eq!(*name, expected_name);
                match (field, cell) {
                    (Field::Str(a), Cell::Text(b)) => assert_eq!(a, b),
                    (Field::Long(a), Cell::Integer(b)) => assert_eq!(a, b),
                    (Field::Double(a), Cell::Number(b)) => assert_eq!(a.to_bits(), b.to_bits()),
                    other => panic!("{name}: {other:?}"),
                }
            }
            read += 1;
        }
        assert_eq!(read, rows.len());
        assert!(parquet_bytes(&[], &method).is_err());
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
