//! Scenario sets: `*.scenarios.json`.

use super::{
    Kind, Limit, MAX_JOINTS, Scenario, as_text, check_id, each, json, unit, write_atomically,
};
use crate::error::{Error, FieldError};
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{MIN_NODES, Start};
use remora_core::advanced::stages::NODES;
use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::collections::HashSet;
use std::fmt;
use std::path::Path;

/// The `format` of scenario sets.
pub const FORMAT: &str = "remora-scenarios/1";

/// Farthest start that is still an approach [m]; the relative motion model ends long before.
const MAX_POSITION: f64 = 1e6;
/// Fastest start [m/s].
const MAX_VELOCITY: f64 = 1e4;
/// Fastest tumble, of target and bus, and fastest joint [rad/s]; the nodes are too coarse for it long
/// before.
const MAX_RATE: f64 = 1.0;
/// Farthest that a joint can be wound up [rad].
const MAX_ANGLE: f64 = 100.0;
/// Shortest and longest time to capture [s].
const DURATION: std::ops::RangeInclusive<f64> = 1.0..=1e6;

/// A set of scenarios, as in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a scenario set")]
pub struct ScenarioSet {
    /// [`FORMAT`].
    pub format: String,
    /// The scenarios; ids are unique.
    pub scenarios: Vec<NamedScenario>,
}

/// A set whose scenarios are not read yet: of a large one only text is held beside what is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a scenario set")]
struct Written<'a> {
    format: String,
    #[serde(borrow, deserialize_with = "elements")]
    scenarios: Vec<&'a RawValue>,
}

/// Most scenarios of a set: more than the largest file has room for.
const MOST: usize = 1 << 21;

/// The elements of a list that is not too long to be one of scenarios.
fn elements<'de: 'a, 'a, D: Deserializer<'de>>(from: D) -> Result<Vec<&'a RawValue>, D::Error> {
    struct Elements;

    impl<'de> Visitor<'de> for Elements {
        type Value = Vec<&'de RawValue>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a list of scenarios")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let mut elements = Vec::new();
            while let Some(element) = list.next_element()? {
                if elements.len() == MOST {
                    return Err(A::Error::custom(format!("has more than {MOST} entries")));
                }
                elements.push(element);
            }
            Ok(elements)
        }
    }
    from.deserialize_seq(Elements)
}

/// One scenario of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a scenario")]
pub struct NamedScenario {
    /// Unique within the set, and fit to be part of a file name.
    pub id: String,
    /// The target's tumble.
    pub target: TargetStart,
    /// Where the servicer starts.
    pub servicer: ServicerStart,
    /// Time to capture [s]; the mission's where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Number of nodes; the mission's where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
}

/// The target at t = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with attitude and rate")]
pub struct TargetStart {
    /// Attitude, body to RTN, `[x, y, z, w]`.
    pub attitude: [f64; 4],
    /// Angular velocity relative to RTN, in target body axes [rad/s].
    pub rate: [f64; 3],
}

/// The servicer at t = 0: its centre of mass, and where they are given bus and arm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with position and velocity")]
pub struct ServicerStart {
    /// Position in RTN [m].
    pub position: [f64; 3],
    /// Velocity relative to RTN, in RTN [m/s].
    pub velocity: [f64; 3],
    /// Attitude of the bus, body to RTN, `[x, y, z, w]`; towards the target where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bus_attitude_body_to_rtn: Option<[f64; 4]>,
    /// Rate of the bus relative to RTN, in RTN [rad/s]; at rest where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bus_rate_rtn_rad_s: Option<[f64; 3]>,
    /// Joint angles [rad]; the mission's where they are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_angle_rad: Option<Vec<f64>>,
    /// Joint rates [rad/s]; at rest where they are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_rate_rad_s: Option<Vec<f64>>,
}

impl ServicerStart {
    /// Bus and arm as the planner takes them.
    fn start(&self) -> Start<MAX_JOINTS> {
        let attitude = self.bus_attitude_body_to_rtn;
        Start {
            bus_attitude: attitude.map(|q| quaternion::normalized(&Vector4::from(q))),
            bus_rate: self.bus_rate_rtn_rad_s.unwrap_or_default().into(),
            joint_angle: self.joint_angle_rad.as_deref().map(each),
            joint_rate: each(self.joint_rate_rad_s.as_deref().unwrap_or_default()),
        }
    }
}

