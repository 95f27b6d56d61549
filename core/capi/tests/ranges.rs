//! Each number of each structure of the caller's, one at a time out of its range: it is refused, unless this file
//! and the header say that it is accepted.
#![allow(unsafe_code, reason = "changes structures number by number, and calls what C calls")]

mod caller;

use caller::{Caller, sized};
use remora_capi::*;
use remora_core::advanced::model::{Field, FieldVisitor, Range};
use remora_core::prelude::Mission;
use std::mem::offset_of;

/// A member: its name, offset and bytes.
type Member = (&'static str, usize, usize);

/// Members of a structure, in their order.
macro_rules! members {
    ($structure:ty: $($member:ident)*) => {{
        // SAFETY: numbers only, so all zeros is a value.
        let zero: $structure = unsafe { std::mem::zeroed() };
        let members: Vec<Member> = vec![
            $((stringify!($member), offset_of!($structure, $member), size_of_val(&zero.$member))),*
        ];
        members
    }};
}

/// Fields of a mission with their places in the structure of C.
struct Fields {
    at: usize,
    doubles: Vec<(Field, usize, usize)>,
    words: Vec<(Field, usize)>,
}

impl FieldVisitor for Fields {
    fn numbers(&mut self, field: Field, values: &mut [f64]) {
        self.doubles.push((field, self.at, size_of_val(values)));
        self.at += size_of_val(values);
    }

    fn word(&mut self, field: Field, _: &mut u32) {
        self.words.push((field, self.at));
        self.at += 4;
    }
}

impl Fields {
    fn members(&self) -> Vec<Member> {
        self.doubles.iter().map(|(field, at, bytes)| (field.key, *at, *bytes)).collect()
    }

    /// Letters of the values that a field accepts by its range.
    fn accepted(&self, key: &str) -> &'static str {
        let range = self.doubles.iter().find(|(field, ..)| field.key == key).map(|(f, ..)| f.range);
        match range {
            Some(Range::Finite) => "nz",
            Some(Range::Unit) => "n",
            Some(Range::NotNegative) => "z",
            Some(Range::Within(0.0, ..)) => "z",
            _ => "",
        }
    }
}

/// Values that are tried, and the letter by which a table below accepts each.
const OUT_OF_RANGE: [(char, f64); 6] = [
    ('x', f64::NAN),
    ('i', f64::INFINITY),
    ('j', f64::NEG_INFINITY),
    ('n', -1.0),
    ('z', 0.0),
    ('h', 1e300),
];

/// Changes each double of a structure's members. Returns those that were neither refused nor listed.
fn walk<T: Copy>(
    sound: &T,
    members: &[Member],
    accepted: impl Fn(&str) -> &'static str,
    mut call: impl FnMut(&T) -> RemoraStatus,
) -> Vec<String> {
    let mut wrong = Vec::new();
    for (name, at, bytes) in members {
        for place in (*at..at + bytes).step_by(8) {
            for (letter, value) in OUT_OF_RANGE {
                let mut changed = *sound;
                // SAFETY: a double of the structure.
                let number = unsafe { &mut *(&raw mut changed).byte_add(place).cast::<f64>() };
                // The sign is turned, for numbers that must not be negative.
                let value = if letter == 'n' && *number != 0.0 { -*number } else { value };
                if value == *number {
                    continue;
                }
                *number = value;
                let status = call(&changed);
                if status == RemoraStatus::Ok && !accepted(name).contains(letter) {
                    wrong.push(format!("{name} at {place}: {value:e} is accepted"));
                }
            }
        }
    }
    wrong
}

