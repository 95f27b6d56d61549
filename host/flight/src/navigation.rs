//! Navigation: from what sensors tell to what guidance is told.
//!
//! Attitudes go on at the measured rates, which are good, and are led to the measured attitudes slowly:
//! those are off by something that drifts within minutes. Position and velocity pass a filter of fixed gain about the Hill-Clohessy-Wiltshire motion with the force that was
//! commanded: velocity noise hurts more than position noise. Joint angles and rates likewise pass one of
//! their own. The spacecraft knows its orbit, and with it the RTN frame, exactly.

use nalgebra::{SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{Multibody, State};
use remora_core::advanced::guidance::Estimate;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, TargetState, hcw_acceleration};
use remora_truth::{Measurement, Rtn, Sample};

/// Bandwidths of the filters [rad/s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filters {
    /// Of position and velocity.
    pub translation: f64,
    /// Of joint angles and rates.
    pub joint: f64,
    /// Times over which the measured attitudes of bus and target are averaged [s].
    pub attitude_s: [f64; 2],
}

impl Default for Filters {
    fn default() -> Self {
        Self { translation: 0.05, joint: 2.0, attitude_s: [300.0, 600.0] }
    }
}

/// Navigation's estimate, carried from one instant to the next.
#[derive(Clone, Debug)]
pub struct Navigation<const NL: usize> {
    filters: Filters,
    /// Position [m] and velocity [m/s] of the system's centre of mass, RTN; none before the first
    /// measurement.
    center: Option<(Vector3<f64>, Vector3<f64>)>,
    joints: Option<(SVector<f64, NL>, SVector<f64, NL>)>,
    /// Attitudes of bus and target to inertial axes.
    attitudes: [Option<Vector4<f64>>; 2],
    time: f64,
}

impl<const NL: usize> Navigation<NL> {
    /// Knows nothing yet.
    pub fn new(filters: Filters) -> Self {
        Self { filters, center: None, joints: None, attitudes: [None; 2], time: 0.0 }
    }

    /// The estimate at `time` [s] from the newest samples, `force` [N, RTN] having been commanded since
    /// the last one; none before every sensor has told something.
    pub fn estimate(
        &mut self,
        mission: &Mission<NL>,
        (time, frame): (f64, &Rtn),
        measured: &Measurement<NL>,
        force: &Vector3<f64>,
    ) -> Option<Estimate<NL>> {
        let since = time - self.time;
        self.time = time;
        let spin = Vector3::new(0.0, 0.0, frame.rate);
        let bus_rate = measured.bus_rate?.value;
        let attitude = turned(&measured.attitude?, &bus_rate, time);
        let attitude = to_rtn(frame, &self.averaged(0, attitude, &bus_rate, since));
        let rate = quaternion::rotation_matrix(&attitude) * bus_rate - spin;
        let target_rate = measured.target_rate?.value;
        let target = turned(&measured.target_attitude?, &target_rate, time);
        let target = to_rtn(frame, &self.averaged(1, target, &target_rate, since));
        let target = TargetState {
            attitude: target,
            rate: quaternion::rotation_matrix(&target) * target_rate - spin,
        };
        let (joint_angle, joint_rate) = self.arm(measured, time, since)?;
        let state = State { attitude, joint_angle, rate, joint_rate };
        let offset = Multibody::new(mission).center_of_mass(&state);
        let moved = self.center(mission, (time, frame), measured, offset, (since, force))?;
        let (position, velocity) = (moved.0 - offset.0, moved.1 - offset.1);
        let wrist = measured.wrist_camera.filter(|seen| time - seen.time < 1.0).map(|seen| {
            // From the port to the tip, in the axes of the last link as it was estimated to be.
            let link = Multibody::new(mission).end_effector(&state).rotation;
            -(link * seen.value)
        });
        Some(Estimate { time, position, velocity, state, target, wrist })
    }

