//! Requirements against what verifies them, and rules of the source that no compiler checks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use xtask::audit::record::{Record, TABLES};
use xtask::audit::requirements::{faults, read};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_requirement_has_a_living_reference_and_no_test_names_another() {
    let requirements = read(&root()).unwrap();
    let faults = faults(&root(), &requirements).unwrap();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(requirements.len() >= 30);
}

/// Numbers of a row by their names: `n 60; min 1.2`.
fn numbers(value: &str) -> BTreeMap<&str, f64> {
    let each = value.split("; ").filter_map(|number| number.split_once(' '));
    each.filter_map(|(name, number)| Some((name, number.parse().ok()?))).collect()
}

/// What cannot be is a p99.9 of fewer than a thousand plans: `docs/evidence/limitations.md` says so.
// Verifies REM-TIM-001.
#[test]
fn latency_is_reported_with_every_quantile_that_can_be() {
    let record = Record::read(&root().join("docs/evidence")).unwrap().unwrap();
    let columns = ["min", "median", "p95", "p99", "p99.9", "max", "jitter"];
    for heading in [
        "Whole plan on one core [ms]",
        "Whole plan on two cores [ms]",
        "Whole plan while the other core plans too [ms]",
        "Phases of a plan on one core, rk4-optimal-model [ms]",
        "Phases of a plan on two cores, rk4-optimal-model [ms]",
    ] {
        let of = format!("latency: {heading}");
        let rows: Vec<_> = record.part(TABLES).filter(|(key, _)| key.of == of).collect();
        assert!(rows.len() >= 8, "{heading}: {}", rows.len());
        for (_, row) in rows {
            let numbers = numbers(row);
            for column in columns.into_iter().filter(|name| *name != "p99.9" || numbers["n"] >= 1e3)
            {
                let value = numbers.get(column);
                assert!(value.is_some_and(|value| *value >= 0.0), "{heading}, {column}: {row}");
            }
        }
    }
}

/// The compiler denies unsafe code but where a module allows it: vector instructions, and the door for C.
// Verifies REM-SAF-003.
#[test]
fn unsafe_code_is_where_it_may_be() {
    fn look(folder: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                look(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                if text.contains("allow(unsafe_code)") || text.contains("expect(unsafe_code)") {
                    let name = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
                    found.push(name.replace('\\', "/"));
                }
            }
        }
    }
    let mut found = Vec::new();
    for folder in ["core", "host"] {
        look(&root().join(folder), &mut found);
    }
    assert!(
        found.iter().all(|file| file.starts_with("core/nn/src/kernels/")
            || file == "core/qp/src/simd.rs"
            || file.starts_with("core/capi/")
            || file == "host/xtask/tests/requirements.rs"),
        "{found:?}"
    );
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    assert!(manifest.contains("unsafe_code = \"deny\""));
    for root_file in [
        "core/src/lib.rs",
        "host/library/src/lib.rs",
        "host/src/lib.rs",
        "host/src/main.rs",
        "host/xtask/src/lib.rs",
        "host/xtask/src/main.rs",
    ] {
        let text = std::fs::read_to_string(root().join(root_file)).unwrap();
        assert!(text.contains("#![forbid(unsafe_code)]"), "{root_file}");
    }
}
