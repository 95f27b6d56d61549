//! Bounds on the end of an approach: its reach, least force and least bus torque.

use super::{SLACK, norm};
use crate::math::quaternion;
use crate::model::{
    Grid, HcwTransition, Mission, Refusal, Scenario, TargetState, largest_and_shares,
    moment_bounds, signed_distance_to_box,
};
use nalgebra::{SVector, Vector3, Vector6};

impl<const NL: usize> Mission<NL> {
    /// Terminal position and velocity of the system's centre of mass, RTN.
    fn goal(&self, last: &TargetState) -> (Vector3<f64>, Vector3<f64>) {
        let d = self.servicer.capture_geometry().reach;
        let goal = quaternion::rotation_matrix(&last.attitude)
            * (self.target.port_position_m + self.target.port_normal * d);
        (goal, last.rate.cross(&goal))
    }

    /// From the terminal state one interval back: no force leads farther out than `before`. Nor does
    /// one that Stage 2 could follow, whose moment would turn the bus away, if it takes the centre of
    /// mass farther than it typically goes.
    pub(super) fn check_reach(&self, grid: &Grid, target: &[TargetState]) -> Result<(), Refusal> {
        let [.., previous, last] = target else { return Ok(()) };
        let box_distance = |state: &TargetState, position: &Vector3<f64>| {
            let local = quaternion::rotation_matrix(&state.attitude).transpose() * position;
            signed_distance_to_box(&self.target.half_extents_m, &local).value
        };
        let (n, interval) = (self.mean_motion(), grid.interval());
        let (goal, velocity) = self.goal(last);
        let back = HcwTransition::new(n, -interval).state;
        let coasting = back * stacked(&goal, &velocity);
        let thrust = back * HcwTransition::new(n, interval).input / self.servicer.total_mass();
        let (force, shares) = largest_and_shares(&self.servicer.force_limit_n);
        let reach = |i: usize| (0..3).map(|j| thrust[(i, j)].abs() * shares[j]).sum::<f64>();
        let most = Vector3::from_fn(|i, _| reach(i) * force);
        let coasting = Vector3::new(coasting[0], coasting[1], coasting[2]);
        let most = norm(&most).min(self.typical().velocity_m_s * interval);
        let before = box_distance(previous, &coasting) + most;
        let limit = grid.keep_out(grid.last() - 1);
        if before < limit - self.tolerances.keep_out_m - SLACK {
            let distance = box_distance(last, &goal);
            return Err(Refusal::Reach { distance, before, limit });
        }
        Ok(())
    }

    /// The least force that reaches the terminal state of Stage 1 [N]: of the axis with the largest
    /// limit, where all are used in proportion to theirs.
    ///
    /// Along any direction `c` of the final `[r; v]`, a force moves the end by no more than the sum
    /// of `|c^T Phi^j Gamma|_1 f / m`. Directions that turn their sign after a part of the horizon
    /// give the bound of thrusting one way and then braking.
    pub(super) fn least_force(
        &self,
        scenario: &Scenario<NL>,
        grid: &Grid,
        target: &[TargetState],
    ) -> f64 {
        let Some(last) = target.last() else { return 0.0 };
        let duration = grid.duration;
        let transition = HcwTransition::new(self.mean_motion(), grid.interval());
        let (state, input) = (transition.state.transpose(), transition.input.transpose());
        let (position, velocity) = self.goal(last);
        let goal = stacked(&position, &velocity);
        let start = stacked(&scenario.position, &scenario.velocity);
        let (_, shares) = largest_and_shares(&self.servicer.force_limit_n);
        let needed = |direction: Vector6<f64>| {
            let (mut c, mut effect) = (direction, 0.0);
            for _ in 0..grid.last() {
                let push = input * c;
                let push = push.component_mul(&shares);
                effect += push.x.abs() + push.y.abs() + push.z.abs();
                c = state * c;
            }
            let miss = direction.dot(&goal) - c.dot(&start);
            miss.abs() * self.servicer.total_mass() / effect
        };
        let mut most = 0.0;
        for axis in 0..3 {
            let unit = |i: usize| Vector6::from_fn(|j, _| if i == j { 1.0 } else { 0.0 });
            for share in [0.0, 0.25, 0.5, 0.75] {
                most = f64::max(most, needed(unit(axis) - unit(axis + 3) * (share * duration)));
            }
            most = f64::max(most, needed(unit(axis + 3)));
        }
        most
    }

    /// The least bus torque with which the system's angular momentum can become that of capture [N m]:
    /// of the axis with the largest limit, where all are used in proportion to theirs; negative where
    /// gravity and the thrusters' lever may do alone.
    pub(super) fn least_bus_torque(
        &self,
        scenario: &Scenario<NL>,
        grid: &Grid,
        target: &[TargetState],
    ) -> f64 {
        let Some(last) = target.last() else { return f64::NEG_INFINITY };
        let (s, n) = (&self.servicer, self.mean_motion());
        let orbit = Vector3::new(0.0, 0.0, n);
        // The system's least moment of inertia is not below its bus's.
        let [least, bus_largest] = moment_bounds(&s.bus_inertia_kg_m2);
        let after = least * norm(&(last.rate + orbit));
        let bus = quaternion::rotation_matrix(&self.bus_attitude_at_start(scenario));
        let inertia = s.system_inertia(&self.joint_angle_at_start(scenario));
        let before = norm(&(inertia * (bus.transpose() * (scenario.start.bus_rate + orbit))));
        // Over all angles of the arm: the bus from the centre of mass, and the largest inertia.
        let (mut lever, mut largest) = (0.0, bus_largest);
        let mut out = norm(&s.arm_base_m);
        for link in &s.links {
            let at = out + norm(&link.center_of_mass_m);
            lever += link.mass_kg * at / s.total_mass();
            let [_, own] = moment_bounds(&link.inertia_kg_m2);
            largest += own + link.mass_kg * at * at;
            out += norm(&link.tip_m);
        }
        let ((force, thrust), (_, torque)) =
            (largest_and_shares(&s.force_limit_n), largest_and_shares(&s.bus_torque_limit_n_m));
        let others = 1.5 * n * n * largest + norm(&thrust) * force * lever;
        // The arm's own motion adds no more than as much as if all of it turned about its base.
        let arm = largest * scenario.start.joint_rate.iter().map(|rate| rate.abs()).sum::<f64>();
        ((after - before - arm) / grid.duration - others) / norm(&torque)
    }
}

fn stacked(position: &Vector3<f64>, velocity: &Vector3<f64>) -> SVector<f64, 6> {
    Vector6::new(position.x, position.y, position.z, velocity.x, velocity.y, velocity.z)
}
