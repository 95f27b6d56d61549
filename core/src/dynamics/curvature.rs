//! Second derivatives of the inverse dynamics.
//!
//! For fixed weights `mu` on the torques, `S(x, a) = mu . torques(x, a)` is the virtual power of
//! the bodies' inertial and tidal forces along the virtual motion `mu`. One reverse sweep over the
//! tree gives its gradient by all of `x` and `a`; run on dual numbers it gives the Hessian. Turning
//! the links beyond a joint turns every vector fixed in them, so the gradient by a joint angle is a
//! sum of torques `v x dS/dv`: no rotation matrix is ever differentiated.

use super::inverse::Motion;
use super::multibody::{BusFrame, LinkPose};
use super::{Acceleration, Multibody, State};
use crate::math::{Dual, Scalar, Vec3};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Second derivatives of `mu . torques(state, acceleration)`: by state twice, and by state and
/// acceleration. Rows and columns of the state are `[dtheta, alpha, rate, joint_rate]`, those of
/// the acceleration `[bus (RTN), joint]`. SI units. The acceleration enters linearly: there is no
/// third block.
#[derive(Clone, Copy, Debug)]
pub struct TorqueCurvature<const NX: usize, const NU: usize> {
    /// By state and state, symmetric.
    pub state_state: SMatrix<f64, NX, NX>,
    /// By acceleration (rows) and state (columns).
    pub acceleration_state: SMatrix<f64, NU, NX>,
}

/// Gradient of the virtual power, bus axes.
struct Gradient<T, const NL: usize> {
    /// By the turn of the bus relative to its surroundings.
    turn: Vec3<T>,
    joint_angle: [T; NL],
    rate: Vec3<T>,
    joint_rate: [T; NL],
    bus_acceleration: Vec3<T>,
    joint_acceleration: [T; NL],
}

/// Forward quantities of one link that the reverse sweep needs.
#[derive(Clone, Copy)]
struct Link<T> {
    /// From the joint before (the bus centre of mass for the first link) to this joint.
    lever: Vec3<T>,
    /// From the joint to the centre of mass.
    arm: Vec3<T>,
    spin: Vec3<T>,
    rate: Vec3<T>,
    angular: Vec3<T>,
    /// Acceleration of the centre of mass relative to the bus.
    center_acceleration: Vec3<T>,
    /// Virtual rotation, and virtual displacement of the centre of mass.
    virtual_turn: Vec3<T>,
    virtual_center: Vec3<T>,
}

impl<T: Scalar> Link<T> {
    const ZERO: Self = Self {
        lever: Vec3::ZERO,
        arm: Vec3::ZERO,
        spin: Vec3::ZERO,
        rate: Vec3::ZERO,
        angular: Vec3::ZERO,
        center_acceleration: Vec3::ZERO,
        virtual_turn: Vec3::ZERO,
        virtual_center: Vec3::ZERO,
    };
}

impl<const NL: usize> Multibody<NL> {
    /// Second derivatives of `mu . torques(state, force, acceleration)`, `mu` in the units
    /// `[1 / (N m)]` on `[bus torque (bus axes), joint torques]`.
    ///
    /// Exact to rounding. Cost: a forward and a reverse sweep on dual numbers of `NX` lanes, about
    /// 10 us for three links on a desktop core.
    pub fn torque_curvature<const NX: usize, const NU: usize>(
        &self,
        state: &State<NL>,
        force: &Vector3<f64>,
        acceleration: &Acceleration<NL>,
        mu: &SVector<f64, NU>,
    ) -> TorqueCurvature<NX, NU> {
        const { assert!(NX == 6 + 2 * NL && NU == 3 + NL, "sizes of state and control") };
        let (rotation, frame) = self.bus_frame(state, force);
        let inertial = acceleration.bus + self.frame_rate().cross(&state.rate);
        let motion = Motion {
            joint_rate: Self::angles(&state.joint_rate),
            bus_acceleration: Vec3(rotation.tr_mul(&inertial).into()),
            joint_acceleration: Self::angles(&acceleration.joint),
        };
        let (frame, joint_angle, motion) =
            self.seed_curvature::<NX>(&rotation, &frame, &motion, state);
        let poses = self.link_poses(&joint_angle);
        let bus_mu = Vec3([mu[0], mu[1], mu[2]].map(Dual::constant));
        let joint_mu = core::array::from_fn(|i| Dual::constant(mu[3 + i]));
        let gradient = self.virtual_power_gradient(&poses, &frame, &motion, bus_mu, &joint_mu);
        self.assemble(&rotation, &gradient)
    }