    /// An attitude that goes on at `rate` (body axes) and is led to the `seen` one: the mean of all that was
    /// seen, at first, and over the time of the filter later.
    fn averaged(
        &mut self,
        which: usize,
        seen: Vector4<f64>,
        rate: &Vector3<f64>,
        since: f64,
    ) -> Vector4<f64> {
        let next = match self.attitudes[which] {
            None => seen,
            Some(before) => {
                let on = quaternion::product(&before, &quaternion::exp(&(rate * since)));
                let off = quaternion::product(&seen, &quaternion::conjugate(&on));
                let gain = since / f64::min(self.time + since, self.filters.attitude_s[which]);
                let led = quaternion::exp(&(quaternion::log(&off) * gain.min(1.0)));
                quaternion::normalized(&quaternion::product(&led, &on))
            }
        };
        self.attitudes[which] = Some(next);
        next
    }

    fn arm(
        &mut self,
        measured: &Measurement<NL>,
        time: f64,
        since: f64,
    ) -> Option<(SVector<f64, NL>, SVector<f64, NL>)> {
        let (angle, rate) = (measured.joint_angle?, measured.joint_rate?);
        let told = SVector::from(rate.value);
        let now = SVector::from(angle.value) + told * (time - angle.time);
        let (angle, _) = match self.joints {
            None => (now, told),
            Some((before, rate)) => {
                let gain = 1.0 - libm::exp(-self.filters.joint * since);
                let expected = before + (rate + told) * (0.5 * since);
                (expected + (now - expected) * gain, told)
            }
        };
        self.joints = Some((angle, told));
        self.joints
    }

    /// The filter of position and velocity: predicts the centre of mass along HCW with the force, and
    /// corrects by the difference from the newest sample. The bus itself is pushed about by the arm.
    /// `offset` leads from the bus to the centre of mass, with its rate.
    fn center(
        &mut self,
        mission: &Mission<NL>,
        (time, frame): (f64, &Rtn),
        measured: &Measurement<NL>,
        offset: (Vector3<f64>, Vector3<f64>),
        (since, force): (f64, &Vector3<f64>),
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let spin = Vector3::new(0.0, 0.0, frame.rate);
        let (place, speed) = (measured.position?, measured.velocity?);
        let seen = frame.axes.tr_mul(&place.value);
        let moves = frame.axes.tr_mul(&speed.value) - spin.cross(&seen);
        let (seen, moves) = (seen + moves * (time - place.time) + offset.0, moves + offset.1);
        let Some((position, velocity)) = self.center else {
            self.center = Some((seen, moves));
            return self.center;
        };
        let n = mission.mean_motion();
        let pull =
            hcw_acceleration(n, &position, &velocity) + force / mission.servicer.total_mass();
        let expected = position + (velocity + pull * (0.5 * since)) * since;
        let w = self.filters.translation;
        // Critically damped: gains of position on position and on velocity, of velocity on itself.
        let (of_position, of_velocity) = (f64::min(2.0 * w * since, 1.0), w * w * since);
        let off = seen - expected;
        let velocity = velocity + pull * since;
        let slip = (moves - velocity) * (w * since);
        self.center = Some((expected + off * of_position, velocity + off * of_velocity + slip));
        self.center
    }
}

/// An attitude brought to `time` at a rate in body axes.
fn turned(sample: &Sample<[f64; 4]>, rate: &Vector3<f64>, time: f64) -> Vector4<f64> {
    let turn = quaternion::exp(&(rate * (time - sample.time)));
    quaternion::product(&Vector4::from(sample.value), &turn)
}

/// An attitude to inertial axes as one to RTN.
fn to_rtn(frame: &Rtn, q: &Vector4<f64>) -> Vector4<f64> {
    let frame = quaternion::conjugate(&quaternion::from_rotation_matrix(&frame.axes));
    quaternion::normalized(&quaternion::product(&frame, q))
}
