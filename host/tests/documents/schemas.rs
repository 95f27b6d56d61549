//! The JSON Schemas of files for editors, made from the structures that the readers fill: fields, units and words are
//! those of the code, ranges and defaults those of the mission.

use super::pages::root;
use remora_core::advanced::model::{self, Field, FieldVisitor, Range, Switch};
use remora_flight::errors_file;
use remora_host::formats::{
    MAX_JOINTS, MISSION_FORMAT, MissionCapture, MissionFile, SCENARIO_FORMAT, ScenarioSet, json,
};
use remora_truth::Errors;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs;

/// Sources of the structures; of two with one name the first counts.
const MISSION: [&str; 7] = [
    "host/files/src/formats/mission_file.rs",
    "host/files/src/formats/mission_sections.rs",
    "host/files/src/formats/mission_servicer.rs",
    "core/src/model/target.rs",
    "core/src/model/mission.rs",
    "core/src/model/servicer.rs",
    "core/src/model/typical.rs",
];
const SCENARIOS: [&str; 1] = ["host/files/src/formats/scenario_set.rs"];
const ERRORS: [&str; 3] = [
    "host/truth/src/errors/mod.rs",
    "host/truth/src/errors/sensors.rs",
    "host/truth/src/errors/faults.rs",
];

/// A field of a structure.
struct Member {
    key: String,
    kind: String,
    about: String,
    is_optional: bool,
}

/// Structures by their names, the format of a file, its defaults and the ranges of its numbers by their keys.
struct Source {
    structures: BTreeMap<String, Vec<Member>>,
    format: &'static str,
    defaults: Value,
    ranges: Ranges,
}

#[derive(Default)]
struct Ranges(BTreeMap<String, Range>);

impl FieldVisitor for Ranges {
    fn numbers(&mut self, field: Field, _: &mut [f64]) {
        self.0.insert(field.key.into(), field.range);
    }

    fn word(&mut self, _: Field, _: &mut u32) {}
}

/// Fields of all structures of a source file.
fn structures(text: &str) -> Vec<(String, Vec<Member>)> {
    let mut found: Vec<(String, Vec<Member>)> = Vec::new();
    let (mut about, mut attributes) = (Vec::new(), String::new());
    let (mut is_open, mut is_default) = (false, false);
    for line in text.lines().map(str::trim) {
        if let Some(words) = line.strip_prefix("///") {
            about.push(words.trim());
            continue;
        }
        if line.starts_with("#[") {
            attributes += line;
            continue;
        }
        let is_name =
            |name: &&str| name.chars().all(|c| c.is_ascii_lowercase() || "_0123456789".contains(c));
        let section = |head| Some(head).filter(|head: &&str| head.contains(" in \""));
        let head = line.strip_suffix('{');
        let head = head.and_then(|head| head.strip_prefix("pub struct ").or_else(|| section(head)));
        let member = line.strip_prefix("pub ").unwrap_or(line).split_once(": ");
        match (head, member.filter(|(name, _)| is_name(name))) {
            (Some(head), _) => {
                let name = head.split([' ', '<']).next().unwrap_or_default();
                found.push((name.into(), Vec::new()));
                (is_open, is_default) = (true, attributes.contains("(default"));
            }
            (None, Some((name, rest))) if is_open => {
                let kind = rest.split(" = ").next().unwrap_or(rest).trim_end_matches(',');
                let renamed = attributes.split("rename = \"").nth(1);
                let renamed = renamed.and_then(|rest| rest.split('"').next());
                let member = Member {
                    key: renamed.unwrap_or(name).into(),
                    kind: kind.into(),
                    about: about.join(" "),
                    is_optional: is_default || attributes.contains("(default"),
                };
                found.last_mut().unwrap().1.push(member);
            }
            _ => is_open &= line != "}",
        }
        (about, attributes) = (Vec::new(), String::new());
    }
    found
}

fn array(items: Value, least: usize, most: usize) -> Value {
    json!({"type": "array", "items": items, "minItems": least, "maxItems": most})
}

