//! Stage 1 under verification: the system's centre of mass.

use super::PARTS;
use super::distance::point_to_box;
use super::posture::Posture;
use super::residuals::{RATE_SCALE, Residuals, excess, worst};
use super::start::Beyond;
use crate::math::quaternion;
use crate::model::{Grid, Mission, Scenario, TargetState, hcw_acceleration};
use crate::stages::TranslationTrajectory;
use crate::stages::worse;
use nalgebra::Vector3;

/// A path, and whether limits hold between its nodes.
pub(super) struct Path<'a, const N: usize, const NL: usize> {
    pub mission: &'a Mission<NL>,
    pub grid: Grid,
    pub trajectory: &'a TranslationTrajectory<N>,
    pub between: bool,
    pub beyond: &'a Beyond<NL>,
}

/// The path over one interval: the states at its ends, the force that is held.
pub(super) struct Leg<'a> {
    pub k: usize,
    pub position: (&'a Vector3<f64>, &'a Vector3<f64>),
    pub velocity: (&'a Vector3<f64>, &'a Vector3<f64>),
    pub force: &'a Vector3<f64>,
}

impl<'a, const N: usize, const NL: usize> Path<'a, N, NL> {
    /// Length of an interval [s].
    pub fn dt(&self) -> f64 {
        self.grid.interval()
    }

    /// The last node.
    pub fn last(&self) -> usize {
        self.grid.last().min(N - 1)
    }

    /// The intervals, from the first on.
    pub fn legs(&self) -> impl Iterator<Item = Leg<'a>> {
        let TranslationTrajectory { position, velocity, force } = self.trajectory;
        let positions = position.iter().zip(position.iter().skip(1));
        let velocities = velocity.iter().zip(velocity.iter().skip(1));
        positions
            .zip(velocities)
            .zip(force)
            .take(self.last())
            .enumerate()
            .map(|(k, ((position, velocity), force))| Leg { k, position, velocity, force })
    }

    pub fn begin(&self, scenario: &Scenario<NL>, out: &mut Residuals) {
        let t = self.trajectory;
        let position = t.position[0] - scenario.position;
        out.dynamics1 = worse(out.dynamics1, error(position, t.velocity[0] - scenario.velocity));
    }

    /// Judges a node and what follows it up to the next. Returns the positions at the ends of
    /// the interval's parts.
    pub fn interval(
        &self,
        leg: &Leg<'_>,
        target: &[TargetState; PARTS + 1],
        out: &mut Residuals,
    ) -> [Vector3<f64>; PARTS + 1] {
        let (mission, force) = (self.mission, leg.force);
        let (mut r, mut v) = (*leg.position.0, *leg.velocity.0);
        let mut positions = [r; PARTS + 1];
        for part in 0..PARTS {
            (r, v) = propagate(mission, self.dt() / PARTS as f64, r, v, force);
            positions[part + 1] = r;
        }
        let defect = error(r - leg.position.1, v - leg.velocity.1);
        out.dynamics1 = worse(out.dynamics1, defect);
        out.control =
            worse(out.control, excess(force.as_slice(), mission.servicer.force_limit_n.as_slice()));

        let (at_node, within) = (self.grid.keep_out(leg.k), self.radius_after(leg.k));
        for part in 0..if self.between { PARTS } else { 1 } {
            let time = (leg.k as f64 + part as f64 / PARTS as f64) * self.dt();
            if self.beyond.keep_out && self.grid.is_recovering(time) {
                continue;
            }
            let radius = if part == 0 { at_node } else { within };
            self.keep_out(radius, &target[part], &positions[part], out);
        }
        positions
    }

    /// Keep-out radius within interval `k` [m]: the smaller of those at its ends. The last node has
    /// none but its place, at reach from the port.
    pub fn radius_after(&self, k: usize) -> f64 {
        let (servicer, approach) = (&self.mission.servicer, &self.mission.approach);
        let (here, there) = if k + 1 < self.last() {
            (self.grid.keep_out(k), self.grid.keep_out(k + 1))
        } else {
            (approach.keep_out_near_m, Posture::at_capture(servicer).reach())
        };
        if there < here { there } else { here }
    }

    fn keep_out(
        &self,
        radius: f64,
        target: &TargetState,
        position: &Vector3<f64>,
        out: &mut Residuals,
    ) {
        let local = quaternion::rotation_matrix(&target.attitude).transpose() * position;
        let (distance, _) = point_to_box(&self.mission.target.half_extents_m, &local, &local);
        out.keep_out = worse(out.keep_out, worse(0.0, radius - distance));
    }

    /// The terminal state: in front of the port, moving with it.
    pub fn end(&self, target: &TargetState, out: &mut Residuals) {
        let (body, t) = (&self.mission.target, self.trajectory);
        let reach = Posture::at_capture(&self.mission.servicer).reach();
        let goal = quaternion::rotation_matrix(&target.attitude)
            * (body.port_position_m + body.port_normal * reach);
        let miss = error(
            t.position[self.last()] - goal,
            t.velocity[self.last()] - target.rate.cross(&goal),
        );
        out.dynamics1 = worse(out.dynamics1, miss);
    }
}

fn error(position: Vector3<f64>, velocity: Vector3<f64>) -> f64 {
    worse(worst(position.as_slice()), worst((velocity / RATE_SCALE).as_slice()))
}

/// HCW over a part of an interval by its Taylor series: exact to rounding for `n h` well below one.
fn propagate<const NL: usize>(
    mission: &Mission<NL>,
    h: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    force: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let n = mission.mean_motion();
    let (mut r, mut v) = (position, velocity);
    // Derivatives of [r; v] of order 1, 2, ...: HCW applied again and again.
    let mut term_r = v;
    let mut term_v = hcw_acceleration(n, &r, &v) + force / mission.servicer.total_mass();
    let mut factor = h;
    for order in 2..14 {
        r += term_r * factor;
        v += term_v * factor;
        let next = hcw_acceleration(n, &term_r, &term_v);
        term_r = term_v;
        term_v = next;
        factor *= h / order as f64;
    }
    (r, v)
}
