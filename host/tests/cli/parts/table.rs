//! Rows of parts, read and forged, and their tables.

use super::Bench;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use remora_host::fingerprint::Fnv;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;

/// Lines of a file before its rows: what was asked for, and what else is said of them.
const HEAD: usize = 2;

/// Times of the machine in a row.
const TIMES: [&str; 5] = [
    "/row/stage1/time_s",
    "/row/stage2/time_s",
    "/row/inference_s",
    "/row/time_s",
    "/row/cpu_time_s",
];

fn lines(bench: &Bench, file: &str) -> Vec<String> {
    bench.read(file).lines().map(String::from).collect()
}

/// What was asked for.
pub fn header(bench: &Bench, file: &str) -> String {
    lines(bench, file).swap_remove(0)
}

/// Rows of a part.
pub fn rows_of(bench: &Bench, file: &str) -> Vec<Value> {
    let lines = lines(bench, file);
    lines[HEAD..lines.len() - 1].iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Rows of all parts but for times, sorted.
pub fn rows(bench: &Bench, out: &str) -> Vec<String> {
    let is_part = |name: &String| {
        name.starts_with("part-") && name.ends_with(".jsonl") && !name.contains(".journal.")
    };
    let mut all = Vec::new();
    for name in bench.names(out).into_iter().filter(is_part) {
        for mut row in rows_of(bench, &format!("{out}/{name}")) {
            TIMES.iter().for_each(|path| *row.pointer_mut(path).unwrap() = Value::Null);
            all.push(row.to_string());
        }
    }
    all.sort();
    all
}

/// Whether a forger has thought of the checksum.
#[derive(PartialEq)]
pub enum Sum {
    Stale,
    Right,
}

/// Changes what stands at a path in a part's first row.
pub fn plant(bench: &Bench, file: &str, path: &str, sum: Sum) {
    change(bench, file, path, sum, |value| match value.as_f64() {
        Some(x) => (0.5 * x).into(),
        None => "0123456789abcdef".into(),
    });
}

/// Puts a value into a part's first row, and the checksum that it then has.
pub fn put(bench: &Bench, file: &str, path: &str, value: &Value) {
    change(bench, file, path, Sum::Right, |_| value.clone());
}

fn change(bench: &Bench, file: &str, path: &str, sum: Sum, to: impl FnOnce(&Value) -> Value) {
    let mut lines = lines(bench, file);
    let end = lines.pop().unwrap();
    let mut row: Value = serde_json::from_str(&lines[HEAD]).unwrap();
    let place = row.pointer_mut(path).unwrap();
    *place = to(place);
    lines[HEAD] = row.to_string();
    let text = lines.join("\n") + "\n";
    let mut hash = Fnv::default();
    hash.add(text.as_bytes());
    let said =
        serde_json::from_str::<Value>(&end).unwrap()["checksum"].as_str().unwrap().to_string();
    let end = if sum == Sum::Right { end.replacen(&said, &hash.to_string(), 1) } else { end };
    bench.write(file, &format!("{text}{end}\n"));
}

/// Columns of numbers of a Parquet table, and what it says of itself.
pub fn columns(
    bench: &Bench,
    file: &str,
) -> (BTreeMap<String, Vec<f64>>, BTreeMap<String, String>) {
    let reader = SerializedFileReader::new(fs::File::open(bench.path(file)).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let entries = metadata.key_value_metadata().unwrap().iter();
    let entries = entries.map(|entry| (entry.key.clone(), entry.value.clone().unwrap())).collect();
    let mut columns = BTreeMap::<String, Vec<f64>>::new();
    for row in reader.get_row_iter(None).unwrap() {
        for (name, field) in row.unwrap().get_column_iter() {
            let number = match field {
                Field::Double(x) => *x,
                Field::Long(n) => *n as f64,
                _ => continue,
            };
            columns.entry(name.clone()).or_default().push(number);
        }
    }
    (columns, entries)
}