fn choice<T: Serialize>(choices: &[T]) -> Value {
    json!({"enum": choices})
}

impl Source {
    fn new(files: &[&str], format: &'static str, defaults: Value) -> Self {
        let mut all = BTreeMap::new();
        for file in files {
            for (name, members) in structures(&fs::read_to_string(root().join(file)).unwrap()) {
                all.entry(name).or_insert(members);
            }
        }
        Self { structures: all, format, defaults, ranges: Ranges::default() }
    }

    fn schema(&self, title: &str, name: &str) -> Value {
        let mut schema = self.object(name, "");
        schema["$schema"] = "http://json-schema.org/draft-07/schema#".into();
        schema["title"] = title.into();
        schema
    }

    /// The schema of a structure at a path of keys.
    fn object(&self, name: &str, path: &str) -> Value {
        let members = self.structures.get(name).unwrap_or_else(|| panic!("{path}: no {name}"));
        let (mut properties, mut required) = (Map::new(), Vec::new());
        for member in members {
            let path = format!("{path}/{}", member.key);
            let mut schema = self.of(&member.kind, &path);
            if path == "/format" {
                schema = json!({"const": self.format});
            }
            self.bound(&mut schema, &path);
            schema["description"] = words(member).into();
            let default = self.defaults.pointer(&path);
            if let Some(value) = default.filter(|value| !value.to_string().contains('{')) {
                schema["default"] = value.clone();
            }
            if !member.is_optional && !member.kind.starts_with("Option<") {
                required.push(member.key.clone());
            }
            properties.insert(member.key.clone(), schema);
        }
        let mut schema = json!({"type": "object", "additionalProperties": false});
        schema["properties"] = properties.into();
        if !required.is_empty() {
            schema["required"] = required.into();
        }
        schema
    }

    /// The schema of a type.
    fn of(&self, kind: &str, path: &str) -> Value {
        let number = || json!({"type": "number"});
        let inside = |open: &str| kind.strip_prefix(open)?.strip_suffix('>');
        match kind {
            "f64" => number(),
            "usize" => json!({"type": "integer", "minimum": 0}),
            "String" => json!({"type": "string"}),
            "[f64; 3]" | "Vector3<f64>" => array(number(), 3, 3),
            "[f64; 4]" => array(number(), 4, 4),
            "Matrix3<f64>" => json!({"anyOf": [array(number(), 3, 3), array(number(), 6, 6)]}),
            "Limits" => json!({"anyOf": [number(), array(number(), 1, MAX_JOINTS)]}),
            "Stops" => json!({"anyOf": [number(), array(number(), 2, 2)]}),
            "Radius" => json!({"anyOf": [number(), {"const": "auto"}]}),
            "Switch" => choice(&[Switch::Auto, Switch::On, Switch::Off]),
            "Capture" => choice(&[MissionCapture::Joints, MissionCapture::Pose]),
            "Vec<NamedScenario>" => {
                json!({"type": "array", "items": self.object("NamedScenario", path), "minItems": 1})
            }
            _ => match (inside("Option<"), inside("Vec<")) {
                (Some(kind), _) => self.of(kind, path),
                (_, Some(kind)) => array(self.of(kind, path), 1, MAX_JOINTS),
                _ => self.object(kind, path),
            },
        }
    }

    /// Writes the range of a mission's field into the schemas of its numbers.
    fn bound(&self, schema: &mut Value, path: &str) {
        let key = path[1..].replace('/', ".").replace("horizon.", "approach.");
        let in_radians = key.replace("_deg", "_rad");
        let Some(range) = self.ranges.0.get(&in_radians) else { return };
        let unit = if key == in_radians { 1.0 } else { 180.0 / std::f64::consts::PI };
        let limits = match *range {
            Range::Positive => json!({"exclusiveMinimum": 0}),
            Range::NotNegative => json!({"minimum": 0}),
            Range::Within(least, most, _) if least > 0.0 && least < f64::MIN_POSITIVE => {
                json!({"exclusiveMinimum": 0, "maximum": most * unit})
            }
            Range::Within(least, most, _) => {
                json!({"minimum": least * unit + 0.0, "maximum": most * unit})
            }
            _ => return,
        };
        limit(schema, limits.as_object().unwrap());
    }
}

