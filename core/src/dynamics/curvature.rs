//! Second derivatives of the inverse dynamics.
//!
//! For fixed weights `mu` on the torques, `S(x, a) = mu . torques(x, a)` is the virtual power of the
//! bodies' inertial and tidal forces along the virtual motion `mu`: the integral over mass of virtual
//! velocity times acceleration, both affine in position. So `S` is the sum over links of the product of
//! the [`SpatialAcceleration`]'s gradient with a matrix of virtual moments, `Gamma`, which depends on the
//! joint angles alone. Rates, accelerations, radial direction and force enter the gradients as
//! polynomials of second degree: their second derivatives follow from `Gamma` directly.
//!
//! Derivatives by joint angles remain. As in [`super::linear`], turning a joint is seen from its subtree:
//! the subtree's geometry stays and the motion before the joint turns back, real and virtual. Each joint
//! takes one pass outwards and one inwards; no geometry is differentiated.

use super::inverse::{Motion, Rnea, SpatialAcceleration, Wrench};
use super::kinematics::{Kinematics, LinkKinematics, second_moment};
use super::multibody::BusFrame;
use super::{Acceleration, Multibody, State};
use crate::math::{Mat3, Vec3};
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

/// Factors of the motion of a subtree in the virtual power.
#[derive(Clone, Copy)]
struct Moments {
    /// Derivative by the acceleration at the joint: virtual momentum.
    linear: Vec3<f64>,
    /// Derivative by the acceleration's gradient: `Gamma`.
    gradient: Mat3<f64>,
    /// Derivative by the rate before the joint, through the joints' own motion.
    rate: Vec3<f64>,
}

/// Virtual motion of all links, and its moments.
struct Virtual<const NL: usize> {
    /// Virtual rotation of the body before each joint.
    turn: [Vec3<f64>; NL],
    /// Virtual displacement of each joint relative to the system's mean.
    at: [Vec3<f64>; NL],
    /// About each joint.
    moments: [Moments; NL],
    /// Coriolis term: half the derivative by a joint's rate, over the link's rate.
    coriolis: [Vec3<f64>; NL],
    /// Sum of virtual joint motion times momentum over each joint and all after it.
    momentum: [Vec3<f64>; NL],
    /// Moments of the whole system about the bus centre of mass.
    bus: Moments,
}

/// Dynamics and virtual motion at one point of state and acceleration.
#[derive(Clone, Copy)]
struct Evaluated<'a, const NL: usize> {
    kinematics: &'a Kinematics<NL>,
    frame: &'a BusFrame<f64>,
    motion: &'a Motion<f64, NL>,
    rnea: &'a Rnea<NL>,
    virtual_: &'a Virtual<NL>,
}

/// Derivatives of the subtree's motion by the angle of its joint.
struct SubtreeDerivatives<const NL: usize> {
    /// Of the virtual rotation.
    turn: Vec3<f64>,
    /// Of the rate.
    rate: Vec3<f64>,
    /// Of the acceleration's gradients, before each joint.
    gradients: [Mat3<f64>; NL],
    /// Of the joints' accelerations.
    accelerations: [Vec3<f64>; NL],
    /// Of the joints' virtual displacements.
    displacements: [Vec3<f64>; NL],
    /// Of the links' wrenches.
    wrenches: [Wrench<f64>; NL],
    /// Of the acceleration of the bus's centre.
    base: Vec3<f64>,
}

/// Derivatives of the virtual power's gradient by one joint angle, bus axes.
struct Column<const NL: usize> {
    /// By the angles of this joint and those after it; zero for those before.
    angle: [f64; NL],
    joint_rate: [f64; NL],
    joint_acceleration: [f64; NL],
    acceleration: Vec3<f64>,
    rate: Vec3<f64>,
    radial: Vec3<f64>,
    specific_force: Vec3<f64>,
}

impl Moments {
    const ZERO: Self =
        Self { linear: Vec3::ZERO, gradient: Mat3([Vec3::ZERO; 3]), rate: Vec3::ZERO };

    /// Adds the moments of `link` for a virtual displacement `at` of its joint and rotation `turn`.
    #[inline]
    fn add(&mut self, link: &LinkKinematics, at: Vec3<f64>, turn: Vec3<f64>) {
        let linear = (at + turn.cross(link.offset)).scaled(link.mass);
        self.linear += linear;
        let Mat3([x, y, z]) = link.second_moment;
        self.gradient +=
            Mat3([turn.cross(x), turn.cross(y), turn.cross(z)]) + Mat3::outer(linear, link.offset);
    }

