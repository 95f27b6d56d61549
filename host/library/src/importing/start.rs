//! Joint angles at the start: given, or the first of a few that are clear of the arm's own bus.

use super::bus::shown_angles;
use crate::error::FieldError;
use crate::formats::{MissionFile, capture_search};
use nalgebra::SVector;
use remora_core::advanced::model::{CaptureSearch, Mission};
use std::f64::consts::FRAC_PI_4;

/// Bends of a single joint that are tried [rad].
const BENDS: [f64; 4] = [FRAC_PI_4, -FRAC_PI_4, 2.0 * FRAC_PI_4, -2.0 * FRAC_PI_4];
/// Points of the straight way to the angles at capture that are looked at.
const WAY: usize = 20;

/// The mission with joint angles at the start that are given, or with the first of the candidates from
/// which the arm turns straight to its angles at capture and stays clear of its own bus all the way; where
/// there is none, the first that is itself clear. The file gets them.
///
/// # Errors
/// As [`MissionFile::mission_of`]; a start within its own bus.
pub(super) fn choose<const NL: usize>(
    file: &mut MissionFile,
    given: Option<&[f64]>,
    decided: &mut Vec<String>,
) -> Result<Mission<NL>, FieldError> {
    if let Some(angles) = given {
        file.servicer.initial_joint_angle_rad = angles.to_vec();
        let mission = file.mission_of::<NL>()?;
        return match depth(&mission, 0.0) {
            depth if depth > 0.0 => {
                Err(within(format!("is {depth:.3} m within the arm's own bus")))
            }
            _ => Ok(mission),
        };
    }
    let straight = file.mission_of::<NL>()?;
    let mut clear: Option<Mission<NL>> = None;
    for start in candidates(&straight) {
        // What costs little comes first: a mission is not had without its angles at capture, which are
        // searched for.
        let mut begun = straight;
        begun.servicer.initial_joint_angle_rad = start;
        if depth(&begun, begun.margins.clearance_m) > 0.0 {
            continue;
        }
        file.servicer.initial_joint_angle_rad = start.as_slice().into();
        let Ok(mission) = file.mission_of::<NL>() else { continue };
        if is_way_clear(&mission) {
            let why = "turns straight to its angles at capture, clear of its own bus";
            decided.push(said(start.as_slice(), why));
            return Ok(mission);
        }
        clear.get_or_insert(mission);
    }
    let reason = "none of the arms that were tried is clear of its own bus: give one";
    let mission = clear.ok_or_else(|| within(reason.into()))?;
    let start = mission.servicer.initial_joint_angle_rad.as_slice();
    file.servicer.initial_joint_angle_rad = start.into();
    let why = "is clear of its own bus, though not all the way to its angles at capture";
    decided.push(said(start, why));
    Ok(mission)
}

/// As straight as the stops let it be, in the middle of the stops, and with one joint bent, or the first
/// and another.
fn candidates<const NL: usize>(mission: &Mission<NL>) -> Vec<SVector<f64, NL>> {
    let (s, margin) = (&mission.servicer, mission.margins.joint_angle_rad);
    let middle = (s.min_joint_angle_rad + s.max_joint_angle_rad) * 0.5;
    let room = (s.max_joint_angle_rad - s.min_joint_angle_rad) * 0.5;
    let room = room.map(|half| (half - margin).max(0.0));
    let within = |angles: SVector<f64, NL>| {
        SVector::from_fn(|i, _| angles[i].clamp(middle[i] - room[i], middle[i] + room[i]))
    };
    let straight = within(SVector::zeros());
    let bent = |i: usize, by: f64| {
        let mut angles = straight;
        angles[i] += by;
        within(angles)
    };
    let single = (0..NL).flat_map(|i| BENDS.map(|by| bent(i, by)));
    [straight].into_iter().chain(single).chain([middle]).collect()
}

/// How deep the arm is in its own bus, beyond its first link, `clearance` about it [m]; negative where it
/// is clear.
fn depth<const NL: usize>(mission: &Mission<NL>, clearance: f64) -> f64 {
    let search = search(mission, clearance);
    let servicer = &mission.servicer;
    servicer.capture_violation(&search, &servicer.initial_joint_angle_rad).bus
}

fn is_way_clear<const NL: usize>(mission: &Mission<NL>) -> bool {
    let s = &mission.servicer;
    let search = search(mission, 0.0);
    let way = s.capture_joint_angle_rad - s.initial_joint_angle_rad;
    (0..=WAY).all(|step| {
        let angles = s.initial_joint_angle_rad + way * (step as f64 / WAY as f64);
        s.capture_violation(&search, &angles).bus <= 0.0
    })
}

fn search<const NL: usize>(mission: &Mission<NL>, clearance: f64) -> CaptureSearch {
    CaptureSearch { clearance, ..capture_search(mission, mission.servicer.boresight) }
}

fn within(reason: String) -> FieldError {
    FieldError::new("servicer.initial_joint_angle_rad", reason)
}

fn said(start: &[f64], why: &str) -> String {
    let angles = shown_angles(start);
    format!("the arm starts at {angles} rad, from where it {why}; --start a,b,... gives another")
}
