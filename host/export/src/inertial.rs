//! A motion in inertial axes: rows of ephemerides.

use crate::chief::{Chief, Place};
use crate::epoch::MICROS;
use crate::motion::{Moment, Motion};
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;

/// One of the two spacecraft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacecraft {
    /// The chief.
    Target,
    /// Bus and arm; the attitude is the bus's.
    Servicer,
}

impl Spacecraft {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::Target, Self::Servicer];

    /// Its part in names of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Target => "target",
            Self::Servicer => "servicer",
        }
    }
}

/// A spacecraft at one instant, inertial axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time since the first node [µs].
    pub micros: i64,
    /// Centre of mass [m].
    pub position: Vector3<f64>,
    /// Its rate of change [m/s].
    pub velocity: Vector3<f64>,
    /// Body to inertial, `(x, y, z, w)`.
    pub attitude: Vector4<f64>,
}

/// A row an instant. Attitudes go on without a change of sign, so that they can be interpolated.
pub fn rows(motion: &Motion, chief: &Chief, of: Spacecraft) -> Vec<Row> {
    let mut before = None;
    let row = |moment: &Moment| {
        let mut row = row(moment, &chief.at(moment.micros as f64 / MICROS), of);
        if before.is_some_and(|before: Vector4<f64>| before.dot(&row.attitude) < 0.0) {
            row.attitude = -row.attitude;
        }
        before = Some(row.attitude);
        row
    };
    motion.moments.iter().map(row).collect()
}

fn row(moment: &Moment, chief: &Place, of: Spacecraft) -> Row {
    let frame = quaternion::from_rotation_matrix(chief.axes());
    let ([position, velocity], attitude) = match of {
        Spacecraft::Target => ([chief.position, chief.velocity], &moment.target_attitude),
        Spacecraft::Servicer => (chief.of(&moment.position, &moment.velocity), &moment.attitude),
    };
    let attitude = quaternion::normalized(&quaternion::product(&frame, attitude));
    Row { micros: moment.micros, position, velocity, attitude }
}
