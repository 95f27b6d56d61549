//! The mission's world is the one that is flown: its orbit about its body, its target, its servicer.

use crate::common;

use common::{FlightCase, planned};
use remora_core::advanced::model::{Mission, Switch};
use remora_core::prelude::{Valid, Validate};
use remora_flight::flight::{Ending, Flight, FlightOutcome, Moment, Settings};
use remora_host::engine::DefaultArmEngine;
use remora_host::formats::{self, MissionFile};
use remora_truth::{Dispersion, Errors};
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

/// Flies without errors. Returns the flight and the last state of the truth.
fn fly(
    mission: &Valid<Mission<3>>,
    (scenario, plan): &FlightCase,
    settings: &Settings,
) -> (FlightOutcome, String) {
    let dispersion = Dispersion { errors: Errors::none(), seed: 0, run: 0 };
    let mut last = String::new();
    let mut watch = |moment: &Moment<'_, 3>| last = format!("{:?}", moment.view);
    let flight = Flight { mission, scenario, plan, settings };
    let flown = flight.fly(&dispersion, &mut DefaultArmEngine::default(), &mut watch).unwrap();
    (flown, last)
}

/// The mission of a file's text.
fn read(text: &str) -> Valid<Mission<3>> {
    MissionFile::parse(text).unwrap().mission().unwrap().sized().validated().unwrap()
}

/// Plans and flies scenarios of a mission without errors; all must be captured.
fn captures(name: &str, mission: &str, count: u64) {
    let mission = read(mission);
    for planned in planned(&mission, count) {
        let (flown, _) = fly(&mission, &planned, &Settings::default());
        println!("{name}: {:?} {:?} {:?}", flown.ending, flown.arrival, flown.violations());
        assert_eq!((flown.ending, flown.violations().len()), (Ending::Captured, 0), "{name}");
        assert!(flown.arrival.miss_m <= 3e-4, "{name}: {:?}", flown.arrival);
    }
}

/// Every accepted orbit, from every place on it: what is too eccentric is refused before planning.
#[test]
fn a_plan_on_an_eccentric_orbit_that_is_accepted_is_captured() {
    for (a, e) in [(6.8e6, 0.04), (2.4e7, 0.3), (2.4e7, 0.45)] {
        let text = format!("[orbit]\nsemi_major_axis_m = {a}\neccentricity = {e}\n");
        let mission = read(&text);
        let planned = &planned(&mission, 1)[0];
        for quarter in 0..4 {
            let mut settings = Settings::default();
            settings.surroundings.argument_of_latitude = f64::from(quarter) * FRAC_PI_2;
            let (flown, _) = fly(&mission, planned, &settings);
            println!("{a} {e} {quarter}: {:?}", flown.arrival);
            assert_eq!(flown.ending, Ending::Captured, "{a} {e} {quarter}: {:?}", flown.arrival);
        }
    }
}

#[test]
fn a_plan_about_the_moon_is_captured() {
    captures("moon", include_str!("../../../fixtures/missions/moon.mission.toml"), 3);
}

#[test]
fn a_plan_on_a_slightly_eccentric_orbit_is_captured() {
    for e in [0.0, 0.01, 0.03] {
        captures(&e.to_string(), &format!("[orbit]\neccentricity = {e}\n"), 2);
    }
}

/// Every number of a section, by JSON pointer.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(at.to_string()),
        Value::Array(all) => {
            all.iter().enumerate().for_each(|(i, one)| numbers(one, &format!("{at}/{i}"), found));
        }
        Value::Object(all) => {
            all.iter().for_each(|(key, one)| numbers(one, &format!("{at}/{key}"), found));
        }
        _ => (),
    }
}

/// The mission with one number slightly changed; none if it is then invalid. A unit vector turns.
fn changed(file: &Value, at: &str) -> Option<Valid<Mission<3>>> {
    let mut other = file.clone();
    let number = other.pointer(at)?.as_f64()?;
    let next = if LIMITS.contains(&at) { number * 0.01 } else { number * 1.001 + 1e-4 };
    *other.pointer_mut(at)? = next.into();
    let (row, _) = at.rsplit_once('/')?;
    let names = ["port_normal", "boresight", "axis"];
    if names.iter().any(|name| row.ends_with(name)) {
        let all = other.pointer_mut(row)?.as_array_mut()?;
        let size = all.iter().filter_map(Value::as_f64).map(|x| x * x).sum::<f64>().sqrt();
        for one in all {
            *one = (one.as_f64()? / size).into();
        }
    }
    let file: MissionFile = serde_json::from_value(other).ok()?;
    file.mission().ok()?.sized().validated().ok()
}

/// Numbers without effect in a world where nothing touches the target.
const INERT: [&str; 1] = ["/target/mass_kg"];

/// Limits that have an effect only when reached: the test divides them by a hundred.
const LIMITS: [&str; 2] = ["/servicer/force_limit_n", "/servicer/joint_torque_limit_n_m"];

/// The key of a number: `/servicer/links/mass_kg` of `/servicer/links/0/mass_kg`.
fn key(at: &str) -> String {
    let words: Vec<&str> = at.split('/').filter(|word| word.parse::<usize>().is_err()).collect();
    words.join("/")
}

#[test]
fn each_key_of_a_mission_about_the_world_changes_the_flight() {
    let mission = Mission::<3>::default().validated().unwrap();
    let planned = &planned(&mission, 1)[0];
    let settings = Settings { rate_hz: 1.0, ..Settings::default() };
    let told = |mission: &Valid<Mission<3>>| format!("{:?}", fly(mission, planned, &settings));
    let file = MissionFile::of(&formats::Mission::from(&*mission));
    let (file, usual) = (serde_json::to_value(&file).unwrap(), told(&mission));
    assert_eq!(told(&mission), usual);
    let mut all = Vec::new();
    for section in ["orbit", "target", "servicer"] {
        numbers(&file[section], &format!("/{section}"), &mut all);
    }
    let mut changes: BTreeMap<String, bool> = BTreeMap::new();
    for at in &all {
        let does = changed(&file, at).is_some_and(|other| told(&other) != usual);
        *changes.entry(key(at)).or_default() |= does;
    }
    changes.retain(|key, _| !INERT.contains(&key.as_str()));
    let without: Vec<&String> =
        changes.iter().filter(|(_, does)| !**does).map(|(key, _)| key).collect();
    assert!(without.is_empty(), "no effect: {without:?}");
    for key in ["gravitational_parameter_m3_s2", "semi_major_axis_m", "eccentricity"] {
        assert!(changes.contains_key(&format!("/orbit/{key}")), "{key}");
    }
    let mut still = *mission;
    still.target.gravity_gradient = Switch::Off;
    assert_ne!(told(&still.validated().unwrap()), usual, "gravity gradient");
}
