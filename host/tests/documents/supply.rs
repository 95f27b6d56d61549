//! What flies of others is what the pages say: the table of `docs/supply.md` and the bill of materials, by the lock
//! file. `ci/supply.py` writes both.

use crate::pages::root;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

/// Name and version.
type Crate = (String, String);

/// The flight crates and all below them, as Cargo resolves them.
fn resolved() -> BTreeSet<Crate> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    let tree = "tree --locked --offline -p remora-capi -e no-dev --target all --prefix none --format {p}";
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
    assert_eq!(listed, resolved, "ci/supply.py writes it");
}

#[test]
fn the_table_of_what_flies_has_each_crate_of_others() {
    let page = fs::read_to_string(root().join("docs/supply.md")).unwrap();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    let of_row = |cell: &str| cell.split_once(' ').map(|(n, v)| (n.to_string(), v.to_string()));
    let listed: BTreeSet<Crate> = rows.filter_map(of_row).collect();
    let mut resolved = resolved();
    resolved.retain(|(name, _)| !name.starts_with("remora-"));
    assert_eq!(listed, resolved, "ci/supply.py writes it");
}
