use serde::{Deserialize, Serialize};

/// Faults with their times. At most one of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Faults {
    /// A thruster axis gives no force any more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thruster_lost: Option<ThrusterLost>,
    /// A joint's brake closes for good.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_stuck: Option<JointStuck>,
    /// The target's rate changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_rate: Option<TargetRateChange>,
    /// Where given, faults come at a time that is drawn evenly from zero to this [s], instead of theirs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn_within_s: Option<f64>,
}

/// A thruster axis gives no force any more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThrusterLost {
    /// Bus axis: 0, 1 or 2.
    pub axis: usize,
    /// From when on [s].
    pub time_s: f64,
}

/// A joint's brake closes for good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointStuck {
    /// Joint, from the bus, counted from 0.
    pub joint: usize,
    /// From when on [s].
    pub time_s: f64,
}

/// The target's rate changes, all components by the same factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetRateChange {
    /// New rate over old rate.
    pub factor: f64,
    /// When [s].
    pub time_s: f64,
}
