//! Requirements against what verifies them, and rules of the source that no compiler checks.

use std::path::{Path, PathBuf};
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

/// Cells of the rows below a heading of the page on latency.
fn rows_below(text: &str, heading: &str) -> Vec<Vec<String>> {
    let mut lines = text.lines().skip_while(|line| *line != format!("## {heading}"));
    assert!(lines.next().is_some(), "{heading}");
    let section = lines.take_while(|line| !line.starts_with('#'));
    let cells = |line: &str| {
        line.trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect()
    };
    section.filter(|line| line.starts_with('|') && !line.contains("---")).map(cells).collect()
}

/// What cannot be is a p99.9 of fewer than a thousand plans: `docs/fell-short.md` says so.
// Verifies REM-TIM-001.
#[test]
fn latency_is_reported_with_every_quantile_that_can_be() {
    let text = std::fs::read_to_string(root().join("docs/audit/latency.md")).unwrap();
    let columns = ["min", "median", "p95", "p99", "p99.9", "max", "jitter"];
    for heading in [
        "Whole plan on one core [ms]",
        "Whole plan on two cores [ms]",
        "Whole plan while the other core plans too [ms]",
        "Phases of a plan on one core, rk4-optimal-model [ms]",
        "Phases of a plan on two cores, rk4-optimal-model [ms]",
    ] {
        let rows = rows_below(&text, heading);
        let (head, rows) = rows.split_first().unwrap();
        assert!(rows.len() >= 8, "{heading}: {}", rows.len());
        let at = |name: &str| head.iter().position(|cell| cell == name).unwrap();
        for row in rows {
            let count: u64 = row[at("n")].parse().unwrap();
            for column in columns.into_iter().filter(|name| *name != "p99.9" || count >= 1000) {
                let value: f64 = row[at(column)].parse().unwrap();
                assert!(value >= 0.0, "{heading}: {row:?}");
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
