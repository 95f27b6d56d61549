//! The features of a node.
//!
//! They come in five groups, the paper's tokens, in the order in which a network takes them:
//! previous action, time, target, centre of mass, state. A network may embed each group as a token
//! of its own or all of them as one.
//!
//! Three encodings. [`Encoding::Paper`] has the paper's numbers, 36 for three joints, resolved in RTN. In
//! [`Encoding::Body`] every direction is resolved in bus axes, so that approaches that differ by a
//! rotation look nearly alike (the orbit's own directions, which are among the features, are all
//! that tells them apart), and what lies ahead is among them, for it is known: the line of sight
//! at nodes to come, the forces to come, the turn and the bend left to be made and the mean
//! rates that would make them. [`Encoding::Servicer`] adds the servicer's own numbers, for a network of
//! many servicers: mass, inertia and torques of the bus, and of each joint its link's length and mass, its
//! limits and its angle at capture. All are raw: SI units, unit vectors, radians.

use super::Scene;
use crate::dynamics::State;
use crate::math::quaternion;
use crate::stages::{NODES, size};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Which numbers a node's features are, and in which frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Encoding {
    /// The paper's, in RTN.
    Paper = 0,
    /// In bus axes, with what lies ahead.
    Body = 1,
    /// In bus axes, with what lies ahead, and with the servicer's numbers beside the time.
    Servicer = 2,
}

impl Encoding {
    /// Its number in a model file.
    pub const fn tag(self) -> u8 {
        self as u8
    }

    /// The one of this number.
    pub const fn of_tag(tag: u8) -> Option<Self> {
        match tag {
            0 => Some(Self::Paper),
            1 => Some(Self::Body),
            2 => Some(Self::Servicer),
            _ => None,
        }
    }

    /// Sizes of the five groups for an arm of so many joints: previous action, time, target, centre of
    /// mass, state.
    pub const fn groups(self, joints: usize) -> [usize; 5] {
        let action = size::controls(joints);
        match self {
            Self::Paper => [action, 1, 7, 9, 7 + 2 * joints],
            Self::Body => [action, 1, 24, 21, 9 + 3 * joints],
            Self::Servicer => [action, 1 + 7 + 5 * joints, 24, 21, 9 + 3 * joints],
        }
    }

    /// How many numbers stand before each row of one number a joint; the last row is the features' end.
    pub const fn gaps(self) -> &'static [usize] {
        match self {
            Self::Paper => &[3, 1 + 7 + 9 + 4, 3],
            Self::Body => &[3, 1 + 24 + 21 + 3, 0, 6],
            Self::Servicer => &[3, 1 + 7, 0, 0, 0, 0, 24 + 21 + 3, 0, 6],
        }
    }

    /// Features of a node for an arm of so many joints.
    pub const fn features(self, joints: usize) -> usize {
        let [a, b, c, d, e] = self.groups(joints);
        a + b + c + d + e
    }
}

/// Most joints of an arm for which a rollout has room.
pub const MAX_JOINTS: usize = 7;

/// Most features a node has in any encoding.
pub const MAX_FEATURES: usize = Encoding::Servicer.features(MAX_JOINTS);

/// How many nodes ahead the line of sight is looked up, but for the last, which is always.
const SIGHTS_AHEAD: [usize; 5] = [0, 3, 6, 12, 24];

/// Intervals ahead, from and to, over which forces are averaged.
const FORCES_AHEAD: [(usize, usize); 5] = [(0, 1), (1, 2), (2, 6), (6, 14), (14, NODES)];

/// Writes numbers one after the other; what does not fit is dropped.
struct Writer<'a>(core::slice::IterMut<'a, f32>);

impl Writer<'_> {
    fn put(&mut self, value: f64) {
        if let Some(slot) = self.0.next() {
            *slot = value as f32;
        }
    }

    fn put_all(&mut self, values: &[f64]) {
        values.iter().for_each(|v| self.put(*v));
    }
}

