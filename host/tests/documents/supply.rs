//! The dependencies that fly are those of the lock file: the table of `docs/evidence/verification.md` and the bill of
//! materials. `ci/supply.py` writes both.

use crate::pages::root;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

/// Name and version.
type Crate = (String, String);

/// The flight crates and all below them, as Cargo resolves them for this machine: what others need may not be
/// here.
fn resolved() -> BTreeSet<Crate> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    let tree = "tree --locked --offline -p remora-capi -e no-dev --prefix none --format {p}";
    let output = cargo.args(tree.split(' ')).current_dir(root()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let of_line = |line: &str| {
        let mut words = line.split_whitespace();
        Some((words.next()?.to_string(), words.next()?.trim_start_matches('v').to_string()))
    };
    text.lines().filter_map(of_line).collect()
}

/// Checksums in the lock file.
fn checksums() -> BTreeMap<Crate, String> {
    let text = fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let of_package = |package: &str| {
        let value = |key: &str| {
            let line = package.lines().find_map(|line| line.strip_prefix(&format!("{key} = ")))?;
            Some(line.trim_matches('"').to_string())
        };
        Some(((value("name")?, value("version")?), value("checksum")?))
    };
    text.split("[[package]]").filter_map(of_package).collect()
}

#[test]
fn the_bill_of_materials_is_what_flies() {
    let text = fs::read_to_string(root().join("docs/flight.cdx.json")).unwrap();
    let bill: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&bill["bomFormat"], &bill["specVersion"]), (&"CycloneDX".into(), &"1.5".into()));
    let (resolved, sums) = (resolved(), checksums());
    let word = |value: &Value| value.as_str().unwrap_or_default().to_string();
    let mut listed = BTreeSet::new();
    for component in bill["components"].as_array().unwrap() {
        let found = (word(&component["name"]), word(&component["version"]));
        let sum = component["hashes"][0]["content"].as_str();
        assert_eq!(sum, sums.get(&found).map(String::as_str), "{found:?}");
        assert!(!word(&component["licenses"][0]["expression"]).is_empty(), "{found:?}");
        listed.insert(found);
    }
    let mut expected = table();
    expected.extend(resolved.into_iter().filter(|(name, _)| name.starts_with("remora-")));
    assert_eq!(listed, expected, "ci/supply.py writes it");
}

/// The crates of the table.
fn table() -> BTreeSet<Crate> {
    rows("").collect()
}

/// The crates of the table whose row holds a text.
fn rows(holds: &str) -> impl Iterator<Item = Crate> {
    let page = fs::read_to_string(root().join("docs/evidence/verification.md")).unwrap();
    let (_, table) = page.split_once("<!-- table: ci/supply.py -->").unwrap();
    let (table, _) = table.split_once("<!-- end of table -->").unwrap();
    let lines = table.lines().filter(|line| line.contains(holds)).map(str::to_string);
    let of_row = |line: String| {
        let (name, version) = line.strip_prefix("| ")?.split(" | ").next()?.split_once(' ')?;
        Some((name.to_string(), version.to_string()))
    };
    lines.filter_map(of_row).collect::<Vec<_>>().into_iter()
}

#[test]
fn the_table_of_what_flies_has_each_crate_of_others() {
    let (listed, sums) = (table(), checksums());
    assert!(listed.iter().all(|found| sums.contains_key(found)), "{listed:?}");
    let mut resolved = resolved();
    resolved.retain(|(name, _)| !name.starts_with("remora-"));
    // Of what is not compiled for this machine the lock file has the version.
    resolved.extend(rows("| elsewhere |"));
    assert_eq!(listed, resolved, "ci/supply.py writes it");
}
