//! The page of the last audit, as it is kept with the sources.

use std::fs;
use std::path::{Path, PathBuf};
use xtask::audit::budgets::Budgets;
use xtask::audit::record::{Record, TABLES};
use xtask::audit::{kept, requirements};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A folder with the page, its plots and the record, to change something in.
fn copy() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(root().join("docs/evidence")).unwrap().flatten() {
        fs::copy(entry.path(), dir.path().join(entry.file_name())).unwrap();
    }
    dir
}

fn faults(out: &Path) -> Vec<String> {
    let rows = requirements::read(&root()).unwrap();
    let texts = requirements::texts(&root(), &rows);
    kept(out, &Budgets::read(&root()).unwrap(), &rows, &texts).unwrap().faults
}

/// Page, budgets and requirements are those of the record. The section of requirements is written
/// anew where `REMORA_WRITE_REQUIREMENTS` is set.
#[test]
fn the_page_is_as_the_audit_wrote_it() {
    let out = root().join("docs/evidence");
    if std::env::var_os("REMORA_WRITE_REQUIREMENTS").is_some() {
        let rows = requirements::read(&root()).unwrap();
        let section = requirements::page(&rows, &requirements::texts(&root(), &rows)).section();
        let file = out.join(requirements::RESULTS);
        let page = fs::read_to_string(&file).unwrap();
        fs::write(&file, format!("{}{section}", requirements::split(&page).0)).unwrap();
    }
    let found = faults(&out);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn what_was_edited_by_hand_is_named() {
    let dir = copy();
    let change = |name: &str, change: &dyn Fn(String) -> String| {
        let file = dir.path().join(name);
        fs::write(&file, change(fs::read_to_string(&file).unwrap())).unwrap();
    };
    let named = || {
        let found = faults(dir.path());
        let page =
            |line: &String| Some(line.strip_prefix("page ")?.split(": not").next()?.to_string());
        assert!(found.iter().all(|line| line.contains(": not")), "{found:?}");
        found.iter().filter_map(page).collect::<Vec<_>>()
    };
    change("results.md", &|text| text + "\n");
    assert_eq!(named(), ["requirements"]);
    change("results.md", &|text| text.replacen("## Loops\n", "## Loops\n\n", 1));
    change("latency-rk4.svg", &|text| text + "\n");
    fs::remove_file(dir.path().join("memory-split.svg")).unwrap();
    let expected = ["latency-rk4.svg", "memory-split.svg", "results.md", "requirements"];
    assert_eq!(named(), expected);
    fs::remove_file(dir.path().join("results.md")).unwrap();
    assert_eq!(named(), expected);
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

/// The page is what a review board reads; all numbers are in the record.
#[test]
fn the_page_is_short() {
    let page = fs::read_to_string(root().join("docs/evidence/results.md")).unwrap();
    let words = page.split_whitespace().count();
    assert!(words < 3000, "{words} words");
    let record = Record::read(&root().join("docs/evidence")).unwrap().unwrap();
    for (key, _) in record.part("parts") {
        assert!(page.contains(&format!("](#{})", key.of)), "no section of {}", key.of);
    }
}

/// What a check makes again is all in the record, and the numbers themselves are not kept.
#[test]
fn the_record_holds_what_a_check_makes_again() {
    let out = root().join("docs/evidence");
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
