//! Arrays of fixed length, in every file: one value more or fewer is refused by key and length.

use super::bench::Bench;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A mission that gives every array that there is a key for.
fn mission() -> Value {
    let link = |axis: [f64; 3]| {
        json!({
            "tip_m": [0.0, 0.0, 0.5], "center_of_mass_m": [0.0, 0.0, 0.25], "mass_kg": 4.0,
            "inertia_kg_m2": [0.2, 0.2, 0.05, 0.0, 0.001, 0.0], "axis": axis,
        })
    };
    json!({
        "target": {
            "half_extents_m": [0.5, 0.5, 0.5], "inertia_kg_m2": [25.0, 30.0, 20.0],
            "port_position_m": [0.5, 0.0, 0.0], "port_normal": [1.0, 0.0, 0.0],
        },
        "scenarios": { "offset_m": [0.0, 0.0, 0.0] },
        "roll": { "end_effector": [1.0, 0.0, 0.0], "port": [0.0, 1.0, 0.0] },
        "servicer": {
            "bus_inertia_kg_m2": [20.0, 20.0, 20.0, 0.1, 0.0, 0.0],
            "bus_half_extents_m": [0.4, 0.4, 0.4],
            "boresight": [0.0, 0.0, 1.0],
            "arm_base_m": [0.0, 0.0, 0.4],
            "arm_base_rotation": [0.0, 0.0, 0.0, 1.0],
            "joint_angle_limit_rad": [[-2.0, 2.5], [-2.0, 2.0], 2.0],
            "joint_rate_limit_rad_s": [0.1, 0.1, 0.2],
            "initial_joint_angle_rad": [0.1, 0.2, 0.3],
            "capture": "pose",
            "end_effector_axis": [0.0, 0.0, 1.0],
            "force_limit_n": [1.0, 1.0, 2.0],
            "bus_torque_limit_n_m": [1.0, 1.0, 2.0],
            "joint_torque_limit_n_m": [1.0, 1.0, 2.0],
            "links": [link([0.0, 0.0, 1.0]), link([0.0, 1.0, 0.0]), link([0.0, 1.0, 0.0])],
        },
    })
}

/// Pointers to the arrays of numbers and of rows; the first and the last of many rows.
fn arrays(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(entries) => {
            entries.iter().for_each(|(key, value)| arrays(value, &format!("{at}/{key}"), found));
        }
        Value::Array(values) => {
            let is_of_numbers = |value: &Value| value.is_number() || value.is_array();
            if !values.is_empty() && values.iter().all(is_of_numbers) {
                found.push(at.into());
            }
            let ends = values.iter().enumerate().filter(|(i, _)| *i == 0 || i + 1 == values.len());
            ends.for_each(|(i, value)| arrays(value, &format!("{at}/{i}"), found));
        }
        _ => (),
    }
}

/// The last key of a pointer.
fn key(pointer: &str) -> &str {
    pointer.rsplit('/').find(|part| part.parse::<usize>().is_err()).unwrap()
}

/// Each array of a document, one longer and one shorter, is refused by key and length. Returns their number.
fn each_is_of_its_length(
    bench: &Bench,
    line: &str,
    document: &Value,
    text: impl Fn(&Value) -> String,
) -> usize {
    let mut found = Vec::new();
    arrays(document, "", &mut found);
    for pointer in &found {
        let whole = document.pointer(pointer).unwrap().as_array().unwrap();
        let longer = [whole.as_slice(), &whole[whole.len() - 1..]].concat();
        let shorter = whole[..whole.len() - 1].to_vec();
        for changed in [longer, shorter] {
            let mut document = document.clone();
            *document.pointer_mut(pointer).unwrap() = changed.clone().into();
            bench.write("changed", &text(&document));
            let run = bench.run(line);
            let told = format!("{line}: {pointer} with {} values\n{}", changed.len(), run.err);
            assert_eq!(run.status, 2, "{told}");
            assert_eq!(run.err.lines().count(), 1, "{told}");
            let words = |c: char| !c.is_ascii_alphanumeric() && c != '_';
            let says = |word: &str| run.err.split(words).any(|part| part == word);
            assert!(says(key(pointer)) && says(&whole.len().to_string()), "{told}");
        }
    }
    found.len()
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name)
}

fn toml_text(document: &Value) -> String {
    toml::to_string(document).unwrap()
}

#[test]
fn an_array_that_is_too_long_or_too_short_is_refused_in_every_file() {
    let bench = Bench::new();
    let walk = |line: &str, document: &Value| {
        each_is_of_its_length(&bench, line, document, Value::to_string)
    };
    let walk_toml =
        |line: &str, document: &Value| each_is_of_its_length(&bench, line, document, toml_text);
    let toml_of = |text: &str| toml::from_str::<Value>(text).unwrap();

    assert_eq!(walk_toml("mission show changed", &mission()), 28);

    bench.solves("plan --id pub-000 --out a.plan.json");
    let chief = std::fs::read_to_string(fixture("chiefs/state.chief.toml")).unwrap();
    let export = "export a.plan.json --epoch 2026-11-23T00:00:00 --out out --format oem";
    assert_eq!(walk_toml(&format!("{export} --chief changed"), &toml_of(&chief)), 2);

    // These keys have no array; a new one fails here.
    let errors = toml_of(&bench.solves("mission errors typical").out);
    assert_eq!(walk_toml("fly a.plan.json --errors changed --out out", &errors), 0);

    let mut set = bench.json("set.scenarios.json");
    let start = set["scenarios"][0]["servicer"].as_object_mut().unwrap();
    start.insert("bus_attitude_body_to_rtn".into(), json!([0.0, 0.6, 0.0, 0.8]));
    start.insert("bus_rate_rtn_rad_s".into(), json!([0.0, 0.0, 0.0]));
    start.insert("joint_angle_rad".into(), json!([0.0, 0.0, 0.0]));
    start.insert("joint_rate_rad_s".into(), json!([0.0, 0.0, 0.0]));
    assert_eq!(walk("plan --scenarios changed --id s1-000", &set), 12);

    assert_eq!(walk("check changed", &bench.json("a.plan.json")), 57);
}

/// Readers other than the two strict ones would drop surplus values of an array.
#[test]
fn every_text_is_read_by_one_of_two_readers() {
    let strict = ["formats/json.rs", "formats/json_text.rs", "formats/toml_text.rs"];
    let others =
        ["serde_json::from_", "serde_json::Deserializer", "toml::from_", "toml::Deserializer"];
    fn walk(folder: &Path, each: &mut dyn FnMut(&Path)) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => walk(&path, each),
                false => each(&path),
            }
        }
    }
    let host = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut seen = 0;
    walk(host, &mut |path| {
        let name = path.strip_prefix(host).unwrap().to_string_lossy().into_owned();
        let is_source =
            name.ends_with(".rs") && (name.starts_with("src") || name.contains("/src/"));
        if !is_source || name.contains("tests") || strict.iter().any(|end| name.ends_with(end)) {
            return;
        }
        seen += 1;
        let text = std::fs::read_to_string(path).unwrap();
        let code = text.split("mod tests {").next().unwrap();
        let found = others.iter().find(|other| code.contains(*other));
        assert!(found.is_none(), "{name} has {found:?}: use formats::json or formats::toml_text");
    });
    assert!(seen > 300, "{seen}");
}
