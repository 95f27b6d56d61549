use super::{
    Class, Errors, Faults, Geometry, Joints, Mass, Navigation, OrbitErrors, Sampling, Sensors,
    Thrusters, Tumble, Wheels,
};

/// A number of an errors file that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}: {wanted}")]
pub struct ErrorsFault {
    /// Its key.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What it should be.
    pub wanted: &'static str,
}

const DEGREE: f64 = core::f64::consts::PI / 180.0;

impl Errors {
    /// The world is as the planner believes: all deviations zero, sensors at 10 Hz without delay.
    pub fn none() -> Self {
        let mut errors = Self::typical();
        for class in Class::ALL {
            errors = errors.scaled(class, 0.0);
        }
        errors.sensors = Sensors::all(Sampling { rate_hz: 10.0, delay_s: 0.0 });
        errors
    }

    /// Typical errors. All values are assumed.
    pub fn typical() -> Self {
        Self {
            navigation: Navigation {
                position_drift_m: 3e-3,
                position_drift_time_s: 200.0,
                position_drift_range_m: 2.5,
                position_noise_m: 5e-3,
                velocity_noise_m_s: 5e-4,
                attitude_drift_rad: 0.05 * DEGREE,
                attitude_drift_time_s: 100.0,
                target_attitude_drift_rad: 0.3 * DEGREE,
                target_attitude_drift_time_s: 200.0,
                bus_rate_noise_rad_s: 1e-5,
                target_rate_noise_rad_s: 5e-6,
                wrist_camera_noise_m: 0.0,
            },
            thrusters: Thrusters {
                scale: 0.03,
                direction_rad: DEGREE,
                noise: 0.05,
                impulse_bit_n_s: 0.02,
                period_s: 1.0,
            },
            wheels: Wheels { scale: 0.02, bias_n_m: 5e-5, noise_n_m: 1e-5, noise_period_s: 0.1 },
            joints: Joints {
                scale: 0.03,
                bias_n_m: 5e-5,
                friction_n_m: 2e-4,
                friction_rate_rad_s: 1e-4,
                angle_bias_rad: 5e-4,
                angle_noise_rad: 1e-4,
                rate_noise_rad_s: 2e-5,
            },
            mass: Mass {
                mass: 0.03,
                inertia: 0.07,
                inertia_axes_rad: 2.0 * DEGREE,
                bus_center_m: 5e-3,
                link_center_m: 2e-3,
            },
            tumble: Tumble {
                rate: 0.03,
                rate_direction_rad: 3.0 * DEGREE,
                attitude_rad: DEGREE,
                inertia_ratio: 0.02,
            },
            geometry: Geometry { port_m: 5e-3, arm_base_m: 2e-3, wrist_camera_m: 1e-3 },
            orbit: OrbitErrors {
                eccentricity: 1e-3,
                drag_m_s2: 2e-6,
                disturbance_n_m: 2e-5,
                target_disturbance_n_m: 0.0,
            },
            sensors: Sensors::all(Sampling { rate_hz: 10.0, delay_s: 0.0 }),
            faults: Faults::default(),
        }
    }

    /// One class's deviations and impulse bit times a factor; times, ranges and faults stay.
    #[must_use]
    pub fn scaled(mut self, class: Class, factor: f64) -> Self {
        for value in self.deviations(class) {
            *value *= factor;
        }
        self
    }

    fn deviations(&mut self, class: Class) -> Vec<&mut f64> {
        match class {
            Class::Navigation => {
                let n = &mut self.navigation;
                vec![
                    &mut n.position_drift_m,
                    &mut n.position_noise_m,
                    &mut n.velocity_noise_m_s,
                    &mut n.attitude_drift_rad,
                    &mut n.target_attitude_drift_rad,
                    &mut n.bus_rate_noise_rad_s,
                    &mut n.target_rate_noise_rad_s,
                    &mut n.wrist_camera_noise_m,
                ]
            }
            Class::Thrusters => {
                let t = &mut self.thrusters;
                vec![&mut t.scale, &mut t.direction_rad, &mut t.noise, &mut t.impulse_bit_n_s]
            }
            Class::Torques => {
                let (w, j) = (&mut self.wheels, &mut self.joints);
                vec![
                    &mut w.scale,
                    &mut w.bias_n_m,
                    &mut w.noise_n_m,
                    &mut j.scale,
                    &mut j.bias_n_m,
                    &mut j.friction_n_m,
                    &mut j.angle_bias_rad,
                    &mut j.angle_noise_rad,
                    &mut j.rate_noise_rad_s,
                ]
            }
            Class::Mass => {
                let m = &mut self.mass;
                vec![
                    &mut m.mass,
                    &mut m.inertia,
                    &mut m.inertia_axes_rad,
                    &mut m.bus_center_m,
                    &mut m.link_center_m,
                ]
            }
            Class::Tumble => {
                let t = &mut self.tumble;
                vec![
                    &mut t.rate,
                    &mut t.rate_direction_rad,
                    &mut t.attitude_rad,
                    &mut t.inertia_ratio,
                ]
            }
            Class::Geometry => {
                let g = &mut self.geometry;
                vec![&mut g.port_m, &mut g.arm_base_m, &mut g.wrist_camera_m]
            }
            Class::Orbit => {
                let o = &mut self.orbit;
                vec![
                    &mut o.eccentricity,
                    &mut o.drag_m_s2,
                    &mut o.disturbance_n_m,
                    &mut o.target_disturbance_n_m,
                ]
            }
        }
    }

