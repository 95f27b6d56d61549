//! Joint angles at the start: given, or the first of a few that are clear of the arm's own bus.

use super::bus::shown_angles;
use crate::error::FieldError;
use crate::formats::{JointVector, Mission, MissionFile, capture_search};
use remora_core::advanced::model::CaptureSearch;
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
/// The error of [`MissionFile::mission`]; a start within its own bus.
pub(super) fn choose(
    file: &mut MissionFile,
    given: Option<&[f64]>,
    decided: &mut Vec<String>,
) -> Result<Mission, FieldError> {
    if let Some(angles) = given {
        file.servicer.initial_joint_angle_rad = angles.to_vec();
        let mission = file.mission()?;
        return match depth(&mission, 0.0) {
            depth if depth > 0.0 => {
                Err(within(format!("is {depth:.3} m within the arm's own bus")))
            }
            _ => Ok(mission),
        };
    }
    let straight = file.mission()?;
    let mut clear: Option<Mission> = None;
    for start in candidates(&straight) {
        // The cheap check comes first: making the mission searches for its angles at capture.
        let mut begun = straight;
        begun.servicer.initial_joint_angle_rad = start;
        if depth(&begun, begun.margins.clearance_m) > 0.0 {
            continue;
        }
        file.servicer.initial_joint_angle_rad = at_start(&begun).into();
        let Ok(mission) = file.mission() else { continue };
        if is_way_clear(&mission) {
            let why = "turns straight to its angles at capture, clear of its own bus";
            decided.push(said(&mission, why));
            return Ok(mission);
        }
        clear.get_or_insert(mission);
    }
    let reason = "none of the arms that were tried is clear of its own bus: give one";
    let mission = clear.ok_or_else(|| within(reason.into()))?;
    file.servicer.initial_joint_angle_rad = at_start(&mission).into();
    let why = "is clear of its own bus, though not all the way to its angles at capture";
    decided.push(said(&mission, why));
    Ok(mission)
}

/// Candidates for the start: straight as far as the stops allow, one joint bent, the middle of
/// the stops.
fn candidates(mission: &Mission) -> Vec<JointVector> {
    let (s, margin) = (&mission.servicer, mission.margins.joint_angle_rad);
    let middle = (s.min_joint_angle_rad + s.max_joint_angle_rad) * 0.5;
    let room = (s.max_joint_angle_rad - s.min_joint_angle_rad) * 0.5;
    let room = room.map(|half| (half - margin).max(0.0));
    let within = |angles: JointVector| {
        JointVector::from_fn(|i, _| angles[i].clamp(middle[i] - room[i], middle[i] + room[i]))
    };
    let straight = within(JointVector::zeros());
    let bent = |i: usize, by: f64| {
        let mut angles = straight;
        angles[i] += by;
        within(angles)
    };
    let single = (0..mission.joints()).flat_map(|i| BENDS.map(|by| bent(i, by)));
    [straight].into_iter().chain(single).chain([middle]).collect()
}

/// How deep the arm is in its own bus, beyond its first link, `clearance` about it [m]; negative where it
/// is clear.
fn depth(mission: &Mission, clearance: f64) -> f64 {
    let search = search(mission, clearance);
    mission.capture_violation(&search, &mission.servicer.initial_joint_angle_rad).bus
}

fn is_way_clear(mission: &Mission) -> bool {
    let s = &mission.servicer;
    let search = search(mission, 0.0);
    let way = s.capture_joint_angle_rad - s.initial_joint_angle_rad;
    (0..=WAY).all(|step| {
        let angles = s.initial_joint_angle_rad + way * (step as f64 / WAY as f64);
        mission.capture_violation(&search, &angles).bus <= 0.0
    })
}

fn search(mission: &Mission, clearance: f64) -> CaptureSearch {
    CaptureSearch { clearance, ..capture_search(mission, mission.servicer.boresight) }
}

fn within(reason: String) -> FieldError {
    FieldError::new("servicer.initial_joint_angle_rad", reason)
}

/// Angles at the start of the joints that the arm has.
fn at_start(mission: &Mission) -> &[f64] {
    &mission.servicer.initial_joint_angle_rad.as_slice()[..mission.joints()]
}

fn said(mission: &Mission, why: &str) -> String {
    let angles = shown_angles(at_start(mission));
    format!("the arm starts at {angles} rad, from where it {why}; --start a,b,... gives another")
}