impl NamedScenario {
    /// Refuses a start of an arm with another number of joints.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check_joints(&self, joints: usize) -> Result<(), FieldError> {
        let ServicerStart { joint_angle_rad, joint_rate_rad_s, .. } = &self.servicer;
        for (key, values) in
            [("joint_angle_rad", joint_angle_rad), ("joint_rate_rad_s", joint_rate_rad_s)]
        {
            let given = values.as_ref().map_or(joints, Vec::len);
            if given != joints {
                let reason =
                    format!("one number for each of the mission's {joints} joints, not {given}");
                return Err(FieldError::new(format!("servicer.{key}"), reason));
            }
        }
        Ok(())
    }

    /// The scenario as the planner takes it, its quaternion normalised.
    pub fn scenario(&self) -> Scenario {
        Scenario {
            target_attitude: quaternion::normalized(&Vector4::from(self.target.attitude)),
            target_rate: Vector3::from(self.target.rate),
            position: Vector3::from(self.servicer.position),
            velocity: Vector3::from(self.servicer.velocity),
            start: self.servicer.start(),
            duration: self.duration_s,
            nodes: self.nodes,
        }
    }

    /// Refuses numbers that are no start of an approach.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn validate(&self) -> Result<(), FieldError> {
        unit::quaternion(&self.target.attitude, || "target.attitude".into())?;
        within(&self.target.rate, MAX_RATE, "target.rate", "rad/s")?;
        within(&self.servicer.position, MAX_POSITION, "servicer.position", "m")?;
        within(&self.servicer.velocity, MAX_VELOCITY, "servicer.velocity", "m/s")?;
        if Vector3::from(self.servicer.position).amax() < 1e-3 {
            let reason = "is at the target's centre, from where nothing points at it";
            return Err(FieldError::new("servicer.position", reason));
        }
        self.validate_start()
    }

    fn validate_start(&self) -> Result<(), FieldError> {
        let s = &self.servicer;
        if let Some(attitude) = &s.bus_attitude_body_to_rtn {
            unit::quaternion(attitude, || "servicer.bus_attitude_body_to_rtn".into())?;
        }
        // A missing value counts as zero or as an empty list, which every limit allows.
        let bus_rate = s.bus_rate_rtn_rad_s.unwrap_or_default();
        within(&bus_rate, MAX_RATE, "servicer.bus_rate_rtn_rad_s", "rad/s")?;
        let joints = |values: &Option<Vec<f64>>| values.clone().unwrap_or_default();
        within(&joints(&s.joint_angle_rad), MAX_ANGLE, "servicer.joint_angle_rad", "rad")?;
        within(&joints(&s.joint_rate_rad_s), MAX_RATE, "servicer.joint_rate_rad_s", "rad/s")?;
        if self.duration_s.is_some_and(|duration| !DURATION.contains(&duration)) {
            return Err(FieldError::new("duration_s", "must lie in [1, 1e6] s"));
        }
        if self.nodes.is_some_and(|nodes| !(MIN_NODES..=NODES).contains(&nodes)) {
            let reason =
                format!("must lie in [{MIN_NODES}, {NODES}], what this program is built for");
            return Err(FieldError::new("nodes", reason));
        }
        Ok(())
    }
}

/// Refuses components beyond `most` or NaN.
fn within(values: &[f64], most: f64, field: &str, unit: &str) -> Result<(), FieldError> {
    if values.iter().all(|x| x.abs() <= most) {
        return Ok(());
    }
    Err(FieldError::new(field, format!("each component must be within {most} {unit}")))
}

impl ScenarioSet {
    /// A set.
    pub fn new(scenarios: Vec<NamedScenario>) -> Self {
        Self { format: FORMAT.into(), scenarios }
    }