    /// Dual numbers along `[dtheta, alpha, rate, joint_rate]`, the bus acceleration included: its
    /// bus components turn with the bus, and hold the frame's share of the rate.
    fn seed_curvature<const NX: usize>(
        &self,
        rotation: &Matrix3<f64>,
        frame: &BusFrame<f64>,
        motion: &Motion<f64, NL>,
        state: &State<NL>,
    ) -> (BusFrame<Dual<NX>>, [Dual<NX>; NL], Motion<Dual<NX>, NL>) {
        let to_bus = rotation.transpose();
        let seeded = |v: Vec3<f64>, by_rate: Option<Matrix3<f64>>| {
            let by_turn = v.to_vector().cross_matrix() * to_bus;
            let mut out = Vec3::<Dual<NX>>::constant(&v.to_vector());
            for i in 0..3 {
                for j in 0..3 {
                    out.0[i].partial[j] = by_turn[(i, j)];
                    if let Some(m) = &by_rate {
                        out.0[i].partial[3 + NL + j] = m[(i, j)];
                    }
                }
            }
            out
        };
        let bus_acceleration =
            seeded(motion.bus_acceleration, Some(to_bus * self.frame_rate().cross_matrix()));
        let frame = BusFrame {
            rate: seeded(frame.rate, Some(to_bus)),
            radial: seeded(frame.radial, None),
            specific_force: seeded(frame.specific_force, None),
        };
        let index = core::array::from_fn::<usize, NL, _>(|i| i);
        let motion = Motion {
            joint_rate: index.map(|i| Dual::variable(state.joint_rate[i], 6 + NL + i)),
            bus_acceleration,
            joint_acceleration: motion.joint_acceleration.map(Scalar::constant),
        };
        (frame, index.map(|i| Dual::variable(state.joint_angle[i], 3 + i)), motion)
    }

    fn assemble<const NX: usize, const NU: usize>(
        &self,
        rotation: &Matrix3<f64>,
        g: &Gradient<Dual<NX>, NL>,
    ) -> TorqueCurvature<NX, NU> {
        let value = |v: &Vec3<Dual<NX>>| Vector3::from(v.0.map(|d| d.value));
        // In RTN: a bus vector's components turn with dtheta, columns 0..3.
        let to_rtn = |v: &Vec3<Dual<NX>>| {
            let mut m = SMatrix::<f64, 3, NX>::from_fn(|i, lane| v.0[i].partial[lane]);
            m = rotation * m;
            let turning = -(rotation * value(v)).cross_matrix();
            for j in 0..3 {
                for i in 0..3 {
                    m[(i, j)] += turning[(i, j)];
                }
            }
            m
        };
        let turn = rotation * SMatrix::<f64, 3, NX>::from_fn(|i, l| g.turn.0[i].partial[l]);
        let acceleration = to_rtn(&g.bus_acceleration);
        // The acceleration's bus components hold W x rate.
        let rate = to_rtn(&g.rate) - self.frame_rate().cross_matrix() * acceleration;
        let mut rows = SMatrix::<f64, NX, NX>::zeros();
        let mut by_acceleration = SMatrix::<f64, NU, NX>::zeros();
        for lane in 0..NX {
            for i in 0..3 {
                rows[(i, lane)] = turn[(i, lane)];
                rows[(3 + NL + i, lane)] = rate[(i, lane)];
                by_acceleration[(i, lane)] = acceleration[(i, lane)];
            }
            for i in 0..NL {
                rows[(3 + i, lane)] = g.joint_angle[i].partial[lane];
                rows[(6 + NL + i, lane)] = g.joint_rate[i].partial[lane];
                by_acceleration[(3 + i, lane)] = g.joint_acceleration[i].partial[lane];
            }
        }
        // Second derivatives along exp(dtheta) are the symmetric part; elsewhere both agree.
        let state_state = (rows + rows.transpose()) * 0.5;
        TorqueCurvature { state_state, acceleration_state: by_acceleration }
    }

