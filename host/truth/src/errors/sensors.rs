use serde::{Deserialize, Serialize};

/// When a sensor samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// Samples a second [Hz].
    pub rate_hz: f64,
    /// From the sample to when it is told [s].
    pub delay_s: f64,
}

/// Rates and delays of the sensors. Samples that fall between control instants cost an integration
/// step each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Relative position.
    pub position: Sampling,
    /// Relative velocity.
    pub velocity: Sampling,
    /// Attitude of the bus.
    pub attitude: Sampling,
    /// Attitude of the target.
    pub target_attitude: Sampling,
    /// Rate of the bus.
    pub bus_rate: Sampling,
    /// Rate of the target.
    pub target_rate: Sampling,
    /// Angles of the joints.
    pub joint_angle: Sampling,
    /// Rates of the joints.
    pub joint_rate: Sampling,
    /// Wrist camera.
    pub wrist_camera: Sampling,
    /// Farthest the wrist camera sees the port [m].
    pub wrist_camera_range_m: f64,
}

impl Sensors {
    /// Every sensor the same.
    pub fn all(sampling: Sampling) -> Self {
        Self {
            position: sampling,
            velocity: sampling,
            attitude: sampling,
            target_attitude: sampling,
            bus_rate: sampling,
            target_rate: sampling,
            joint_angle: sampling,
            joint_rate: sampling,
            wrist_camera: sampling,
            wrist_camera_range_m: 1.0,
        }
    }
}