/// Changes each 32-bit number of a structure's members to values that no code, flag or count has.
fn walk_codes<T: Copy>(
    sound: &T,
    members: &[Member],
    values: &[u32],
    mut call: impl FnMut(&T) -> RemoraStatus,
) {
    for (name, at, bytes) in members {
        assert_eq!(*bytes, 4, "{name}");
        for value in values {
            let mut changed = *sound;
            // SAFETY: a number of the structure.
            unsafe { (&raw mut changed).byte_add(*at).cast::<u32>().write(*value) };
            assert_ne!(call(&changed), RemoraStatus::Ok, "{name} = {value} is accepted");
        }
    }
}

/// Checks that the list has all members of a structure but its size and the unread ones.
fn are_all<T>(members: &[&[Member]], not_read: usize) {
    let bytes: usize = members.iter().flat_map(|m| m.iter()).map(|(_, _, bytes)| bytes).sum();
    assert_eq!(bytes + 4 + not_read, size_of::<T>());
}

#[test]
fn every_number_of_a_mission_out_of_range_is_refused() {
    let mut caller = Caller::new();
    let mut sound = caller.mission;
    // Roll and typical magnitudes are read only where they are given.
    (sound.has_roll, sound.has_typical) = (1, 1);
    (sound.roll_ee_link, sound.roll_port_target) = ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    (sound.typical_length_m, sound.typical_velocity_m_s) = (8.0, 0.01);
    (sound.typical_force_n, sound.typical_angle_rad, sound.typical_rate_rad_s) = (1.0, 1.0, 1e-3);
    sound.typical_joint_rate_rad_s = 1e-3;
    (sound.typical_bus_torque_n_m, sound.typical_joint_torque_n_m) = (1e-3, 1e-3);
    let mut fields = Fields { at: 4, doubles: Vec::new(), words: Vec::new() };
    let mut mission: Mission = Mission::default();
    mission.visit(&mut fields);
    assert_eq!(fields.at + 4, size_of::<RemoraMission>(), "members are missing");
    // Angles, directions and positions have signs; zero is allowed where a part may be absent.
    let accepted = |key: &str| match key {
        "servicer.links.mass_kg" | "servicer.links.inertia_kg_m2" => "",
        "approach.recovery_s" | "weights.force_change" => "z",
        _ => fields.accepted(key),
    };
    let mut opens = |mission: &RemoraMission| {
        caller.mission = *mission;
        caller.opens(REMORA_ABI)
    };
    assert_eq!(opens(&sound), RemoraStatus::Ok);
    assert_eq!(walk(&sound, &fields.members(), accepted, &mut opens), [""; 0]);
    for (field, at) in &fields.words {
        let wrong: &[u32] = match field.range {
            Range::Code(codes) => &[codes, u32::MAX],
            _ => &[0, 3, 61, u32::MAX],
        };
        walk_codes(&sound, &[(field.key, *at, 4)], wrong, &mut opens);
    }
}

#[test]
fn every_number_of_a_scenario_out_of_range_is_refused() {
    let mut caller = Caller::asking_little(4, RemoraIntegrator::Euler, 1e5);
    let mut sound = caller.scenario;
    (sound.has_bus_attitude, sound.has_joint_angle) = (1, 1);
    sound.bus_attitude_body_to_rtn = [0.0, -0.5f64.sqrt(), 0.0, 0.5f64.sqrt()];
    sound.joint_angle_rad = caller.mission.initial_joint_angle_rad;
    let doubles = members!(RemoraScenario:
        target_attitude_body_to_rtn target_rate_body_rad_s com_position_rtn_m com_velocity_rtn_m_s
        duration_s bus_attitude_body_to_rtn bus_rate_rtn_rad_s joint_angle_rad joint_rate_rad_s);
    let flags = members!(RemoraScenario: has_bus_attitude has_joint_angle);
    let counts = members!(RemoraScenario: nodes);
    are_all::<RemoraScenario>(&[&doubles, &flags, &counts], 0);
    // The planner decides whether there is a plan from there.
    let accepted = |name: &str| if name == "duration_s" { "z" } else { "nz" };
    let mut plans = |scenario: &RemoraScenario| {
        caller.scenario = *scenario;
        caller.plans()
    };
    assert_eq!(walk(&sound, &doubles, accepted, &mut plans), [""; 0]);
    walk_codes(&sound, &flags, &[2, u32::MAX], &mut plans);
    walk_codes(&sound, &counts, &[1, 3, 61, u32::MAX], &mut plans);
}