    /// Parses and validates a set. Memory: the scenarios, 16 bytes each beside.
    ///
    /// # Errors
    /// The first field found wrong: unknown format or field, numbers that are not, quaternions
    /// not of unit length, ids used twice or unfit for a file name, no scenario at all.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        json::check_header(text, FORMAT)?;
        let written: Written<'_> = json::deserialize(text)?;
        let parse = |(i, scenario)| json::parse_element(text, scenario, &format!("scenarios[{i}]"));
        let scenarios = written.scenarios.into_iter().enumerate().map(parse);
        let set = Self { format: written.format, scenarios: scenarios.collect::<Result<_, _>>()? };
        set.validate()?;
        Ok(set)
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// The file with the error of [`ScenarioSet::parse`].
    pub fn read(file: &Path) -> Result<Self, Error> {
        Kind::Scenarios.read(file, Limit::SET, |bytes| Self::parse(as_text(bytes)?))
    }

    /// The set that is compiled into the program: `fixtures/scenarios/public.scenarios.json`.
    ///
    /// # Errors
    /// None, as long as the tests pass.
    pub fn built_in() -> Result<Self, Error> {
        let text = include_str!("../../../../fixtures/scenarios/public.scenarios.json");
        Self::parse(text).map_err(|error| error.at(Path::new("built-in scenarios")))
    }

    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// The file with the reason why it cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let text = json::to_text(self).map_err(|error| Error::output(file, &error.into()))?;
        write_atomically(file, text.as_bytes())
    }

    /// The scenario called `id`.
    pub fn get(&self, id: &str) -> Option<&NamedScenario> {
        self.scenarios.iter().find(|scenario| scenario.id == id)
    }

    fn validate(&self) -> Result<(), FieldError> {
        if self.scenarios.is_empty() {
            return Err(FieldError::new("scenarios", "holds no scenario"));
        }
        let mut ids = HashSet::new();
        for (i, scenario) in self.scenarios.iter().enumerate() {
            check_id(&scenario.id, || format!("scenarios[{i}].id"))?;
            scenario.validate().map_err(|error| {
                FieldError::new(format!("scenarios[{i}].{}", error.field), error.reason)
            })?;
            if !ids.insert(scenario.id.as_str()) {
                let reason = format!("{:?} is used twice", scenario.id);
                return Err(FieldError::new(format!("scenarios[{i}].id"), reason));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(change: fn(&mut NamedScenario)) -> String {
        let mut scenario = NamedScenario {
            id: "a".into(),
            target: TargetStart { attitude: [0.0, 0.0, 0.0, 1.0], rate: [0.0; 3] },
            servicer: ServicerStart { position: [0.0, 0.0, 5.0], ..ServicerStart::default() },
            duration_s: None,
            nodes: None,
        };
        change(&mut scenario);
        json::to_text(&ScenarioSet::new(vec![scenario])).unwrap()
    }

    #[test]
    fn the_built_in_set_is_sound_and_survives_a_round_trip() {
        let set = ScenarioSet::built_in().unwrap();
        assert_eq!(set.scenarios.len(), 60);
        let again = ScenarioSet::parse(&json::to_text(&set).unwrap()).unwrap();
        assert_eq!(set, again);
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |change| ScenarioSet::parse(&text(change)).unwrap_err().field;
        assert!(ScenarioSet::parse(&text(|_| ())).is_ok());
        assert_eq!(field(|s| s.id = "../a".into()), "scenarios[0].id");
        assert_eq!(field(|s| s.id = String::new()), "scenarios[0].id");
        assert_eq!(field(|s| s.id = ".hidden".into()), "scenarios[0].id");
        assert_eq!(field(|s| s.target.attitude[0] = 0.1), "scenarios[0].target.attitude");
        assert_eq!(field(|s| s.target.rate[1] = f64::NAN), "scenarios[0].target.rate[1]");
        assert_eq!(field(|s| s.target.rate[1] = 7.0), "scenarios[0].target.rate");
        assert_eq!(field(|s| s.servicer.position = [0.0; 3]), "scenarios[0].servicer.position");
        assert_eq!(field(|s| s.servicer.velocity[0] = 1e9), "scenarios[0].servicer.velocity");
    }

    /// A list of other values takes no more memory than one of scenarios, and reading ends early.
    // Verifies REM-IO-004.
    #[test]
    fn a_list_too_long_to_be_one_of_scenarios_is_not_read_to_its_end() {
        let list = |end: &str| {
            let zeros = "0,".repeat(MOST + 1);
            format!("{{\"format\": \"{FORMAT}\", \"scenarios\": [{zeros}{end}")
        };
        // Reading stops at the limit, so it never meets the broken JSON at the end.
        let error = ScenarioSet::parse(&list("}")).unwrap_err();
        assert!(error.field.starts_with("scenarios"), "{}", error.field);
        assert!(error.reason.starts_with("has more than 2097152 entries"), "{}", error.reason);
    }

    #[test]
    fn a_start_and_a_duration_are_read_and_checked() {
        let moving = |s: &mut NamedScenario| {
            s.servicer.bus_attitude_body_to_rtn = Some([0.0, 0.6, 0.0, 0.8]);
            s.servicer.bus_rate_rtn_rad_s = Some([1e-4, 0.0, -2e-4]);
            s.servicer.joint_angle_rad = Some(vec![-0.5, 0.4, 0.3]);
            s.servicer.joint_rate_rad_s = Some(vec![1e-3, 0.0, 0.0]);
            s.duration_s = Some(700.0);
        };
        let written = text(moving);
        let set = ScenarioSet::parse(&written).unwrap();
        assert_eq!(set.format, FORMAT);
        let scenario = set.scenarios[0].scenario();
        assert_eq!(scenario.duration, Some(700.0));
        assert_eq!(scenario.start.joint_angle, Some(each(&[-0.5, 0.4, 0.3])));
        assert_eq!(scenario.start.bus_rate, Vector3::new(1e-4, 0.0, -2e-4));
        assert_eq!(scenario.start.joint_rate, each::<MAX_JOINTS>(&[1e-3, 0.0, 0.0]));
        assert_eq!(json::to_text(&set).unwrap(), written);

        let field = |change| ScenarioSet::parse(&text(change)).unwrap_err().field;
        let servicer = "scenarios[0].servicer";
        assert_eq!(
            field(|s| s.servicer.bus_attitude_body_to_rtn = Some([0.0; 4])),
            format!("{servicer}.bus_attitude_body_to_rtn")
        );
        assert_eq!(
            field(|s| s.servicer.bus_rate_rtn_rad_s = Some([2.0, 0.0, 0.0])),
            format!("{servicer}.bus_rate_rtn_rad_s")
        );
        assert_eq!(
            field(|s| s.servicer.joint_angle_rad = Some(vec![0.0, 101.0, 0.0])),
            format!("{servicer}.joint_angle_rad")
        );
        assert_eq!(
            field(|s| s.servicer.joint_rate_rad_s = Some(vec![0.0, 0.0, -3.0])),
            format!("{servicer}.joint_rate_rad_s")
        );
        assert_eq!(field(|s| s.duration_s = Some(0.0)), "scenarios[0].duration_s");
    }

    #[test]
    fn unknown_fields_and_missing_numbers_are_named() {
        let parse = |text: &str| ScenarioSet::parse(text).unwrap_err();
        let good = text(|_| ());
        let error = parse(&good.replace("\"rate\"", "\"Rate\""));
        assert_eq!(error.field, "scenarios[0].target.Rate");
        assert!(error.reason.contains("unknown field `Rate`"), "{}", error.reason);
        let error = parse(&good.replace("[0.0,0.0,0.0,1.0]", "[0.0,0.0,1.0]"));
        assert_eq!(error.field, "scenarios[0].target.attitude");
        let servicer = good.find("\"servicer\"").unwrap();
        let rows = format!("{}\"servicer\": [[0,0,5],[0,0,0]]}}]}}", &good[..servicer]);
        assert_eq!(parse(&rows).field, "scenarios[0].servicer");
        for other in ["remora-scenarios/2", "remora-scenarios/3"] {
            assert_eq!(parse(&good.replace(FORMAT, other)).field, "format");
        }
        let empty = json::to_text(&ScenarioSet::new(Vec::new())).unwrap();
        assert_eq!(parse(&empty).field, "scenarios");
    }
}
