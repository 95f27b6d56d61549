//! Where scenarios are drawn from: not nearer than the arm is long.

use crate::formats::MissionFile;
use remora_core::advanced::model::{Approach, ScenarioRanges};

/// Least distance of a start beyond the far keep-out distance [m].
const BEYOND: f64 = 0.5;

/// Moves the middle of the starts away until even the nearest one is beyond the far keep-out distance.
pub(super) fn keep_off(
    file: &mut MissionFile,
    (approach, scenarios): (&Approach, &ScenarioRanges),
    decided: &mut Vec<String>,
) {
    let least = approach.keep_out_far_m + scenarios.offset_m.max() + BEYOND;
    let given = file.scenarios.standoff_m;
    if given >= least {
        return;
    }
    let least = least.ceil();
    file.scenarios.standoff_m = least;
    decided.push(format!(
        "scenarios start about {least} m in front of the port, not {given} m: the arm extends {:.2} m",
        approach.keep_out_far_m
    ));
}
