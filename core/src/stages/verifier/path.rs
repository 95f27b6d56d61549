//! Stage 1 under verification: the system's centre of mass.

use super::PARTS;
use super::distance::point_to_box;
use super::posture::Posture;
use super::residuals::{RATE_SCALE, Residuals, excess, worse, worst};
use crate::math::quaternion;
use crate::model::{Mission, Scenario, TargetState, hcw_acceleration};
use crate::stages::TranslationTrajectory;
use nalgebra::Vector3;

/// A path, and whether limits hold between its nodes.
pub(super) struct Path<'a, const N: usize, const NL: usize> {
    pub mission: &'a Mission<NL>,
    pub trajectory: &'a TranslationTrajectory<N>,
    pub between: bool,
}

impl<const N: usize, const NL: usize> Path<'_, N, NL> {
    /// Length of an interval [s].
    pub fn dt(&self) -> f64 {
        self.mission.approach.duration / (N - 1) as f64
    }

    pub fn begin(&self, scenario: &Scenario, out: &mut Residuals) {
        let t = self.trajectory;
        let position = t.position[0] - scenario.position;
        out.dynamics1 = worse(out.dynamics1, error(position, t.velocity[0] - scenario.velocity));
    }

    /// Judges node `k` and what follows it up to the next. Returns the positions at the ends of
    /// the interval's parts.
    pub fn interval(
        &self,
        k: usize,
        target: &[TargetState; PARTS + 1],
        out: &mut Residuals,
    ) -> [Vector3<f64>; PARTS + 1] {
        let (mission, t) = (self.mission, self.trajectory);
        let (mut r, mut v) = (t.position[k], t.velocity[k]);
        let mut positions = [r; PARTS + 1];
        for part in 0..PARTS {
            (r, v) = propagate(mission, self.dt() / PARTS as f64, r, v, t.force[k]);
            positions[part + 1] = r;
        }
        let defect = error(r - t.position[k + 1], v - t.velocity[k + 1]);
        out.dynamics1 = worse(out.dynamics1, defect);
        out.control = worse(out.control, excess(t.force[k].as_slice(), mission.servicer.max_force));

        let at_node = mission.approach.keep_out(k, N);
        self.keep_out(at_node, &target[0], &positions[0], out);
        if self.between {
            let radius = self.radius_after(k);
            for part in 1..PARTS {
                self.keep_out(radius, &target[part], &positions[part], out);
            }
        }
        positions
    }

    /// Keep-out radius within interval `k` [m]: the smaller of those at its ends. The last node has
    /// none but its place, at reach from the port.
    pub fn radius_after(&self, k: usize) -> f64 {
        let (servicer, approach) = (&self.mission.servicer, &self.mission.approach);
        let (here, there) = if k + 2 < N {
            (approach.keep_out(k, N), approach.keep_out(k + 1, N))
        } else {
            (approach.keep_out_near, Posture::at_capture(servicer).reach())
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
        let (distance, _) = point_to_box(&self.mission.target.half_extents, &local, &local);
        out.keep_out = worse(out.keep_out, worse(0.0, radius - distance));
    }

    /// The terminal state: in front of the port, moving with it.
    pub fn end(&self, target: &TargetState, out: &mut Residuals) {
        let (body, t) = (&self.mission.target, self.trajectory);
        let reach = Posture::at_capture(&self.mission.servicer).reach();
        let goal = quaternion::rotation_matrix(&target.attitude)
            * (body.port_position + body.port_normal * reach);
        let miss = error(t.position[N - 1] - goal, t.velocity[N - 1] - target.rate.cross(&goal));
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
    force: Vector3<f64>,
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