    fn sweep_out<T: Scalar>(
        &self,
        poses: &[LinkPose<T>; NL],
        frame: &BusFrame<T>,
        motion: &Motion<T, NL>,
        bus_mu: Vec3<T>,
        joint_mu: &[T; NL],
    ) -> [Link<T>; NL] {
        let mut links = [Link::ZERO; NL];
        let (mut rate, mut angular) = (frame.rate, motion.bus_acceleration);
        let (mut at, mut linear) = (Vec3::ZERO, Vec3::ZERO);
        let (mut virtual_turn, mut virtual_joint) = (bus_mu, Vec3::ZERO);
        for (i, link) in links.iter_mut().enumerate() {
            let pose = &poses[i];
            link.lever = pose.joint - at;
            at = pose.joint;
            linear += angular.cross(link.lever) + rate.cross(rate.cross(link.lever));
            virtual_joint += virtual_turn.cross(link.lever);
            link.spin = pose.axis * motion.joint_rate[i];
            angular += pose.axis * motion.joint_acceleration[i] + rate.cross(link.spin);
            rate += link.spin;
            virtual_turn += pose.axis * joint_mu[i];
            link.arm = pose.center - pose.joint;
            link.center_acceleration =
                linear + angular.cross(link.arm) + rate.cross(rate.cross(link.arm));
            link.virtual_center = virtual_joint + virtual_turn.cross(link.arm);
            (link.rate, link.angular, link.virtual_turn) = (rate, angular, virtual_turn);
        }
        links
    }

