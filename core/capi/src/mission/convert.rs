//! From the core's mission to C's and back: both have their fields in one order.
#![allow(unsafe_code, reason = "sees a structure of numbers as words of 32 bits")]

use super::RemoraMission;
use crate::RemoraStatus;
use crate::abi::REMORA_NODES;
use remora_core::advanced::model::{Body, Field, FieldVisitor, Range};
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::prelude::Mission;

/// Flag of the caller, 0 or 1.
pub(crate) fn flag(code: u32, otherwise: RemoraStatus) -> Result<bool, RemoraStatus> {
    match code {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(otherwise),
    }
}

/// Words of the structure of C after its size: a number has two of them, in the processor's order.
struct Words<'a>(&'a mut [u32]);

impl<'a> Words<'a> {
    fn of(mission: &'a mut RemoraMission) -> Self {
        let words = size_of::<RemoraMission>() / size_of::<u32>();
        // SAFETY: the structure consists of words and pairs of words without gaps, and every pattern is a value.
        let all = unsafe { core::slice::from_raw_parts_mut((&raw mut *mission).cast(), words) };
        Self(all.get_mut(1..).unwrap_or_default())
    }

    /// The next words; fewer only after the last member.
    fn next(&mut self, count: usize) -> &'a mut [u32] {
        let rest = core::mem::take(&mut self.0);
        let (next, rest) = rest.split_at_mut(count.min(rest.len()));
        self.0 = rest;
        next
    }
}

/// Writes fields into the structure of C.
struct Writer<'a>(Words<'a>);

impl FieldVisitor for Writer<'_> {
    fn numbers(&mut self, _: Field, values: &mut [f64]) {
        let pairs = self.0.next(2 * values.len()).as_chunks_mut().0;
        for (pair, value) in pairs.iter_mut().zip(values) {
            *pair = pair_of(*value);
        }
    }

    fn word(&mut self, _: Field, value: &mut u32) {
        self.0.next(1).fill(*value);
    }
}

/// Reads fields from the structure of C; tells whether all codes have a meaning.
struct Reader<'a> {
    words: Words<'a>,
    is_sound: bool,
}

impl FieldVisitor for Reader<'_> {
    fn numbers(&mut self, _: Field, values: &mut [f64]) {
        let pairs = self.words.next(2 * values.len()).as_chunks().0;
        for (value, pair) in values.iter_mut().zip(pairs) {
            *value = number_of(*pair);
        }
    }

    fn word(&mut self, field: Field, value: &mut u32) {
        for word in self.words.next(1) {
            *value = *word;
        }
        self.is_sound &= !matches!(field.range, Range::Code(codes) if *value >= codes);
    }
}

fn pair_of(value: f64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = value.to_ne_bytes();
    [u32::from_ne_bytes([a, b, c, d]), u32::from_ne_bytes([e, f, g, h])]
}

fn number_of([first, second]: [u32; 2]) -> f64 {
    let ([a, b, c, d], [e, f, g, h]) = (first.to_ne_bytes(), second.to_ne_bytes());
    f64::from_ne_bytes([a, b, c, d, e, f, g, h])
}

impl RemoraMission {
    /// C's structure of a mission. Members of parts that are not given have values without a meaning.
    pub(crate) fn of(mission: &Mission) -> Self {
        // SAFETY: numbers only, so all zeros is a value.
        let mut told: Self = unsafe { core::mem::zeroed() };
        told.size = size_of::<Self>() as u32;
        let mut mission = *mission;
        mission.visit(&mut Writer(Words::of(&mut told)));
        told
    }

    /// Converts C's mission, if every number is in its range.
    #[inline(never)]
    pub(crate) fn validated(&self) -> Result<Valid<Mission>, RemoraStatus> {
        let (mut told, mut mission) = (*self, Mission::default());
        let mut reader = Reader { words: Words::of(&mut told), is_sound: true };
        mission.visit(&mut reader);
        mission.orbit.body = Body::with(mission.orbit.gravitational_parameter_m3_s2);
        if !reader.is_sound || mission.approach.nodes > REMORA_NODES {
            return Err(RemoraStatus::InvalidMission);
        }
        mission.validated().map_err(|_| RemoraStatus::InvalidMission)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::advanced::model::{Roll, Switch};
    use remora_core::nalgebra::Vector3;

    #[test]
    fn a_mission_goes_to_c_and_back_number_by_number() {
        let mut mission = Mission::default();
        mission.servicer.links[1].inertia_kg_m2[(0, 1)] = 1e-3;
        mission.servicer.links[1].inertia_kg_m2[(1, 0)] = 1e-3;
        mission.servicer.joint_rate_limit_rad_s[2] = 4e-3;
        mission.target.gravity_gradient = Switch::On;
        mission.approach.clearance = Switch::Off;
        let (end_effector, port) = (Vector3::x(), Vector3::y());
        for roll in [None, Some(Roll { end_effector, port })] {
            mission.roll = roll;
            mission.typical_magnitudes = roll.map(|_| mission.typical());
            let there = RemoraMission::of(&mission);
            assert_eq!(*there.validated().unwrap(), mission);
        }
    }

    #[test]
    fn fields_fill_the_structure() {
        let mut told = RemoraMission::of(&Mission::default());
        let mut writer = Writer(Words::of(&mut told));
        let mut mission: Mission = Mission::default();
        mission.visit(&mut writer);
        assert_eq!(writer.0.0.len(), 1, "the member `reserved` is left");
    }

    /// Finds two members of one type swapped in both directions, which the test above cannot.
    #[test]
    fn members_mean_what_they_are_called() {
        let there = RemoraMission::of(&Mission::default());
        assert_eq!((there.keep_out_far_m, there.keep_out_near_m), (1.85, 1.46));
        assert_eq!(
            (there.preset_time_s, there.recovery_time_s, there.keep_out_near_time_s),
            (80.0, 80.0, 360.0)
        );
        assert_eq!(
            (there.target_inertia_body_kg_m2, there.target_half_extents_body_m),
            ([2.5, 3.0, 2.0], [0.4, 0.4, 0.2])
        );
        assert_eq!(
            (there.links[2].tip_from_joint_link_m, there.links[2].mass_kg),
            ([0.0, 0.0, 0.3], 10.0)
        );
        assert_eq!((there.weight_force, there.weight_force_change), (1.0, 0.03));
        assert_eq!((there.weight_bus_torque, there.weight_joint_torque), (0.5, 1.0));
        assert_eq!((there.nodes, there.duration_s), (60, 1200.0));
    }

    #[test]
    fn numbers_out_of_range_and_unknown_codes_are_refused() {
        for change in [
            (|m| m.bus_mass_kg = -1.0) as fn(&mut RemoraMission),
            |m| m.target_mass_kg = f64::NAN,
            |m| m.nodes = 1,
            |m| m.nodes = 61,
            |m| m.clearance = 3,
            |m| m.gravity_gradient = 7,
            |m| m.has_roll = 2,
            |m| m.bus_inertia_body_kg_m2[0][1] = 1.0,
        ] {
            let mut mission = RemoraMission::of(&Mission::default());
            change(&mut mission);
            assert_eq!(mission.validated().unwrap_err(), RemoraStatus::InvalidMission);
        }
    }
}
