//! The pages of the last audit, as they are kept with the sources.

use std::fs;
use std::path::{Path, PathBuf};
use xtask::audit::budgets::Budgets;
use xtask::audit::record::{Record, TABLES};
use xtask::audit::{kept, requirements};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A folder with the pages and the record, to change something in.
fn copy() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(root().join("docs/audit")).unwrap().flatten() {
        fs::copy(entry.path(), dir.path().join(entry.file_name())).unwrap();
    }
    dir
}

fn faults(out: &Path) -> Vec<String> {
    let rows = requirements::read(&root()).unwrap();
    let texts = requirements::texts(&root(), &rows);
    kept(out, &Budgets::read(&root()).unwrap(), &rows, &texts).unwrap().faults
}

/// Pages, budgets and requirements are those of the record. The page of requirements is written
/// anew where `REMORA_WRITE_REQUIREMENTS` is set.
#[test]
fn the_pages_are_as_the_audit_wrote_them() {
    let out = root().join("docs/audit");
    if std::env::var_os("REMORA_WRITE_REQUIREMENTS").is_some() {
        let rows = requirements::read(&root()).unwrap();
        let page = requirements::page(&rows, &requirements::texts(&root(), &rows));
        fs::write(out.join("requirements.md"), page.markdown()).unwrap();
    }
    let found = faults(&out);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn what_was_edited_by_hand_is_named() {
    let dir = copy();
    for page in ["latency.md", "latency-rk4.svg", "requirements.md"] {
        let file = dir.path().join(page);
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, format!("{text}\n")).unwrap();
    }
    fs::remove_file(dir.path().join("loops.md")).unwrap();
    let found = faults(dir.path()).join("\n");
    for page in ["latency.md", "latency-rk4.svg", "requirements", "loops.md"] {
        assert!(found.contains(&format!("page {page}: not")), "{page}\n{found}");
    }
    assert!(!found.contains("memory.md"), "{found}");
}

#[test]
fn a_budget_that_changed_since_is_named() {
    let dir = copy();
    let file = dir.path().join("record.csv");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("budgets,host,stack_bound_bytes,", "budgets,host,gone,"))
        .unwrap();
    let found = faults(dir.path()).join("\n");
    assert!(found.contains("budgets of host, stack_bound_bytes: "), "{found}");
    assert!(found.contains("budgets of host, gone: nothing"), "{found}");
}

/// Each page is what a review board reads; all numbers are in the record.
#[test]
fn pages_are_short() {
    for entry in fs::read_dir(root().join("docs/audit")).unwrap().flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            let words = fs::read_to_string(&path).unwrap().split_whitespace().count();
            assert!(words < 800, "{}: {words} words", path.display());
        }
    }
}

/// What a check makes again is all in the record, and the numbers themselves are not kept.
#[test]
fn the_record_holds_what_a_check_makes_again() {
    let out = root().join("docs/audit");
    let record = Record::read(&out).unwrap().unwrap();
    for part in ["budgets", "envelope", "injection", "instructions", "loops", "memory", "parts"] {
        assert!(record.part(part).count() > 0, "nothing of {part}");
    }
    for part in ["memory", "instructions", "latency", "injection"] {
        let of = format!("{part}: ");
        assert!(record.part(TABLES).any(|(key, _)| key.of.starts_with(&of)), "no table of {part}");
    }
    for target in ["thumbv7em-none-eabihf", "aarch64-unknown-none", "riscv64gc-unknown-none-elf"] {
        let bound = record.get("memory", target, "stack bound of plan [bytes]");
        assert!(bound.is_some_and(|bytes| bytes.parse::<u64>().is_ok()), "{target}: {bound:?}");
    }
    assert!(!out.join("audit.json").exists() && !out.join("audit.html").exists());
}