#[test]
fn every_option_out_of_range_is_refused() {
    let mut caller = Caller::asking_little(4, RemoraIntegrator::Euler, 1e5);
    let mut sound = caller.options;
    sound.integrator = RemoraIntegrator::Rk4 as u32;
    let doubles = members!(RemoraOptions: deadline_s);
    let mut plans = |options: &RemoraOptions| {
        caller.options = *options;
        caller.plans()
    };
    // No clock, so the only deadline is INFINITY.
    assert_eq!(walk(&sound, &doubles, |_| "i", &mut plans), [""; 0]);
    let codes = members!(RemoraOptions: mode integrator);
    walk_codes(&sound, &codes, &[2, u32::MAX], &mut plans);
    walk_codes(&sound, &members!(RemoraOptions: substeps), &[0, 3, 1001, u32::MAX], &mut plans);
    sound.model_bytes = 1;
    assert_eq!(plans(&sound), RemoraStatus::Null);
    sound.model = std::ptr::dangling();
    sound.model_bytes = usize::MAX;
    assert_eq!(plans(&sound), RemoraStatus::InvalidOption);
}

#[test]
fn every_setting_of_guidance_out_of_range_is_refused() {
    let mut caller = Caller::new();
    let sound = caller.settings;
    let doubles = members!(RemoraGuidance:
        com_bandwidth_rad_s bus_bandwidth_rad_s joint_bandwidth_rad_s most_per_step_rad integral
        integral_limit_com_m integral_limit_angle_rad fade_plan_s fade_turn_s camera_bandwidth_rad_s
        closing_distances_m closing_out_s closing_back_s closing_settle_s replan_age_s replan_com_m
        replan_bus_rad replan_target_rad replan_last_s abort_settling_com_m abort_settling_bus_rad
        abort_settling_joint_rad abort_settled_com_m abort_settled_bus_rad abort_settled_joint_rad
        abort_settles_s abort_near_com_m abort_near_bus_rad abort_near_joint_rad abort_near_times_s
        abort_port_m);
    are_all::<RemoraGuidance>(&[&doubles], 4);
    let accepted = |name: &str| match name {
        "integral" | "integral_limit_com_m" | "integral_limit_angle_rad" => "z",
        "closing_distances_m" | "closing_settle_s" | "closing_back_s" => "z",
        "replan_last_s" | "abort_settles_s" | "abort_near_times_s" => "z",
        name if name.starts_with("replan_") || name.starts_with("abort_") => "i",
        _ => "",
    };
    let flies = |settings: &RemoraGuidance| {
        caller.settings = *settings;
        caller.flies()
    };
    assert_eq!(walk(&sound, &doubles, accepted, flies), [""; 0]);
}

/// A flight that has just begun. Each step is made by a clone, and so is its first.
fn flying() -> Caller {
    let mut caller = Caller::planned_little(4, RemoraIntegrator::Rk4, 1e5);
    caller.takes_off();
    caller
}

#[test]
fn every_limit_out_of_range_is_refused() {
    let caller = flying();
    let mut sound: RemoraLimits = sized(|s, size| s.size = size);
    sound.max_bus_force_rtn_n = [2.0; 3];
    (sound.max_bus_torque_body_n_m, sound.max_joint_torque_n_m) = ([5e-3; 3], [5e-3; 3]);
    let doubles = members!(RemoraLimits:
        max_bus_force_rtn_n max_bus_torque_body_n_m max_joint_torque_n_m);
    are_all::<RemoraLimits>(&[&doubles], 4);
    let guides = |limits: &RemoraLimits| caller.clone().guides(Some(limits));
    assert_eq!(walk(&sound, &doubles, |_| "z", guides), [""; 0]);
}