    /// Whether every number makes sense for an arm of `joints` joints.
    ///
    /// # Errors
    ///
    /// The first that does not.
    pub fn check(&self, joints: usize) -> Result<(), ErrorsFault> {
        let mut copy = self.clone();
        for class in Class::ALL {
            for value in copy.deviations(class) {
                if !(*value >= 0.0 && value.is_finite()) {
                    let wanted = "a deviation is finite and not negative";
                    return Err(ErrorsFault { key: class.key(), value: *value, wanted });
                }
            }
        }
        self.check_times()?;
        self.check_faults(joints)
    }

    fn check_times(&self) -> Result<(), ErrorsFault> {
        let (n, s) = (&self.navigation, &self.sensors);
        let samplings = [
            ("sensors.position", s.position),
            ("sensors.velocity", s.velocity),
            ("sensors.attitude", s.attitude),
            ("sensors.target_attitude", s.target_attitude),
            ("sensors.bus_rate", s.bus_rate),
            ("sensors.target_rate", s.target_rate),
            ("sensors.joint_angle", s.joint_angle),
            ("sensors.joint_rate", s.joint_rate),
            ("sensors.wrist_camera", s.wrist_camera),
        ];
        for (key, sampling) in samplings {
            let (rate, delay) = (sampling.rate_hz, sampling.delay_s);
            fits(key, rate, rate > 0.0 && rate <= 1e3, "a rate is above 0, up to 1000 Hz")?;
            fits(key, delay, (0.0..=1e3).contains(&delay), "a delay is 0 to 1000 s")?;
        }
        let times = [
            ("navigation.position_drift_time_s", n.position_drift_time_s),
            ("navigation.position_drift_range_m", n.position_drift_range_m),
            ("navigation.attitude_drift_time_s", n.attitude_drift_time_s),
            ("navigation.target_attitude_drift_time_s", n.target_attitude_drift_time_s),
            ("joints.friction_rate_rad_s", self.joints.friction_rate_rad_s),
        ];
        for (key, value) in times {
            fits(key, value, value > 0.0 && value.is_finite(), "must be finite and above 0")?;
        }
        let periods = [
            ("thrusters.period_s", self.thrusters.period_s),
            ("wheels.noise_period_s", self.wheels.noise_period_s),
        ];
        for (key, value) in periods {
            fits(key, value, (1e-3..=1e6).contains(&value), "a period is 0.001 to 1e6 s")?;
        }
        let range = s.wrist_camera_range_m;
        fits("sensors.wrist_camera_range_m", range, range >= 0.0, "a range is not negative")
    }

    fn check_faults(&self, joints: usize) -> Result<(), ErrorsFault> {
        let time = |key, time: f64| {
            fits(key, time, time >= 0.0 && time.is_finite(), "a time is finite, 0 or later")
        };
        if let Some(lost) = self.faults.thruster_lost {
            let key = "faults.thruster_lost";
            fits(key, lost.axis as f64, lost.axis < 3, "axes are 0, 1 and 2")?;
            time(key, lost.time_s)?;
        }
        if let Some(stuck) = self.faults.joint_stuck {
            let key = "faults.joint_stuck";
            fits(key, stuck.joint as f64, stuck.joint < joints, "the arm has no such joint")?;
            time(key, stuck.time_s)?;
        }
        if let Some(change) = self.faults.target_rate {
            let key = "faults.target_rate";
            fits(key, change.factor, change.factor.is_finite(), "a factor is finite")?;
            time(key, change.time_s)?;
        }
        Ok(())
    }
}

fn fits(
    key: &'static str,
    value: f64,
    good: bool,
    wanted: &'static str,
) -> Result<(), ErrorsFault> {
    if good { Ok(()) } else { Err(ErrorsFault { key, value, wanted }) }
}

impl Class {
    /// The section of an errors file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Navigation => "navigation",
            Self::Thrusters => "thrusters",
            Self::Torques => "wheels, joints",
            Self::Mass => "mass",
            Self::Tumble => "tumble",
            Self::Geometry => "geometry",
            Self::Orbit => "orbit",
        }
    }
}