/// Adds keys to all schemas of numbers.
fn limit(schema: &mut Value, limits: &Map<String, Value>) {
    match schema {
        Value::Array(all) => all.iter_mut().for_each(|schema| limit(schema, limits)),
        Value::Object(keys) => {
            if keys.get("type") == Some(&"number".into()) {
                keys.extend(limits.clone());
            }
            keys.values_mut().for_each(|schema| limit(schema, limits));
        }
        _ => {}
    }
}

/// Documentation of a field, without links; what code has in radians may be in degrees here.
fn words(member: &Member) -> String {
    let text = member.about.replace("[`", "`").replace("`]", "`");
    let text = if member.key.contains("_deg") { text.replace("[rad", "[deg") } else { text };
    assert!(!text.is_empty() && !text.contains("]("), "{}: {text:?}", member.key);
    text
}

fn value(of: &impl Serialize) -> Value {
    serde_json::to_value(of).unwrap()
}

/// All schemas by the names of their files.
fn schemas() -> [(&'static str, Value); 3] {
    let defaults = value(&MissionFile::default());
    let mut mission = Source::new(&MISSION, MISSION_FORMAT, defaults);
    let mut built_in = model::Mission::<3>::default();
    built_in.visit(&mut mission.ranges);
    let scenarios = Source::new(&SCENARIOS, SCENARIO_FORMAT, Value::Null);
    let errors = Source::new(&ERRORS, "", Value::Null);
    [
        ("mission", mission.schema("Mission of Remora", "MissionFile")),
        ("scenarios", scenarios.schema("Scenario set of Remora", "ScenarioSet")),
        ("errors", errors.schema("Errors of Remora's simulated world", "Errors")),
    ]
}

/// The files are written anew where `REMORA_WRITE_SCHEMAS` is set.
#[test]
fn the_schemas_are_those_of_the_code() {
    for (name, made) in schemas() {
        let file = root().join(format!("host/schemas/{name}.schema.json"));
        if std::env::var_os("REMORA_WRITE_SCHEMAS").is_some() {
            fs::write(&file, json::to_text(&made).unwrap() + "\n").unwrap();
        }
        let kept = fs::read_to_string(&file).unwrap_or_default();
        let kept: Value = serde_json::from_str(&kept).unwrap_or_default();
        assert!(kept == made, "{file:?} is stale: REMORA_WRITE_SCHEMAS=1 writes it");
    }
}

/// Whether a value fits a schema that has only keys which are written here.
fn fits(schema: &Value, value: &Value) -> bool {
    let of_key = |(key, asked): (&String, &Value)| match key.as_str() {
        "anyOf" => asked.as_array().unwrap().iter().any(|schema| fits(schema, value)),
        "const" => value == asked,
        "enum" => asked.as_array().unwrap().contains(value),
        "type" => match asked.as_str().unwrap() {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "integer" => value.is_u64() || value.is_i64(),
            _ => value.is_number(),
        },
        "minimum" => value.as_f64().is_some_and(|value| value >= asked.as_f64().unwrap()),
        "maximum" => value.as_f64().is_some_and(|value| value <= asked.as_f64().unwrap()),
        "exclusiveMinimum" => value.as_f64().is_some_and(|value| value > asked.as_f64().unwrap()),
        "items" => value.as_array().is_some_and(|all| all.iter().all(|item| fits(asked, item))),
        "minItems" => {
            value.as_array().is_some_and(|all| all.len() as u64 >= asked.as_u64().unwrap())
        }
        "maxItems" => {
            value.as_array().is_some_and(|all| all.len() as u64 <= asked.as_u64().unwrap())
        }
        "required" => {
            asked.as_array().unwrap().iter().all(|key| value.get(key.as_str().unwrap()).is_some())
        }
        "properties" => value.as_object().is_some_and(|keys| {
            keys.iter().all(|(key, value)| asked.get(key).is_some_and(|schema| fits(schema, value)))
        }),
        "additionalProperties" | "$schema" | "title" | "description" | "default" => true,
        _ => panic!("{key} is unknown here"),
    };
    schema.as_object().unwrap().iter().all(of_key)
}

/// Files of the checkout whose names end so, as values.
fn fixtures(ending: &str) -> Vec<(String, Value)> {
    let mut folders = vec![root().join("fixtures")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(ending) {
                let text = fs::read_to_string(path).unwrap();
                let is_json = ending.ends_with(".json");
                let value = if is_json {
                    serde_json::from_str(&text).unwrap()
                } else {
                    toml::from_str(&text).unwrap()
                };
                found.push((name, value));
            }
        }
    }
    found
}