    /// The reverse sweep. Names of adjoints end in `_by`: `rate_by` is the derivative of the
    /// virtual power of everything beyond, by the rate there.
    fn virtual_power_gradient<T: Scalar>(
        &self,
        poses: &[LinkPose<T>; NL],
        frame: &BusFrame<T>,
        motion: &Motion<T, NL>,
        bus_mu: Vec3<T>,
        joint_mu: &[T; NL],
    ) -> Gradient<T, NL> {
        let links = self.sweep_out(poses, frame, motion, bus_mu, joint_mu);
        let scaled = |v: Vec3<T>, factor: f64| Vec3(v.0.map(|x| x * factor));
        let n2 = self.mean_motion * self.mean_motion;
        let radial = frame.radial;
        let tide = |v: Vec3<T>| scaled(v - scaled(radial * radial.dot(v), 3.0), n2);

        // Means over the whole system, the bus at the origin.
        let (mut center, mut drift, mut virtual_mean) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        for i in 0..NL {
            let share = self.links[i].mass / self.total_mass;
            center += scaled(poses[i].center, share);
            drift += scaled(links[i].center_acceleration, share);
            virtual_mean += scaled(links[i].virtual_center, share);
        }
        let common = frame.specific_force - drift;

        let mut joint_angle = [T::ZERO; NL];
        let mut joint_rate = [T::ZERO; NL];
        let mut joint_acceleration = [T::ZERO; NL];
        let (mut linear_by, mut angular_by, mut rate_by) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let (mut force, mut virtual_turn_by) = (Vec3::ZERO, Vec3::ZERO);
        let (mut position_by, mut radial_by) = (Vec3::ZERO, Vec3::ZERO);
        // Torque on everything fixed in the links beyond.
        let mut torque = Vec3::ZERO;

        for i in (0..NL).rev() {
            let (body, pose, link) = (&self.links[i], &poses[i], &links[i]);
            let inertia = |v: Vec3<T>| Self::apply_inertia(body, pose, v);
            let (arm, rate, turn) = (link.arm, link.rate, link.virtual_turn);
            let relative = scaled(link.virtual_center - virtual_mean, body.mass);
            let offset = pose.center - center;
            let f = scaled(link.center_acceleration + common + tide(offset), body.mass);
            let pull = tide(relative);
            let weighted = relative.cross(rate);
            let displaced = scaled(link.virtual_center, 3.0 * n2 * body.mass);
            radial_by -= displaced * radial.dot(offset) + offset * radial.dot(displaced);

            linear_by += relative;
            angular_by += arm.cross(relative);
            rate_by += rate.cross(arm).cross(relative) + arm.cross(weighted);
            force += f;
            position_by += pull;
            virtual_turn_by += arm.cross(f);
            let arm_by = relative.cross(link.angular) + weighted.cross(rate) + f.cross(turn) + pull;
            torque += arm.cross(arm_by);

            // Rotational part: turn . (I angular + rate x I rate - 3 n^2 radial x I radial).
            let (i_turn, i_angular) = (inertia(turn), inertia(link.angular));
            let (i_rate, gyro) = (inertia(rate), turn.cross(rate));
            let i_gyro = inertia(gyro);
            let (i_radial, lean) = (inertia(radial), turn.cross(radial));
            let i_lean = inertia(lean);
            let gravity_gradient = scaled(radial.cross(i_radial), 3.0 * n2);
            virtual_turn_by += i_angular + rate.cross(i_rate) - gravity_gradient;
            angular_by += i_turn;
            rate_by += i_rate.cross(turn) + i_gyro;
            radial_by -= scaled(i_radial.cross(turn) + i_lean, 3.0 * n2);
            torque += i_angular.cross(turn)
                + i_turn.cross(link.angular)
                + i_rate.cross(gyro)
                + i_gyro.cross(rate)
                - scaled(i_radial.cross(lean) + i_lean.cross(radial), 3.0 * n2);

            joint_angle[i] = pose.axis.dot(torque);

            // Through the joint, to the body before it.
            let (rate, angular, turn) = match i {
                0 => (frame.rate, motion.bus_acceleration, bus_mu),
                _ => (links[i - 1].rate, links[i - 1].angular, links[i - 1].virtual_turn),
            };
            let spin_by = rate_by + angular_by.cross(rate);
            joint_rate[i] = pose.axis.dot(spin_by);
            joint_acceleration[i] = pose.axis.dot(angular_by);
            let axis_by = angular_by * motion.joint_acceleration[i]
                + virtual_turn_by * joint_mu[i]
                + spin_by * motion.joint_rate[i];
            let lever = link.lever;
            let weighted = linear_by.cross(rate);
            let lever_by =
                linear_by.cross(angular) + weighted.cross(rate) + force.cross(turn) + position_by;
            rate_by += link.spin.cross(angular_by)
                + rate.cross(lever).cross(linear_by)
                + lever.cross(weighted);
            angular_by += lever.cross(linear_by);
            virtual_turn_by += lever.cross(force);
            torque += lever.cross(lever_by) + pose.axis.cross(axis_by);
        }

        // The bus itself.
        let (rate, moments) = (frame.rate, &self.bus_inertia);
        rate_by += rate.scale_each(moments).cross(bus_mu) + bus_mu.cross(rate).scale_each(moments);
        angular_by += bus_mu.scale_each(moments);
        let lean = bus_mu.cross(radial).scale_each(moments);
        radial_by -= scaled(radial.scale_each(moments).cross(bus_mu) + lean, 3.0 * n2);
        let force_by = scaled(virtual_mean, self.total_mass);
        let turn = rate_by.cross(rate)
            + angular_by.cross(motion.bus_acceleration)
            + radial_by.cross(radial)
            + force_by.cross(frame.specific_force);
        Gradient {
            turn,
            joint_angle,
            rate: rate_by,
            joint_rate,
            bus_acceleration: angular_by,
            joint_acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Control;
    use crate::math::quaternion;
    use crate::model::Mission;
    use nalgebra::Vector4;
    use proptest::prelude::*;

    /// A servicer whose arm is not planar, so that nothing cancels by symmetry.
    fn body() -> Multibody<3> {
        let mut mission = Mission::default();
        let tilt = |a: f64| Vector3::new(libm::sin(a), libm::cos(a), 0.0);
        for (i, link) in mission.servicer.links.iter_mut().enumerate() {
            link.axis = tilt(0.7 * i as f64);
            link.inertia += Vector3::new(0.1, 0.0, 0.05);
            link.center_of_mass.x += 0.04;
        }
        mission.servicer.bus_inertia = Vector3::new(80.0, 95.0, 110.0);
        // A fast orbit, so that the tidal terms count.
        mission.orbit.semi_major_axis = 1.5e5;
        Multibody::new(&mission)
    }

    fn moved(x: &State<3>, d: &SVector<f64, 12>) -> State<3> {
        let part = |i: usize| Vector3::new(d[i], d[i + 1], d[i + 2]);
        State {
            attitude: quaternion::product(&quaternion::exp(&part(0)), &x.attitude),
            joint_angle: x.joint_angle + part(3),
            rate: x.rate + part(6),
            joint_rate: x.joint_rate + part(9),
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(30))]
        #[test]
        fn hessian_matches_differences_on_the_manifold(
            numbers in proptest::array::uniform32(-1.0..1.0f64),
        ) {
            let body = body();
            let at = |i: usize| Vector3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
            let q = Vector4::new(numbers[0], numbers[1], numbers[2], 1.5);
            let x = State {
                attitude: quaternion::normalized(&q),
                joint_angle: at(3) * 1.5,
                rate: at(6) * 0.2,
                joint_rate: at(9) * 0.5,
            };
            let force = at(12) * 20.0;
            let acceleration = Acceleration { bus: at(15) * 0.05, joint: at(18) * 0.3 };
            let mu = SVector::<f64, 6>::from_fn(|i, _| numbers[21 + i]);
            let power = |x: &State<3>, a: &Acceleration<3>| {
                let Control { bus_torque, joint_torque } = body.torques(x, &force, a);
                mu.fixed_rows::<3>(0).dot(&bus_torque) + mu.fixed_rows::<3>(3).dot(&joint_torque)
            };
            let exact = body.torque_curvature::<12, 6>(&x, &force, &acceleration, &mu);

            let h = 1e-3;
            let e = |i: usize| SVector::<f64, 12>::ith(i, h);
            let at = |d: SVector<f64, 12>| power(&moved(&x, &d), &acceleration);
            let scale = exact.state_state.amax().max(1.0);
            for i in 0..12 {
                for j in 0..=i {
                    let (a, b) = (e(i), e(j));
                    let second =
                        (at(a + b) - at(a - b) - at(b - a) + at(-a - b)) / (4.0 * h * h);
                    let error = (second - exact.state_state[(i, j)]).abs();
                    prop_assert!(error < 2e-5 * scale, "({i}, {j}): {error:e}");
                }
                for j in 0..6 {
                    let mut plus = acceleration;
                    if j < 3 { plus.bus[j] += 1.0 } else { plus.joint[j - 3] += 1.0 }
                    let by_a = |d: SVector<f64, 12>| {
                        let x = moved(&x, &d);
                        power(&x, &plus) - power(&x, &acceleration)
                    };
                    let mixed = (by_a(e(i)) - by_a(-e(i))) / (2.0 * h);
                    let error = (mixed - exact.acceleration_state[(j, i)]).abs();
                    prop_assert!(error < 2e-4, "acceleration {j}, state {i}: {error:e}");
                }
            }
        }
    }
}