/// Guidance answers numbers that are not finite, or beyond 1e30, with the planned command.
#[test]
fn every_number_of_an_estimate_out_of_range_is_refused_or_answered_as_degraded() {
    let caller = flying();
    let mut sound = caller.estimate;
    sound.has_ee_from_port = 1;
    sound.ee_from_port_rtn_m = [1e-3, 2e-3, 3e-3];
    let doubles = members!(RemoraEstimate:
        time_s bus_position_rtn_m bus_velocity_rtn_m_s bus_attitude_body_to_rtn bus_rate_rtn_rad_s
        joint_angle_rad joint_rate_rad_s target_attitude_body_to_rtn target_rate_rtn_rad_s
        ee_from_port_rtn_m);
    let flags = members!(RemoraEstimate: has_ee_from_port);
    are_all::<RemoraEstimate>(&[&doubles, &flags], 0);
    let guides = |estimate: &RemoraEstimate| {
        let mut caller = caller.clone();
        caller.estimate = *estimate;
        let status = caller.guides(None);
        if status == RemoraStatus::Ok {
            let RemoraCommand { mode, bus_force_rtn_n, .. } = caller.command;
            assert!(bus_force_rtn_n.iter().all(|x| x.is_finite()));
            // SAFETY: an estimate is numbers of eight bytes, flags first.
            let numbers: [f64; size_of::<RemoraEstimate>() / 8] =
                unsafe { std::mem::transmute_copy(estimate) };
            let is_usable = numbers.iter().all(|x| x.abs() <= 1e30);
            assert_eq!(mode == RemoraFlightMode::Degraded as u32, !is_usable);
        }
        status
    };
    assert_eq!(walk(&sound, &doubles, |_| "xijnzh", guides), [""; 0]);
    walk_codes(&sound, &flags, &[2, u32::MAX], guides);
    // An attitude that is not of unit length.
    for scale in [0.0, 0.5, 0.99, 1.01, 2.0] {
        let mut estimate = sound;
        estimate.target_attitude_body_to_rtn.iter_mut().for_each(|x| *x *= scale);
        assert_eq!(guides(&estimate), RemoraStatus::InvalidEstimate, "{scale}");
    }
    let replans = |estimate: &RemoraEstimate| {
        let mut caller = caller.clone();
        caller.estimate = *estimate;
        caller.replans(10.0)
    };
    assert_eq!(walk(&sound, &doubles, |_| "nz", replans), [""; 0]);
}

#[test]
fn every_argument_out_of_range_is_refused() {
    let mut caller = flying();
    for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
        assert_ne!(caller.hands_over(time), RemoraStatus::Ok, "{time}");
        assert_ne!(caller.replans(time), RemoraStatus::Ok, "{time}");
        let flight = caller.flight.pointer();
        // SAFETY: both pointers are to memory of this test.
        let status = unsafe { remora_expected(flight, time, &mut caller.estimate) };
        assert_eq!(status, RemoraStatus::InvalidTime, "{time}");
    }
    assert_eq!(caller.replans(-1.0), RemoraStatus::InvalidTime);
    for code in [0, 3, u32::MAX] {
        // SAFETY: the pointer is to a flight of this test.
        let status = unsafe { remora_ask(caller.flight.pointer(), code) };
        assert_eq!(status, RemoraStatus::InvalidOption, "{code}");
    }
    for code in [2, u32::MAX] {
        let mut sum = 0;
        // SAFETY: both pointers are to memory of this test.
        let status = unsafe { remora_self_test(caller.workspace.pointer(), code, &mut sum) };
        assert_eq!(status, RemoraStatus::InvalidOption, "{code}");
    }
    for index in [4, u32::MAX] {
        assert_eq!(caller.copies_node(index), RemoraStatus::NoSuchNode);
    }
}