impl<const NL: usize> Scene<'_, NL> {
    /// Writes the features of node `k` in `state`, reached by the first action of `previous` (ignored at
    /// the first node, where zeros stand for it), into the first [`Encoding::features`] of `out`.
    pub fn features(
        &self,
        encoding: Encoding,
        k: usize,
        state: &State<NL>,
        previous: &[f32],
        out: &mut [f32],
    ) {
        // No node is beyond the last: no panic in the image.
        let k = k.min(NODES - 1);
        let mut out = Writer(out.iter_mut());
        for i in 0..size::controls(NL) {
            let value = previous.get(i).filter(|_| k > 0);
            out.put(value.copied().map_or(0.0, f64::from));
        }
        out.put(self.last.saturating_sub(k) as f64 * self.dt);
        match encoding {
            Encoding::Paper => self.paper_features(k, state, &mut out),
            Encoding::Body => self.body_features(k, state, &mut out),
            Encoding::Servicer => {
                self.servicer_features(&mut out);
                self.body_features(k, state, &mut out);
            }
        }
    }

    /// The servicer's numbers, the same at each node.
    fn servicer_features(&self, out: &mut Writer<'_>) {
        let servicer = &self.mission.servicer;
        out.put(servicer.bus_mass_kg);
        out.put_all(servicer.bus_inertia_kg_m2.diagonal().as_slice());
        out.put_all(servicer.bus_torque_limit_n_m.as_slice());
        for link in &servicer.links {
            out.put(libm::sqrt(link.tip_m.norm_squared()));
        }
        servicer.links.iter().for_each(|link| out.put(link.mass_kg));
        out.put_all(servicer.joint_rate_limit_rad_s.as_slice());
        out.put_all(servicer.joint_torque_limit_n_m.as_slice());
        out.put_all(servicer.capture_joint_angle_rad.as_slice());
    }

    fn paper_features(&self, k: usize, state: &State<NL>, out: &mut Writer<'_>) {
        let target = &self.target[k];
        let upright = self.target[0].attitude.w >= 0.0;
        out.put_all((target.attitude * if upright { 1.0 } else { -1.0 }).as_slice());
        out.put_all(target.rate.as_slice());
        out.put_all(self.translation.position[k].as_slice());
        out.put_all(self.translation.velocity[k].as_slice());
        out.put_all(self.translation.force[k].as_slice());
        out.put_all(self.bus_attitude(state).as_slice());
        out.put_all(state.joint_angle.as_slice());
        out.put_all(state.rate.as_slice());
        out.put_all(state.joint_rate.as_slice());
    }

    /// The attitude with the sign that is continuous along an approach, positive `w` at its start.
    fn bus_attitude(&self, state: &State<NL>) -> Vector4<f64> {
        let start = self.mission.bus_attitude_at_start(self.scenario);
        let upright = (state.attitude.dot(&start) >= 0.0) == (start.w >= 0.0);
        state.attitude * if upright { 1.0 } else { -1.0 }
    }

    fn body_features(&self, k: usize, state: &State<NL>, out: &mut Writer<'_>) {
        let to_body = quaternion::rotation_matrix(&state.attitude).transpose();
        self.target_ahead(k, &to_body, out);
        out.put_all(to_body.column(0).as_slice());
        out.put_all(to_body.column(2).as_slice());
        for (from, to) in FORCES_AHEAD {
            out.put_all((to_body * self.mean_force(k + from, k + to)).as_slice());
        }
        out.put_all((to_body * state.rate).as_slice());
        out.put_all(state.joint_angle.as_slice());
        out.put_all(state.joint_rate.as_slice());
        self.what_is_left(k, state, &to_body, out);
    }

    /// Value at node `k`, or at the last node where that comes before.
    fn at_or_last<'v, T>(&self, values: &'v [T; NODES], k: usize) -> &'v T {
        &values[k.min(self.last).min(NODES - 1)]
    }

    /// Lines of sight and the target's last attitude and rate.
    fn target_ahead(&self, k: usize, to_body: &Matrix3<f64>, out: &mut Writer<'_>) {
        for ahead in SIGHTS_AHEAD {
            out.put_all((to_body * self.at_or_last(&self.sight, k + ahead)).as_slice());
        }
        out.put_all((to_body * self.at_or_last(&self.sight, NODES)).as_slice());
        out.put_all((to_body * self.approach).as_slice());
        out.put_all((to_body * self.at_or_last(self.target, NODES).rate).as_slice());
    }

    /// Turn to be made until the end effector points at the port, and the mean rates that would
    /// make it and the joints' travel in the time left.
    fn what_is_left(
        &self,
        k: usize,
        state: &State<NL>,
        to_body: &Matrix3<f64>,
        out: &mut Writer<'_>,
    ) {
        let time = self.last.saturating_sub(k).max(1) as f64 * self.dt;
        let turn = quaternion::log(&quaternion::between(&self.arm, &(to_body * self.approach)));
        out.put_all(turn.as_slice());
        out.put_all((turn / time).as_slice());
        let travel = self.mission.servicer.capture_joint_angle_rad - state.joint_angle;
        let time = self.preset.saturating_sub(k).max(1) as f64 * self.dt;
        let open = if k < self.preset { 1.0 } else { 0.0 };
        out.put_all((travel * (open / time)).as_slice());
    }

    /// Mean force over intervals `from..to`, those beyond the horizon left out.
    fn mean_force(&self, from: usize, to: usize) -> Vector3<f64> {
        let forces = self.translation.force.get(from..to.min(self.last)).unwrap_or(&[]);
        let sum = forces.iter().fold(Vector3::zeros(), |sum: Vector3<f64>, f| sum + f);
        sum / forces.len().max(1) as f64
    }
}
