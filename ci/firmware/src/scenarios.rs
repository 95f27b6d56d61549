//! The audit's scenarios of `fixtures/`, as constants, and their mission.

use core::hint::black_box;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::qp::Valid;
use remora_core::advanced::stages::LINKS;

include!(concat!(env!("OUT_DIR"), "/scenarios.rs"));

/// The mission. Missions are data: were this one a constant, the compiler could prove bounds with it that no
/// other mission has.
#[inline(never)]
pub fn mission() -> Valid<Mission<LINKS>> {
    black_box(Valid::of_constant(Mission::default()))
}

/// The scenarios in the order of their file, with their names.
pub fn all() -> impl Iterator<Item = (&'static str, Scenario)> {
    ROWS.iter().map(|(id, row)| (*id, scenario(row)))
}

/// Scenario as the host reads it from the file: its quaternion normalised.
fn scenario(row: &[f64; 13]) -> Scenario {
    let [qx, qy, qz, qw, wx, wy, wz, x, y, z, vx, vy, vz] = *row;
    Scenario {
        target_attitude: quaternion::normalized(&[qx, qy, qz, qw].into()),
        target_rate: [wx, wy, wz].into(),
        position: [x, y, z].into(),
        velocity: [vx, vy, vz].into(),
        ..Scenario::default()
    }
}
