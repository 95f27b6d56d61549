//! Where scenarios are drawn from: not nearer than the arm is long.

use crate::formats::MissionFile;
use remora_core::advanced::model::Mission;

/// What a start is beyond the far keep-out distance at least [m].
const BEYOND: f64 = 0.5;

/// Moves the middle of the starts away until even the nearest one is beyond the far keep-out distance.
pub(super) fn keep_off<const NL: usize>(
    file: &mut MissionFile,
    mission: &Mission<NL>,
    decided: &mut Vec<String>,
) {
    let offset = mission.scenarios.offset.max();
    let least = mission.approach.keep_out_far + offset + BEYOND;
    let given = file.scenarios.standoff_m;
    if given >= least {
        return;
    }
    let least = least.ceil();
    file.scenarios.standoff_m = least;
    decided.push(format!(
        "scenarios start about {least} m in front of the port, not {given} m: the arm extends {:.2} m",
        mission.approach.keep_out_far
    ));
}