    /// Coriolis term of a joint with this axis.
    #[inline]
    fn coriolis(&self, axis: Vec3<f64>) -> Vec3<f64> {
        self.gradient.apply_transposed(axis) - axis.scaled(self.gradient.trace())
    }

    /// Refers the moments to a point at `-lever`.
    #[inline]
    fn shift(&mut self, lever: Vec3<f64>) {
        self.gradient += Mat3::outer(self.linear, lever);
    }
}

/// Derivative by a turn about `a` of the product of `gradient` with `moments`, where `gradient`
/// turns back: the product with `a` of this.
#[inline]
fn twist(gradient: &Mat3<f64>, moments: &Mat3<f64>) -> Vec3<f64> {
    let (Mat3([gx, gy, gz]), Mat3([mx, my, mz])) = (*gradient, *moments);
    let inner = Vec3([gz.dot(my) - gy.dot(mz), gx.dot(mz) - gz.dot(mx), gy.dot(mx) - gx.dot(my)]);
    inner - (gx.cross(mx) + gy.cross(my) + gz.cross(mz))
}

/// `M + M^T - 2 s tr(M)` applied to `v`.
#[inline]
fn symmetric(m: &Mat3<f64>, s: f64, v: Vec3<f64>) -> Vec3<f64> {
    m.apply(v) + m.apply_transposed(v) - v.scaled(2.0 * s * m.trace())
}

