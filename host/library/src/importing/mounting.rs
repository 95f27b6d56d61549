//! How near to the bus the mounting itself brings the arm.

use super::bus::numbers;
use crate::formats::{Mission, MissionFile};
use remora_core::advanced::model::{Link, signed_distance_to_box};

/// Steps of each joint of the mounting, over its stops.
const STEPS: usize = 12;
/// Most joints that are looked at: arms have at most two before their first link of any length.
const MOST: usize = 2;
/// Least clearance worth keeping; a smaller one counts as none [m].
const LEAST: f64 = 5e-3;
/// Step to which a clearance is rounded down [m].
const STEP: f64 = 1e-3;

/// Fits margin or radius where the second link cannot keep the margin to the bus anywhere. The
/// margin shrinks to the gap left. Where that is next to nothing, the link's radius shrinks
/// instead: thicker parts belong to the mounting.
pub(super) fn fit(
    file: &mut MissionFile,
    mission: &Mission,
    names: &[String],
    decided: &mut Vec<String>,
) {
    let links = &mission.servicer.links;
    let mut long = (0..mission.joints()).filter(|i| links.get(*i).is_some_and(Link::has_length));
    let (Some(first), Some(second)) = (long.next(), long.next()) else { return };
    if let Some(name) = names.get(second) {
        let far = farthest(mission, first);
        fit_link(file, (second, name), (far, mission.margins.clearance_m), decided);
    }
}

/// Fits the link at this place and of this name. Its joint gets `far` from the bus [m]; `margin`
/// is the mission's [m].
fn fit_link(
    file: &mut MissionFile,
    (at, name): (usize, &str),
    (far, margin): (f64, f64),
    decided: &mut Vec<String>,
) {
    let Some(link) = file.servicer.links.get_mut(at) else { return };
    // A capsule that begins elsewhere is not held at the bus by its joint.
    if link.capsule_start_m.amax() > 0.0 {
        return;
    }
    let gap = far - link.radius_m;
    // Rounding must leave the search room.
    if gap >= margin + STEP {
        return;
    }
    if gap >= LEAST + STEP {
        let left = ((gap - STEP) / STEP).floor() * STEP;
        decided.push(format!(
            "link {name} is mounted {} m from the bus: planning keeps a margin of {} m between bodies, not {margin}",
            numbers(&[gap]),
            numbers(&[left])
        ));
        file.margins.clearance_m = left;
        return;
    }
    let radius = (far - margin - STEP).max(0.0);
    decided.push(format!(
        "the joint of link {name} is {} m from the bus, within the link's radius of {} m: the radius is taken as {} m, \
         what is thicker as the mounting",
        numbers(&[far]),
        numbers(&[link.radius_m]),
        numbers(&[radius])
    ));
    link.radius_m = radius;
}

/// Farthest that the end of link `last` gets from the bus's box [m].
fn farthest(mission: &Mission, last: usize) -> f64 {
    let s = &mission.servicer;
    let mut arm = *s;
    // Links after it get no length, so that the end effector is the end of the link.
    arm.links.iter_mut().skip(last + 1).for_each(|link| link.tip_m.fill(0.0));
    let moving = last.min(MOST - 1) + 1;
    let count = (STEPS + 1).pow(moving as u32);
    let distance = |index: usize| {
        let mut angles = s.initial_joint_angle_rad;
        for i in 0..moving {
            let share = (index / (STEPS + 1).pow(i as u32)) % (STEPS + 1);
            let way = s.max_joint_angle_rad[i] - s.min_joint_angle_rad[i];
            angles[i] = s.min_joint_angle_rad[i] + way * share as f64 / STEPS as f64;
        }
        let (_, end) = arm.center_of_mass_and_end_effector(&angles);
        signed_distance_to_box(&s.bus_half_extents_m, &end).value
    };
    (0..count).map(distance).fold(f64::NEG_INFINITY, f64::max)
}
