//! Requirements against what verifies them, and rules of the source that no compiler checks.

use remora_audit::requirements::{faults, read};
use std::path::{Path, PathBuf};

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

/// The compiler denies unsafe code but where a module allows it.
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
        found
            .iter()
            .all(|file| file.starts_with("core/nn/src/")
                || *file == "host/audit/tests/requirements.rs"),
        "{found:?}"
    );
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    assert!(manifest.contains("unsafe_code = \"deny\""));
    for root_file in
        ["core/src/lib.rs", "core/qp/src/lib.rs", "host/library/src/lib.rs", "host/src/main.rs"]
    {
        let text = std::fs::read_to_string(root().join(root_file)).unwrap();
        assert!(text.contains("#![forbid(unsafe_code)]"), "{root_file}");
    }
}