impl<const NL: usize> Multibody<'_, NL> {
    /// Second derivatives of `mu . torques(state, force, acceleration)`, `mu` in the units
    /// `[1 / (N m)]` on `[bus torque (bus axes), joint torques]`.
    ///
    /// Exact to rounding. Cost: about 500 flops for each pair of joints and 1000 a link, some 2 us
    /// for three links on a desktop core.
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
        let kinematics = self.kinematics(state);
        let rnea = self.rnea(&kinematics, &frame, &motion);
        let bus_mu = Vec3([mu[0], mu[1], mu[2]]);
        let joint_mu = core::array::from_fn(|i| mu[3 + i]);
        let virtual_ = self.virtual_motion(&kinematics, &motion, bus_mu, &joint_mu);

        let mut out =
            TorqueCurvature { state_state: SMatrix::zeros(), acceleration_state: SMatrix::zeros() };
        self.fill_bus(&rotation, &frame, &motion, &virtual_, &mut out);
        Self::fill_joint_rates(&rotation, &kinematics, &frame, &virtual_, &mut out);
        let at = Evaluated {
            kinematics: &kinematics,
            frame: &frame,
            motion: &motion,
            rnea: &rnea,
            virtual_: &virtual_,
        };
        for j in 0..NL {
            let column = self.joint_column(&at, j);
            self.fill_joint(j, &rotation, &at, &column, &mut out);
        }
        for j in 0..NX {
            for i in 0..j {
                out.state_state[(i, j)] = out.state_state[(j, i)];
            }
        }
        out
    }

    /// The virtual motion `mu` and its moments.
    fn virtual_motion(
        &self,
        kinematics: &Kinematics<NL>,
        motion: &Motion<f64, NL>,
        bus_mu: Vec3<f64>,
        joint_mu: &[f64; NL],
    ) -> Virtual<NL> {
        let mut out = Virtual {
            turn: [Vec3::ZERO; NL],
            at: [Vec3::ZERO; NL],
            moments: [Moments::ZERO; NL],
            coriolis: [Vec3::ZERO; NL],
            momentum: [Vec3::ZERO; NL],
            bus: Moments::ZERO,
        };
        let mut momentum = Vec3::ZERO;
        for i in (0..NL).rev() {
            momentum += kinematics.links[i].momentum.scaled(joint_mu[i]);
            out.momentum[i] = momentum;
        }
        // The virtual motion of the centre of mass is subtracted.
        let total = momentum + bus_mu.cross(kinematics.whole.first);
        let (mut turn, mut at) = (bus_mu, total.scaled(-1.0 / self.total_mass));
        for (i, link) in kinematics.links.iter().enumerate() {
            at += turn.cross(link.lever);
            (out.turn[i], out.at[i]) = (turn, at);
            turn += link.axis.scaled(joint_mu[i]);
            out.moments[i].add(link, at, turn);
        }
        let mut subtree = Moments::ZERO;
        for i in (0..NL).rev() {
            let link = &kinematics.links[i];
            subtree.linear += out.moments[i].linear;
            subtree.gradient += out.moments[i].gradient;
            out.coriolis[i] = subtree.coriolis(link.axis);
            subtree.rate += out.coriolis[i].scaled(2.0 * motion.joint_rate[i]);
            out.moments[i] = subtree;
            subtree.shift(link.lever);
        }
        let second = second_moment(&self.servicer.bus_inertia_kg_m2);
        subtree.gradient += Mat3::cross_matrix(bus_mu).product(&second);
        subtree.linear = total;
        out.bus = subtree;
        out
    }

    /// Derivatives of the gradient by the angle of joint `j`.
    fn joint_column(&self, at: &Evaluated<NL>, j: usize) -> Column<NL> {
        let Evaluated { kinematics, frame, motion, rnea, virtual_ } = *at;
        let axis = kinematics.links[j].axis;
        let mean_by =
            virtual_.turn[j].cross(kinematics.links[j].momentum) + axis.cross(virtual_.momentum[j]);
        let mut column = Column {
            angle: [0.0; NL],
            joint_rate: [0.0; NL],
            joint_acceleration: [0.0; NL],
            acceleration: Vec3::ZERO,
            rate: Vec3::ZERO,
            radial: Vec3::ZERO,
            specific_force: mean_by,
        };
        let back = mean_by.scaled(-1.0 / self.total_mass);
        let mut subtree = self.subtree(at, j, back, &mut column);

        // Before the joint geometry and motion stay; its subtree turns with it.
        let here = &virtual_.moments[j];
        let Mat3(turned) = here.gradient.turned_back(axis);
        subtree.linear += axis.cross(here.linear);
        subtree.gradient += Mat3(turned.map(|column| -column));
        subtree.rate += axis.cross(here.rate);
        subtree.shift(kinematics.links[j].lever);
        for i in (0..j).rev() {
            let link = &kinematics.links[i];
            let linear = back.scaled(link.mass);
            subtree.linear += linear;
            subtree.gradient += Mat3::outer(linear, link.offset);
            column.pass(&mut subtree, i, link.axis, rnea.links[i].rate, motion.joint_rate[i]);
            subtree.shift(link.lever);
        }
        let n2 = self.mean_motion * self.mean_motion;
        column.acceleration = subtree.gradient.axial();
        column.rate = symmetric(&subtree.gradient, 1.0, frame.rate) + subtree.rate;
        column.radial = symmetric(&subtree.gradient, 0.0, frame.radial).scaled(-3.0 * n2);
        column
    }

    /// The part of [`Multibody::joint_column`] for the joint's subtree, in axes that turn with it;
    /// returns the derivative of the subtree's moments. `back` is the derivative of what is subtracted
    /// from every virtual displacement.
    #[inline]
    fn subtree(
        &self,
        at: &Evaluated<NL>,
        j: usize,
        back: Vec3<f64>,
        column: &mut Column<NL>,
    ) -> Moments {
        let Evaluated { kinematics, motion, rnea, virtual_, .. } = *at;
        let derivatives = self.outward(at, j, back);
        let SubtreeDerivatives { turn, rate, base, .. } = derivatives;
        let (mut wrench, mut moments) = (Wrench::ZERO, Moments::ZERO);
        for i in (j..NL).rev() {
            let link = &kinematics.links[i];
            let (here, force) = (&virtual_.moments[i], &rnea.wrenches[i]);
            let (acceleration, displacement) =
                (derivatives.accelerations[i], derivatives.displacements[i]);
            wrench.add(&derivatives.wrenches[i]);
            moments.add(link, displacement, turn);
            column.pass(&mut moments, i, link.axis, rnea.links[i].rate, motion.joint_rate[i]);
            column.joint_rate[i] += 2.0 * rate.dot(virtual_.coriolis[i]);

            let force_by = wrench.force + base.scaled(link.subtree.mass);
            let moment_by = wrench.moment + link.subtree.first.cross(base);
            let torque = force_by.cross(virtual_.at[i])
                + force.force.cross(displacement)
                + moment_by.cross(virtual_.turn[i])
                + force.moment.cross(turn)
                + moments.linear.cross(rnea.links[i].at)
                + here.linear.cross(acceleration + base)
                + moments.rate.cross(rnea.before(i).rate)
                + here.rate.cross(rate)
                + twist(&derivatives.gradients[i], &here.gradient)
                + twist(&rnea.before(i).gradient, &moments.gradient);
            column.angle[i] = link.axis.dot(torque);
            if i > j {
                wrench.shift(link.lever);
                moments.shift(link.lever);
            }
        }
        moments
    }

    /// Outward pass of [`Multibody::subtree`]: real and virtual motion of the subtree's links.
    #[inline]
    fn outward(&self, at: &Evaluated<NL>, j: usize, back: Vec3<f64>) -> SubtreeDerivatives<NL> {
        let Evaluated { kinematics, motion, rnea, virtual_, .. } = *at;
        let axis = kinematics.links[j].axis;
        // Seen from the subtree, all motion before the joint turns back.
        let turn = virtual_.turn[j].cross(axis);
        let rate = rnea.before(j).rate.cross(axis);
        let mut gradient = rnea.before(j).gradient.turned_back(axis);
        let mut at = rnea.links[j].at.cross(axis);
        let mut virtual_at = virtual_.at[j].cross(axis) + back;
        let mut out = SubtreeDerivatives {
            turn,
            rate,
            gradients: [Mat3([Vec3::ZERO; 3]); NL],
            accelerations: [Vec3::ZERO; NL],
            displacements: [Vec3::ZERO; NL],
            wrenches: [Wrench::ZERO; NL],
            base: Vec3::ZERO,
        };
        let mut force = axis.cross(rnea.wrenches[j].force);
        for i in j..NL {
            let link = &kinematics.links[i];
            if i > j {
                at += gradient.apply(link.lever);
                virtual_at += turn.cross(link.lever);
            }
            (out.gradients[i], out.accelerations[i]) = (gradient, at);
            out.displacements[i] = virtual_at;
            gradient += Mat3::double_cross(rate.scaled(2.0 * motion.joint_rate[i]), link.axis);
            out.wrenches[i] = SpatialAcceleration { rate, gradient, at }.wrench(link);
            force += out.wrenches[i].force;
        }
        out.base = force.scaled(-1.0 / self.total_mass);
        out
    }

    /// Everything by attitude and bus rate alone.
    fn fill_bus<const NX: usize, const NU: usize>(
        &self,
        rotation: &Matrix3<f64>,
        frame: &BusFrame<f64>,
        motion: &Motion<f64, NL>,
        virtual_: &Virtual<NL>,
        out: &mut TorqueCurvature<NX, NU>,
    ) {
        let n2 = self.mean_motion * self.mean_motion;
        let Moments { gradient, rate: by_joints, linear } = &virtual_.bus;
        let sum = Matrix3::from_fn(|i, j| gradient.0[j].0[i] + gradient.0[i].0[j]);
        let sum = rotation * sum * rotation.transpose();
        let by_rate_twice = sum - Matrix3::from_diagonal_element(2.0 * gradient.trace());
        let rtn = |v: Vec3<f64>| rotation * v.to_vector();
        // Vectors whose bus components the virtual power depends on, and its derivatives by those.
        let (rate, radial) = (rtn(frame.rate), rtn(frame.radial));
        let by_rate = by_rate_twice * rate + rtn(*by_joints);
        let by_radial = sum * radial * (-3.0 * n2);
        let by_acceleration = rtn(gradient.axial());
        let pairs = [
            (rate, by_rate),
            (radial, by_radial),
            (rtn(motion.bus_acceleration), by_acceleration),
            (rtn(frame.specific_force), rtn(*linear)),
        ];
        // A vector v has the components of v - theta x v + 1/2 theta x (theta x v).
        let rate_cross = rate.cross_matrix();
        let radial_cross = radial.cross_matrix();
        let mut turn_turn = rate_cross.tr_mul(&(by_rate_twice * rate_cross))
            - radial_cross.tr_mul(&(sum * radial_cross)) * (3.0 * n2);
        for (v, by) in pairs {
            let outer = by * v.transpose();
            turn_turn += (outer + outer.transpose()) * 0.5;
            turn_turn -= Matrix3::from_diagonal_element(by.dot(&v));
        }
        // The acceleration in bus axes holds W x rate.
        let rate_turn = by_rate_twice * rate_cross - by_rate.cross_matrix()
            + self.frame_rate().cross_matrix() * by_acceleration.cross_matrix();
        for j in 0..3 {
            for i in 0..3 {
                out.state_state[(i, j)] = turn_turn[(i, j)];
                out.state_state[(3 + NL + i, j)] = rate_turn[(i, j)];
                out.state_state[(3 + NL + i, 3 + NL + j)] = by_rate_twice[(i, j)];
                out.acceleration_state[(i, j)] = -by_acceleration.cross_matrix()[(i, j)];
            }
        }
    }

    /// Everything by joint rates and what is not a joint angle.
    fn fill_joint_rates<const NX: usize, const NU: usize>(
        rotation: &Matrix3<f64>,
        kinematics: &Kinematics<NL>,
        frame: &BusFrame<f64>,
        virtual_: &Virtual<NL>,
        out: &mut TorqueCurvature<NX, NU>,
    ) {
        for k in 0..NL {
            let twice = virtual_.coriolis[k].scaled(2.0);
            let by_rate = rotation * twice.to_vector();
            let by_turn = rotation * twice.cross(frame.rate).to_vector();
            for i in 0..3 {
                out.state_state[(6 + NL + k, i)] = by_turn[i];
                out.state_state[(6 + NL + k, 3 + NL + i)] = by_rate[i];
            }
            for i in 0..=k {
                out.state_state[(6 + NL + k, 6 + NL + i)] = kinematics.links[i].axis.dot(twice);
            }
        }
    }

    /// Everything by the angle of joint `j`, the lower triangle of the state's block.
    fn fill_joint<const NX: usize, const NU: usize>(
        &self,
        j: usize,
        rotation: &Matrix3<f64>,
        at: &Evaluated<NL>,
        column: &Column<NL>,
        out: &mut TorqueCurvature<NX, NU>,
    ) {
        let Evaluated { frame, motion, .. } = *at;
        let by_turn = column.rate.cross(frame.rate)
            + column.radial.cross(frame.radial)
            + column.acceleration.cross(motion.bus_acceleration)
            + column.specific_force.cross(frame.specific_force);
        let by_turn = rotation * by_turn.to_vector();
        let by_acceleration = rotation * column.acceleration.to_vector();
        let by_rate =
            rotation * column.rate.to_vector() - self.frame_rate().cross(&by_acceleration);
        for i in 0..3 {
            out.state_state[(3 + j, i)] = by_turn[i];
            out.state_state[(3 + NL + i, 3 + j)] = by_rate[i];
            out.acceleration_state[(i, 3 + j)] = by_acceleration[i];
        }
        for i in 0..NL {
            if i >= j {
                out.state_state[(3 + i, 3 + j)] = column.angle[i];
            }
            out.state_state[(6 + NL + i, 3 + j)] = column.joint_rate[i];
            out.acceleration_state[(3 + i, 3 + j)] = column.joint_acceleration[i];
        }
    }
}