#[test]
fn schemas_take_all_files_of_the_checkout() {
    let [(_, mission), (_, scenarios), (_, errors)] = schemas();
    let missions = fixtures(".mission.toml");
    let sets = fixtures(".scenarios.json");
    assert!(missions.len() > 12 && sets.len() > 2, "{} {}", missions.len(), sets.len());
    for (schema, files) in [(&mission, missions), (&scenarios, sets)] {
        for (name, file) in files {
            assert!(fits(schema, &file), "{name}");
        }
    }
    assert!(fits(&scenarios, &value(&ScenarioSet::built_in().unwrap())));
    for all in [Errors::typical(), Errors::none()] {
        let text = errors_file::text(&all).unwrap();
        assert!(fits(&errors, &toml::from_str(&text).unwrap()));
    }
}

/// Whatever a file leaves out, has beside its keys or has too long: schema and reader agree.
#[test]
fn schemas_and_readers_refuse_the_same_files() {
    let [(_, mission), (_, scenarios), (_, errors)] = schemas();
    let is_mission = |file: &Value| {
        let text = toml::to_string(file).unwrap();
        MissionFile::parse(&text).is_ok_and(|file| file.mission().is_ok())
    };
    let is_set = |file: &Value| ScenarioSet::parse(&file.to_string()).is_ok();
    let is_errors = |file: &Value| errors_file::parse(&toml::to_string(file).unwrap(), 3).is_ok();
    let mut full = ScenarioSet::built_in().unwrap();
    full.scenarios.truncate(1);
    agree(&mission, &value(&MissionFile::default()), &is_mission);
    agree(&scenarios, &value(&full), &is_set);
    agree(&errors, &value(&Errors::typical()), &is_errors);
}

/// Compares schema and reader for a file and all that differ from it in one place.
fn agree(schema: &Value, file: &Value, is_read: &dyn Fn(&Value) -> bool) {
    assert!(fits(schema, file) && is_read(file), "{file}");
    let mut paths = vec![String::new()];
    let mut seen = 0;
    while let Some(path) = paths.pop() {
        let mut changed = Vec::new();
        let change = |with: &dyn Fn(&mut Value)| {
            let mut file = file.clone();
            with(file.pointer_mut(&path).unwrap());
            file
        };
        match file.pointer(&path).unwrap() {
            Value::Object(keys) => {
                changed.push(change(&|value| value["unknown"] = 1.into()));
                for key in keys.keys() {
                    changed.push(change(&|value| drop(value.as_object_mut().unwrap().remove(key))));
                    paths.push(format!("{path}/{key}"));
                }
            }
            // Eight copies of a scenario have one id.
            Value::Array(items) if path != "/scenarios" => {
                let long = vec![items[0].clone(); MAX_JOINTS + 1];
                changed.push(change(&|value| *value = long.clone().into()));
                paths.extend((0..items.len()).map(|i| format!("{path}/{i}")));
            }
            Value::Array(_) => paths.push(format!("{path}/0")),
            _ => changed.push(change(&|value| *value = json!({"unknown": 1}))),
        }
        for changed in changed {
            assert_eq!(fits(schema, &changed), is_read(&changed), "{path}: {changed}");
            seen += 1;
        }
    }
    assert!(seen > 30, "{seen}");
}
