//! Report of `remora learn dataset`.

use super::time;
use remora_learn::dataset::{Made, Trajectory};
use std::path::Path;

/// Counts, time, directory.
pub fn dataset_report(made: &Made, joints: usize, wall_s: f64, directory: &Path) -> String {
    let Made { tried, kept, now } = made;
    let rate = 100.0 * *kept as f64 / (*tried).max(1) as f64;
    let size = *kept as f64 * Trajectory::bytes(joints) as f64 / 1e6;
    format!(
        "{tried} scenarios: {kept} trajectories kept ({rate:.2} %), {size:.1} MB\n\
         {now} planned in {}, {} there before\nwritten: {}\n",
        time(wall_s),
        tried - now,
        directory.display(),
    )
}