impl<const NL: usize> Column<NL> {
    /// Derivatives by the motion of joint `i` from those of its subtree's moments, during the inward
    /// pass; `rate` is that of its link.
    #[inline]
    fn pass(
        &mut self,
        subtree: &mut Moments,
        i: usize,
        axis: Vec3<f64>,
        rate: Vec3<f64>,
        joint_rate: f64,
    ) {
        let coriolis = subtree.coriolis(axis);
        self.joint_rate[i] = 2.0 * rate.dot(coriolis) + axis.dot(subtree.rate);
        self.joint_acceleration[i] = axis.dot(subtree.gradient.axial());
        subtree.rate += coriolis.scaled(2.0 * joint_rate);
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
    fn mission() -> Mission<3> {
        let mut mission = Mission::default();
        let tilt = |a: f64| Vector3::new(libm::sin(a), libm::cos(a), 0.0);
        for (i, link) in mission.servicer.links.iter_mut().enumerate() {
            link.axis = tilt(0.7 * i as f64);
            link.inertia_kg_m2 +=
                Matrix3::new(0.1, 0.02, -0.03, 0.02, 0.0, 0.01, -0.03, 0.01, 0.05);
            link.armature_kg_m2 = 0.2;
            link.center_of_mass_m.x += 0.04;
        }
        mission.servicer.bus_inertia_kg_m2 =
            Matrix3::new(80.0, 6.0, -9.0, 6.0, 95.0, 4.0, -9.0, 4.0, 110.0);
        // A fast orbit, so that the tidal terms count.
        mission.orbit.semi_major_axis_m = 1.5e5;
        mission
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
            let mission = mission();
            let body = Multibody::new(&mission);
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
